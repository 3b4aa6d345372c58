# ---
# jupyter:
#   jupytext:
#     formats: py:percent,ipynb
#   kernelspec:
#     display_name: Python 3 (ipykernel)
#     language: python
#     name: python3
# ---
# %% [markdown]
# # Which gap and which balance keep the orbit stable from 12500 to 18000 rpm?
# The cage of case 1a of the paper loses its stable orbit just below and just above this range of speed. Guidance gap
# and balance move both edges. The design must keep 10 % of speed from both edges, for every cage whose gap is made
# within 0.02 mm and whose eccentricity within 2 µm, at the lowest cost of turning and balancing. The edges solve
# equations, so that their derivatives are exact.

# %%
import matplotlib.pyplot as plt
import numpy as np

import jaxcage as jc


jc.keep_compiled_programs()
jc.enable_x64()
model = jc.case("1a")
operating = tuple(jc.rpm(12500, 18000, 2))
vary = {"guidance_gap": (0.35e-3, 0.65e-3), "eccentricity": (8e-6, 30e-6)}
tolerance = {"guidance_gap": jc.Tolerance(-0.02e-3, 0.02e-3), "eccentricity": jc.Tolerance(-2e-6, 2e-6)}

# %% [markdown]
# ## Settings of this page

# %% tags=["parameters"]
GAPS = 9  # number of guidance gaps at which the edges are drawn
STATES = 16  # initial states from which the chosen design is simulated at each speed

# %% [markdown]
# ## The stable range over the gap
# The edges are followed from gap to gap. Each arrow is the exact derivative of an edge. A wider gap moves the upper
# edge up and the lower one down.

# %%
space = jc.design.DesignSpace.of(model, {"guidance_gap": vary["guidance_gap"]})
stable = jc.design.OperatingRange(space, operating)
places = np.linspace(0.1, 0.6, GAPS)
gaps = np.array([1e3 * space.values(np.array([place]))["guidance_gap"] for place in places])
edges = [stable.edges(np.array([place])) for place in places]
error = max(edge[name].error_rpm for edge in edges for name in ("lower", "upper"))
print(f"largest error of an edge: {error:.1g} rpm")

figure, ax = plt.subplots(figsize=(8, 4.5), layout="constrained")
ax.axhspan(12500, 18000, color="0.9", label="operating range")
for name, colour in (("lower", "#0072B2"), ("upper", "#D55E00")):
    speed = np.array([edge[name].value_rpm for edge in edges])
    slope = np.array([1e-3 * edge[name].derivative["guidance_gap"] for edge in edges])
    ax.plot(gaps, speed, "o", color=colour, markersize=5, label=f"{name} edge of the stable range")
    reach = np.full(GAPS, 0.6 * (gaps[1] - gaps[0]))
    ax.quiver(
        gaps, speed, reach, reach * slope, angles="xy", scale_units="xy", scale=1, color=colour, width=0.004, zorder=3
    )
ax.axvline(0.45, color="0.4", linewidth=0.8, linestyle="--", label="gap as given")
ax.set(xlabel="Guidance gap [mm]", ylabel="Cage speed [rpm]", xlim=(gaps[0] - 0.01, gaps[-1] + 0.02))
ax.legend(fontsize=8, loc="upper left")
plt.show()

# %% [markdown]
# ## The search
# The cost is the given gap over the gap, for turning, plus the given eccentricity over the eccentricity, for balancing:
# 2 as given. Lines are of equal cost. Every point is a design whose edges were solved for, also in the corners of its
# tolerances.

# %%
best = jc.design_for(model, operating, vary, tolerance=tolerance, check=STATES)

path = np.array([(1e3 * step["guidance_gap"], 1e6 * step["eccentricity"]) for step in best.path])
chosen = 1e3 * best.values["guidance_gap"], 1e6 * best.values["eccentricity"]
figure, ax = plt.subplots(figsize=(8, 4.5), layout="constrained")
x, y = np.meshgrid(np.linspace(0.43, 0.67, 50), np.linspace(14, 31, 50))
lines = ax.contour(x, y, 0.45 / x + 23 / y, levels=np.arange(1.4, 2.8, 0.1), colors="0.75", linewidths=0.8)
ax.clabel(lines, fontsize=7)
ax.plot(*path.T, "o-", color="#0072B2", markersize=5, label=f"designs on the way ({best.evaluations} solved for)")
ax.plot(*path[0], "s", color="black", label="as given")
ax.plot(*chosen, "*", color="#D55E00", markersize=14, label="chosen")
ax.set(xlabel="Guidance gap [mm]", ylabel="Eccentricity [µm]")
ax.legend(fontsize=8)
plt.show()

# %% [markdown]
# ## Before and after

# %%
figure, ax = plt.subplots(figsize=(8, 4), layout="constrained")
names = ("lower margin", "upper margin")
for shift, values, label, colour in ((-0.2, best.before, "as given", "0.6"), (0.2, best.after, "chosen", "#0072B2")):
    ax.bar(np.arange(2) + shift, [values[name].value for name in names], width=0.38, label=label, color=colour)
worst = [best.worst[f"margin at the {end} end"].value for end in ("lower", "upper")]
ends = np.arange(2)
ax.hlines(worst, ends + 0.01, ends + 0.39, color="black", linewidth=2, label="worst within the tolerances")
ax.axhline(10, color="#D55E00", linewidth=1, label="required")
ax.set(xticks=[0, 1], xticklabels=["lower end", "upper end"], ylabel="Distance of the edge [% of speed]")
ax.legend(fontsize=8)
plt.show()

# %% [markdown]
# ## How wide the tolerances may be
# Each tolerance is widened alone, up to four times, until a requirement breaks in the worst bearing.

# %%
units = {"guidance_gap": (1e3, "mm"), "eccentricity": (1e6, "µm")}
figure, ax = plt.subplots(figsize=(8, 2.4), layout="constrained")
for each in best.budget:
    factor, unit = units[each.name]
    half, name = each.width / 2 * factor, each.name.replace("_", " ")
    bar = ax.barh(f"{name}, ±{half:.3g} {unit}", each.factor, color="#0072B2", height=0.6)
    ax.bar_label(bar, [f"±{each.factor * half:.3g} {unit}"], padding=4)
    print(f"{name}: {each.factor:.2f} times as wide as asked for; beyond: {each.limit or 'no limit found'}")
ax.axvline(1, color="#D55E00", linewidth=1)
ax.set(xlabel="Allowed tolerance over that asked for", xlim=(0, 4.8))
plt.show()

# %% [markdown]
# ## The answer
# A stable orbit need not attract every initial state: the chosen design is therefore simulated, with other steps than
# those of the search.

# %%
print(best)
print("At a bound of the search:", ", ".join(best.at_bound) or "nothing")
print("Simulated:", best.checked)

# %% [markdown]
# ## Conclusion
# A gap of 0.65 mm, the widest allowed, and an eccentricity of 24.1 µm lower the cost from 2 to 1.65; the edges are 21 %
# of speed below and 75 % above the range. The cage is not calm from every initial state: 63 % of the simulations end
# calm, and the others meet chaos with a mean life of 88 to 487 revolutions.
