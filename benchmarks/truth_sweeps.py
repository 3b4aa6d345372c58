"""The sweeps that several sections look at: every model by the default method, and by 8 times its steps."""

import functools

import jaxcage as jc
from jaxcage.integrate import ControlledSteps, controlled, finer

from .truth_models import Subject


TIMES = 3
"""Steps are halved so often: 8 times the steps at 16^-3 of the tolerance."""
GRID = 8
"""Speeds of each model."""
FEW = 3
"""Of them where it is to be quick."""


def fine() -> ControlledSteps:
    """What the default method is compared with."""
    return finer(controlled(), TIMES)


@functools.cache
def pair(subject: Subject, quick: bool) -> tuple[jc.Sweep, jc.Sweep]:
    """A model over its grid of speeds as by default, its labels confirmed, and by the finer steps."""
    grid = subject.grid(FEW if quick else GRID)
    return jc.sweep(subject.model, grid, horizon=0), jc.sweep(
        subject.model, grid, horizon=0, confirm=False, method=fine()
    )
