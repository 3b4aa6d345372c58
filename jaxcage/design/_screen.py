"""The global stage of identification: which constants give chaos where it was measured, and only there.

Every design is swept over speed in all cases at once, and its largest exponents are held against the measured zones. No
edge is needed for that, so that the search works far from the answer, where zones are missing or too many.
"""

import dataclasses
from collections.abc import Callable, Mapping, Sequence

import numpy as np
from jaxtyping import Float
from scipy.stats import qmc

from .._checks import require_x64
from ..integrate import AbstractMethod
from ..models import AbstractForcedSystem
from ..sweeps import sweep_designs
from ._measured import MeasuredEdge, inside_zones, of_case
from ._unknowns import Unknown, check_unknowns, values_at, with_values


CHAOTIC = 0.02
"""Exponent per revolution above which a motion is taken for chaotic."""
SOFT = 0.04
"""Half width over which calm turns into chaos, so that the score tells better from worse."""
TOGETHER = 64
"""Designs swept in one batch."""
NEAR = 0.04
"""Within this relative distance of an edge a speed counts half."""


@dataclasses.dataclass(frozen=True)
class Candidate:
    """A choice of constants and how far its zones are from those measured."""

    values: dict[str, float]
    """[SI]."""
    score: float
    """Mean over the cases of the share of speeds with the wrong kind of motion, plus half the worst case's."""
    by_case: dict[str, float]

    def __str__(self) -> str:
        numbers = ", ".join(f"{n} {v:.4g}" for n, v in self.values.items())
        return f"score {self.score:.4f}: {numbers}"


@dataclasses.dataclass(frozen=True)
class _Target:
    """What one case should do at the speeds of the grid."""

    chaotic: np.ndarray
    weight: np.ndarray

    @classmethod
    def of(cls, edges: Sequence[MeasuredEdge], rpm: np.ndarray) -> "_Target":
        """Every stretch between two edges weighs half by its width and half as one of them."""
        chaotic = inside_zones(edges, rpm)
        near = np.min(np.abs(rpm[:, None] / np.array([e.rpm for e in edges]) - 1), axis=1) < NEAR
        base = np.where(near, 0.5, 1.0)
        stretch = np.cumsum(np.append(0, np.diff(chaotic.astype(int)) != 0))
        total = np.bincount(stretch, base)
        share = 0.5 * base / base.sum() + 0.5 * base / total[stretch] / total.size
        return cls(chaotic, share)

    def wrong(self, exponent: Float[np.ndarray, " speeds"]) -> float:
        """Share of speeds with the wrong kind of motion; a lane that failed is wrong whatever it should do."""
        chaos = np.clip((exponent - CHAOTIC) / (2 * SOFT) + 0.5, 0, 1)
        return float(np.sum(self.weight * np.where(np.isfinite(exponent), np.abs(self.chaotic - chaos), 1.0)))


def screen(
    systems: Mapping[str, AbstractForcedSystem],
    unknowns: Sequence[Unknown],
    measured: Sequence[MeasuredEdge],
    speeds: Float[np.ndarray, " speeds"],
    *,
    designs: int = 256,
    generations: int = 0,
    begin: Mapping[str, float] | None = None,
    spread: float = 0.1,
    best: int = 8,
    seed: int = 0,
    starts: Sequence[tuple[float, ...]] | None = None,
    discard: int = 160,
    revolutions: int = 100,
    method: AbstractMethod | None = None,
    report: Callable[[int, Candidate], None] | None = None,
) -> list[Candidate]:
    """Search the bounds of the unknowns for the zones measured.

    **Arguments:**

    - `systems`, `unknowns`, `measured`: cases by name, what is unknown, and the edges of the zones.
    - `speeds`: grid [rad/s].
    - `designs`: quasi-random designs (Sobol), rounded up to a power of 2.
    - `generations`: of an evolution strategy (CMA-ES) that starts from the best of them, or from `begin` [SI].
    - `spread`: its first standard deviation, as a part of the distance between the bounds.
    - `best`: how many candidates to return.
    - `starts`: initial states, by default the first of the first system's own, for all cases.
    - `discard`, `revolutions`: revolutions left out and observed, at each speed.
    - `report`: called with the designs tried so far and the best candidate.

    **Returns:** the best candidates, best first.

    **Raises:** `ValueError` for unknowns that no case has, or cases without an edge.
    """
    require_x64()
    check_unknowns(systems, unknowns)
    rpm = np.asarray(speeds, dtype=float) * 30 / np.pi
    edges = {case: of_case(measured, case) for case in systems}
    if empty := [case for case, own in edges.items() if not own]:
        raise ValueError(f"Argument `measured` must hold an edge of every case, but none of {', '.join(empty)}.")
    targets = {case: _Target.of(own, rpm) for case, own in edges.items()}
    tried: list[Candidate] = []

    def scores(places: Float[np.ndarray, "designs unknowns"]) -> np.ndarray:
        new: list[Candidate] = []
        for part in np.array_split(places, -(-len(places) // TOGETHER)):
            models = [m for place in part for m in with_values(systems, unknowns, place).values()]
            first = starts or [tuple(float(c) for c in models[0].starts(float(speeds[len(speeds) // 2]))[0])]
            swept = sweep_designs(
                models,
                speeds,
                starts=first,
                discard=discard,
                revolutions=revolutions,
                exponents=1,
                blocks=1,
                keep=1,
                method=method,
            )
            for i, place in enumerate(part):
                own = swept[i * len(systems) : (i + 1) * len(systems)]
                wrong = [
                    float(np.mean([t.wrong(s.exponents[:, j, 0]) for j in range(s.exponents.shape[1])]))
                    for s, t in zip(own, targets.values(), strict=True)
                ]
                by_case = dict(zip(systems, wrong, strict=True))
                new.append(Candidate(values_at(unknowns, place), float(np.mean(wrong) + 0.5 * np.max(wrong)), by_case))
            tried.extend(new[-len(part) :])
            if report is not None:
                report(len(tried), min(tried, key=lambda c: c.score))
        return np.array([c.score for c in new])

    sample = qmc.Sobol(len(unknowns), rng=seed).random_base2(max(1, int(np.ceil(np.log2(designs)))))
    first = scores(sample)
    start = sample[np.argmin(first)]
    if begin is not None:
        start = np.clip([u.place(begin[u.name]) for u in unknowns], 0.0, 1.0)
    if generations:
        import cma  # takes a second to load

        options = {"bounds": [0.0, 1.0], "maxiter": generations, "seed": seed + 1, "verbose": -9}
        search = cma.CMAEvolutionStrategy(start, spread, options)
        while not search.stop():
            places = search.ask()
            search.tell(places, scores(np.array(places)).tolist())
    return sorted(tried, key=lambda c: c.score)[:best]
