"""Step control of the integration loop: the estimated error of a step, and the size of the next one.

Errors are measured in units of the model's scale. A step ends at a strobe state, and near abrupt changes of the law; a
PI controller chooses the next one from the errors of this step and the last.
"""

import math
from collections.abc import Callable
from typing import Any

from .ir import Code, Value, number
from .layout import Field, Layout, Tableau, fixed_numbers


SAFETY, LEAST_FACTOR, MOST_FACTOR = 0.9, 0.2, 6.0
"""Safety factor of the step size, and limits of its change."""
TANGENT_TOLERANCE = 10.0
"""Tolerance of tangent vectors relative to their length, as a multiple of that of the state."""
NEAREST = 1e-4
"""Time to an abrupt change of the law [rad] below which steps are not shortened further."""


def limited_step(w: Code, field: Field, rows: Layout, phase: Callable[[], Value], step: Value) -> Value:
    """Step size, shortened so that the step ends near an abrupt change of the law."""
    n, state, rate = field.dimension, rows["state"][0], rows["rate"][0]
    near = w.all([*range(state, state + n), *range(rate, rate + n)])
    leading = [phase(), *near]
    arguments = [*leading, *fixed_numbers(w, field, rows, field.abrupt, len(leading))]
    distance, speed = w.program(field.abrupt, arguments)
    time = w.larger(w.div(distance, w.add(speed, number(1e-9))), number(NEAREST))
    return w.smaller(w.widened(time), step)


def step_to_strobe(w: Code, limited: Value, left: Value) -> tuple[Value, Value, Value]:
    """Step size if `left` remains to the strobe state, and masks: the step ends there; it is half of what remains."""
    ends = w.compare("ge", w.mul(limited, number(1.0001)), left)
    halves = w.compare("gt", w.mul(limited, number(2.0)), left)
    return w.select(ends, left, w.select(halves, w.mul(left, number(0.5)), limited)), ends, halves


def squared_error(w: Code, field: Field, rows: Layout, tableau: Tableau, step: Value, tolerance: Value) -> Value:
    """Squared ratio of the largest estimated error of a step to the tolerance."""
    n, span = field.dimension, field.span
    state, stage, again, rate = (rows[name][0] for name in ("state", "stage", "again", "rate"))
    terms = [(w.mul(step, number(e)), j) for j, e in enumerate(tableau.error) if e != 0.0]

    def estimate(at: Any, first: int) -> Value:
        """Estimated error of an integrated number by its row from `first` on."""
        if tableau.implicit:
            return w.get(at(first + again))
        return w.add(*(w.mul(e, w.get(at(first + rate + j * span))) for e, j in terms))

    def worst(at: Any, error: list[Value]) -> list[Value]:
        sizes = (w.call("fabs", w.get(at(x))) for x in (state, stage))
        unit = w.mul(w.add(number(1.0), w.larger(*sizes)), tolerance) if field.relative else tolerance
        relative = w.div(estimate(at, 0), unit)
        return [w.call("maximum", error[0], w.mul(relative, relative))]

    (error,) = w.over(n, [number(0.0)], worst)
    for first_of in range(n, n * (1 + field.tangents), n) if field.relative else ():

        def sums(at: Any, old: list[Value], first_of: int = first_of) -> list[Value]:
            new, wrong = w.get(at(stage + first_of)), estimate(at, first_of)
            return [w.add(old[0], w.mul(new, new)), w.add(old[1], w.mul(wrong, wrong))]

        length, wrong = w.over(n, [number(1e-300), number(0.0)], sums)
        allowed = w.mul(tolerance, number(TANGENT_TOLERANCE))
        error = w.call("maximum", error, w.div(wrong, w.mul(length, w.mul(allowed, allowed))))
    return w.larger(w.smaller(error, number(1e12)), number(1e-12))  # a NaN becomes the largest error


def next_step(
    w: Code, order: int, step: Value, limited: Value, shorter: Value, fine: Value, bits: Value, last: Value, most: Value
) -> Value:
    """Size of the next step: a PI controller with the error of this step to the power -0.7/order, and that of the last
    one to the power 0.4/order.

    **Arguments:** order of the method; step; its size before it was shortened to end at the strobe state or half way to
    it; masks: it was so shortened, it is accepted; binary logarithms of its squared error over the tolerance, and of
    that of the last accepted step; largest step.
    """
    power = 0.5 / order
    grown = w.sub(w.mul(last, number(0.4 * power)), w.mul(bits, number(0.7 * power)))
    factor = w.add(w.select(fine, grown, w.mul(bits, number(-power))), number(math.log2(SAFETY)))
    factor = w.smaller(factor, w.select(fine, number(math.log2(MOST_FACTOR)), number(-0.2)))
    factor = w.exp2(w.larger(factor, number(math.log2(LEAST_FACTOR))))
    proposed = w.mul(step, factor)
    proposed = w.select(w.both(fine, shorter), w.larger(proposed, limited), proposed)
    return w.smaller(proposed, most)
