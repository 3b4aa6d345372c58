"""What a report is about: everything that is computed of one design, with the time it took."""

import dataclasses
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import numpy as np
from jaxtyping import Int

from .._errors import NoResult
from ..analysis import Sweep, Zones, zones
from ..bearing import LoadDistribution, PublishedCase, load_distribution
from ..models import CageModel
from ..orbits import (
    Curve,
    Explained,
    LossZones,
    Sensitivity,
    SynchronousOrbits,
    explain,
    loss_zones,
    synchronous_orbits,
)
from ..solve import OUTCOMES, AbstractMethod
from ..sweeps import sweep
from ._map import Axis, Exponents, follow_edges, largest_exponents, parameter_axis, speed_axis
from ._slopes import edge_slopes


MAP_PARAMETER = "guidance_gap"
FOLLOWED = ("zone 1 onset", "zone 1 exit", "zone 2 onset")
"""Edges that are followed across the map, which takes about a minute each."""
Progress = Callable[[str, int, int], None]


class AllFailed(NoResult):
    """No simulation finished: there is nothing to report."""


def require_some(outcome: Int[np.ndarray, "..."], where: str = "") -> None:
    """Stop if all simulations failed.

    **Raises:** `AllFailed`, which says of how many, `where`, and how.
    """
    if np.all(outcome != 0):
        how = ", ".join(sorted({OUTCOMES[code] for code in np.ravel(outcome)}))
        raise AllFailed(f"All {np.size(outcome)} simulations{where} failed ({how}): try more steps (--steps).")


@dataclasses.dataclass(frozen=True)
class Map:
    """The largest exponent over speed and the guidance gap, with the edges followed in both."""

    axis: Axis
    exponents: Exponents
    curves: list[Curve]
    refused: dict[str, str]
    """Edges that could not be followed, and why."""


@dataclasses.dataclass(frozen=True)
class Findings:
    """Everything that is known of one design."""

    name: str
    model: CageModel
    published: PublishedCase | None
    sweep: Sweep
    found: SynchronousOrbits
    loss: LossZones
    explained: Explained
    slopes: dict[str, Sensitivity]
    """Of every exact edge; empty in a quick report."""
    map: Map | None
    statics: LoadDistribution | None
    """None without a load."""
    quick: bool
    orbit_method: str
    seconds: dict[str, float]
    """Time of each stage, compilation with it."""

    @property
    def zones(self) -> Zones:
        """Chaotic zones, with the mechanisms that are known."""
        return self.explained.zones


def examine(
    name: str,
    model: CageModel,
    published: PublishedCase | None,
    *,
    speeds: np.ndarray,
    discard: int,
    revolutions: int,
    blocks: int,
    sweep_method: AbstractMethod | None,
    orbit_method: AbstractMethod | None,
    quick: bool = False,
    progress: Progress | None = None,
) -> Findings:
    """Compute all that a report shows.

    **Arguments:** name, model and what is published of it; speeds [rad/s] with revolutions left out and observed (in
    `blocks` blocks); methods for simulations and for orbits; `quick` leaves out gradients, mechanisms of chaotic edges
    and curves of the map; progress is told the stage, how much of it is done, of how much.

    **Raises:** `AllFailed` if no simulation finished.
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
        swept = sweep(
            model,
            speeds,
            discard=discard,
            revolutions=revolutions,
            blocks=blocks,
            method=sweep_method,
            progress=lambda done, of: say("sweep", done, of),
        )
    require_some(swept.outcome)
    with timed("synchronous orbits"):
        first, last = float(speeds[0]), float(speeds[-1])
        found = synchronous_orbits(model, first, last, settled=swept, method=orbit_method, progress=say)
        loss = loss_zones(found)
    explained, slopes = Explained(zones(swept), {}), {}
    if not quick:
        with timed("mechanisms of chaotic edges"):
            explained = explain(explained.zones, found, model, orbit_method)
        with timed("gradients"):
            slopes = edge_slopes(model, loss, explained, orbit_method)
    with timed("map"):
        chart = _map(model, loss, speeds, orbit_method, sweep_method, quick, say)
    shared = load_distribution(model.bearing, model.load) if float(model.load) > 0 else None
    about = "as many as each orbit needs" if orbit_method is None else f"{orbit_method}"
    return Findings(name, model, published, swept, found, loss, explained, slopes, chart, shared, quick, about, seconds)


def _map(
    model: CageModel,
    loss: LossZones,
    speeds: np.ndarray,
    orbit_method: AbstractMethod | None,
    sweep_method: AbstractMethod | None,
    quick: bool,
    say: Progress,
) -> Map:
    axis, across = parameter_axis(model, MAP_PARAMETER), speed_axis(float(speeds[0]), float(speeds[-1]))
    edges = {} if quick else {name: edge for name, edge in loss.edges.items() if name in FOLLOWED}
    curves, refused = follow_edges(model, edges, across, axis, orbit_method, say)
    exponents = largest_exponents(
        model,
        np.linspace(speeds[0], speeds[-1], 40 if quick else 80),
        axis,
        7 if quick else 12,
        starts=1,
        discard=100 if quick else 250,
        revolutions=60 if quick else 100,
        method=sweep_method,
        say=say,
    )
    return Map(axis, exponents, curves, refused)
