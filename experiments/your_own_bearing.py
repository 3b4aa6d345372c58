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
# # Does the cage of your own bearing stay calm from 4000 to 14000 rpm of the shaft?
# A bearing is a TOML file. This page describes an NU1014 in an imagined machine, and asks whether its cage stays calm.
# Ten numbers in the file are known within a range only. The answer is therefore a chance, with an error.

# %%
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import jaxcage as jc
from jaxcage.files import read_bearing
from jaxcage.show import chance_of_chaos, load_bars, orbit_diagram


jc.keep_compiled_programs()
jc.enable_x64()

# %% [markdown]
# ## Settings of this page

# %% tags=["parameters"]
SPEEDS = 121  # number of speeds in the orbit diagram
DRAWS = 128  # number of draws from the ranges of the file
AT = 49  # number of speeds at which each draw is simulated

# %% [markdown]
# ## The file
# It is the file of `jaxcage init my_bearing.toml`, which has a comment for every line, with the values of this bearing:
# gap, balance, load, designation, oil and land width. The other ranges are those of the template.

# %%
Path("out").mkdir(exist_ok=True)
file = Path("out/my_bearing.toml")
file.write_text("""
speeds = "shaft"
guidance_gap = "0.25 mm +- 0.05 mm"
eccentricity = "G6.3 at 12000 rpm shaft"
material = "brass"
load = "1.2 kN"
clearance_reading = "radial"
unbalance = "physical"

[bearing]
designation = "NU1014"

[lubricant]
grade = 32
temperature = "55 degC"

[film]
land_width = "2.5 mm"

[contact]
stiffness = "2.408e9 (2e8 .. 2e10) N/m^(10/9)"
onset = "0.97 (0.9 .. 0.99)"
restitution = "0.9991 (0.3 .. 1)"

[support]
stiffness = "1.394e5 (1e4 .. 1e6) N/m"
damping = "1.661 (0.3 .. 30) N s/m"
cubic_stiffness = "1.126e13 (1e11 .. 1e14) N/m^3"
cross_stiffness = "1762 (-5e3 .. 5e3) N/m"

[impact]
kind = "from_bearing"
approach_ratio = "2 (1 .. 4)"
unmatched = "0.5 (0.03 .. 2.5)"
""")
bearing = read_bearing(file)
model = bearing.model
ratio = float(model.bearing.cage_speed_ratio)
operating = np.array([4000.0, 14000.0]) * ratio
print(f"The cage runs at {operating[0]:.0f} to {operating[1]:.0f} rpm, {ratio:.3f} times as fast as the shaft.")
print("Unknown:", ", ".join(each.label for each in bearing.unknowns))

# %% [markdown]
# ## The load
# The shaft's load rests on the rollers below it.

# %%
load = jc.bearing.load_distribution(model.bearing, model.load)
print(
    f"largest roller load {float(load.max_load):.0f} N; the shaft goes down by {1e6 * float(load.shaft_shift):.1f} µm"
)
figure, ax = plt.subplots(figsize=(7, 3.3), layout="constrained")
load_bars(load, ax)
plt.show()

# %% [markdown]
# ## The motion of the best guess
# Each point is the height of the cage once in a revolution, from three initial states. The shaded range is that in
# which the machine runs.

# %%
sweep = jc.sweep(model, jc.rpm(0.8 * operating[0], 2 * operating[1], SPEEDS))
figure, ax = plt.subplots(figsize=(10, 3.8), layout="constrained")
orbit_diagram(sweep, 1, ax)
ax.axvspan(*operating, color="0.92", zorder=0, label="operating range")
ax.legend(loc="lower left", fontsize=8, markerscale=4)
plt.show()
print(jc.zones(sweep))

# %% [markdown]
# ## The chance
# Draws from the ranges are simulated up to twice the highest speed. Bars are 95 % intervals. A draw counts as calm if
# it is calm at all speeds of the operating range.

# %%
speeds = jc.rpm(operating[0], 2 * operating[1], AT)
drawn = jc.design.ensemble(model, bearing.unknowns, speeds, draws=DRAWS)
chance, chaotic, known = jc.design.range_chance(drawn, *operating)
figure, ax = plt.subplots(figsize=(9, 3.8), layout="constrained")
chance_of_chaos(drawn, ax)
ax.axvspan(*operating, color="0.92", zorder=0)
plt.show()
low, high = chance.interval
print(f"Calm over the whole range: {chance.share:.0%} of {chance.known} draws (95 % interval {low:.0%} to {high:.0%})")

# %% [markdown]
# ## Conclusion
# The best guess is calm at all speeds of the machine, and so are all 128 draws, with a 95 % interval of 97 to 100 %:
# the cage very probably stays calm. Up to twice the highest speed at most one draw in 128 is chaotic at any speed.
