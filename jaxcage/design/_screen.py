"""The global stage of identification: which constants give chaos where it was measured, and only there.

Every design is swept over speed in all cases at once, and its largest exponents are held against the measured zones. No
edge is needed for that, so that the search works far from the answer, where zones are missing or too many. Chaos counts
by how much of the way to a horizon it lasts: a transient half as long is half as wrong.
"""

import dataclasses
from collections.abc import Callable, Mapping, Sequence

import numpy as np
from jaxtyping import Float

from .._arguments import require_at_least
from .._checks import require_x64
from .._errors import ArgumentError
from .._notebook import notebook_html
from .._sobol import sobol
from ..analysis import CHAOS_THRESHOLD, Sweep, Zone, zones
from ..integrate import AbstractMethod
from ..models import AbstractForcedSystem
from ..sweeps import sweep_designs
from ._measured import MeasuredEdge, inside_zones, matched, of_case
from ._unknowns import Unknown, check_unknowns, values_at, with_values


SOFT = 0.04
"""Half width over which calm turns into chaos, so that the score tells better from worse."""
MISSING = 0.3
"""What a missing edge costs, as a relative error; one that is farther off costs no more."""
TOGETHER = 64
"""Designs swept in one batch."""
BLOCKS, KEEP = 5, 16
"""Blocks of revolutions, which tell a chaotic lane from one of which nothing is known; strobe states, which tell where
chaos has closed on an orbit of up to 8 revolutions."""
NEEDLESS = 0.01
"""What a needless change between calm and chaos costs, as a relative error of the edges."""


@dataclasses.dataclass(frozen=True)
class Candidate:
    """A choice of constants and how far its zones are from those measured."""

    values: dict[str, float]
    """[SI]."""
    score: float
    """Mean over the cases of how far their edges are off, about relative to the speed, plus half the worst case's."""
    by_case: dict[str, float]

    def __str__(self) -> str:
        numbers = ", ".join(f"{n} {v:.4g}" for n, v in self.values.items())
        return f"score {self.score:.4f}: {numbers}"

    _repr_html_ = notebook_html


@dataclasses.dataclass(frozen=True)
class _Target:
    """What one case should do at the speeds of the grid."""

    measured: Sequence[MeasuredEdge]
    chaotic: np.ndarray
    width: np.ndarray
    """Relative width of the speeds' cells, d log(speed)."""

    def wrong(self, found: Sweep, by: str) -> float:
        """How far a sweep is from what was measured."""
        if by == "edges":
            return self.wrong_edges(zones(found).zones, float(found.rpm[-1]))
        lasted = 1.0 if found.escape is None else np.minimum(found.escape, found.horizon) / found.horizon
        return self.wrong_motion(found.exponents[..., 0], lasted)

    def wrong_edges(self, found: Sequence[Zone], last_rpm: float) -> float:
        """Mean relative error of the edges, a missing one counted as `MISSING`, and `NEEDLESS` for each end of each
        zone too many.
        """
        edges = matched(self.measured, found, last_rpm)
        pairs = zip(edges, self.measured, strict=True)
        near = [MISSING if e is None else abs(e.speed_rpm / m.rpm - 1) for e, m in pairs]
        extra = max(len(found) - len({m.zone for m in self.measured}), 0)
        return float(np.mean(np.minimum(near, MISSING)) + 2 * NEEDLESS * extra)

    def wrong_motion(
        self, exponent: Float[np.ndarray, "speeds starts"], lasted: Float[np.ndarray, "speeds starts"] | float = 1.0
    ) -> float:
        """Mean relative error of the edges, were each wrong speed due to one that has moved; each needless change
        between calm and chaos costs `NEEDLESS` besides. A lane that failed is wrong whatever it should do.

        **Arguments:** largest exponents; the part of the way to the horizon after which lanes are calm for good.
        """
        chaos = (lasted * np.clip((exponent - CHAOS_THRESHOLD) / (2 * SOFT) + 0.5, 0, 1)).max(axis=1)
        chaos = np.where(np.isfinite(chaos), chaos, 1.0 - self.chaotic)
        changes = np.sum(np.abs(np.diff(chaos))) - np.sum(np.abs(np.diff(self.chaotic.astype(float))))
        return float(self.width @ np.abs(self.chaotic - chaos) / len(self.measured) + NEEDLESS * max(changes, 0.0))


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
    by: str = "motion",
    seed: int = 0,
    starts: Sequence[tuple[float, ...]] | None = None,
    discard: int = 160,
    revolutions: int = 100,
    horizon: int = 3000,
    method: AbstractMethod | None = None,
    report: Callable[[int, Candidate], None] | None = None,
) -> list[Candidate]:
    """Search the bounds of the unknowns for the zones measured.

    **Arguments:**

    - `systems`, `unknowns`, `measured`: cases by name, what is unknown, and the edges of the zones.
    - `speeds`: grid [rad/s]; one in equal ratios weighs all edges alike.
    - `designs`: quasi-random designs (Sobol), rounded up to a power of 2.
    - `begin`: a design [SI] that is looked at beside them.
    - `generations`: of an evolution strategy (CMA-ES) that starts from the best of them all.
    - `spread`: its first standard deviation, as a part of the distance between the bounds.
    - `best`: how many candidates to return.
    - `by`: what is held against the measured edges: `motion`, chaotic or not at each speed, smoothly, which works far
      from the answer; or the `edges` of the zones found, which is what counts near it.
    - `starts`: initial states, by default the first of each design's own; a speed is chaotic if any of them is.
    - `discard`, `revolutions`: revolutions left out and observed, at each speed.
    - `horizon`: revolutions that chaos must last to count in full; where it is not beyond those observed, all chaos
        counts that is seen.
    - `report`: called with each candidate, and how many have been tried with it.

    **Returns:** the best candidates, best first.

    **Raises:** `ValueError` for unknowns that no case has, cases without an edge, or another `by`.
    """
    require_x64()
    require_at_least(0, seed=seed)
    if by not in ("motion", "edges"):
        raise ArgumentError("by", said=f"must be motion or edges, but '{by}' was given.")
    check_unknowns(systems, unknowns)
    rpm = np.asarray(speeds, dtype=float) * 30 / np.pi
    edges = {case: of_case(measured, case) for case in systems}
    if empty := [case for case, own in edges.items() if not own]:
        raise ArgumentError("measured", said=f"must hold an edge of every case, but none of {', '.join(empty)}.")
    width = np.gradient(np.log(rpm))
    targets = {case: _Target(own, inside_zones(own, rpm), width) for case, own in edges.items()}
    tried: list[Candidate] = []

    def scores(places: Float[np.ndarray, "designs unknowns"]) -> np.ndarray:
        new: list[Candidate] = []
        for part in np.array_split(places, -(-len(places) // TOGETHER)):
            models = [with_values(system, unknowns, place) for place in part for system in systems.values()]
            swept = sweep_designs(
                models,
                speeds,
                starts=1 if starts is None else starts,
                discard=discard,
                revolutions=revolutions,
                confirm=by == "edges",
                horizon=horizon,
                exponents=1,
                blocks=BLOCKS,
                keep=KEEP,
                method=method,
            )
            for i, place in enumerate(part):
                own = swept[i * len(systems) : (i + 1) * len(systems)]
                wrong = [t.wrong(s, by) for s, t in zip(own, targets.values(), strict=True)]
                by_case = dict(zip(systems, wrong, strict=True))
                new.append(Candidate(values_at(unknowns, place), float(np.mean(wrong) + 0.5 * np.max(wrong)), by_case))
                tried.append(new[-1])
                if report is not None:
                    report(len(tried), new[-1])
        return np.array([c.score for c in new])

    sample = sobol(len(unknowns), 2 ** max(1, int(np.ceil(np.log2(designs)))), seed)
    if begin is not None:
        sample = np.vstack([np.clip([u.place(begin[u.name]) for u in unknowns], 0.0, 1.0), sample])
    first = scores(sample)
    start = sample[np.argmin(first)]
    if generations:
        import cma  # takes a second to load

        options = {"bounds": [0.0, 1.0], "maxiter": generations, "seed": seed + 1, "verbose": -9}
        search = cma.CMAEvolutionStrategy(start, spread, options)
        while not search.stop():
            places = search.ask()
            search.tell(places, scores(np.array(places)).tolist())
    return sorted(tried, key=lambda c: c.score)[:best]
