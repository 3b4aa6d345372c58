"""Chances that a file with ranges states, beside planted bearings whose true values lie within them.

python -m benchmarks.own                 # 4 designs, 5 planted bearings each
python -m benchmarks.own --decide        # one bearing that is not decided, and what one measurement decides

A planted bearing takes its values from the ranges of `jaxcage init` evenly, apart from the draws that the chances are
made of. Its true verdict at a speed is what it does there itself. Of all bearings and speeds with a stated chance p the
chaotic ones should be the sum of p; of those called calm at most 5 % should be chaotic, and the other way round.
"""

import argparse
import tempfile
import time
from pathlib import Path

import jax
import numpy as np

import jaxcage as jc
from jaxcage.io import Measurement, Unknown, read_bearing, write_template
from jaxcage.studies import Ensemble, ensemble, identify, misses


DESIGNS = ((0.45e-3, 23e-6), (0.3e-3, 23e-6), (0.6e-3, 23e-6), (0.45e-3, 60e-6))
"""Guidance gap and eccentricity [m]."""
SPEED, MEASURED_AT = 8024.0, 5000.0
"""Of the cage [rpm]: where it is not decided whether it is chaotic, and where the size of its orbit is measured."""
PLANTED = {"support.stiffness": 0.8, "impact.amplitude": 0.2}
"""Places of the measured bearing's true values in their ranges; of the others the middle. One with a small orbit: of a
large one the ranges keep so much that nothing is decided."""


def coverage(draws: int, truths: int, speeds: int) -> None:
    """Print how often planted bearings do what was stated."""
    model, unknowns = _template()
    rpm = jc.rpm(4000, 24000, speeds)
    expected, variance, seen, counted, wrong = 0.0, 0.0, 0, 0, 0
    decided = 0
    for i, (gap, eccentricity) in enumerate(DESIGNS):
        design = jc.replace(model, guidance_gap=gap, eccentricity=eccentricity)
        stated = ensemble(design, unknowns, rpm, draws=draws, seed=i)
        planted = ensemble(design, unknowns, rpm, draws=truths, seed=1000 + i)
        for j, verdict in enumerate(stated.verdict):
            k, n = (int(x[j]) for x in planted.counts)
            expected, seen, counted = expected + n * float(stated.chance[j]), seen + k, counted + n
            decided += n * (verdict in ("calm", "chaotic"))
            wrong += {"calm": k, "chaotic": n - k}.get(verdict, 0)
        total = np.sum(stated.chaotic & ~stated.failed, axis=1)  # speeds of one bearing are not independent
        variance += truths * float(np.var(total, ddof=1)) * (1 + truths / draws)
        print(f"design {i + 1}: {_line(stated)}", flush=True)
        print(f"  planted: {_line(planted, of_verdicts=False)}", flush=True)
    print(
        f"{counted} verdicts of {truths * len(DESIGNS)} planted bearings: {seen} chaotic, {expected:.1f} stated, "
        f"standard deviation {np.sqrt(variance):.1f}"
    )
    print(f"decided: {decided}, of which {wrong} wrong")


def decide(draws: int) -> None:
    """Print a bearing that is not decided at one speed, and the chance there after a measurement at another."""
    model, unknowns = _template()
    at = jc.rpm(SPEED, SPEED + 100)[:1]
    before = ensemble(model, unknowns, at, draws=draws)
    print(f"before: {_line(before)}", flush=True)
    place = np.array([[PLANTED.get(u.label, 0.5) for u in unknowns]])
    probe = Measurement("orbit size", MEASURED_AT, 1e-9, 1e-9)
    size = 1e-9 * (1 + float(misses(model, unknowns, [probe], place)[0, 0]))
    measured = Measurement("orbit size", probe.cage_rpm, size, 0.1 * size)
    found = identify(model, unknowns, [measured], draws=draws)
    new = [Unknown(u.label, u.names, r) for u, r in zip(unknowns, found.ranges, strict=True)]
    after = ensemble(model, new, at, draws=draws, seed=1)
    print(f"measured: {measured}; {found.accepted} of {draws} draws of stage {found.stages} do it")
    print("left of the ranges:", ", ".join(f"{u.label} {s:.0%}" for u, s in zip(unknowns, found.share, strict=True)))
    print(f"after: {_line(after)}")


def _template() -> tuple[jc.CageModel, tuple[Unknown, ...]]:
    with tempfile.TemporaryDirectory() as folder:
        file = read_bearing(write_template(Path(folder) / "own.toml"))
    return file.model, file.unknowns


def _line(found: Ensemble, of_verdicts: bool = True) -> str:
    chaotic, of = found.counts
    cells = zip(found.rpm, chaotic, of, found.verdict, strict=True)
    return ", ".join(f"{r:.0f} rpm {k}/{n} {v if of_verdicts else ''}".rstrip() for r, k, n, v in cells)


def main() -> None:
    """Read the options and print."""
    jax.config.update("jax_enable_x64", True)
    jc.keep_compiled_programs()
    options = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    options.add_argument("--draws", type=int, default=64)
    options.add_argument("--truths", type=int, default=5)
    options.add_argument("--speeds", type=int, default=6)
    options.add_argument("--decide", action="store_true")
    given = options.parse_args()
    began = time.process_time()
    decide(given.draws) if given.decide else coverage(given.draws, given.truths, given.speeds)
    print(f"processor time: {time.process_time() - began:.0f} s")


if __name__ == "__main__":
    main()
