"""A step of the whole bearing for many lanes, with a tangent vector: few kernels, each a loop along rollers and lanes.

A stage is one kernel over all rollers of all lanes (the forces on a roller, and what it passes on), sums over the
rollers, and one kernel over the lanes (cage and inner ring). XLA by itself cuts the
stage into a hundred loops. However many rollers there are, the program is the same.

Numbers of rollers are arrays of rollers times lanes, lanes last, laid out as one axis.
"""

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..forces._phase import cos_sin
from ..models.whole import LEDGER, MEANS, MOVING, BearingAtSpeed, Bodies, Passed, Rollers
from ..solve import lanewise, with_tangents


Row = tuple[Array, ...]
INTEGRATED = (*LEDGER, *MEANS, "eccentricity_squared")
"""What is integrated over time, by the trapezoidal rule from step to step."""
FOLLOWED = ("pocket_force", "land_force", "roller_slip", "eccentricity")
"""Of what the largest values are followed."""
OF_ROLLER, OF_BODIES = len(Rollers._fields), len(Bodies._fields)
SHARES, WEIGHTS = (0.5, 0.5, 1.0), (2.0, 2.0, 1.0)
"""Of the classical method: how far each stage after the first goes, and its weight in the step."""


class Moving(NamedTuple):
    """Numbers of the rollers and of cage and ring, or their rates over the cage's angle, or tangents of either."""

    rollers: Row
    """As in `Rollers`, of rollers times lanes each."""
    bodies: Row
    """As in `Bodies`, of lanes each."""


class Point(NamedTuple):
    """Where lanes are, and all that is known there."""

    y: Moving
    slope: Moving
    """Over the cage's angle."""
    tangent: Moving
    """Empty rows without tangent vectors."""
    tangent_slope: Moving
    integrand: Row
    """Over the cage's angle: time, and what `INTEGRATED` names."""
    watched: Row
    """As in `FOLLOWED`."""


class Layout(NamedTuple):
    """Between lanes, and rollers times lanes."""

    rollers: int
    lanes: int

    def over(self, x: Array) -> Array:
        """A number of each lane, for all its rollers."""
        return jnp.tile(x, self.rollers)

    def of_rollers(self, x: np.ndarray) -> Array:
        """A number of each roller, for all lanes."""
        return jnp.repeat(jnp.asarray(x), self.lanes)

    def reduce(self, f: Callable[..., Array], rows: Sequence[Array]) -> list[Array]:
        """Sums or maxima over the rollers."""
        return [f(x.reshape(self.rollers, self.lanes), axis=0) for x in rows]


class Law(NamedTuple):
    """The bearing's laws as kernels take them: numbers that all lanes share, and those that each has its own of."""

    at: BearingAtSpeed
    """Each number a scalar, or of lanes."""
    layout: Layout
    places_cos: Array
    places_sin: Array
    units: Moving
    """Inverse magnitudes of the state."""
    sense: Array
    """Of the cage's rotation: 1 or -1."""

    def kernel(
        self, f: Callable[..., Sequence[Any]], results: int, shared: Sequence[Any], own: Sequence[Array], rollers: bool
    ) -> Row:
        """f(laws of a lane, shared numbers, own numbers) in every lane, or for every roller of every lane."""
        leaves, tree = jax.tree.flatten(self.at)
        leaves = [jnp.asarray(x, dtype=float) for x in leaves]
        mine = [x.ndim == 1 for x in leaves]
        alike = [x for x, m in zip(leaves, mine, strict=True) if not m]
        lanes = [self.layout.over(x) if rollers else x for x, m in zip(leaves, mine, strict=True) if m]

        def body(given: Row, lane: Row) -> Sequence[Any]:
            few, each = iter(given[: len(alike)]), iter(lane[: len(lanes)])
            at = jax.tree.unflatten(tree, [next(each) if m else next(few) for m in mine])
            return f(at, given[len(alike) :], lane[len(lanes) :])

        return lanewise(body, results, [*alike, *map(jnp.asarray, shared)], [*lanes, *own])


def law_of(at: BearingAtSpeed, units: Moving, lanes: int) -> Law:
    """**Arguments:** laws, each number a scalar or of lanes; inverse magnitudes of the state."""
    layout = Layout(at.n_rollers, lanes)
    units = Moving(tuple(map(layout.over, units.rollers)), units.bodies)
    places = layout.of_rollers(np.cos(at.places)), layout.of_rollers(np.sin(at.places))
    return Law(at, layout, *places, units, jnp.sign(jnp.asarray(at.rolling_cage_speed)))


def _taken(row: Sequence[Any], *sizes: int) -> list[tuple[Any, ...]]:
    """A row cut into parts."""
    ends = np.cumsum([0, *sizes])
    return [tuple(row[a:b]) for a, b in zip(ends[:-1], ends[1:], strict=True)]


def _rollers_kernel(
    law: Law,
    phase: Row,
    h: Array,
    values: Sequence[Row],
    tangents: Sequence[Row],
    share: Any,
    weight: Any,
    last: Row | None,
) -> list[Row]:
    """Forces on all rollers, `share` of a step on, or at its end.

    **Arguments:** of values and tangents: rollers at the beginning of the step, their slopes at the stage before, the
    weighted sum of slopes so far, and cage and ring at this stage (of lanes). With `last`, the slopes of the stage
    before, it is the end of the step.

    **Returns:** of values, then of tangents: slopes; the new weighted sums, or the rollers at the end; what moves cage
    and ring. Then, at the end: the rest of what is passed on, slip, and the estimated error.
    """
    layout, ends = law.layout, last is not None
    own = [law.places_cos, law.places_sin, *map(layout.over, (*phase, h))]
    sizes = (OF_ROLLER, OF_ROLLER, OF_ROLLER, OF_BODIES)
    spread = lambda rows: [*rows[0], *rows[1], *rows[2], *map(layout.over, rows[3])]
    pushed = bool(tangents[0])

    def f(at: BearingAtSpeed, shared: Row, lane: Row) -> Sequence[Any]:
        (cos_j, sin_j, cos, sin, h), lane = lane[:5], lane[5:]
        pocket = cos * cos_j - sin * sin_j, sin * cos_j + cos * sin_j
        share, weight = shared

        def go(rows: Sequence[Row]) -> tuple[Any, Any]:
            y0, slope, total, bodies = rows
            way = [x / 6 for x in total] if ends else [share * x for x in slope]
            y = tuple(a + h * b for a, b in zip(y0, way, strict=True))
            rollers, cage = Rollers(*y), Bodies(*bodies)
            rates, passed = at.roller_rates(rollers, cage, at.on_roller(rollers, cage, *pocket))
            new = _over_angle(rates, cage.cage_speed)
            sums = tuple(t + weight * x for t, x in zip(total, new, strict=True))
            return (*new, *(y if ends else sums), *passed[:MOVING]), (*passed[MOVING:], at.slip(rollers.spin))

        values, lane = _taken(lane, *sizes), lane[sum(sizes) :]
        tangents = [_taken(lane, *sizes)] if pushed else []
        lane = lane[sum(sizes) * pushed :]
        results, slopes, seen = with_tangents(go, values, tangents)
        if not ends:
            return (*results, *sum(slopes, ()))
        before, units = _taken(lane, OF_ROLLER, OF_ROLLER)
        return (*results, *sum(slopes, ()), *seen, _error(h, before, results, units))

    more = [*last, *law.units.rollers] if last is not None else []
    given = [*own, *spread(values), *(spread(tangents) if pushed else ()), *more]
    size, rest = 2 * OF_ROLLER + MOVING, (len(Passed._fields) - MOVING + 2) * ends
    out = law.kernel(f, size * (1 + pushed) + rest, (share, weight), given, rollers=True)
    parts = (OF_ROLLER, OF_ROLLER, MOVING)
    return _taken(out, *parts, *(parts if pushed else (0, 0, 0)), rest)


def _bodies_kernel(
    law: Law, phase: Row, h: Array, values: Sequence[Row], tangents: Sequence[Row], weight: Any, rest: Row, last: Row
) -> list[Row]:
    """Cage and inner ring under what all rollers pass on.

    **Arguments:** of values and tangents: cage and ring, the weighted sum of slopes so far, what moves them; at the end
    of a step the rest of what is passed on, and the slopes of the stage before.

    **Returns:** of values, then of tangents: slopes, the new weighted sums. Then, at the end: integrands, what is
    watched of the land, and the estimated error.
    """
    ends, pushed = bool(rest), bool(tangents[0])
    sizes = (OF_BODIES, OF_BODIES, MOVING)

    def f(at: BearingAtSpeed, shared: Row, lane: Row) -> Sequence[Any]:
        (cos, sin, h), lane = lane[:3], lane[3:]
        values, lane = _taken(lane, *sizes), lane[sum(sizes) :]
        tangents = [_taken(lane, *sizes)] if pushed else []
        lane = lane[sum(sizes) * pushed :]
        more, before, units = _taken(lane, len(rest), len(last), len(last))
        fill = more or (jnp.zeros_like(cos),) * (len(Passed._fields) - MOVING)

        def go(rows: Sequence[Row]) -> tuple[Any, Any]:
            bodies, total, sums = rows
            cage = Bodies(*bodies)
            land = at.on_land(cage)
            rates, integrals, _ = at.body_rates(cage, (cos, sin), Passed(*sums, *fill), land)
            new = _over_angle(rates, cage.cage_speed)
            sums = tuple(t + shared[0] * x for t, x in zip(total, new, strict=True))
            integrands = _over_angle((jnp.ones_like(cos), *integrals, land.eps * land.eps), cage.cage_speed)
            return (*new, *sums), (*integrands, land.size, land.eps)

        results, slopes, seen = with_tangents(go, values, tangents)
        if not ends:
            return (*results, *sum(slopes, ()))
        return (*results, *sum(slopes, ()), *seen, _error(h, before, results, units))

    units = law.units.bodies if ends else ()
    flat = lambda rows: [x for row in rows for x in row]
    given = [*phase, h, *flat(values), *flat(tangents), *rest, *last, *units]
    seen = (1 + len(INTEGRATED) + 3) * ends
    out = law.kernel(f, 2 * OF_BODIES * (1 + pushed) + seen, (weight,), given, rollers=False)
    parts = (OF_BODIES, OF_BODIES)
    return _taken(out, *parts, *(parts if pushed else (0, 0)), seen)


def _over_angle(rates: Sequence[Any], cage_speed: Any) -> tuple[Any, ...]:
    """Rates over the cage's angle, counted in its sense."""
    pace = 1 / jnp.abs(cage_speed)
    return tuple(pace * x for x in rates)


def _error(h: Any, before: Row, results: Sequence[Any], units: Row) -> Any:
    """Largest estimated error of these numbers: the difference of the last two slopes, in their units."""
    worst = jnp.zeros_like(h)
    for old, new, unit in zip(before, results[: len(before)], units, strict=True):
        worst = jnp.maximum(worst, jnp.abs((old - new) * unit))
    return h / 6 * worst


def _ahead(
    angle: Array, h: Array, share: Any, of_sum: Any, values: Sequence[Row], tangents: Sequence[Row]
) -> tuple[Row, Row, Row]:
    """Cage and inner ring on their way through a step, and cosine and sine of an angle.

    **Arguments:** angle; step; of values and tangents: where the step begins, slopes, and sums of slopes, which count
    `share` and `of_sum` times.
    """
    rows = [row for row in (tuple(values), tuple(tangents)) if row[0]]

    def f(shared: Row, lane: Row) -> Sequence[Any]:
        (angle, h), lane = lane[:2], lane[2:]
        share, of_sum = shared
        out = [*cos_sin(angle)]
        for part in _taken(lane, *[3 * OF_BODIES] * len(rows)):
            y, slope, total = _taken(part, *[OF_BODIES] * 3)
            out += [a + h * (share * k + of_sum * t) for a, k, t in zip(y, slope, total, strict=True)]
        return out

    shared = jnp.asarray(share, dtype=float), jnp.asarray(of_sum, dtype=float)
    lanes = [angle, h, *(x for row in rows for part in row for x in part)]
    phase, *moved = _taken(lanewise(f, 2 + OF_BODIES * len(rows), shared, lanes), 2, *[OF_BODIES] * len(rows))
    return phase, moved[0], moved[1] if len(rows) > 1 else ()


def _end(
    law: Law, angle: Array, h: Array, y: Moving, total: Moving, t: Moving, t_total: Moving, last: Moving
) -> tuple[Point, Array]:
    """The point at the end of a step, by the weighted sums of its slopes, and the error."""
    sums = (y.bodies, last.bodies, total.bodies), (t.bodies, t.bodies, t_total.bodies)
    phase, bodies, t_bodies = _ahead(angle, h, 0.0, 1 / 6, *sums)
    values = (y.rollers, last.rollers, total.rollers, bodies)
    tangents = (t.rollers, t.rollers, t_total.rollers, t_bodies)
    got = _rollers_kernel(law, phase, h, values, tangents, 0.0, 0.0, last.rollers)
    slope, rollers, moving, t_slope, t_rollers, t_moving, seen = got
    sums = law.layout.reduce(jnp.sum, [*moving, *t_moving, *seen[:-2]])
    moving, t_moving, rest = _taken(sums, len(moving), len(t_moving), len(seen) - 2)
    normal, slip, error = law.layout.reduce(jnp.max, [seen[Passed._fields.index("normal") - MOVING], *seen[-2:]])
    values, tangents = (bodies, bodies, moving), (t_bodies, t_bodies, t_moving)
    got = _bodies_kernel(law, phase, h, values, tangents, 0.0, rest, last.bodies)
    b_slope, _, t_b_slope, _, seen = got
    *integrand, land_force, eps, b_error = seen
    point = Point(
        Moving(rollers, bodies),
        Moving(slope, b_slope),
        Moving(t_rollers, t_bodies),
        Moving(t_slope, t_b_slope),
        tuple(integrand),
        (normal, land_force, slip, eps),
    )
    return point, jnp.maximum(error, b_error)


def first_point(law: Law, angle: Array, y: Moving, tangent: Moving) -> Point:
    """All that is known at a state."""
    none = lambda m: Moving(*(tuple(jnp.zeros_like(x) for x in row) for row in m))
    nothing = none(y)
    return _end(law, angle, jnp.zeros_like(angle), y, nothing, tangent, none(tangent), nothing)[0]


def step(law: Law, angle: Array, h: Float[Array, " lanes"], at: Point) -> tuple[Point, Array]:
    """One step of every lane: where it leads, and its estimated error in units of the state."""
    shares, weights = jnp.asarray(SHARES), jnp.asarray(WEIGHTS)

    def stage(i: Array, carry: tuple[Moving, ...]) -> tuple[Moving, ...]:
        slope, total, t_slope, t_total = carry
        share, weight = shares[i], weights[i]
        here = angle + law.sense * share * h
        rows = (at.y.bodies, slope.bodies, total.bodies), (at.tangent.bodies, t_slope.bodies, t_total.bodies)
        phase, bodies, t_bodies = _ahead(here, h, share, 0.0, *rows)
        values = (at.y.rollers, slope.rollers, total.rollers, bodies)
        tangents = (at.tangent.rollers, t_slope.rollers, t_total.rollers, t_bodies)
        got = _rollers_kernel(law, phase, h, values, tangents, share, weight, None)
        k, sums, moving, t_k, t_sums, t_moving, _ = got
        moving, t_moving = _taken(law.layout.reduce(jnp.sum, [*moving, *t_moving]), len(moving), len(t_moving))
        values, tangents = (bodies, total.bodies, moving), (t_bodies, t_total.bodies, t_moving)
        k_b, sums_b, t_k_b, t_sums_b, _ = _bodies_kernel(law, phase, h, values, tangents, weight, (), ())
        return Moving(k, k_b), Moving(sums, sums_b), Moving(t_k, t_k_b), Moving(t_sums, t_sums_b)

    begun = (at.slope, at.slope, at.tangent_slope, at.tangent_slope)
    last, total, _, t_total = jax.lax.fori_loop(0, len(SHARES), stage, begun)
    return _end(law, angle + law.sense * h, h, at.y, total, at.tangent, t_total, last)


def kept(law: Law, taken: Array, new: Point, old: Point) -> Point:
    """The new point of the lanes whose step was `taken` (1, else 0), the old one of the others."""

    def choose(taken: Array, new: Any, old: Any) -> Any:
        a, tree = jax.tree.flatten(new)
        pick = lambda _, lane: [
            jnp.where(lane[0] > 0, x, y) for x, y in zip(lane[1 : 1 + len(a)], lane[1 + len(a) :], strict=True)
        ]
        got = lanewise(pick, len(a), (), [taken, *a, *jax.tree.leaves(old)])
        return jax.tree.unflatten(tree, got)

    parts = lambda p: (
        (p.y.rollers, p.slope.rollers, p.tangent.rollers, p.tangent_slope.rollers),
        (p.y.bodies, p.slope.bodies, p.tangent.bodies, p.tangent_slope.bodies, p.integrand, p.watched),
    )
    of_rollers, of_lanes = zip(parts(new), parts(old), strict=True)
    rollers = choose(law.layout.over(taken), *of_rollers)
    bodies = choose(taken, *of_lanes)
    y, slope, tangent, t_slope = (Moving(r, b) for r, b in zip(rollers, bodies[:4], strict=True))
    return Point(y, slope, tangent, t_slope, bodies[4], bodies[5])
