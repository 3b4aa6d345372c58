"""Everything that a report shows of a design, computed by one path for every model."""

import dataclasses
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
import xarray as xr
from jaxtyping import Float

from .._errors import NoResult
from ..analysis import Stretch, Zones, failed, outcomes, stretches, zones
from ..bearing import LoadDistribution, PublishedCase, load_distribution
from ..lanes import label_map, sweep
from ..models import AbstractForcedSystem
from ..orbits import Curve, LossZones, Sensitivity, SynchronousOrbits, explain, loss_zones, synchronous_orbits
from ..solve import AbstractMethod
from .gradient_tables import edge_slopes
from .operating import Operating
from .parameter_axes import SPEED, Axis, follow_edges, parameter_axis


MAPPED = "guidance_gap"
FOLLOWED = ("zone 1 onset", "zone 1 exit", "zone 2 onset")
"""Edges that are followed across the map, which takes about a minute each."""
Progress = Callable[[str, int, int], None]


class AllFailed(NoResult):
    """Every simulation failed: there is nothing to report."""


def require_some(found: xr.Dataset, where: str = "") -> None:
    """**Raises:** `AllFailed` if every lane failed, with their number, `where`, and how they ended."""
    if failed(found).all():
        said = f"All {found['label'].size} simulations{where} failed ({', '.join(sorted(outcomes(found)))})"
        raise AllFailed(f"{said}: try more steps (--steps).")


@dataclasses.dataclass(frozen=True)
class Map:
    """Largest exponent over speed and a parameter, with the edges followed in both."""

    axis: Axis
    found: xr.Dataset
    curves: list[Curve]
    refused: dict[str, str]
    """Edges that could not be followed, and the reasons."""


@dataclasses.dataclass(frozen=True)
class Orbits:
    """Synchronous orbits of a model whose revolutions repeat."""

    found: SynchronousOrbits
    loss: LossZones
    slopes: dict[str, Sensitivity]
    """Sensitivity of every exact edge; empty in a quick report."""
    map: Map
    method: str


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


def examine(
    name: str,
    model: AbstractForcedSystem,
    published: PublishedCase | None = None,
    *,
    speeds: Float[np.ndarray, " speeds"],
    operating: tuple[Operating, ...] = (),
    quick: bool = False,
    orbit_method: AbstractMethod | None = None,
    progress: Progress | None = None,
    **settings: Any,
) -> Findings:
    """Compute all that a report shows.

    **Arguments:** name, model and published case; speeds of the model [rad/s]; operating speeds; `quick` leaves out
    gradients, mechanisms of chaotic edges and curves of the map; integration method of orbits; `progress` is called
    with the stage, how much of it is done, and of how much; settings of the sweep.

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
        swept = sweep(model, speeds, progress=lambda done, of: say("sweep", done, of), **settings)
    require_some(swept)
    at, known, orbits = operating, stretches(swept) if model.samples > 1 else zones(swept), None
    if isinstance(known, Zones):
        with timed("synchronous orbits"):
            ends = float(speeds[0]), float(speeds[-1])
            found = synchronous_orbits(model, *ends, settled=swept, method=orbit_method, progress=say)
            loss, slopes = loss_zones(found), {}
        if not quick:
            with timed("mechanisms of chaotic edges"):
                explained = explain(known, found, model, orbit_method)
                known = explained.zones
            with timed("gradients"):
                slopes = edge_slopes(model, loss, explained, orbit_method)  # pyright: ignore[reportArgumentType]
        with timed("map"):
            chart = _map(model, loss, ends, orbit_method, settings.get("method"), quick, say)
        words = "as many as each orbit needs" if orbit_method is None else " ".join(str(orbit_method).split())
        orbits = Orbits(found, loss, slopes, chart, words)
    load = float(getattr(model, "load", 0.0))
    shared = load_distribution(model.bearing, load) if load > 0 else None  # pyright: ignore
    return Findings(name, model, published, swept, at, known, orbits, shared, quick, seconds)


def _map(
    model: AbstractForcedSystem,
    loss: LossZones,
    ends: tuple[float, float],
    orbit_method: AbstractMethod | None,
    sweep_method: AbstractMethod | None,
    quick: bool,
    say: Progress,
) -> Map:
    axis = parameter_axis(model, MAPPED)
    edges = {} if quick else {name: edge for name, edge in loss.edges.items() if name in FOLLOWED}
    curves, refused = follow_edges(model, edges, Axis(SPEED, *ends, "rad/s"), axis, orbit_method, say)
    columns, rows, discard, revolutions = (40, 7, 100, 60) if quick else (80, 12, 250, 100)
    found = label_map(
        model,
        {SPEED: np.linspace(*ends, columns)},
        {MAPPED: np.linspace(axis.lower, axis.upper, rows)},
        discard=discard,
        revolutions=revolutions,
        blocks=1,
        keep=1,
        method=sweep_method,
        stage=say,
    )
    return Map(axis, found, curves, refused)
