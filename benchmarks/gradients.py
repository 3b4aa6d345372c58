"""Elasticities of the cage's edges against fourth-order differences of edges that are solved anew.

    python -m benchmarks.gradients 1a

searches the synchronous orbits of a case, takes the named edges, and compares for every parameter. It prints the
largest disagreement over max(|elasticity|, 0.01), the homogeneity residuals, and what a gradient costs against a solve.
"""

import argparse
import concurrent.futures
import time

import jax
import numpy as np


jax.config.update("jax_enable_x64", True)

import jaxcage as jc
from jaxcage.orbits import edge_speed, loss_zones, sensitivity, synchronous_orbits


STENCIL = {-2: 1 / 12, -1: -2 / 3, 1: 2 / 3, 2: -1 / 12}


STEPS = (1e-3, 1e-4, 1e-5, 1e-6)
"""Relative steps: edges of orbits that touch the rib bend within the contact's regularisation length, 4e-4 of it."""


def best_difference(model, point, name: str) -> float:
    """The difference at the step where it changes least from one step to the next, whatever the exact value is."""
    found = [difference(model, point, name, step) for step in STEPS]
    change = [abs(b - a) if np.isfinite(b - a) else np.inf for a, b in zip(found[:-1], found[1:])]
    k = int(np.argmin(change))
    return found[k + 1] if change[k] > 0 else found[k]


def difference(model, point, name: str, step: float) -> float:
    """Elasticity by the fourth-order central difference with relative step `step`."""
    value = jc.parameters(model)[name]
    speeds = {k: edge_speed(jc.replace(model, **{name: value * (1 + k * step)}), point) for k in STENCIL}
    return sum(w * speeds[k] for k, w in STENCIL.items()) / (step * point.speed)


def main() -> None:
    parser = argparse.ArgumentParser(description="Elasticities of edges against differences.")
    parser.add_argument("case", nargs="?", default="1a")
    options = parser.parse_args()
    model = jc.case(options.case)
    edges = loss_zones(synchronous_orbits(model, jc.rpm(2500), jc.rpm(27500))).edges
    for name, point in edges.items():
        exact = sensitivity(model, point, name)
        moving = [n for n, v in jc.parameters(model).items() if float(v) != 0.0]
        with concurrent.futures.ThreadPoolExecutor(2) as pool:
            found = dict(zip(moving, pool.map(lambda n: best_difference(model, point, n), moving)))
        off = {n: abs(exact.elasticity[n] - d) / max(abs(d), 0.01) for n, d in found.items()}
        began = time.perf_counter()
        edge_speed(model, point)
        solved = time.perf_counter()
        sensitivity(model, point)
        both = time.perf_counter() - solved
        worst = max(off, key=lambda n: off[n])
        print(f"{options.case} {name}: {exact.kind} at {exact.value_rpm:.4f} rpm, {exact.status}")
        print(f"  largest disagreement {off[worst]:.1e} ({worst}), {len(off)} parameters")
        print(f"  homogeneity {', '.join(f'{base} {abs(r):.1e}' for base, r in exact.homogeneity.items())}")
        print(f"  solve {solved - began:.2f} s, solve and gradient {both:.2f} s", flush=True)
        for n in sorted(off, key=lambda n: -off[n])[:5]:
            print(f"    {n:<24} {exact.elasticity[n]:+.9f} {found[n]:+.9f} {off[n]:.1e}")


if __name__ == "__main__":
    main()
