"""`python -m benchmarks.bearing_gradients`: gradients of the whole bearing's statistics beside central differences.

Elasticities of slip, impulses, wear and power from scattered designs, with several seeds, beside differences of two
designs that are run from common random starts, one parameter at a time; z is their distance over the error of both.
"""

import argparse
from typing import Any

import numpy as np

import jaxcage as jc
from benchmarks.bearing_trends import table
from jaxcage.design import StatisticGradient, bearing_gradient
from jaxcage.models.whole import CagePlace, drawn_places


CASES = ((4450.0, 10000.0), (300.0, 10000.0), (4450.0, 20000.0), (1000.0, 6000.0), (4450.0, 14000.0))
"""Load [N] and shaft speed [rpm]."""
COMPARED = ("guidance_gap", "pocket_clearance", "viscosity_1+viscosity_2")


def differences(
    model: jc.BearingModel, speed: float, direction: str, starts: tuple[CagePlace, ...], spread: float, length: Any
) -> dict[str, tuple[float, float]]:
    """Elasticity of every statistic and its error, from pairs of runs that begin alike."""
    names = direction.split("+")
    values = {name: float(x) for name, x in jc.parameters(model).items() if name in names}
    designs = [jc.replace(model, **{n: x * (1 + side) for n, x in values.items()}) for side in (spread, -spread)]
    more, less = jc.sweep_bearings(designs, speed, starts=starts, blocks=1, exponents=0, **length)
    found = {}
    for name, blocks in more.block_means.items():
        a, b = blocks[0, :, 0], less.block_means[name][0, :, 0]
        value, change = np.mean(a + b) / 2, (a - b) / (2 * spread)
        with np.errstate(divide="ignore", invalid="ignore"):
            found[name] = change.mean() / value, np.std(change, ddof=1) / np.sqrt(change.size) / abs(value)
    return found


def rows_of(fitted: list[StatisticGradient], other: dict[str, dict[str, tuple[float, float]]]) -> list[tuple[str, ...]]:
    """One row for each direction that was differenced."""
    rows = []
    for direction, differenced in other.items():
        i = fitted[0].directions.index(direction)
        value, error = differenced[fitted[0].name]
        cells = [pair(each.elasticity[i], each.elasticity_error[i]) for each in fitted]
        z = [(each.elasticity[i] - value) / np.hypot(each.elasticity_error[i], error) for each in fitted]
        apart = " ".join(f"{x:+.1f}" if np.isfinite(x) else "-" for x in z)
        rows.append((fitted[0].name, direction, *cells, pair(value, error), apart))
    return rows


def pair(value: float, error: float) -> str:
    """A number with its error."""
    return f"{value:+.3f} ± {error:.3f}" if np.isfinite(value) else "-"


def main() -> None:
    """Read the options and run."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--designs", type=int, default=64)
    parser.add_argument("--starts", type=int, default=32, help="of each design of a difference")
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--discard", type=int, default=20)
    parser.add_argument("--revolutions", type=int, default=40)
    parser.add_argument("--spread", type=float, default=0.05)
    parser.add_argument("--cases", type=int, nargs="*", default=range(len(CASES)))
    given = parser.parse_args()
    jc.enable_x64()
    length = dict(discard=given.discard, revolutions=given.revolutions)
    print(
        f"Elasticities from {given.designs} designs within ±{given.spread:.0%}, and from differences with "
        f"{given.starts} common starts, {given.discard} revolutions left out, {given.revolutions} observed"
    )
    for load, rpm in (CASES[i] for i in given.cases):
        model, speed = jc.replace(jc.whole_bearing("nu2310"), load=load), float(jc.rpm(rpm))
        several = [
            bearing_gradient(model, speed, designs=given.designs, spread=given.spread, seed=seed, **length)
            for seed in range(given.seeds)
        ]
        starts = drawn_places(given.starts, seed=100)
        other = {name: differences(model, speed, name, starts, given.spread, length) for name in COMPARED}
        print(f"\n{load:.0f} N, {rpm:.0f} rpm of the shaft; failed {[g.failed for g in several]}")
        heads = ("statistic", "by", *(f"seed {seed}" for seed in range(given.seeds)), "differences", "z")
        rows = [heads]
        for name in several[0].statistics:
            rows += rows_of([g.statistics[name] for g in several], other)
        table(rows)
        print("\nAll elasticities, seed 0")
        first = several[0].statistics
        directions = next(iter(first.values())).directions
        cells = [
            (s.name, f"{s.value:.3g}", *map(pair, s.elasticity, s.elasticity_error), "" if s.settled else "drifts")
            for s in first.values()
        ]
        table([("statistic", "value", *directions, ""), *cells])


if __name__ == "__main__":
    main()
