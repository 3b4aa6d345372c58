"""Periods of lanes after 600 revolutions, and of the same lanes 3000 later: `python -m benchmarks.periods [CASE ...]`.

Counts lanes that return after k > 1 revolutions: in how many the period is less than the smallest such k because they
are still on their way, and how many of both kinds have another period later. Two minutes.
"""

import sys
from collections.abc import Sequence

import numpy as np

import jaxcage as jc
from jaxcage.analysis import closing_period


CASES = ("1a", "1b", "2a", "3a")
TOLERANCE = 1e-4
"""Of `closing_period`."""


def first_return(strobe: np.ndarray, scale: np.ndarray) -> np.ndarray:
    """Smallest k <= 8 after which every strobe state is back, whether it stays there or not; 0 where there is none."""
    y = strobe / scale[..., None, :]
    back = [np.all(np.linalg.norm(y[..., k:, :] - y[..., :-k, :], axis=-1) <= TOLERANCE, axis=-1) for k in range(1, 9)]
    return np.where(np.any(back, axis=0), np.argmax(back, axis=0) + 1, 0)


def main(cases: Sequence[str]) -> None:
    """Print the table."""
    jc.enable_x64()
    jc.keep_compiled_programs()
    speeds = jc.rpm(2500, 27500, 126)
    print("case  return after k > 1  period below k  other later  period k  other later")
    for name in cases:
        model = jc.case(name)
        seen = jc.sweep(model, speeds, horizon=0, confirm=False)
        options = dict(discard=3000, revolutions=64, blocks=2, exponents=0, horizon=0, confirm=False)
        later = jc.sweep(model, speeds, starts=seen.last, **options)  # pyright: ignore[reportArgumentType]
        scale = seen.scale[:, None]
        k, period, end = first_return(seen.strobe, scale), *(closing_period(s.strobe, scale) for s in (seen, later))
        below, same = (k > 1) & (period < k), (k > 1) & (period == k)
        counts = [np.sum(x) for x in (k > 1, below, below & (period != end), same, same & (period != end))]
        print(f"{name:4s}{counts[0]:20d}{counts[1]:16d}{counts[2]:13d}{counts[3]:10d}{counts[4]:13d}", flush=True)


if __name__ == "__main__":
    main(sys.argv[1:] or CASES)
