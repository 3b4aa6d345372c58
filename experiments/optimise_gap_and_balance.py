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
# what do they cost? A small gap is dear, and so is good balance. A gradient search from the design itself and from
# two good ones among 16 random places, all in one batch; searches without gradients on the same objective; and the
# design for cages that are never made exactly as drawn.

# %%
import json

import numpy as np
from _size import save, small

import jaxcage as jc
from jaxcage.plotting import design_figure, new_figure


jc.enable_x64()
model = jc.case("1b")
vary = {"guidance_gap": (0.30e-3, 0.60e-3), "eccentricity": (5e-6, 60e-6)}
COST = 1000.0  # rpm of chaotic speeds that one unit of manufacturing cost is worth
width = jc.design.chaotic_width(
    4000, 27500, small(20, 6), cloud=small(6, 4), spread=0.1, discard=small(80, 10), revolutions=small(40, 10)
)
objective = width + COST * jc.design.cost()

# %%
scouts = small(16, 2)
found = jc.optimise(model, vary, objective, starts=small(3, 2), scouts=scouts, steps=small(5, 1))
print(found)
designs = scouts + sum(len(o.history) for o in found.optima) * width.cloud
print(f"{designs} designs swept for {len(found.optima)} searches, {scouts} of them to find where to start")

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
    share = np.mean(np.any(sweep.label == "chaotic", axis=1))
    print(name, f"{share:.0%} of the speeds chaotic", jc.zones(sweep), sep="\n")
save(design_figure(found, before, after), "optimise_gap_and_balance")

# %% [markdown]
# Without gradients: differential evolution and CMA-ES on the same objective. How many designs until the objective is as
# low as the gradient search's best?

# %%
import cma
from scipy.optimize import differential_evolution


target, space = found.best.objective, found.space
calls: dict[str, list[float]] = {"CMA-ES": [], "differential evolution": []}


def count(name, places):
    values = objective.values(space, np.atleast_2d(places))
    calls[name] += values.tolist()
    return values


search = cma.CMAEvolutionStrategy(space.place.clip(0.02, 0.98), 0.2, dict(bounds=[0, 1], seed=1, verbose=-9))
while not search.stop() and len(calls["CMA-ES"]) < small(60, 6):
    places = search.ask()
    search.tell(places, count("CMA-ES", np.array(places)).tolist())
differential_evolution(
    lambda x: count("differential evolution", x.T),
    [(0, 1)] * 2,
    vectorized=True,
    updating="deferred",
    popsize=small(10, 3),
    maxiter=small(2, 1),
    polish=False,
    rng=1,
)
own = lambda o: np.allclose(o.history[0].place, space.place.clip(0.02, 0.98))
alone, scouted = next(o for o in found.optima if own(o)), next(o for o in found.optima if not own(o))
reached = lambda values: next((i + 1 for i, v in enumerate(values) if v <= target + 2 * found.best.error), None)
path = lambda o: [s.value for s in o.history for _ in range(width.cloud)]
rows = {
    "gradient, from the design": path(alone),
    "gradient, from the best scout": [scouted.history[0].value] * scouts + path(scouted),
} | calls
for name, values in rows.items():
    print(f"{name:<30} best {min(values):7.0f} rpm, designs until {target:.0f} rpm: {reached(values)}")

# %% [markdown]
# ## As made, not as drawn
# Gaps within 10 %, balance Rayleigh-distributed: the mean chaotic width is made small instead.

# %%
scatter = {"guidance_gap": jc.design.uniform(0.1), "eccentricity": jc.design.rayleigh()}
few = jc.design.chaotic_width(4000, 27500, small(20, 6), cloud=4, discard=small(80, 10), revolutions=small(40, 10))
robust = jc.design.Robust(few, scatter, draws=small(6, 2)) + COST * jc.design.cost()
nominal = np.array([[u.place(found.best.values[u.name]) for u in space.unknowns]])
made = jc.optimise(model, vary, robust, starts=nominal, steps=small(3, 1))
print(made)
many = jc.design.Robust(width, scatter, draws=small(24, 4))
result = {}
for name, values in (("nominal", found.best.values), ("robust", made.best.values)):
    place = np.array([u.place(values[u.name]) for u in space.unknowns])
    spread = width.values(space, many.made(space, place))
    result[name] = dict(values, median_rpm=float(np.median(spread)), p95_rpm=float(np.quantile(spread, 0.95)))
    print(name, result[name])

# %%
print(json.dumps(result, indent=1))
figure = new_figure(8.0, 3.0)
ax = figure.subplots()
for name, values in rows.items():
    ax.plot(np.minimum.accumulate(values), label=name)
ax.set(xlabel="Designs swept", ylabel="Best objective [rpm]")
ax.legend(frameon=False)
save(figure, "gradient_or_not")
