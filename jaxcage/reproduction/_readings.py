"""What each ambiguous reading of the paper does to the zones."""

import dataclasses
from collections.abc import Callable, Mapping, Sequence

import numpy as np

from .._parameters import get, parameter_paths, replace, with_values
from ..analysis import Sweep, zones
from ..bearing import PUBLISHED_CASES
from ..forces import ElasticRib, PocketImpact, RollerPassImpact
from ..integrate import AbstractMethod, method
from ..models import CageModel
from ..sweeps import rpm, sweep
from ._edges import AT_FIRST, LASTING, ZONE_RANGE_RPM, ComparedEdge, compare_edges, zones_in_range


@dataclasses.dataclass(frozen=True)
class Reading:
    """One way to read what the paper leaves open."""

    question: str
    answer: str
    model: Callable[[CageModel], CageModel] = lambda model: model
    method: Callable[[], AbstractMethod | None] = lambda: None
    confirm: bool = True
    """Whether labels are those of finer steps; not where it is asked what these steps show."""
    first_start_only: bool = False
    persist: int = 0
    """Revolutions that chaos must outlast to count."""
    case: str = "1a"
    cage_per_printed: Callable[[CageModel], float] = lambda model: 1.0
    """Cage speed over the speed on the printed axis."""


@dataclasses.dataclass(frozen=True)
class ReadingResult:
    """What a reading does."""

    reading: Reading
    sweep: Sweep
    chaotic_share: float
    """Share of the speeds from 4000 rpm up at which any start is chaotic."""
    zones: int
    """Chaotic zones between 4000 and 27500 rpm."""
    edges: tuple[ComparedEdge, ...]
    failed: int


def _elastic(model: CageModel) -> CageModel:
    stiffness = 100 * float(model.support.stiffness_x)
    return replace(model, rib=ElasticRib(mass=2.0, stiffness=stiffness, damping=20.0, cubic_stiffness=0.0))


def _roller_pass(model: CageModel) -> CageModel:
    return replace(model, impact=RollerPassImpact(oscillator=PocketImpact(), harmonics=4))


def _scaled(name: str, factor: float) -> Callable[[CageModel], CageModel]:
    """A parameter scaled; next to nothing of it too, which is beyond the range that users may give."""

    return lambda model: with_values(model, {name: factor * get(model, parameter_paths(model)[name])})


def _chosen(**values: str) -> Callable[[CageModel], CageModel]:
    return lambda model: replace(model, **{name.replace("__", "."): v for name, v in values.items()})


def _relative_cubic(model: CageModel) -> CageModel:
    """K_3 = alpha K_s/c^2 with the alpha that leaves the narrow gap of the paper's other cases as it is."""
    narrow = PUBLISHED_CASES["1a"].guidance_gap_mm * 1e-3
    alpha = model.support.cubic_stiffness * narrow**2 / model.support.stiffness_x
    return replace(model, **{"support.cubic": "dimensionless", "cubic_ratio": float(alpha)})


def _plain() -> AbstractMethod:
    """For laws that have no kernel or a large one: no levels to compile."""
    return method("rk4", steps=512)


READINGS: tuple[Reading, ...] = (
    Reading("as the cases have it", "-"),
    Reading("clearance", "radial, c = C_r/2", _chosen(clearance_reading="radial")),
    Reading("eccentricity", "a tenth of a micrometre", _scaled("eccentricity", 0.1)),
    Reading("unbalance", "physical", _chosen(unbalance="physical")),
    Reading("unbalance", "as printed in (20)", _chosen(unbalance="as_printed")),
    Reading("unbalance", "none", _scaled("eccentricity", 0.0)),
    Reading("film", "positive pressure", _chosen(film__model="positive_pressure"), _plain),
    Reading("film", "full circle", _chosen(film__model="full")),
    Reading("film", "none", _scaled("lubricant.density", 1e-9)),
    Reading("cross-coupling", "as printed in (20)", _chosen(support__cross="as_printed")),
    Reading("cross-coupling", "none", _scaled("cross_stiffness", 0.0)),
    Reading("impact", "roller by roller", _roller_pass, _plain),
    Reading("impact", "none", _scaled("amplitude", 0.0)),
    Reading("rib", "elastic", _elastic, _plain),
    Reading("integration", "Newmark, 64 steps", method=lambda: method("newmark", steps=64), confirm=False),
    Reading("integration", "Newmark, 256 steps", method=lambda: method("newmark", steps=256), confirm=False),
    Reading("start", "the paper's alone", first_start_only=True),
    Reading("chaos", "outlasts 3000 revolutions", persist=3000),
    Reading("speed axis", "shaft speed", cage_per_printed=lambda model: float(model.bearing.cage_speed_ratio)),
    Reading("as the cases have it", "-", case="1b"),
    Reading("chaos", "outlasts 3000 revolutions", case="1b", persist=3000),
    Reading("cubic stiffness", "falls with the gap", _relative_cubic, case="1b"),
)
"""The cubic term as alpha K_s/c^2 acts on the case with the other gap only."""


def try_readings(
    models: Mapping[str, CageModel],
    *,
    readings: Sequence[Reading] = READINGS,
    speeds: int = 95,
    discard: int = 300,
    revolutions: int = 300,
    report: Callable[[str, int, int], None] | None = None,
) -> list[ReadingResult]:
    """Sweep the case of each reading, of `models` by name, and compare on the printed axis."""
    results = []
    for i, reading in enumerate(readings):
        if report is not None:
            report(f"{reading.question}: {reading.answer}", i, len(readings))
        read = reading.model(models[reading.case])
        ratio = reading.cage_per_printed(read)
        grid = ratio * rpm(*ZONE_RANGE_RPM, speeds)
        found = sweep(
            read,
            grid,
            starts=1 if reading.first_start_only else None,
            discard=discard,
            revolutions=revolutions,
            confirm=reading.confirm,
            horizon=reading.persist,
            method=reading.method(),
        )
        found = dataclasses.replace(found, speed=found.speed / ratio)
        chaotic = zones(found)
        results.append(
            ReadingResult(
                reading,
                found,
                float(np.mean(np.any(found.label == "chaotic", axis=1))),
                len(zones_in_range(chaotic.zones)),
                tuple(
                    compare_edges(
                        PUBLISHED_CASES[reading.case], chaotic.zones, LASTING if reading.persist else AT_FIRST
                    )
                ),
                int(np.sum(found.failed)),
            )
        )
    return results
