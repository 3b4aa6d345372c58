"""Zones of the cases by default steps, and by four times as many: `python -m benchmarks.zones_finer [CASE ...]`.

Every edge of a zone of lasting chaos is statistical: it is stated with an error, within which finer steps, from the
same starts and followed to the same horizon, must have it again. One that moves by more, or that is there once only,
is listed and makes the exit status 1. Sweeps are kept in FOLDER and are not made again.
"""

import argparse
import math
import pathlib
import sys
from collections.abc import Sequence

import numpy as np

import jaxcage as jc
from jaxcage.analysis import Edge
from jaxcage.integrate import controlled, finer
from jaxcage.io import load_sweep, save_sweep

from .report import table
from .truth_models import CASES


TIMES = 2
"""Steps are halved so often."""
FIRST, LAST, COUNT = 2500.0, 27500.0, 251
"""Those of `jaxcage sweep`."""


def swept(case: str, fine: bool, keep: pathlib.Path) -> jc.Sweep:
    """A case as `jaxcage sweep` runs it, or with four times the steps from the beginning."""
    path = keep / f"{case}_{'fine' if fine else 'default'}.zarr"
    if path.exists():
        return load_sweep(path)
    speeds = jc.rpm(FIRST, LAST, COUNT)
    model = jc.case(case)
    if fine:
        found = jc.sweep(model, speeds, method=finer(controlled(), TIMES), confirm=False)
    else:
        found = jc.sweep(model, speeds)
    save_sweep(path, found, model)
    return found


def edges(found: jc.Sweep) -> list[Edge]:
    """Ends of the zones of lasting chaos, ascending; those beyond the range are none."""
    ends = (end for zone in jc.zones(found).zones for end in (zone.onset, zone.exit))
    return [end for end in ends if end is not None]


def beside(ours: Sequence[Edge], finer_ones: Sequence[Edge]) -> list[tuple[Edge | None, Edge | None]]:
    """Edges of the two in pairs, nearest first; what is left over stands alone."""
    left, right = list(ours), list(finer_ones)
    pairs: list[tuple[Edge | None, Edge | None]] = []
    near = sorted((abs(a.speed_rpm - b.speed_rpm), i, j) for i, a in enumerate(ours) for j, b in enumerate(finer_ones))
    for _, i, j in near:
        a, b = ours[i], finer_ones[j]
        if a in left and b in right and agree(a, b):
            pairs.append((a, b))
            left.remove(a)
            right.remove(b)
    alone: list[tuple[Edge | None, Edge | None]] = [*((a, None) for a in left), *((None, b) for b in right)]
    return sorted(pairs + alone, key=lambda pair: next(e.speed_rpm for e in pair if e is not None))


def agree(a: Edge, b: Edge) -> bool:
    """Whether each lies within both errors of the other."""
    return abs(a.speed_rpm - b.speed_rpm) <= math.hypot(a.uncertainty_rpm, b.uncertainty_rpm)


def changed(a: jc.Sweep, b: jc.Sweep) -> tuple[int, int]:
    """Speeds at which chaos lasts by the first alone, and by the second alone."""
    return int(np.sum(a.lasting & ~b.lasting)), int(np.sum(b.lasting & ~a.lasting))


def arguments(words: Sequence[str] | None) -> argparse.Namespace:
    """What the command line says."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.zones_finer", description=(__doc__ or "").split("\n\n")[0]
    )
    parser.add_argument("cases", nargs="*", default=CASES, metavar="CASE", help="published cases, all if left out")
    parser.add_argument("--keep", default="out/zones_finer", metavar="FOLDER", help="where sweeps are kept")
    given = parser.parse_args(words)
    if wrong := [c for c in given.cases if c not in CASES]:
        parser.error(f"CASE must be one of {', '.join(CASES)}, but {wrong[0]!r} was given")
    return given


def main(words: Sequence[str] | None = None) -> int:
    """Carry the command out."""
    given = arguments(words)
    keep = pathlib.Path(given.keep)
    keep.mkdir(parents=True, exist_ok=True)
    rows, moved = [], 0
    for case in given.cases:
        ours, fine = swept(case, False, keep), swept(case, True, keep)
        for a, b in beside(edges(ours), edges(fine)):
            moved += a is None or b is None
            rows.append((case, "none" if a is None else str(a), "none" if b is None else str(b)))
        spurious, missed = changed(ours, fine)
        print(
            f"{case}: chaos lasts at {spurious} speeds by default steps alone, at {missed} by finer ones alone",
            flush=True,
        )
    print(table(("case", "edge by default", "by four times the steps"), rows))
    return 1 if moved else 0


if __name__ == "__main__":
    sys.exit(main())
