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
# # Orbit diagrams and zones
# Two of the paper's cages differ only in their guidance gap: 0.45 mm (1a) and 0.60 mm (1b). Between 6000 and 14000
# rpm every speed is run from three initial states; the strobe points, taken once in a revolution, fill an area where
# the motion is chaotic: red where that lasts, amber where it dies out. `jaxcage sweep 1a` does the whole range.

# %%
from _size import save, small

import jaxcage as jc
from jaxcage.bearing import PUBLISHED_CASES
from jaxcage.show import exponent_strip, mark_published, new_figure, orbit_diagram


jc.enable_x64()

# %%
speeds = jc.rpm(6000, 14000, small(81, 12))
names = ("1a", "1b")
length = dict(discard=small(200, 30), revolutions=small(200, 20))
swept = jc.sweep([jc.case(name) for name in names], speeds, **length)
sweeps = {name: swept.isel(design=i) for i, name in enumerate(names)}
for name, sweep in sweeps.items():
    print(name, jc.zones(sweep), sep="\n")

# %%
figure = new_figure(12.0, 7.0)
axes = figure.subplots(4, 1, sharex=True, height_ratios=(2, 1, 2, 1))
for i, (name, sweep) in enumerate(sweeps.items()):
    orbit_diagram(sweep, 1, axes[2 * i])
    mark_published(axes[2 * i], PUBLISHED_CASES[name])
    axes[2 * i].set_title(
        f"{name}: gap {PUBLISHED_CASES[name].guidance_gap_mm} mm, published edges dotted", loc="left", pad=20
    )
    exponent_strip(sweep, axes[2 * i + 1])
for ax in axes[:-1]:
    ax.set_xlabel("")
save(figure, "orbit_diagrams")
