"""Inputs of the integration loop: methods, the programs of a model, and the rows of its working memory."""

import itertools
import math
from typing import Any, NamedTuple

import diffrax as dfx

from .ir import Code, Value, number


REVOLUTION = 2 * math.pi
PAIRS: dict[str, tuple[type[dfx.AbstractERK] | None, int]] = {
    "tsit5": (dfx.Tsit5, 5),
    "dopri5": (dfx.Dopri5, 5),
    "bosh3": (dfx.Bosh3, 3),
    "dopri8": (dfx.Dopri8, 8),
    "rodas4": (None, 4),
}
"""Embedded explicit pairs by name, with their order; and an implicit method."""


Layout = dict[str, range]
"""Rows of a lane's numbers in the working memory of a vector, by name."""


class Tableau(NamedTuple):
    """Coefficients of an embedded pair whose last stage is the first of the next step."""

    phase: list[float]
    stages: list[list[float]]
    error: list[float]
    order: int

    @property
    def implicit(self) -> bool:
        """True if a step is one program of its own (`Field.step`)."""
        return not self.error

    @classmethod
    def named(cls, name: str) -> "Tableau":
        solver, order = PAIRS[name]
        if solver is None:
            return cls([0.0, 1.0], [], [], order)
        t: Any = solver.tableau
        floats = lambda row: [float(x) for x in row]
        phase, stages, error = [0.0, *floats(t.c)], [[], *map(floats, t.a_lower)], floats(t.b_error)
        if not t.fsal:
            phase, stages, error = [*phase, 1.0], [*stages, floats(t.b_sol)], [*error, 0.0]
        return cls(phase, stages, error, order)


class Field(NamedTuple):
    """The programs of a system, traced, and what the loop is to do with their numbers."""

    prelude: Any
    """fixed numbers -> what the rates need of them."""
    rates: Any
    """phase, state and tangents, fixed numbers, results of the prelude -> rates; or what writes the code of rates
    itself (`Rollers`)."""
    excursion: Any | None
    """phase, state, fixed numbers -> excursion; None where the code of rates stores what is watched behind the rates,
    the excursion first."""
    abrupt: Any | None
    """phase, state, rates, fixed numbers -> distance from an abrupt change of the law and speed towards it; None where
    the law has none."""
    dimension: int
    tangents: int
    wide: tuple[bool, ...]
    """Which of the fixed numbers differ from lane to lane."""
    step: Any | None = None
    """phase, length of the step, state and tangents, fixed numbers -> the same at its end, and their estimated errors;
    for an implicit method."""
    beside: int = 0
    """Numbers that are integrated beside the state, behind the tangents: their errors do not control the steps."""
    watched: int = 1
    """Numbers whose largest values are kept; where there are more than the excursion, from one strobe to the next."""
    phased: bool = False
    """True if a lane's phase at a strobe follows from their number, and from the second fixed number."""
    own_turn: bool = False
    """True if the first fixed number is the phase from strobe to strobe, instead of a revolution."""
    relative: bool = True
    """True if errors are measured relative to the state and to one, false for units of the scale alone."""
    careful: bool = True
    """True if the errors of tangent vectors control the steps too."""

    @property
    def moving(self) -> int:
        """Numbers that are integrated."""
        return self.dimension * (1 + self.tangents) + self.beside

    @property
    def span(self) -> int:
        """Numbers that the code of rates stores."""
        return self.moving + (0 if self.excursion is not None else self.watched)

    @property
    def recorded(self) -> int:
        """Numbers of a strobe state: the state and, where there are any, what is integrated beside it and the largest
        of what is watched."""
        return self.dimension + (self.beside + self.watched if self.excursion is None else 0)


def layout_of(field: Field, stages: int) -> Layout:
    """Rows of the working memory: those that are stored when a lane leaves come first, then others that are loaded with
    the next one, from `fixed` to `first_step`."""
    sizes = {
        "state": field.moving,
        "step": 1,
        "peak": field.watched,
        "steps": 1,
        "mark": 1,
        "fixed": sum(field.wide),
        **dict.fromkeys(("phase", "error", "revolution", "first_step", "lane"), 1),
        "rate": field.span * stages,
        "stage": field.moving,
        "again": field.span,
        "made": len(field.prelude.jaxpr.outvars) if field.prelude else 0,
    }
    ends = itertools.accumulate(sizes.values())
    return {name: range(end - size, end) for (name, size), end in zip(sizes.items(), ends, strict=True)}


def fixed_numbers(w: Code, field: Field, rows: Layout, program: Any, first: int) -> list[Value]:
    """The fixed numbers of a program, which stand behind its first arguments; those that it does not read are 0."""
    used = set(program.needed)
    values, wide_row, shared = [], iter(rows["fixed"]), itertools.count()
    for k, wide in zip(range(first, len(program.jaxpr.invars)), field.wide, strict=False):
        at = next(wide_row if wide else shared)
        values.append((w.get(at) if wide else w.shared(at)) if k in used else number(0.0))
    return values


def rates_arguments(w: Code) -> str:
    """Arguments of the function of rates."""
    phase, places = f"{w.type('double', True)} %phase", ("place", "memory", "shared", "out")
    return ", ".join([phase, *(f"ptr noalias %{name}" for name in places)])
