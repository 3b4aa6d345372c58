"""What a search saw as its best, chosen anew by a finer objective."""

import dataclasses

import numpy as np

from ._objective import AbstractObjective
from ._optimise import Optimised, Step, ended_at
from ._unknowns import Design


UNCONFIRMED = "not confirmed"
"""How a search ended whose best is no better than the design as it is."""


def judged(found: Optimised[Design], objective: AbstractObjective, among: int = 4) -> tuple[Optimised[Design], float]:
    """The same searches, with the best of each chosen anew by a finer objective.

    What a search saw as its best is better than it is, since of many values with noise the least is chosen. The finer
    objective looks at the best few of each search and at the design that the searches began with: where that one is the
    best, it stays.

    **Arguments:** what was found; an objective with more speeds, starts or revolutions; how many designs of each.

    **Returns:** the searches, the best first by the finer objective; and what that says of the design itself.
    """
    space = found.space
    own = np.clip(space.place, 0.0, 1.0)
    picked = [
        sorted((s for s in o.history if s.status == "ok"), key=lambda s: s.value)[:among] or [o.history[-1]]
        for o in found.optima
    ]
    values = objective.values(space, np.array([own, *(s.place for steps in picked for s in steps)]))
    nothing = (np.nan,) * own.size
    itself = Step(tuple(own.tolist()), float(values[0]), np.nan, nothing, nothing)
    optima, others = [], iter(values[1:].tolist())
    for o, steps in zip(found.optima, picked, strict=True):
        finer = [dataclasses.replace(s, value=x, error=np.nan) for s, x in zip(steps, others, strict=False)]
        best = min([itself, *finer], key=lambda s: np.nan_to_num(s.value, nan=np.inf))
        optima.append(ended_at(space, best, o.history, "nothing better found" if best is itself else o.status))
    return Optimised.of(space, optima), float(values[0])


def unchanged(found: Optimised[Design], value: float) -> Optimised[Design]:
    """The same searches with the design as it is, and what it is worth, in front: what they found is no better."""
    place = tuple(np.clip(found.space.place, 0.0, 1.0).tolist())
    nothing = (np.nan,) * len(place)
    own = ended_at(found.space, Step(place, value, np.nan, nothing, nothing), found.best.history, UNCONFIRMED)
    return Optimised((own, *found.optima), found.space)
