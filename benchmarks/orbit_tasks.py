"""Branches of orbits that every program follows: the system for us, its equations in C for the others."""

import dataclasses
import functools
import math
import pathlib
import shutil
from collections.abc import Callable, Sequence

import jax.numpy as jnp
import numpy as np

import jaxcage as jc


POWERS = (-1.0, -2.0, 1.0, 0.0, 0.0, 0.0, -2.0, -2.0, -2.0, -1.0, -2.0, 0.0, float("nan"), -2.0)
"""With which power of the speed each constant of the cage grows; that of the impact is a parameter."""


@dataclasses.dataclass(frozen=True)
class Task:
    """A branch over speed, from an orbit known to the first of two speeds up or down."""

    name: str
    law: str
    """File with the equations in C, lengths over `scale`, phase for time."""
    unit: str
    begin: float
    end: float
    """Speeds [unit] at which the branch begins and ends."""
    per_unit: float
    """One unit [rad/s]."""
    make: Callable[[], jc.CageModel | jc.ForcedOscillator]
    numbers: Callable[["Task"], str]
    """Contents of the header that the equations include."""
    guess: tuple[float, ...] | None = None
    known: tuple[float, ...] = ()
    """Special points that the tests' table of literature has from another solver [unit]."""

    @property
    def dimension(self) -> int:
        return self.make().dimension

    @property
    def speed(self) -> float:
        """Speed at which the branch begins [rad/s]."""
        return self.begin * self.per_unit

    def scale(self) -> np.ndarray:
        """SI units of a state in the units of the equations in C, at the first speed."""
        model = self.make()
        length = float(model.clearance) if isinstance(model, jc.CageModel) else 1.0
        half = self.dimension // 2
        return np.array([length] * half + [length * self.speed] * half)


def _duffing(damping: float, linear: float, force: float) -> jc.ForcedOscillator:
    def law(tau, q, v, speed):
        del speed
        (x,), (u,) = q, v
        return (force * jnp.cos(tau) - damping * u - linear * x - x**3,)

    return jc.ForcedOscillator(law, coordinates=1)


def duffing(
    begin: float, end: float, numbers: Sequence[float], guess: tuple[float, ...], known: tuple[float, ...]
) -> Task:
    """x'' + damping x' + linear x + x^3 = force cos(w t) over w."""
    damping, linear, force = numbers
    header = (
        f"#define DAMPING {damping!r}\n#define LINEAR {linear!r}\n#define FORCE {force!r}\n#define UNIT {begin!r}\n"
    )
    name = f"Duffing {damping:g}, {linear:g}, {force:.9g}"
    make = functools.partial(_duffing, *numbers)
    return Task(name, "duffing_law.c", "rad/s", begin, end, 1.0, make, lambda task: header, guess, known)


def cage_numbers(task: Task) -> str:
    """The cage's constants at the first speed, and how they grow."""
    from .problem import constants

    model = task.make()
    assert isinstance(model, jc.CageModel) and isinstance(model.impact, jc.forces.SynchronousImpact)
    (known,) = constants(model, np.array([task.speed]))
    powers = [float(model.impact.exponent) - 2 if math.isnan(p) else p for p in POWERS]
    row = lambda name, values: f"static const double {name}[] = {{{', '.join(repr(float(v)) for v in values)}}};\n"
    return row("REFERENCE", known) + row("POWERS", powers)


TASKS = {
    "duffing-folds": duffing(1.0, 2.0, (0.1, 1.0, 0.3), (0.9, 0.0), (1.77971952, 1.3242362)),
    "duffing-doubling": duffing(1.5, 1.0, (0.3, -1.0, 0.265581786), (1.0, 0.0), (1.2,)),
    "cage": Task(
        "cage 1a", "cage_law.c", "rpm", 15000.0, 19000.0, math.pi / 30, functools.partial(jc.case, "1a"), cage_numbers
    ),
}
"""By name; the Duffing points are those of the tests' table."""


def prepare(task: Task, folder: pathlib.Path) -> None:
    """The equations in C with their numbers, in `folder`."""
    here = pathlib.Path(__file__).parent
    for name in ("auto_equations.c", task.law):
        shutil.copy(here / name, folder)
    folder.joinpath("numbers.h").write_text(task.numbers(task))
