"""Operating speeds against zones: inside, close, clear, or not known."""

import dataclasses
import math
import re
from collections.abc import Sequence

import numpy as np

from .._errors import ArgumentError
from ..analysis import Edge, Sweep, Zone, Zones
from ..io import Whose, split_owner, to_si
from ._zone_tables import zone_span


CLOSE = 0.05
"""An edge nearer than this share of the speed is called close."""
INSIDE = ("inside", "partly inside")
"""States of what is, at some speed at least, in a zone."""
_RANGE = re.compile(r"\s*([\d.]+(?:e\d+)?)\s*([a-z/]*)\s*(?:(?:-|–|to)\s*([\d.]+(?:e\d+)?)\s*(.*?))?\s*", re.IGNORECASE)


@dataclasses.dataclass(frozen=True)
class Operating:
    """A speed, or a range of speeds, at which the cage runs [rpm]."""

    low_rpm: float
    high_rpm: float

    def __str__(self) -> str:
        if self.low_rpm == self.high_rpm:
            return f"{self.low_rpm:.0f} rpm"
        return f"{self.low_rpm:.0f} to {self.high_rpm:.0f} rpm"

    def of_shaft(self, cage_speed_ratio: float) -> "Operating":
        """The shaft's speeds."""
        return Operating(self.low_rpm / cage_speed_ratio, self.high_rpm / cage_speed_ratio)


@dataclasses.dataclass(frozen=True)
class Verdict:
    """What the zones of one kind say of an operating speed."""

    state: str
    """`inside`, `partly inside`, `in transient chaos`, `partly in transient chaos`, `close`, `clear` or `unknown`."""
    where: str
    """In which zone, or why nothing is known."""
    edge: str = ""
    """Name and speed of the nearest edge; nothing if there is none."""
    edge_rpm: float | None = None
    distance_rpm: float | None = None
    """From the operating speed to the nearest edge, 0 where a range holds one."""
    percent: float | None = None
    """The same, in per cent of the operating speed's end that is nearer."""

    def __str__(self) -> str:
        if self.distance_rpm is None or self.edge_rpm is None:
            return self.where
        return f"{self.where}; nearest edge: {self.edge}, {self.distance_rpm:.0f} rpm ({self.percent:.1f} %) away"


def read_operating(
    text: str, cage_speed_ratio: float = 1.0, unsaid: Whose = "cage", cage_rpm_at_rest: float = 0.0
) -> list[Operating]:
    """Speeds and ranges such as `8500, 12000-15000`, `900 rad/s, 1200 to 1500 rad/s` or `20000-24000 rpm shaft`.

    **Arguments:** the text, in rpm if nothing else is said; cage speed over shaft speed; whose speeds they are where
    the text does not say it; speed of the cage while the shaft rests [rpm], where the outer ring turns.

    **Returns:** speeds of the cage.

    **Raises:** `ValueError`, one sentence.
    """
    return [_read_one(part, cage_speed_ratio, unsaid, cage_rpm_at_rest) for part in text.split(",") if part.strip()]


def _read_one(given: str, ratio: float, unsaid: Whose, at_rest: float) -> Operating:
    try:
        part, whose = split_owner(given)
    except ValueError as error:
        raise ArgumentError("operating", said=f"must be speeds of either, but {error}.") from None
    match = _RANGE.fullmatch(" ".join(part.split()))
    if match is None:
        raise ArgumentError(
            "operating", said=f'must be speeds and ranges like "8500, 12000-15000 rpm", but "{part.strip()}" was given.'
        )
    low, unit, high, other = match.groups()
    unit = unit or other or "rpm"
    try:
        first = to_si(f"{low} {unit}", "rpm")
        last = first if high is None else to_si(f"{high} {other or unit}", "rpm")
    except ValueError as error:
        raise ArgumentError(
            "operating",
            said=f'must be speeds in rpm, or with a unit such as "900 rad/s", but "{part.strip()}" {error}.',
        ) from None
    if not 0 < first <= last < math.inf:
        raise ArgumentError(
            "operating", said=f'must be speeds above 0 and ranges that grow, but "{part.strip()}" was given.'
        )
    if (whose or unsaid) == "cage":
        return Operating(first, last)
    return Operating(at_rest + ratio * first, at_rest + ratio * last)


def chaotic_verdict(at: Operating, zones: Zones, sweep: Sweep) -> Verdict:
    """Where `at` is among the chaotic zones of a sweep. A speed beside lanes that failed is not called clear."""
    rpm = sweep.rpm
    if at.low_rpm < rpm[0] - 1e-6 or at.high_rpm > rpm[-1] + 1e-6:
        return Verdict("unknown", f"not swept: the sweep goes from {rpm[0]:.0f} to {rpm[-1]:.0f} rpm")
    found = _verdict(at, zones.zones)
    inside = found.state in INSIDE
    dying = [z for z in zones.transient if _meets(at, z)]
    if dying and not inside:
        lives = [life.seconds for z in dying for life in z.life or ()]
        often = f", mean life up to {max(lives):.2g} s after each disturbance" if lives else ""
        state = f"{'' if _held(at, dying) else 'partly '}in transient chaos"
        return dataclasses.replace(found, state=state, where=f"{state}{often}")
    beside = (rpm >= at.low_rpm - zones.resolution_rpm) & (rpm <= at.high_rpm + zones.resolution_rpm)
    lost = int(np.sum(sweep.failed[beside]))
    if lost and not inside:
        return Verdict("unknown", f"{lost} simulations beside it failed: nothing is known")
    return found


def loss_verdict(at: Operating, zones: Sequence[Zone], lower_rpm: float, upper_rpm: float, any_orbit: bool) -> Verdict:
    """Where `at` is among the synchronous-loss zones of a search from `lower_rpm` to `upper_rpm`."""
    if not any_orbit:
        return Verdict("unknown", "no synchronous orbit was found: nothing is known")
    if at.low_rpm < lower_rpm - 1e-6 or at.high_rpm > upper_rpm + 1e-6:
        return Verdict("unknown", f"not searched: the search goes from {lower_rpm:.0f} to {upper_rpm:.0f} rpm")
    return _verdict(at, zones)


def _verdict(at: Operating, zones: Sequence[Zone]) -> Verdict:
    inside = [str(i) for i, z in enumerate(zones, start=1) if _meets(at, z)]
    numbers = f"zone{'s' if len(inside) > 1 else ''} {' and '.join(inside)}"
    partly = "" if _held(at, zones) else "partly "
    where = f"{partly}in {numbers}" if inside else "outside all zones"
    edges = [
        (f"zone {i} {end}", edge)
        for i, zone in enumerate(zones, start=1)
        for end, edge in (("onset", zone.onset), ("exit", zone.exit))
        if edge is not None
    ]
    if not edges:
        return Verdict(f"{partly}inside" if inside else "clear", where)
    name, edge = min(edges, key=lambda e: _distance(at, e[1]))
    away = _distance(at, edge)
    percent = 100 * away / (at.high_rpm if edge.speed_rpm > at.high_rpm else at.low_rpm)
    near = away <= edge.uncertainty_rpm or percent < 100 * CLOSE
    state = f"{partly}inside" if inside else "close" if near else "clear"
    return Verdict(state, where, f"{name}, {edge}".replace("+-", "±"), edge.speed_rpm, away, percent)


def _meets(at: Operating, zone: Zone) -> bool:
    low, high = zone_span(zone)
    return low <= at.high_rpm and at.low_rpm <= high


def _held(at: Operating, zones: Sequence[Zone]) -> bool:
    """Whether all of it is in one of the zones."""
    return any(low <= at.low_rpm and at.high_rpm <= high for low, high in map(zone_span, zones))


def _distance(at: Operating, edge: Edge) -> float:
    return max(edge.speed_rpm - at.high_rpm, at.low_rpm - edge.speed_rpm, 0.0)
