"""Stretches of shaft speed over which the cage of a whole bearing does the same."""

import dataclasses

import numpy as np

from ._bearing_sweep import BearingSweep


SURE = 2.0
"""Standard errors by which an exponent must be above zero to be called positive."""


@dataclasses.dataclass(frozen=True)
class BearingZone:
    """Neighbouring shaft speeds of a sweep with the same names for the cage's motion."""

    states: tuple[str, ...]
    """Names of the motion, as in `cage_state`: several where the start decides; `failed` where no lane came to its
    end."""
    chaotic: bool
    """Whether the largest exponent, in the mean over starts, is above 0 by more than two standard errors."""
    low_rpm: float
    """Of the shaft, halfway between the last speed outside and the first inside, or the first speed of the sweep."""
    high_rpm: float
    speeds: int
    exponent: float
    """Mean over all lanes of the zone."""
    exponent_error: float


def bearing_zones(found: BearingSweep) -> tuple[BearingZone, ...]:
    """Zones of a sweep, from the lowest speed to the highest.

    Speeds belong together that have the same states, from all starts, and an exponent that is positive at all of them
    or at none. Edges are as sure as half the distance of the speeds of the sweep.
    """
    kinds = [_kind(found, i) for i in range(found.speed.size)]
    edges = [0, *(i for i in range(1, len(kinds)) if kinds[i] != kinds[i - 1]), len(kinds)]
    between = lambda i: float(found.rpm[i - 1] + found.rpm[i]) / 2
    zones = []
    for first, end in zip(edges[:-1], edges[1:], strict=True):
        exponent, error = _exponent(found, slice(first, end))
        zones.append(
            BearingZone(
                *kinds[first],
                low_rpm=between(first) if first else float(found.rpm[0]),
                high_rpm=between(end) if end < len(kinds) else float(found.rpm[-1]),
                speeds=end - first,
                exponent=exponent,
                exponent_error=error,
            )
        )
    return tuple(zones)


def _kind(found: BearingSweep, i: int) -> tuple[tuple[str, ...], bool]:
    """States at a speed, and whether it is chaotic."""
    states = set(found.state[i].tolist())
    exponent, error = _exponent(found, slice(i, i + 1))
    return tuple(sorted(states - {"failed"} or states)), bool(exponent > SURE * error)


def _exponent(found: BearingSweep, speeds: slice) -> tuple[float, float]:
    """Mean over all blocks of some speeds, and its standard error; NaN without any."""
    blocks = found.block_means["exponent"][speeds]
    known = blocks[np.isfinite(blocks)]
    if known.size < 2:
        return float("nan"), float("nan")
    return float(known.mean()), float(known.std(ddof=1) / np.sqrt(known.size))
