"""Inputs of the integration loop: methods, the programs of a model, and the rows of its working memory."""

import itertools
import math
from typing import Any, NamedTuple

import diffrax as dfx

from .ir import Code, Value, number


REVOLUTION = 2 * math.pi
IMPLICIT = "rodas4"
"""Method for lanes that take too many or too short steps with an explicit one."""
PAIRS: dict[str, tuple[type[dfx.AbstractERK] | None, int]] = {
    "tsit5": (dfx.Tsit5, 5),
    "dopri5": (dfx.Dopri5, 5),
    "bosh3": (dfx.Bosh3, 3),
    "dopri8": (dfx.Dopri8, 8),
    IMPLICIT: (None, 4),
}
"""Embedded explicit pairs and the implicit method (None) by name, with their order."""


Layout = dict[str, range]
"""Rows of the working memory of a vector by name."""


class Tableau(NamedTuple):
    """Coefficients of an embedded pair with FSAL (first same as last)."""

    phase: list[float]
    stages: list[list[float]]
    error: list[float]
    order: int

    @property
    def implicit(self) -> bool:
        """True if a step is a program of its own (`Field.step`)."""
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
    """The traced programs of a system for the integration loop, and options of the loop."""

    prelude: Any
    """Program: fixed numbers -> intermediate results of the rates that depend on nothing else."""
    rates: Any
    """Program: phase, state and tangents, fixed numbers, results of the prelude -> rates; or an object that writes the
    code of the rates itself (`RollersCode`)."""
    excursion: Any | None
    """Program: phase, state, fixed numbers -> excursion; None if the code of the rates stores the watched quantities,
    the excursion first, after the rates."""
    abrupt: Any | None
    """Program: phase, state, rates, fixed numbers -> distance from an abrupt change of the law and speed towards it;
    None if the law has none."""
    dimension: int
    tangents: int
    wide: tuple[bool, ...]
    """True for each fixed number that differs from lane to lane."""
    step: Any | None = None
    """Program of an implicit method: phase, step size, state and tangents, fixed numbers -> state and tangents at the
    end, and their estimated errors."""
    beside: int = 0
    """Number of additional integrands, stored after the tangents; their errors do not control the steps."""
    watched: int = 1
    """Number of quantities whose maximum is recorded; if more than the excursion, between strobe states."""
    phased: bool = False
    """True if the phase of the law at a strobe state follows from its index."""
    relative: bool = True
    """True if errors are relative to the state plus one, and those of tangent vectors also control the steps; False if
    they are in units of the scale, and of the state alone."""

    @property
    def moving(self) -> int:
        """Number of integrated numbers."""
        return self.dimension * (1 + self.tangents) + self.beside

    @property
    def span(self) -> int:
        """Number of results stored by the code of the rates."""
        return self.moving + (0 if self.excursion is not None else self.watched)

    @property
    def recorded(self) -> int:
        """Length of a strobe state: the state and, if any, additional integrands and maxima of watched quantities."""
        return self.dimension + (self.beside + self.watched if self.excursion is None else 0)


def layout_of(field: Field, stages: int) -> Layout:
    """Rows of the working memory: up to `mark` stored when a lane ends, up to `first_step` loaded for the next one."""
    sizes = {
        "state": field.moving,
        "step": 1,
        "peak": field.watched,
        "steps": 1,
        "mark": 1,
        **dict.fromkeys(("most", "turn", "begin"), 1),
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
    """Fixed numbers of a program, its arguments from `first` on; those that it does not read are 0."""
    used = set(program.needed)
    values, wide_row, shared = [], iter(rows["fixed"]), itertools.count()
    for k, wide in zip(range(first, len(program.jaxpr.invars)), field.wide, strict=False):
        at = next(wide_row if wide else shared)
        values.append((w.get(at) if wide else w.load(w.element("%shared", at))) if k in used else number(0.0))
    return values


def rates_arguments(w: Code) -> str:
    phase, places = f"{w.type('double', True)} %phase", ("place", "memory", "shared", "out")
    return ", ".join([phase, *(f"ptr noalias %{name}" for name in places)])
