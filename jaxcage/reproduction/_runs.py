"""The runs behind the reproduction: every case over speed, and the strobe sections of fig. 9."""

import dataclasses
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from ..analysis import Sweep, Zone, Zones, zones
from ..bearing import FIGURE_AXES, PUBLISHED_CASES, PUBLISHED_SPEED_RANGE_RPM
from ..models import CageModel
from ..orbits import LossZones, loss_zones, synchronous_orbits
from ..sweeps import rpm, sweep_designs
from ._edges import AT_FIRST, LASTING, LOSS, ComparedEdge, compare_edges
from ._observer import OBSERVERS, Observer, observed_zones


SECTION_RPM = 8500.0
SECTION_REVOLUTIONS = (4, 4000)
"""Fig. 9: strobe points from the first to the second of these revolutions."""


@dataclasses.dataclass(frozen=True)
class Runs:
    """What was computed, by case."""

    models: Mapping[str, CageModel]
    sweeps: Mapping[str, Sweep]
    zones: Mapping[str, Zones]
    loss: Mapping[str, LossZones]
    """Empty where the orbits were left out."""
    sections: Mapping[str, Sweep]
    """At the speed of fig. 9, from the paper's start, with its transient."""
    diagrams: Mapping[str, Mapping[str, tuple[Zone, ...]]] = dataclasses.field(default_factory=dict)
    """Zones that each observer reads off a diagram, by the observer's name and the case."""

    def zones_by_kind(self, name: str) -> dict[str, Sequence[Zone]]:
        """The zones of a case of every kind."""
        at_first = zones(dataclasses.replace(self.sweeps[name], escape=None)).zones
        kinds: dict[str, Sequence[Zone]] = {LASTING: self.zones[name].zones, AT_FIRST: at_first}
        kinds |= {observer: found[name] for observer, found in self.diagrams.items()}
        return kinds | ({LOSS: self.loss[name].zones} if name in self.loss else {})


def run_all(
    models: Mapping[str, CageModel],
    *,
    speeds: int = 251,
    discard: int = 300,
    revolutions: int = 300,
    section_revolutions: int = SECTION_REVOLUTIONS[1],
    orbits: bool = True,
    observers: Sequence[Observer] = OBSERVERS,
    report: Callable[[str, int, int], None] | None = None,
) -> Runs:
    """Sweep every case over the published range from three starts, find its synchronous orbits, read its diagrams as
    the paper may have done, and run fig. 9."""
    say = report or (lambda what, done, total: None)
    grid = rpm(*PUBLISHED_SPEED_RANGE_RPM, speeds)
    by_name = lambda found: dict(zip(models, found, strict=True))
    swept = by_name(
        sweep_designs(
            list(models.values()),
            grid,
            discard=discard,
            revolutions=revolutions,
            progress=lambda done, total: say("sweeps", done, total),
        )
    )
    loss: dict[str, LossZones] = {}
    for i, (name, model) in enumerate(models.items() if orbits else ()):
        say(f"orbits of {name}", i, len(models))
        found = synchronous_orbits(model, float(grid[0]), float(grid[-1]), settled=swept[name])
        loss[name] = loss_zones(found)
    say("diagrams", 0, 1)
    seen = observed_zones(list(models.values()), grid, observers)
    diagrams = {observer: by_name(found) for observer, found in seen.items()}
    say("strobe sections", 0, 1)
    observed = section_revolutions - SECTION_REVOLUTIONS[0]
    blocks = max(n for n in range(1, 21) if observed % n == 0)
    sections = sweep_designs(
        list(models.values()),
        np.array([rpm(SECTION_RPM)]),
        starts=1,
        discard=SECTION_REVOLUTIONS[0],
        revolutions=observed,
        blocks=blocks,
        keep=observed,
    )
    return Runs(models, swept, {name: zones(s) for name, s in swept.items()}, loss, by_name(sections), diagrams)


def edges_of(runs: Runs, name: str) -> list[ComparedEdge]:
    """The published edges of a case beside those of each kind."""
    published = PUBLISHED_CASES[name]
    return [row for kind, found in runs.zones_by_kind(name).items() for row in compare_edges(published, found, kind)]


def ranges_of(runs: Runs) -> list[dict[str, Any]]:
    """Ranges of the strobe points beside the limits of the printed axes, which are not ranges of the motion."""
    found = []
    for name, figure, low, high in (("fig. 7", "7", 2500.0, 27500.0), ("fig. 8a", "8a", 7000.0, 22000.0)):
        ys = [
            s.strobe[(s.rpm >= low) & (s.rpm <= high)][..., 1]
            for c, s in runs.sweeps.items()
            if figure == "7" or c[0] == "1"
        ]
        found.append(_range(name, "vertical displacement", "mm", figure, np.concatenate([1e3 * y.ravel() for y in ys])))
    sections = np.concatenate([s.strobe[0, 0] for s in runs.sections.values()])
    half = sections.shape[-1] // 2
    found.append(_range("fig. 9", "vertical displacement", "mm", "9", 1e3 * sections[:, 1]))
    found.append(_range("fig. 9", "vertical velocity", "mm/s", "9", 1e3 * sections[:, 1 + half]))
    return found


def _range(name: str, quantity: str, unit: str, figure: str, values: np.ndarray) -> dict[str, Any]:
    axis = next(a for a in FIGURE_AXES if a.figure == figure and a.quantity == quantity)
    low, high = float(np.nanmin(values)), float(np.nanmax(values))
    inside = axis.lower <= low and high <= axis.upper
    printed = {"axis_lower": axis.lower, "axis_upper": axis.upper, "inside": inside}
    return {"figure": name, "quantity": quantity, "unit": unit, "lower": low, "upper": high, **printed}
