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
# # Optimising gap and balance
# The paper's case 1b is chaotic from 7000 rpm to beyond 18000. Which guidance gap and which balance make it calm, and
# what do they cost? A small gap is dear, and so is good balance. A search by a Gaussian process from the design itself,
# and the design for cages that are never made exactly as drawn.

# %%
import json

import numpy as np
from _size import save, small

import jaxcage as jc
from jaxcage.show import design_figure


jc.enable_x64()
model = jc.case("1b")
vary = {"guidance_gap": (0.30e-3, 0.60e-3), "eccentricity": (5e-6, 60e-6)}
COST = 1000.0  # rpm of chaotic speeds that one unit of manufacturing cost is worth
width = jc.design.chaotic_width(4000, 27500, small(20, 6), discard=small(80, 10), revolutions=small(40, 10))
objective = width + COST * jc.design.cost()

# %%
found = jc.design.surrogate_search(model, vary, objective, batches=small(6, 2), batch=small(8, 4))
print(found)

# %% [markdown]
# The optimum under a fresh sweep: other starts, steps half as long.


# %%
def check(design):
    c, rng = float(design.clearance), np.random.default_rng(7)
    starts = [tuple(float(v) for v in rng.uniform(-0.6, 0.6, 4) * c * np.array([1, 1, 120, 120])) for _ in range(3)]
    length = dict(discard=small(300, 10), revolutions=small(100, 10), blocks=10, horizon=0, confirm=False)
    return jc.sweep(
        design, jc.rpm(4000, 27500, small(48, 6)), starts=starts, method=jc.method("rk4", steps=768), **length
    )


before, after = check(model), check(found.best.model)
for name, sweep in (("before", before), ("after", after)):
    share = float((sweep["label"] == "chaotic").any("start").mean())
    print(name, f"{share:.0%} of the speeds chaotic", jc.zones(sweep), sep="\n")
save(design_figure(found, before, after), "optimise_gap_and_balance")

# %% [markdown]
# ## As made, not as drawn
# Gaps within 10 %, balance Rayleigh-distributed: the mean chaotic width is made small instead.

# %%
scatter = {"guidance_gap": jc.design.uniform(0.1), "eccentricity": jc.design.rayleigh()}
space = found.space
robust = jc.design.Robust(width, scatter, draws=small(8, 2)) + COST * jc.design.cost()
made = jc.design.surrogate_search(
    model, vary, robust, starts=space.place_of(found.best.values)[None], batches=small(4, 1), batch=small(8, 4)
)
print(made)
many = jc.design.Robust(width, scatter, draws=small(32, 4))
result = {}
for name, values in (("nominal", found.best.values), ("robust", made.best.values)):
    spread = width.values(space, many.made(space, space.place_of(values)))
    result[name] = dict(values, median_rpm=float(np.median(spread)), p95_rpm=float(np.quantile(spread, 0.95)))
    print(name, result[name])

# %%
print(json.dumps(result, indent=1))
