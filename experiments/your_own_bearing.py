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
# # Bring your own bearing
# A bearing is a TOML file. `jaxcage init my_bearing.toml` writes one to start from; here is another one,
# an NU2310 with a smaller gap, better balance and thicker, colder oil.

# %%
from pathlib import Path

from _size import FOLDER, save, small

import jaxcage as jc
from jaxcage.files import load_model
from jaxcage.show import new_figure, orbit_diagram


jc.enable_x64()

# %%
TEXT = """
base = "1a"
guidance_gap = "0.35 mm"
eccentricity = "12 um"

[lubricant]
grade = 100
temperature = "30 degC"
"""
FOLDER.mkdir(exist_ok=True)
path = Path("out") / "my_bearing.toml"
path.parent.mkdir(exist_ok=True)
path.write_text(TEXT)
model = load_model(path)
print({name: float(jc.parameters(model)[name]) for name in ("guidance_gap", "eccentricity", "cage_mass")})

# %% [markdown]
# How the load is carried, where the cage sits at rest, and how it runs.

# %%
load = jc.bearing.load_distribution(model.bearing, model.load)
print(
    f"largest roller load {float(load.max_load):.0f} N, the shaft goes down by {1e6 * float(load.shaft_shift):.1f} um"
)
sweep = jc.sweep(model, jc.rpm(6000, 22000, small(161, 40)), discard=small(200, 20), revolutions=small(200, 20))
print(jc.zones(sweep))
figure = new_figure(small(10, 5), 3.5)
orbit_diagram(sweep, 1, figure.subplots())
save(figure, "your_own_bearing")
