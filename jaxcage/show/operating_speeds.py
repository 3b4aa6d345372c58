"""Operating speeds of a machine, and their place among the zones of a design."""

import dataclasses
import math
import re
from collections.abc import Iterable, Sequence

import numpy as np
import xarray as xr

from .._errors import ArgumentError
from ..analysis import Edge, Stretch, Zone, Zones, failed
from ..files import SpeedOf, Whose, own_rpm, split_owner, to_si
from ..models import AbstractForcedSystem
from ..orbits import SynchronousOrbits
from .tables import Beside, Column, Table, table
from .zone_tables import zone_span


CLOSE = 0.05
"""Relative distance within which an edge is called close."""
_TO = re.compile(r"\s*(?:-|–|\bto\b)\s*")


@dataclasses.dataclass(frozen=True)
class Operating:
    """Operating speed, or range of speeds, of the model [rpm]."""

    low_rpm: float
    high_rpm: float

    def __str__(self) -> str:
        ends = dict.fromkeys((f"{self.low_rpm:.0f}", f"{self.high_rpm:.0f}"))
        return f"{' to '.join(ends)} rpm"


def read_operating(text: str, model: AbstractForcedSystem, unsaid: Whose | None = None) -> tuple[Operating, ...]:
    """Read speeds and ranges such as `8500, 12000-15000`, `900 rad/s, 1200 to 1500 rad/s` or `20000-24000 rpm shaft`.

    **Arguments:** the text, in rpm unless it names a unit; the model; `cage` or `shaft` for speeds that do not name
    one, by default that of the model.

    **Returns:** speeds of the model.

    **Raises:** `ValueError` for a text that does not name speeds.
    """
    return tuple(_read_one(part.strip(), model, unsaid) for part in text.split(",") if part.strip())


def _read_one(given: str, model: AbstractForcedSystem, unsaid: Whose | None) -> Operating:
    try:
        part, whose = split_owner(given)
        ends = _TO.split(part, maxsplit=1)
        units = [end.lstrip("0123456789.e ") for end in ends]
        other = next(filter(None, units), "rpm")
        speeds = [to_si(end if unit else f"{end} {other}", "rpm") for end, unit in zip(ends, units, strict=True)]
    except ValueError as error:
        example = '"8500, 12000-15000 rpm", "900 rad/s" or "20000 rpm shaft"'
        raise ArgumentError("operating", said=f'must be speeds such as {example}, but "{given}" {error}.') from None
    if not 0 < speeds[0] <= speeds[-1] < math.inf:
        said = f'must be speeds above 0 and ranges that grow, but "{given}" was given.'
        raise ArgumentError("operating", said=said)
    named = whose or unsaid
    own = [own_rpm(model, speed if named is None else SpeedOf(speed, named)) for speed in speeds]
    return Operating(own[0], own[-1])


@dataclasses.dataclass(frozen=True)
class Verdict:
    """Place of an operating speed among the zones of one kind."""

    state: str
    """`inside`, `partly inside`, `in transient chaos`, `partly in transient chaos`, `chaotic`, `close`, `clear` or
    `unknown`."""
    where: str
    """The zone, or the reason why nothing is known."""
    edge: str = ""
    """Name and speed of the nearest edge; empty if there is none."""
    edge_rpm: float | None = None
    distance_rpm: float | None = None
    """Distance from the operating speed to the nearest edge, 0 where a range includes one."""
    percent: float | None = None
    """Distance in per cent of the nearer end of the operating speed."""


def chaotic_verdict(at: Operating, zones: Zones, sweep: xr.Dataset) -> Verdict:
    """Place of `at` among the chaotic zones of a sweep; a speed beside failed lanes is not called clear."""
    rpm, reach = sweep["rpm"].values, zones.resolution_rpm
    found = _beyond(at, rpm) or _verdict(at, zones.zones)
    if found.state == "unknown" or found.state.endswith("inside"):
        return found
    if dying := [z for z in zones.transient if _meets(at, z)]:
        lives = [life.seconds for z in dying for life in z.life or ()]
        often = f", mean life up to {max(lives):.2g} s after each disturbance" if lives else ""
        state = f"{'' if _within(at, dying) else 'partly '}in transient chaos"
        return dataclasses.replace(found, state=state, where=f"{state}{often}")
    lost = int(np.sum(failed(sweep)[(rpm >= at.low_rpm - reach) & (rpm <= at.high_rpm + reach)]))
    return Verdict("unknown", f"{lost} simulations beside it failed: nothing is known") if lost else found


def unstable_verdict(
    at: Operating, zones: Sequence[Zone], lower_rpm: float, upper_rpm: float, any_orbit: bool
) -> Verdict:
    """Place of `at` among the unstable ranges of a search from `lower_rpm` to `upper_rpm`."""
    if not any_orbit:
        return Verdict("unknown", "no synchronous orbit was found: nothing is known")
    return _beyond(at, np.array([lower_rpm, upper_rpm])) or _verdict(at, zones)


def motion_verdict(at: Operating, stretches: Sequence[Stretch], sweep: xr.Dataset) -> Verdict:
    """Motion of the cage at `at`, `chaotic` if the largest exponent is significantly positive."""
    met = [s for s in stretches if s.low_rpm <= at.high_rpm and at.low_rpm <= s.high_rpm]
    motions = dict.fromkeys(" or ".join(s.labels).replace("_", " ") for s in met)
    state = "chaotic" if any(s.chaotic for s in met) else "clear"
    return _beyond(at, sweep["rpm"].values) or Verdict(state, ", ".join(motions))


def assess(
    operating: Sequence[Operating],
    sweep: xr.Dataset,
    found: Zones | Sequence[Stretch],
    orbits: SynchronousOrbits | None = None,
    loss: Sequence[Zone] = (),
) -> list[tuple[Operating, dict[str, Verdict]]]:
    """Verdicts on each operating speed by kind of zone.

    **Arguments:** operating speeds; a sweep and its zones or stretches; synchronous orbits and their unstable ranges.
    """
    if not isinstance(found, Zones):
        return [(at, {"motion": motion_verdict(at, found, sweep)}) for at in operating]
    verdicts: list[tuple[Operating, dict[str, Verdict]]] = []
    for at in operating:
        each = {"chaotic": chaotic_verdict(at, found, sweep)}
        if orbits is not None:
            searched = orbits.lower_rpm, orbits.upper_rpm, bool(orbits.stretches)
            each = {"unstable": unstable_verdict(at, loss, *searched)} | each
        verdicts.append((at, each))
    return verdicts


def verdict_table(name: str, assessed: Sequence[tuple[Operating, dict[str, Verdict]]], beside: Beside = None) -> Table:
    """Operating speeds, and those of the shaft, with the verdicts on them."""
    ratio = 1.0 if beside is None else beside[1]
    rows = [
        vars(v)
        | {"speed": str(Operating(ratio * at.low_rpm, ratio * at.high_rpm))}
        | {"kind": kind, "verdict": v.state}
        for at, verdicts in assessed
        for kind, v in verdicts.items()
    ]
    away = [Column("away [rpm]", "distance_rpm", digits=0), Column("away [%]", "percent", digits=1)]
    close = f"close: an edge within {100 * CLOSE:g} % of the speed or within its own uncertainty"
    columns = ["kind", "verdict", "where"]
    title = f"Operating speeds of {name} beside its zones ({close})"
    speed = Column("speed" if beside is None else f"speed ({beside[0]})", "speed")
    return table(title, rows, [speed, *columns, Column("nearest edge", "edge"), *away])


def calmest(zones: Iterable[Zone], first: float, last: float) -> tuple[float, float] | None:
    """Widest range between two speeds [rpm] outside all zones; None if there is none."""
    free, at = [], first
    for low, high in sorted(zone_span(zone, first, last) for zone in zones):
        free.append((at, low))
        at = max(at, high)
    low, high = max([*free, (at, last)], key=lambda pair: pair[1] - pair[0])
    return (low, high) if high > low else None


def _beyond(at: Operating, rpm: np.ndarray) -> Verdict | None:
    if rpm[0] - 1e-6 <= at.low_rpm and at.high_rpm <= rpm[-1] + 1e-6:
        return None
    return Verdict("unknown", f"not computed: the speeds go from {rpm[0]:.0f} to {rpm[-1]:.0f} rpm")


def _verdict(at: Operating, zones: Sequence[Zone]) -> Verdict:
    numbered = list(enumerate(zones, start=1))
    inside = [str(i) for i, zone in numbered if _meets(at, zone)]
    partly = "" if _within(at, zones) else "partly "
    where = f"{partly}in zone{'s' * (len(inside) > 1)} {' and '.join(inside)}" if inside else "outside all zones"
    ends = [(f"zone {i} {end}", getattr(zone, end)) for i, zone in numbered for end in ("onset", "exit")]
    edges: list[tuple[str, Edge]] = [(name, edge) for name, edge in ends if edge is not None]
    if not edges:
        return Verdict(f"{partly}inside" if inside else "clear", where)
    distance = lambda edge: max(edge.speed_rpm - at.high_rpm, at.low_rpm - edge.speed_rpm, 0.0)
    name, edge = min(edges, key=lambda named: distance(named[1]))
    away = distance(edge)
    percent = 100 * away / (at.high_rpm if edge.speed_rpm > at.high_rpm else at.low_rpm)
    near = away <= edge.uncertainty_rpm or percent < 100 * CLOSE
    state = f"{partly}inside" if inside else "close" if near else "clear"
    return Verdict(state, where, f"{name}, {edge}".replace("+-", "±"), edge.speed_rpm, away, percent)


def _meets(at: Operating, zone: Zone) -> bool:
    low, high = zone_span(zone)
    return low <= at.high_rpm and at.low_rpm <= high


def _within(at: Operating, zones: Sequence[Zone]) -> bool:
    """True if all of `at` lies in one of the zones."""
    return any(low <= at.low_rpm and at.high_rpm <= high for low, high in map(zone_span, zones))
