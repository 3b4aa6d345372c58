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
# # Which gap and which balance keep the cage calm from 12 500 to 18 000 rpm?
# The cage of the paper's case 1a loses its stable orbit just below and just above this range. Guidance gap and balance
# move both edges; the gradients of the edges are exact. The design shall keep 10 % of speed from both edges, for every
# cage whose gap is made within 0.02 mm, at the lowest cost of turning and balancing.

# %% tags=["remove-input"]
from _size import save, small


POINTS, STATES = small(7, 3), small(16, 3)

# %%
import matplotlib.pyplot as plt
import numpy as np

import jaxcage as jc


jc.enable_x64()
model = jc.case("1a")
operating = tuple(jc.rpm(12500, 18000, 2))
vary = {"guidance_gap": (0.35e-3, 0.65e-3), "eccentricity": (8e-6, 30e-6)}
tolerance = {"guidance_gap": jc.Tolerance(-0.02e-3, 0.02e-3)}
best = jc.design_for(model, operating, vary, tolerance=tolerance, check=STATES)
print(best, best.checked, sep="\n")

# %% [markdown]
# ## The stable range over the gap
# The edges of the stable range are bifurcations, followed from gap to gap. Arrows are their exact derivatives.

# %%
space = jc.design.DesignSpace.of(model, {"guidance_gap": vary["guidance_gap"]})
range_ = jc.design.OperatingRange(space, operating)
places = np.unique(np.append(np.linspace(0.1, 0.6, POINTS), space.place))
figure, axes = plt.subplots(2, 2, figsize=(11, 7.5), constrained_layout=True)
ax = axes[0, 0]
ax.axhspan(12500, 18000, color="0.9", label="operating range")
for name, colour in (("lower", "C0"), ("upper", "C3")):
    edges = [(p, edge) for p in places if (edge := range_.edges(np.array([p]))[name]) is not None]
    gaps = [1e3 * space.values(np.array([p]))["guidance_gap"] for p, _ in edges]
    ax.plot(gaps, [edge.value_rpm for _, edge in edges], "o-", color=colour, label=f"{name} edge")
    for gap, (_, edge) in zip(gaps, edges, strict=True):
        slope = edge.derivative["guidance_gap"] * 1e-3
        ax.annotate(
            "", (gap + 0.02, edge.value_rpm + 0.02 * slope), (gap, edge.value_rpm), arrowprops={"arrowstyle": "->"}
        )
ax.set(xlabel="Guidance gap [mm]", ylabel="Cage speed [rpm]", title="Edges and their gradients")
ax.legend(fontsize=8)

# %% [markdown]
# ## The search
# Every point is a design whose edges were solved for, at the nominal design and at the corners of its tolerance.

# %%
ax = axes[0, 1]
path = np.array([(1e3 * step["guidance_gap"], 1e6 * step["eccentricity"]) for step in best.path])
ax.plot(*path.T, "o-", color="C0", label="search")
ax.plot(*path[0], "s", color="0.4", label="given design")
ax.plot(
    1e3 * best.values["guidance_gap"], 1e6 * best.values["eccentricity"], "*", color="C3", markersize=13, label="chosen"
)
ax.set(xlabel="Guidance gap [mm]", ylabel="Eccentricity [µm]", title=f"{best.evaluations} designs solved for")
ax.legend(fontsize=8)

# %% [markdown]
# ## Before and after

# %%
ax, names = axes[1, 0], ("lower margin", "upper margin")
for shift, values, label in ((-0.2, best.before, "given"), (0.2, best.after, "chosen")):
    ax.bar(np.arange(2) + shift, [values[name].value for name in names], width=0.38, label=label)
worst = [best.worst[f"margin at the {end} end"].value for end in ("lower", "upper")]
ax.plot(np.arange(2) + 0.2, worst, "k_", markersize=24, label="worst within the tolerance")
ax.axhline(10, color="0.4", linewidth=0.8)
ax.set(xticks=[0, 1], xticklabels=["lower end", "upper end"], ylabel="Distance of the edge [% of speed]")
ax.set_title(f"Margins, cost {best.cost_before:.2f} to {best.cost:.2f}")
ax.legend(fontsize=8)

# %% [markdown]
# ## How wide the tolerance may be
# The budget is of first order, from the slack that is left at the worst corner.

# %%
ax = axes[1, 1]
names = [each.name.replace("_", " ") for each in best.budget]
widths = np.array([(1e3 * each.width, 1e3 * each.width * min(each.factor, 10)) for each in best.budget])
for shift, column, label in ((0.2, widths[:, 0], "asked for"), (-0.2, widths[:, 1], "allowed")):
    ax.barh(np.arange(len(names)) + shift, column, height=0.38, label=label)
ax.set(yticks=np.arange(len(names)), yticklabels=names, xlabel="From end to end [mm]", title="Tolerance budget")
ax.legend(fontsize=8)
save(figure, "optimise_gap_and_balance")
