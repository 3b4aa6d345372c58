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
# # Sensitivity and tolerances
# Which parameters decide how much of the speed range is chaotic (Sobol indices), and how much the tolerances of a
# drawing scatter an exact edge (elasticities)?

# %%
import numpy as np
from _size import save, small

import jaxcage as jc
from jaxcage.show import new_figure


jc.enable_x64()
model = jc.case("2a")
now = {name: float(value) for name, value in jc.parameters(model).items()}

# %%
varied = ("guidance_gap", "eccentricity", "cage_mass", "stiffness_x", "damping", "amplitude", "land_width")
vary = {name: (0.8 * now[name], 1.2 * now[name]) for name in varied}
runs = jc.design.Runs(jc.rpm(4000, 27500, small(20, 4)), discard=small(100, 5), revolutions=small(40, 5))
width = jc.design.chaotic_width(4000, 27500)
shares = jc.design.global_sensitivity(model, vary, width.values(runs), samples=small(16, 2))
print(shares)

# %% [markdown]
# An exact edge, and what +-5 % in each parameter does to it. The same scatter by solving the edge in random designs.

# %%
orbits = jc.synchronous_orbits(model, jc.rpm(12700), jc.rpm(13700), count=21, discard=1500)
edge = next(p for p in orbits.edges if p.kind == "period-doubling")
exact = jc.sensitivity(model, edge, "lower edge of the calm stretch")
tolerances = dict.fromkeys(varied, 0.05 / np.sqrt(3))
budget = jc.design.tolerance_budget(exact, tolerances)
print(budget)

# %%
rng = np.random.default_rng(0)
solved = []
for _ in range(small(12, 2)):
    changed = {name: now[name] * (1 + 0.05 * rng.uniform(-1, 1)) for name in varied}
    guess = exact.value_rpm * (1 + sum(exact.elasticity[n] * (v / now[n] - 1) for n, v in changed.items())) * np.pi / 30
    found = jc.sensitivity(jc.replace(model, **changed), jc.orbits.Point(edge.kind, guess, exact.state))
    solved.append(found.value_rpm)
solved = np.array(solved)
print(
    f"{np.isfinite(solved).sum()} of {solved.size} edges found, deviation {np.nanstd(solved):.1f} rpm, "
    f"to first order {budget.total:.1f} rpm"
)

# %%
figure = new_figure(10.0, 3.5)
left, right = figure.subplots(1, 2)
order = sorted(varied, key=lambda n: shares.total[n])
left.barh(order, [shares.total[n] for n in order], color="#0072B2")
left.set_xlabel("Share of the chaotic width's variance, with interactions")
order = sorted(varied, key=lambda n: budget.deviation[n])
right.barh(order, [budget.deviation[n] for n in order], color="#D55E00")
right.set_xlabel(f"Scatter of the edge at {exact.value_rpm:.0f} rpm [rpm]")
save(figure, "sensitivity_and_tolerances")
