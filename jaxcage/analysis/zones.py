"""Zones and their edges, as found in a sweep.

Two kinds of edge are distinguished. A **chaotic edge** is the end of a run of chaotic speeds, after windows narrower
than a stated width are closed: it is statistical, with the resolution of the grid. Chaos that lasts beyond the horizon
of the sweep and chaos that dies out before it form separate zones; an edge between these is as uncertain as the mean
lives next to it, which may be on either side of the horizon within their errors. An **edge of an unstable range** is a
speed at which the stable period-1 orbit appears or disappears; a sweep brackets it between two neighbouring speeds.
"""

import dataclasses
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
import xarray as xr
from jaxtyping import Bool, Float

from .._errors import ArgumentError
from ..quantities import notebook_html
from .labels import CHAOS_THRESHOLD
from .sweep import chaotic_share, failed, lasting, resolution_rpm, restless, survival_at


CLOSE_BELOW_RPM, CLOSE_BELOW = 500.0, 0.05
"""Width of the windows within a zone that are closed [rpm], and its limit as a fraction of the highest speed (large
bearings turn slowly)."""


def closing_width(rpm: np.ndarray) -> float:
    """Width below which windows between speeds `rpm` are closed [rpm]."""
    return min(CLOSE_BELOW_RPM, CLOSE_BELOW * float(np.max(rpm)))


@dataclasses.dataclass(frozen=True)
class Edge:
    """One end of a zone."""

    speed_rpm: float
    uncertainty_rpm: float
    kind: str
    """Kind of zone: `chaotic`, `transient` or `unstable`."""
    mechanism: str = "unknown"
    """Mechanism: `period-doubling`, `Neimark-Sacker`, `fold` or `unknown`."""
    basis: str = "statistical"
    """Source: `statistical`, from a sweep; `located`, a bifurcation that was solved for; `followed`, the last orbit of
    a branch whose end was not found, without an uncertainty."""

    def __str__(self) -> str:
        if self.basis == "statistical":
            return f"{self.speed_rpm:.0f} ± {self.uncertainty_rpm:.0f} rpm"
        return f"{self.speed_rpm:.2f} rpm ({self.mechanism})"

    _repr_html_ = notebook_html


class MeanLife(NamedTuple):
    """Mean life of chaos at a speed."""

    revolutions: float
    speed_rpm: float
    bound: bool
    """True if no trajectory left chaos there, so that `revolutions` is a lower bound."""

    @property
    def seconds(self) -> float:
        """Mean life [s] at that speed."""
        return 60 * self.revolutions / self.speed_rpm


def lives_in_words(lives: Sequence[MeanLife], value: Callable[[MeanLife], str]) -> str:
    """Text with the shortest and the longest life, each formatted by `value`, with ">" before a lower bound."""
    signed = [("> " if life.bound else "") + value(life) for life in lives]
    return signed[0] if all(life.bound for life in lives) else " to ".join(dict.fromkeys(signed))


@dataclasses.dataclass(frozen=True)
class Zone:
    """A range of speed; an edge is None if the zone extends beyond the swept range."""

    kind: str
    """Kind: `chaotic`, `transient`, `unstable`, or `synchronous`, in which the stable period-1 orbit was met."""
    onset: Edge | None
    exit: Edge | None
    share: float
    """Mean over the zone's speeds of the fraction of initial states that are chaotic while observed; in a synchronous
    zone, that settled on the orbit; in an unstable range, that did not."""
    life: tuple[MeanLife, MeanLife] | None = None
    """Shortest and longest mean life of chaos at the zone's speeds, each from the lanes there and at the neighbouring
    speeds. Without an escape only a lower bound is known, which is the shortest only if all are lower bounds. None if
    lanes were not followed."""

    @property
    def width_rpm(self) -> float | None:
        """Width [rpm], None for an open zone."""
        return None if self.onset is None or self.exit is None else self.exit.speed_rpm - self.onset.speed_rpm


@dataclasses.dataclass(frozen=True)
class Zones:
    """Zones in the speed range of a sweep, at the resolution of its speeds."""

    zones: tuple[Zone, ...]
    """Zones of lasting chaos, ascending."""
    synchronous: tuple[Zone, ...]
    """Ranges in which a stable period-1 orbit was met; their ends are edges of unstable ranges."""
    resolution_rpm: float
    close_below_rpm: float
    transient: tuple[Zone, ...] = ()
    """Zones of chaos that dies out before the horizon, ascending."""
    horizon: int = 0
    """Revolutions that chaos must last, those of the run rounded up to blocks of 30; 0 if lanes were not followed."""

    def __str__(self) -> str:
        head = f"Zones of chaos that lasts beyond {self.horizon} revolutions" if self.horizon else "Chaotic zones"
        rows = [f"{head}, at a resolution of {self.resolution_rpm:.0f} rpm"]
        rows += [f"  zone {i}: {_row(zone)}" for i, zone in enumerate(self.zones, start=1)] or ["  none"]
        if self.transient:
            rows += ["Transient chaos", *(f"  {_row(zone)}" for zone in self.transient)]
        return "\n".join(rows)

    _repr_html_ = notebook_html


def _row(zone: Zone) -> str:
    width = "open" if zone.width_rpm is None else f"{zone.width_rpm:.0f} rpm wide"
    ends = f"{zone.onset or 'below the range'} to {zone.exit or 'above the range'}"
    life = "" if zone.life is None else lives_in_words(zone.life, lambda life: f"{life.revolutions:.0f}")
    return f"{ends}, {width}, {zone.share:.0%} of initial states chaotic{life and f', mean life {life} revolutions'}"


def runs(mask: Bool[np.ndarray, " speeds"]) -> list[tuple[int, int]]:
    """First and last index of each run of True values."""
    padded = np.concatenate([[False], mask, [False]]).astype(int)
    changes = np.diff(padded)
    return list(zip(np.flatnonzero(changes == 1).tolist(), (np.flatnonzero(changes == -1) - 1).tolist(), strict=True))


def close_windows(
    rpm: np.ndarray,
    chaotic: Bool[np.ndarray, " speeds"],
    undecided: Bool[np.ndarray, " speeds"],
    close_below_rpm: float,
) -> list[tuple[int, int]]:
    """Runs of chaotic speeds, joined if the distance from the last to the next is less than `close_below_rpm`, or every
    speed between is undecided."""
    joined: list[tuple[int, int]] = []
    for first, last in runs(chaotic):
        before = joined[-1][1] if joined else first
        near = rpm[first] - rpm[before] < close_below_rpm * (1 - 1e-9)  # rounding of the grid
        if joined and (near or np.all(undecided[before + 1 : first])):
            first = joined.pop()[0]
        joined.append((first, last))
    return joined


class _Speeds(NamedTuple):
    """Classification of the speeds of a sweep for one kind of zone."""

    known: Bool[np.ndarray, " speeds"]
    """True if it is known that a speed is inside or outside; False for a gap."""
    undecided: Bool[np.ndarray, " speeds"]
    """True if the opposite is possible within the errors."""
    share: Float[np.ndarray, " speeds"]
    """Fraction of the initial states that are chaotic, or periodic, as the kind of zone says."""


def _edge(rpm: np.ndarray, at: _Speeds, inner: int, step: int, kind: str) -> Edge | None:
    """Edge between the zone's end at `inner` and the first known speed beyond it."""
    outer = _first(at.known, inner + step, step)
    if not 0 <= outer < rpm.size:
        return None
    speed = (float(rpm[inner]) + float(rpm[outer])) / 2
    sure = (_first(~at.undecided, inner, -step), _first(~at.undecided, outer, step))
    reach = max(abs(float(rpm[min(max(i, 0), rpm.size - 1)]) - speed) for i in sure)
    return Edge(speed, max(abs(float(rpm[outer] - rpm[inner])), reach), kind)


def _first(mask: Bool[np.ndarray, " speeds"], index: int, step: int) -> int:
    """Index of the first True value from `index` on in direction `step`; outside the array without one."""
    while 0 <= index < mask.size and not mask[index]:
        index += step
    return index


def _zones(found: xr.Dataset, at: _Speeds, spans: Sequence[tuple[int, int]], kind: str) -> tuple[Zone, ...]:
    followed = kind != "synchronous" and "escape" in found
    edges = kind if kind != "synchronous" else "unstable"
    rpm, chaotic = found["rpm"].values, restless(found)
    return tuple(
        Zone(
            kind,
            _edge(rpm, at, a, -1, edges),
            _edge(rpm, at, b, 1, edges),
            float(np.nanmean(at.share[a : b + 1])),
            _life(found, chaotic, a, b) if followed else None,
        )
        for a, b in spans
    )


def _life(found: xr.Dataset, chaotic: np.ndarray, first: int, last: int) -> tuple[MeanLife, MeanLife]:
    """Shortest and longest mean life at the chaotic speeds of a zone."""
    at = {float(found["rpm"][i]): survival_at(found, i) for i in range(first, last + 1) if chaotic[i]}
    lives = [MeanLife(s.mean_life if s.escapes else s.lower_bound, rpm, not s.escapes) for rpm, s in at.items()]
    shortest = min(lives, key=lambda life: (life.bound, life.revolutions))
    longest = max(lives, key=lambda life: life.revolutions)
    return shortest, longest._replace(bound=any(life.bound for life in lives))


def zones(sweep: xr.Dataset, close_below_rpm: float | None = None) -> Zones:
    """Find the chaotic zones of a sweep, and the ranges in which the synchronous orbit was met.

    A speed with at least one chaotic lane counts as transient if lanes were followed to a horizon that exceeds the mean
    life of chaos, else as chaotic. Speeds without a chaotic lane at which some lanes failed or were inaccurate are
    neither inside nor outside a zone, and the uncertainty of an edge next to them is the width of the gap.

    **Arguments:** result of `sweep` for one model, with at least one exponent; width of the windows to be closed [rpm],
    by default 500 rpm and at most 5 % of the highest speed. A window is also closed if no speed in it is surely outside
    a zone.

    **Returns:** `Zones`. Edges lie half way between neighbouring speeds. Their uncertainty is the spacing or, if
    larger, the distance to the first speed on either side at which the interval of the mean life (95 %) excludes the
    horizon.
    """
    sweep = _ascending(sweep)
    if not sweep.sizes["exponent"]:
        raise ArgumentError("sweep", said="must have at least one exponent, but has none.")
    rpm, label = sweep["rpm"].values, sweep["label"].values
    close_below_rpm = closing_width(rpm) if close_below_rpm is None else close_below_rpm
    lasts, chaotic, sound = lasting(sweep), restless(sweep), np.all(~failed(sweep), axis=1)
    synchronous: np.ndarray = np.any(label == "periodic-1", axis=1)
    met = _Speeds(synchronous | sound, np.zeros_like(sound), np.mean(label == "periodic-1", axis=1))
    chaos = _Speeds(chaotic | sound, _undecided(sweep, chaotic), chaotic_share(sweep))
    return Zones(
        _zones(sweep, chaos, close_windows(rpm, lasts, chaos.undecided, close_below_rpm), "chaotic"),
        _zones(sweep, met, runs(synchronous), "synchronous"),
        resolution_rpm(sweep),
        close_below_rpm,
        _zones(sweep, chaos, runs(chaotic & ~lasts), "transient"),
        sweep.attrs["horizon"],
    )


def _ascending(sweep: xr.Dataset) -> xr.Dataset:
    """Sort a sweep by speed, since joined parts may come in any order."""
    if sweep["label"].dims != ("speed", "initial_state"):
        raise ArgumentError("sweep", said=f"must be over speed and initial state, but is over {sweep['label'].dims}.")
    return sweep.sortby("speed")


def _undecided(found: xr.Dataset, chaotic: Bool[np.ndarray, " speeds"]) -> Bool[np.ndarray, " speeds"]:
    """True for speeds at which the mean life may be on either side of the horizon, or an undecided lane chaotic."""
    highest = (found["exponents"] + 2 * found["standard_error"]).values
    open_ = (found["label"].values == "undecided") & (highest > CHAOS_THRESHOLD)[..., 0]
    undecided = ~chaotic & np.any(open_, axis=1)
    if "escape" in found:
        for i in np.flatnonzero(chaotic).tolist():
            lives = survival_at(found, i)
            undecided[i] = lives.escapes > 0 and lives.interval[0] < found.attrs["horizon"] <= lives.interval[1]
    return undecided


SURE = 2.0
"""Number of standard errors by which an exponent must exceed zero to count as positive."""


@dataclasses.dataclass(frozen=True)
class Stretch:
    """Neighbouring speeds of a sweep at which the lanes have the same labels."""

    labels: tuple[str, ...]
    """Labels of the lanes, several if they depend on the initial state; `failed` if every lane failed."""
    chaotic: bool
    """True if the largest exponent, in the mean over lanes, is above 0 by more than two standard errors."""
    low_rpm: float
    """Lower end: halfway between the last speed outside and the first inside, or the first speed of the sweep."""
    high_rpm: float
    speeds: int
    exponent: float
    """Mean of the largest exponent per revolution over all lanes of the stretch."""
    exponent_error: float


def stretches(sweep: xr.Dataset) -> tuple[Stretch, ...]:
    """Find the stretches of speed with equal labels and sign of the exponent.

    **Arguments:** result of `sweep`. **Returns:** stretches in ascending order, accurate to half the spacing of speeds.
    """
    sweep = _ascending(sweep)
    rpm, label = sweep["rpm"].values, sweep["label"].values
    kinds = [_kind(sweep, label, i) for i in range(rpm.size)]
    ends = [0, *(i for i in range(1, len(kinds)) if kinds[i] != kinds[i - 1]), len(kinds)]
    between = lambda i: float(rpm[i - 1] + rpm[i]) / 2
    return tuple(
        Stretch(
            *kinds[first],
            between(first) if first else float(rpm[0]),
            between(end) if end < len(kinds) else float(rpm[-1]),
            end - first,
            *_exponent(sweep, slice(first, end)),
        )
        for first, end in zip(ends[:-1], ends[1:], strict=True)
    )


def _kind(sweep: xr.Dataset, label: np.ndarray, i: int) -> tuple[tuple[str, ...], bool]:
    """Labels at a speed, and True if its exponent is positive."""
    labels = set(label[i].tolist())
    exponent, error = _exponent(sweep, slice(i, i + 1))
    return tuple(sorted(labels - {"failed"} or labels)), bool(exponent > SURE * error)


def _exponent(sweep: xr.Dataset, speeds: slice) -> tuple[float, float]:
    """Return the mean of the largest exponent over speeds, and its standard error from the scatter of the blocks at
    each speed; NaN if no speed has two blocks."""
    blocks = (each[np.isfinite(each)] for each in sweep["block_growth"].values[speeds][..., :1])
    known = [each for each in blocks if each.size > 1]
    if not known:
        return float("nan"), float("nan")
    error = np.linalg.norm([each.std(ddof=1) / np.sqrt(each.size) for each in known]) / len(known)
    return float(np.mean([each.mean() for each in known])), float(error)
