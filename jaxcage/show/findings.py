"""Everything that a report shows of a design, computed by one path for every model; operating speeds beside zones."""

import dataclasses
import math
import re
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any

import numpy as np
import xarray as xr
from jaxtyping import Float

from .._errors import ArgumentError, NoResult
from .._parameters import parameters
from ..analysis import Edge, Stretch, Zone, Zones, failed, outcomes, stretches, zones
from ..bearing import LoadDistribution, PublishedCase, load_distribution
from ..design import DIRECTIONS, MeanGradient, Runs, mean_gradient
from ..files import SpeedOf, Whose, own_rpm, split_owner, to_si
from ..lanes import label_map, sweep
from ..models import AbstractForcedSystem
from ..orbits import Curve, LossZones, Sensitivity, SynchronousOrbits, explain, loss_zones, synchronous_orbits
from ..solve import AbstractMethod, Trajectory, simulate
from .gradient_tables import edge_slopes
from .maps import SPEED, Axis, follow_edges, parameter_axis
from .zone_tables import zone_span


CLOSE = 0.05
"""An edge nearer than this share of the speed is called close."""
_RANGE = re.compile(r"\s*([\d.]+(?:e\d+)?)\s*([a-z/]*)\s*(?:(?:-|–|to)\s*([\d.]+(?:e\d+)?)\s*(.*?))?\s*", re.IGNORECASE)


@dataclasses.dataclass(frozen=True)
class Operating:
    """A speed, or a range of speeds, at which the model runs [rpm]."""

    low_rpm: float
    high_rpm: float

    def __str__(self) -> str:
        ends = dict.fromkeys((f"{self.low_rpm:.0f}", f"{self.high_rpm:.0f}"))
        return f"{' to '.join(ends)} rpm"

    def of_shaft(self, cage_speed_ratio: float) -> "Operating":
        """Speeds of the shaft that go with speeds of the cage."""
        return Operating(self.low_rpm / cage_speed_ratio, self.high_rpm / cage_speed_ratio)


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
    """The same, in per cent of the nearer end of the operating speed."""


def read_operating(text: str, model: AbstractForcedSystem, unsaid: Whose | None = None) -> tuple[Operating, ...]:
    """Speeds and ranges such as `8500, 12000-15000`, `900 rad/s, 1200 to 1500 rad/s` or `20000-24000 rpm shaft`.

    **Arguments:** the text, in rpm unless it names a unit; the model; whose speeds (`cage` or `shaft`) they are where
    the text does not say it, by default those of the model.

    **Returns:** speeds of the model.

    **Raises:** `ValueError`, one sentence.
    """
    return tuple(_read_one(part, model, unsaid) for part in text.split(",") if part.strip())


def _read_one(given: str, model: AbstractForcedSystem, unsaid: Whose | None) -> Operating:
    refuse = lambda said: ArgumentError("operating", said=f"must be speeds {said}.")
    try:
        part, whose = split_owner(given)
    except ValueError as error:
        raise refuse(f"of either, but {error}") from None
    if (match := _RANGE.fullmatch(" ".join(part.split()))) is None:
        raise refuse(f'and ranges like "8500, 12000-15000 rpm", but "{part.strip()}" was given')
    low, unit, high, other = match.groups()
    ends = [f"{low} {unit or other or 'rpm'}", f"{high or low} {other or unit or 'rpm'}"]
    try:
        first, last = (to_si(end, "rpm") for end in ends)
    except ValueError as error:
        raise refuse(f'in rpm, or with a unit such as "900 rad/s", but "{part.strip()}" {error}') from None
    if not 0 < first <= last < math.inf:
        raise refuse(f'above 0 and ranges that grow, but "{part.strip()}" was given')
    named = whose or unsaid
    return Operating(*(own_rpm(model, end if named is None else SpeedOf(end, named)) for end in (first, last)))


def chaotic_verdict(at: Operating, zones: Zones, sweep: xr.Dataset) -> Verdict:
    """Place of `at` among the chaotic zones of a sweep. A speed beside lanes that failed is not called clear."""
    if (beyond := _beyond(at, sweep["rpm"].values)) is not None:
        return beyond
    found = _verdict(at, zones.zones)
    if found.state.endswith("inside"):
        return found
    dying = [z for z in zones.transient if _meets(at, z)]
    if dying:
        lives = [life.seconds for z in dying for life in z.life or ()]
        often = f", mean life up to {max(lives):.2g} s after each disturbance" if lives else ""
        state = f"{'' if _within(at, dying) else 'partly '}in transient chaos"
        return dataclasses.replace(found, state=state, where=f"{state}{often}")
    rpm, reach = sweep["rpm"].values, zones.resolution_rpm
    lost = int(np.sum(failed(sweep)[(rpm >= at.low_rpm - reach) & (rpm <= at.high_rpm + reach)]))
    return Verdict("unknown", f"{lost} simulations beside it failed: nothing is known") if lost else found


def loss_verdict(at: Operating, zones: Sequence[Zone], lower_rpm: float, upper_rpm: float, any_orbit: bool) -> Verdict:
    """Place of `at` among the synchronous-loss zones of a search from `lower_rpm` to `upper_rpm`."""
    if not any_orbit:
        return Verdict("unknown", "no synchronous orbit was found: nothing is known")
    return _beyond(at, np.array([lower_rpm, upper_rpm])) or _verdict(at, zones)


def motion_verdict(at: Operating, stretches: Sequence[Stretch], sweep: xr.Dataset) -> Verdict:
    """Motion of the cage at `at`, `chaotic` where the largest exponent is positive beyond doubt."""
    met = [s for s in stretches if s.low_rpm <= at.high_rpm and at.low_rpm <= s.high_rpm]
    motions = dict.fromkeys(" or ".join(s.labels).replace("_", " ") for s in met)
    state = "chaotic" if any(s.chaotic for s in met) else "clear"
    return _beyond(at, sweep["rpm"].values) or Verdict(state, ", ".join(motions))


def _beyond(at: Operating, rpm: np.ndarray) -> Verdict | None:
    if rpm[0] - 1e-6 <= at.low_rpm and at.high_rpm <= rpm[-1] + 1e-6:
        return None
    return Verdict("unknown", f"not computed: the speeds go from {rpm[0]:.0f} to {rpm[-1]:.0f} rpm")


def _verdict(at: Operating, zones: Sequence[Zone]) -> Verdict:
    inside = [str(i) for i, z in enumerate(zones, start=1) if _meets(at, z)]
    partly = "" if _within(at, zones) else "partly "
    where = f"{partly}in zone{'s' * (len(inside) > 1)} {' and '.join(inside)}" if inside else "outside all zones"
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


def _within(at: Operating, zones: Sequence[Zone]) -> bool:
    """True if all of `at` lies in one of the zones."""
    return any(low <= at.low_rpm and at.high_rpm <= high for low, high in map(zone_span, zones))


def _distance(at: Operating, edge: Edge) -> float:
    return max(edge.speed_rpm - at.high_rpm, at.low_rpm - edge.speed_rpm, 0.0)


FOLLOWED = ("zone 1 onset", "zone 1 exit", "zone 2 onset")
"""Edges that are followed across the map, which takes about a minute each."""
LENGTH: dict[str, Any] = {"discard": 20, "revolutions": 20}
"""Length of the run of a bearing with its rollers at an operating speed."""


def require_some(found: xr.Dataset, where: str = "") -> None:
    """**Raises:** `NoResult` if every lane failed, with their number, `where`, and how they ended."""
    if failed(found).all():
        said = f"All {found['label'].size} simulations{where} failed ({', '.join(sorted(outcomes(found)))})"
        raise NoResult(f"{said}: try more steps (--steps).")


@dataclasses.dataclass(frozen=True)
class Orbits:
    """Synchronous orbits of a model whose revolutions repeat."""

    found: SynchronousOrbits
    loss: LossZones
    slopes: dict[str, Sensitivity]
    """Sensitivity of every exact edge; empty in a quick report."""
    axis: Axis
    map: xr.Dataset
    """Largest exponent over speed and the parameter of the axis."""
    curves: list[Curve]
    refused: dict[str, str]
    """Edges that could not be followed, and the reasons."""
    method: str


@dataclasses.dataclass(frozen=True)
class OneSpeed:
    """A bearing with its rollers at the first operating speed."""

    at: Operating
    run: Trajectory
    slopes: MeanGradient | None
    """Slopes of means by the design; None in a quick report."""


@dataclasses.dataclass(frozen=True)
class Findings:
    """Everything that is known of one design."""

    name: str
    model: Any
    published: PublishedCase | None
    sweep: xr.Dataset
    operating: tuple[Operating, ...]
    zones: Zones | tuple[Stretch, ...]
    """Chaotic zones with the mechanisms that are known, or stretches of speed with the same motion of a cage's centre.
    """
    orbits: Orbits | None
    statics: LoadDistribution | None
    """None without a load."""
    quick: bool
    seconds: dict[str, float]
    """Time of each stage, compilation included."""
    one_speed: OneSpeed | None = None


def examine(
    name: str,
    model: AbstractForcedSystem,
    published: PublishedCase | None = None,
    *,
    speeds: Float[np.ndarray, " speeds"],
    operating: tuple[Operating, ...] = (),
    quick: bool = False,
    orbit_method: AbstractMethod | None = None,
    progress: Callable[[str, int, int], None] | None = None,
    **settings: Any,
) -> Findings:
    """Compute all that a report shows.

    **Arguments:** name, model and published case; speeds of the model [rad/s]; operating speeds; `quick` leaves out
    gradients, mechanisms of chaotic edges and curves of the map; integration method of orbits; `progress` is called
    with the stage, how much of it is done, and of how much; settings of the sweep.

    **Raises:** `NoResult` if no simulation finished.
    """
    say = progress or (lambda what, done, of: None)
    seconds: dict[str, float] = {}

    @contextmanager
    def timed(stage: str) -> Iterator[None]:
        began = time.perf_counter()
        say(stage, 0, 1)
        yield
        seconds[stage] = time.perf_counter() - began

    with timed("sweep"):
        swept = sweep(model, speeds, progress=lambda done, of: say("sweep", done, of), **settings)
    require_some(swept)
    known, orbits, one = stretches(swept) if model.samples > 1 else zones(swept), None, None
    if isinstance(known, Zones):
        ends, slopes, curves, refused = (float(speeds[0]), float(speeds[-1])), {}, [], {}
        with timed("synchronous orbits"):
            found = synchronous_orbits(model, *ends, settled=swept, method=orbit_method, progress=say)
            loss, axis = loss_zones(found), parameter_axis(model, "guidance_gap")
        if not quick:
            with timed("mechanisms of chaotic edges"):
                explained = explain(known, found, model, orbit_method)
                known = explained.zones
            with timed("gradients"):
                slopes = edge_slopes(model, loss, explained, orbit_method)
            with timed("curves"):
                edges = {name: edge for name, edge in loss.edges.items() if name in FOLLOWED}
                curves, refused = follow_edges(model, edges, ends, axis, orbit_method, say)
        with timed("map"):
            columns, rows, discard, revolutions = (40, 7, 100, 60) if quick else (80, 12, 250, 100)
            across = {SPEED: np.linspace(*ends, columns)}, {axis.name: np.linspace(axis.lower, axis.upper, rows)}
            length: Any = {"discard": discard, "revolutions": revolutions, "blocks": 1, "keep": 1}
            mapped = label_map(model, *across, **length, method=settings.get("method"), stage=say)
        words = "as many as each orbit needs" if orbit_method is None else " ".join(str(orbit_method).split())
        orbits = Orbits(found, loss, slopes, axis, mapped, curves, refused, words)
    elif operating:
        at = (operating[0].low_rpm + operating[0].high_rpm) * np.pi / 60
        with timed("one speed"):
            run, slopes = simulate(model, at, samples=128, method=settings.get("method"), **LENGTH), None
        if not quick:
            with timed("slopes of means"):
                runs = Runs(at, starts=2, **LENGTH, blocks=2, exponents=0, tolerance=1e-4)
                value = parameters(model)
                moved = [names for names in DIRECTIONS if all(float(value[name]) for name in names.split("+"))]
                slopes = mean_gradient(model, runs, directions=moved)
        one = OneSpeed(operating[0], run, slopes)
    load = float(getattr(model, "load", 0.0))
    shared = load_distribution(model.bearing, load) if load > 0 else None  # pyright: ignore
    return Findings(name, model, published, swept, operating, known, orbits, shared, quick, seconds, one)
