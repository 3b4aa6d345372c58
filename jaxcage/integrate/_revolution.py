"""One revolution with tangent vectors along which the field changes too: what Newton's method on an orbit asks for."""

from collections.abc import Sequence

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array

from .._form import split
from .._types import Scalar, State
from ..models import ESCAPE
from ._kernel import can_be_kernel, steps_through
from ._method import FixedSteps, Moved, Stretch, Tangents, moved_by, result_at
from ._results import outcome_code
from ._strobe import StrobeMap


Drift = Sequence[Scalar | None]
"""Tangents of the numbers of a field, in the order of its leaves; None where there is none."""


def pushed(strobe: StrobeMap, y: State, tangents: Tangents, drifts: Sequence[Drift | None]) -> Moved:
    """A lane one revolution on, with tangent vectors along which the field changes too.

    **Arguments:** strobe map; state; tangent vectors (in units of the state), and for each of them the tangents of the
    field's numbers, None where there are none.
    """
    method = strobe.method
    if isinstance(method, FixedSteps) and can_be_kernel(method.solver):
        pieces = (strobe.field, strobe.system, strobe.scale)
        y, peak, result, after = steps_through(method.solver, method.steps, pieces, y, tangents, drifts)
        return Moved(y, after, peak, outcome_code(result_at(result, y, peak, ESCAPE)))
    form, row = split(strobe.field, eqx.is_inexact_array)

    def advance(start: tuple[State, list[Array]]) -> Stretch:
        y, row = start
        return eqx.tree_at(lambda s: s.field, strobe, form.filled(row))(y)

    zero = list(map(jnp.zeros_like, row))
    filled = [[z if d is None else d for z, d in zip(zero, drift or zero, strict=True)] for drift in drifts]
    return moved_by(advance, (y, row), list(zip(tangents, filled, strict=True)))
