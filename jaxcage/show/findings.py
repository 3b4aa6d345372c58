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
from .._parameters import parameters
from ..analysis import Stretch, Zones, failed, outcomes, stretches, zones
from ..bearing import LoadDistribution, PublishedCase, load_distribution
from ..design import DIRECTIONS, MeanGradient, Runs, mean_gradient
from ..lanes import label_map, sweep
from ..models import AbstractForcedSystem
from ..orbits import Curve, LossZones, Sensitivity, SynchronousOrbits, explain, loss_zones, synchronous_orbits
from ..solve import AbstractMethod, Trajectory, simulate
from .maps import SPEED, Axis, follow_edges, parameter_axis
from .operating import Operating, Verdict, chaotic_verdict, loss_verdict, motion_verdict
from .slope_tables import edge_slopes
from .tables import Beside


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

    @property
    def beside(self) -> Beside:
        """The shaft speed, if the model's is that of the cage, and its ratio to it."""
        found = self.sweep
        return ("shaft", float(found["shaft_rpm"][-1] / found["rpm"][-1])) if "shaft_rpm" in found.coords else None

    def words(self, at: Operating) -> str:
        """An operating speed, with that of the shaft."""
        return str(at) if self.beside is None else f"{at} (shaft {at.of_shaft(1 / self.beside[1])})"

    @property
    def assessed(self) -> list[tuple[Operating, dict[str, Verdict]]]:
        """Each operating speed with the verdicts on it by kind of zone."""
        return [(at, self._verdicts(at)) for at in self.operating]

    def _verdicts(self, at: Operating) -> dict[str, Verdict]:
        orbits, found = self.orbits, self.zones
        if orbits is None or not isinstance(found, Zones):
            assert not isinstance(found, Zones)
            return {"motion": motion_verdict(at, found, self.sweep)}
        searched = orbits.found.lower_rpm, orbits.found.upper_rpm
        loss = loss_verdict(at, orbits.loss.zones, *searched, bool(orbits.found.stretches))
        return {"synchronous-loss": loss, "chaotic": chaotic_verdict(at, found, self.sweep)}


def examine(
    name: str,
    model: AbstractForcedSystem,
    published: PublishedCase | None,
    *,
    speeds: Float[np.ndarray, " speeds"],
    operating: tuple[Operating, ...],
    quick: bool,
    progress: Callable[[str, int, int], None],
    method: AbstractMethod | None = None,
    **settings: Any,
) -> Findings:
    """Compute all that a report shows.

    **Arguments:** name, model and published case; speeds of the model [rad/s]; operating speeds; `quick` leaves out
    gradients, mechanisms of chaotic edges and curves of the map; `progress` is called with the stage, how much of it is
    done, and of how much; integration method; settings of the sweep.

    **Raises:** `NoResult` if no simulation finished.
    """
    seconds: dict[str, float] = {}

    @contextmanager
    def timed(stage: str) -> Iterator[None]:
        began = time.perf_counter()
        progress(stage, 0, 1)
        yield
        seconds[stage] = time.perf_counter() - began

    with timed("sweep"):
        report = lambda done, of: progress("sweep", done, of)
        swept = sweep(model, speeds, method=method, progress=report, **settings)
    require_some(swept)
    known, orbits, one = stretches(swept) if model.samples > 1 else zones(swept), None, None
    if isinstance(known, Zones):
        ends, slopes, curves, refused = (float(speeds[0]), float(speeds[-1])), {}, [], {}
        with timed("synchronous orbits"):
            found = synchronous_orbits(model, *ends, settled=swept, method=method, progress=progress)
            loss, axis = loss_zones(found), parameter_axis(model, "guidance_gap")
        if not quick:
            with timed("mechanisms of chaotic edges"):
                explained = explain(known, found, model, method)
                known = explained.zones
            with timed("gradients"):
                slopes = edge_slopes(model, loss, explained, method)
            with timed("curves"):
                edges = {name: edge for name, edge in loss.edges.items() if name in FOLLOWED}
                curves, refused = follow_edges(model, edges, ends, axis, method, progress)
        with timed("map"):
            columns, rows, discard, revolutions = (40, 7, 100, 60) if quick else (80, 12, 250, 100)
            across = {SPEED: np.linspace(*ends, columns)}, {axis.name: np.linspace(axis.lower, axis.upper, rows)}
            length: Any = {"discard": discard, "revolutions": revolutions, "blocks": 1, "keep": 1}
            mapped = label_map(model, *across, **length, method=method, stage=progress)
        words = "as many as each orbit needs" if method is None else " ".join(str(method).split())
        orbits = Orbits(found, loss, slopes, axis, mapped, curves, refused, words)
    elif operating:
        at = (operating[0].low_rpm + operating[0].high_rpm) * np.pi / 60
        with timed("one speed"):
            run, means = simulate(model, at, samples=128, method=method, **LENGTH), None
        if not quick:
            with timed("slopes of means"):
                runs, value = Runs(at, starts=2, **LENGTH, blocks=2, exponents=0, tolerance=1e-4), parameters(model)
                moved = [names for names in DIRECTIONS if all(float(value[name]) for name in names.split("+"))]
                means = mean_gradient(model, runs, directions=moved)
        one = OneSpeed(operating[0], run, means)
    load = float(getattr(model, "load", 0.0))
    shared = load_distribution(model.bearing, load) if load > 0 else None  # pyright: ignore
    return Findings(name, model, published, swept, operating, known, orbits, shared, quick, seconds, one)
