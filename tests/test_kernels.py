"""Steps as one compiled loop over the lanes: values, tangents, error control, other devices."""

import dataclasses
import functools

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from helpers import even, raw_sweep, raw_sweeps, wide_but

import jaxcage as jc
from jaxcage.integrate import (
    OUTCOMES,
    ClassicalRK4,
    FixedSteps,
    Rodas4,
    _march,
    compiled,
    controlled,
    march,
    march_with_tangents,
    method,
    revolution,
    strobe_map,
)
from jaxcage.integrate._kernel import kernel_step
from jaxcage.integrate._march import Tangent, is_elementary, march_p
from jaxcage.integrate._method import TERM
from jaxcage.integrate._program import Sizes, pieces, program_of
from jaxcage.models._field import _columns
from jaxcage.orbits._implicit import AbstractEquations
from jaxcage.orbits._orbit import OrbitEquations
from jaxcage.orbits._problem import Given, make_problem
from jaxcage.sweeps import _engine


MODEL = jc.case("1a", "preliminary")
SPEEDS = jc.rpm(4000, 27000, 6)
CLEARANCE = float(MODEL.clearance)
# Inside the film, at the onset of contact, and pressed into the rib.
STATES = np.array([[0.3, -0.5, 0.1, 0.2], [0.0, -0.97, 0.0, 0.0], [0.6, 0.77, -0.2, 0.3]] * 2)
STATES = STATES * np.stack([CLEARANCE * np.array([1, 1, w, w]) for w in SPEEDS])


slow = functools.partial(pytest.param, marks=pytest.mark.slow)
wide = functools.partial(pytest.param, marks=pytest.mark.wide)


def lane_state(states):
    return tuple(jnp.asarray(c) for c in np.asarray(states).T)


# --- the primitive --------------------------------------------------------------------------------------------------


def heun(i, moved, watched, fixed):
    """Heun's method on a Duffing oscillator; the largest |x| is watched."""
    (x, v), (peak,), (h, cubic) = moved, watched, fixed
    pull = lambda x, v, t: -0.2 * v + x - cubic * x**3 + 0.3 * jnp.cos(t)
    t = i * h
    x1, v1, a = x + h * v, v + h * pull(x, v, t), pull(x, v, t)
    x, v = x + h / 2 * (v + v1), v + h / 2 * (a + pull(x1, v1, t + h))
    return (x, v), (jnp.maximum(peak, jnp.abs(x)),)


def by_march(z, count=48):
    (x, v), (peak,) = march(heun, count, (z[0], z[1]), (0.0,), (2 * np.pi / 200, z[2]), multiple=4)
    return jnp.stack([x, v]), peak


def by_loop(z, count=48):
    moved, watched = (z[0], z[1]), (0.0,)
    for i in range(count):
        moved, watched = heun(float(i), moved, watched, (2 * np.pi / 200, z[2]))
    return jnp.stack(moved), watched[0]


LANES = jnp.stack([jnp.linspace(0, 1, 7), jnp.linspace(0.5, -0.2, 7), jnp.linspace(1, 2, 7)], axis=1)
first = lambda f: lambda z: f(z)[0]


def test_a_march_is_its_steps_one_by_one_in_one_lane_and_in_many():
    for got, expected in zip(by_march(LANES[2]), by_loop(LANES[2]), strict=True):
        np.testing.assert_allclose(got, expected, rtol=1e-13)
    for got, expected in zip(jax.vmap(by_march)(LANES), jax.vmap(by_loop)(LANES), strict=True):
        np.testing.assert_allclose(got, expected, rtol=1e-12)


@pytest.mark.wide
@pytest.mark.parametrize("order, tolerance", [wide(1, 1e-12), (2, 1e-10), wide(3, 1e-8)])
def test_derivatives_of_a_march_of_any_order(order, tolerance):
    """Against the same steps without the primitive; lanes outside the derivative and inside."""
    few = functools.partial(by_march, count=12), functools.partial(by_loop, count=12)
    march_d, loop_d = map(first, few)
    for _ in range(order):
        march_d, loop_d = jax.jacfwd(march_d), jax.jacfwd(loop_d)
    expected = jax.vmap(loop_d)(LANES)
    np.testing.assert_allclose(jax.vmap(march_d)(LANES), expected, rtol=0, atol=tolerance * np.abs(expected).max())
    if order == 1:
        inside = jax.jacfwd(lambda z: jax.vmap(first(few[0]))(z))(LANES)
        each = np.array([inside[i, :, i] for i in range(len(LANES))])
        np.testing.assert_allclose(each, expected, rtol=0, atol=tolerance)


def test_values_keep_their_place_beside_a_jacobian():
    """`jacfwd` with what else was computed: the values depend on no direction, and are not mapped over any."""
    both = lambda z: (by_march(z)[0],) * 2
    slope, value = jax.vmap(jax.jacfwd(both, has_aux=True))(LANES)
    np.testing.assert_allclose(value, jax.vmap(first(by_loop))(LANES), rtol=1e-12)
    assert slope.shape == (7, 2, 3)


def test_directions_too_many_for_one_kernel_are_lanes(monkeypatch):
    expected = jax.jacfwd(first(by_march))(LANES[1])
    monkeypatch.setattr(_march, "DIRECTIONS", 1)
    np.testing.assert_allclose(jax.jacfwd(first(by_march))(LANES[1]), expected, rtol=1e-12)


def test_lanes_may_have_counts_of_their_own():
    counts = jnp.array([0, 4, 20, 48])
    got = jax.vmap(lambda n: by_march(LANES[3], n)[0])(counts)
    expected = [by_loop(LANES[3], int(n))[0] for n in counts]
    np.testing.assert_allclose(got, np.stack(expected), rtol=1e-12)


@pytest.mark.parametrize("largest", [2800, 5])
def test_lanes_with_counts_of_their_own_are_differentiated(largest, monkeypatch):
    """As one kernel, and as several."""
    monkeypatch.setattr(_march, "LARGEST", {False: largest, True: largest})
    counts = jnp.array([4, 12])
    got = jax.vmap(lambda n: jax.jacfwd(lambda z: by_march(z, n)[0])(LANES[3]))(counts)
    expected = [jax.jacfwd(lambda z, n=n: by_loop(z, int(n))[0])(LANES[3]) for n in counts]
    np.testing.assert_allclose(got, np.stack(expected), rtol=0, atol=1e-12)


@pytest.mark.wide
def test_tangents_with_and_without_those_of_the_fixed_numbers():
    z, h = LANES[4], 2 * np.pi / 200
    tangents, drifts = [(1.0, 0.0), (0.0, 1.0), (0.0, 0.0)], [(None, None), (None, None), (None, 1.0)]
    options = dict(tangents=tangents, fixed_tangents=drifts)
    for whole in (True, False):
        y, (peak,), pushed = march_with_tangents(heun, 48, (z[0], z[1]), (0.0,), (h, z[2]), **options, whole=whole)
        value, highest = by_loop(z)
        np.testing.assert_allclose(jnp.stack(y), value, rtol=1e-12)
        np.testing.assert_allclose(peak, highest, rtol=1e-12)
        np.testing.assert_allclose(np.array(pushed).T, jax.jacfwd(first(by_loop))(z), rtol=1e-10)


@pytest.mark.parametrize(
    "f, plain",
    [
        (lambda x, a: jnp.where(x > a, jnp.exp(x), 0.0), True),
        (lambda x, a: jnp.sum(jnp.stack([x, a])), False),  # arrays
        (lambda x, a: jax.lax.fori_loop(0, 3, lambda i, v: v * a, x), False),  # control flow
        (lambda x, a: jnp.asarray([1.0, 2.0])[0] * x, False),  # a caught array
    ],
)
def test_what_can_be_one_loop(f, plain):
    assert is_elementary(lambda i, y, seen, x: ((f(y[0], x[0]),), ()), Sizes(1, 0, 1)) == plain


def test_a_caught_tracer_cannot_be_in_the_loop():
    seen = []

    def outer(a):
        seen.append(is_elementary(lambda i, y, seen, x: ((a * y[0],), ()), Sizes(1, 0, 0)))
        return a

    jax.make_jaxpr(outer)(1.0)
    assert seen == [False]


# --- steps in several kernels, and in parts -------------------------------------------------------------------------


@pytest.mark.wide
@pytest.mark.parametrize("largest", [1, 2, 3, 5, 100])
def test_a_step_is_what_its_pieces_are_one_after_the_other(largest, monkeypatch):
    """Numbers of every type go from one kernel to the next; a result may be an argument, or the same in every lane."""

    def step(i, moved, watched, fixed):
        (x, y, _), (a,) = moved, fixed
        above, whole = x > a, jnp.floor(y * 3).astype(jnp.int32)
        new = jnp.where(above, jnp.sin(x), x * a) + whole.astype(float)
        return (new, x, 2.0), (jnp.where(above, 1.0, watched[0] + i),)

    def go(x, count=3):
        return jnp.stack([c for row in march(step, count, (x, x - 1, x), (0.0,), (0.4,)) for c in row])

    def expected(x):
        moved, watched = (x, x - 1, x), (0.0,)
        for i in range(3):
            moved, watched = step(jnp.asarray(float(i)), tuple(map(jnp.asarray, moved)), watched, (0.4,))
        return jnp.stack([jnp.asarray(c) for c in (*moved, *watched)])

    monkeypatch.setattr(_march, "LARGEST", {False: largest, True: largest})
    monkeypatch.setattr(_march, "TOGETHER", 0)
    lanes = jnp.linspace(-2, 3, 9)
    np.testing.assert_allclose(jax.jit(jax.vmap(go))(lanes), jax.vmap(expected)(lanes), rtol=1e-14)


@pytest.mark.parametrize("solver, largest, most", [(ClassicalRK4(), 500, 120), slow(Rodas4(), 12000, 600)])
def test_pieces_hold_no_more_than_they_may_and_exchange_few_numbers(solver, largest, most):
    """XLA has no kernels of more than 1000 results; Rodas4 differentiated twice, cut behind its values, has 1805."""
    step, numbers = kernel_step(solver, MODEL.at_speed(1200.0), MODEL, MODEL.scale(1200.0))
    sizes = Sizes(4, len(step.watched(0.0)), 3 + len(numbers))
    tangent = Tangent(step, sizes, ((False,) * sizes.fixed,) * 4)
    if isinstance(solver, Rodas4):
        tangent = Tangent(tangent, tangent.whole, ((False, False, *(True,) * 22, *(False,) * (len(numbers) - 22)),))
    program = program_of(tangent, tangent.whole)
    parts = pieces(program, largest, tangent.late)
    assert sum(len(p.eqns) for p in parts) == len(program.jaxpr.eqns) > largest
    assert max(len(p.eqns) for p in parts) <= largest
    assert max(len(p.outvars) for p in parts) < most


def duffing(tau, q, v, speed):
    (x,), (u,) = q, v
    return (-0.2 * u + x - x**3 + 0.3 * jnp.cos(tau),)


def on_a_line(kind, solver, by_loop):
    """The state after a few steps from a point on a line through states and numbers of the field, as a function of s;
    by `march`, or by the same steps one after the other, nothing compiled."""
    system, state, speed = MODEL, STATES[2], SPEEDS[2]
    if kind == "duffing":
        system, state, speed = jc.ForcedOscillator(duffing, coordinates=1), np.array([0.7, -0.3]), 1.1
    if kind == "elastic rib":
        rib = jc.forces.ElasticRib(mass=0.5, stiffness=1e8, damping=200.0, cubic_stiffness=1e14)
        system = eqx.tree_at(lambda m: m.rib, MODEL, rib, is_leaf=lambda x: isinstance(x, jc.forces.RigidRib))
        state = np.concatenate([STATES[2][:2], [1e-6, -2e-6], STATES[2][2:], [1e-3, 0.0]])
    scale = system.scale(jnp.asarray(speed))
    field = system.at_speed(jnp.asarray(speed))
    few = len(jax.tree.leaves(eqx.filter(field, eqx.is_inexact_array)))
    step, numbers = kernel_step(solver, field, system, scale)
    assert step.whole

    def image(s, count=5):
        y = tuple(c + 0.1 * s * (-1) ** i * z for i, (c, z) in enumerate(zip(state, scale, strict=True)))
        moving = [x * (1 + 0.3 * s) if i < few else x for i, x in enumerate(numbers)]
        clock = (jnp.asarray(0.3), jnp.asarray(2 * np.pi / 200), jnp.asarray(9.0))
        given = (y, step.watched(0.3), (*clock, *moving))
        if by_loop:
            new, seen, fixed = given
            for i in range(count):
                new, seen = step(jnp.asarray(float(i)), new, seen, fixed)
        else:
            new, seen = march(step, count, *given)
        return jnp.stack(new) / jnp.stack(scale), jnp.stack(seen)

    return image


def derivative(f, order):
    for _ in range(order):
        f = functools.partial(lambda f, s: jax.jvp(lambda s: f(s), (s,), (1.0,))[1], f)
    return f


@pytest.mark.wide
@pytest.mark.parametrize(
    "kind, solver, order",
    [
        ("duffing", "rk4", 1),
        ("duffing", "rk4", 2),
        wide("duffing", "rk4", 3),
        slow("duffing", "tsit5", 3),
        slow("cage", "rk4", 2),
        slow("cage", "rk4", 3),
        slow("elastic rib", "rk4", 2),
    ],
)
def test_derivatives_by_parts_of_steps(kind, solver, order, monkeypatch):
    """Beyond the first, a quarter of a Runge-Kutta step at a time; against whole steps without the primitive."""
    monkeypatch.setattr(_march, "WHOLE", 0)
    chosen = method(solver, steps=8).solver
    got, expected = (derivative(first(on_a_line(kind, chosen, by_loop)), order) for by_loop in (False, True))
    lanes = jnp.array([0.0, 0.2, -0.3])
    found, right = np.asarray(jax.jit(jax.vmap(got))(lanes)), np.stack([expected(s) for s in lanes])
    assert np.abs(right).max() > 1e-3
    np.testing.assert_allclose(found, right, rtol=0, atol=1e-10 * np.abs(right).max())


def test_parts_and_whole_steps_are_chosen_by_size(monkeypatch):
    """A Duffing oscillator differentiated twice is small; the cage is not."""
    counted = []
    counts = lambda *x, how, bind=march_p.bind: (counted.append(how), bind(*x, how=how))[1]
    monkeypatch.setattr(march_p, "bind", counts)
    for kind, stages in (("duffing", 1), ("cage", 4)):
        jax.eval_shape(derivative(first(on_a_line(kind, ClassicalRK4(), False)), 2), 0.1)
        last = counted[-1]
        assert isinstance(last.step.step, Tangent)
        assert last.sizes.moved == {1: 8, 4: 3 * 16}[stages]


@pytest.mark.wide
@pytest.mark.parametrize("name", ["rk4", "tsit5"])
def test_a_loop_of_stages_watches_what_a_loop_of_steps_does(name):
    solver, speed = method(name, steps=8).solver, SPEEDS[2]
    step, numbers = kernel_step(solver, MODEL.at_speed(speed), MODEL, MODEL.scale(speed))
    y, fixed = tuple(STATES[2]), (0.2, 0.02, 9.0, *numbers)
    stage = step.stage
    assert stage is not None
    new, seen = march(step, 20, y, step.watched(0.2), fixed)
    by_stages, also_seen = march(stage, 20 * stage.count, y * stage.copies, step.watched(0.2), fixed)
    np.testing.assert_allclose(by_stages, new * stage.copies, rtol=1e-11)
    np.testing.assert_allclose(also_seen, seen, rtol=1e-8)
    assert seen[0] > 0.9 and 0.2 < seen[1] < 0.2 + 20 * 0.02 * 1.001  # shortened near the land


@pytest.mark.wide
def test_lanes_with_counts_of_their_own_are_differentiated_by_parts(monkeypatch):
    monkeypatch.setattr(_march, "WHOLE", 0)
    image = on_a_line("duffing", ClassicalRK4(), False)
    second = lambda n: derivative(lambda s: image(s, n)[0], 2)(0.1)
    counts = jnp.array([0, 3, 7])
    got = jax.jit(jax.vmap(second))(counts)
    expected = [
        derivative(lambda s, n=n: on_a_line("duffing", ClassicalRK4(), True)(s, n)[0], 2)(0.1) for n in (0, 3, 7)
    ]
    np.testing.assert_allclose(got, np.stack(expected), rtol=0, atol=1e-10)
    assert np.abs(got[2]).max() > 1e-3


# --- lanes against one lane alone, step by step by the solver -------------------------------------------------------


EVEN = even(MODEL)


def by_lanes(chosen, directions=()):
    @compiled
    def run(model, speed, y, tangents):
        one = lambda s, y, t: revolution(strobe_map(model, s, chosen), y, t, jnp.zeros((), jnp.int32))
        return jax.vmap(one)(speed, y, tangents)

    tangents = tuple(lane_state(np.broadcast_to(d, STATES.shape)) for d in directions)
    moved = run(EVEN, jnp.asarray(SPEEDS), lane_state(STATES), tangents)
    return jnp.stack(moved.y), [jnp.stack(t) for t in moved.tangents], moved.peak, moved.level


@eqx.filter_jit
def by_solver(chosen, speed, y, direction):
    """The solver's own steps, one after the other, as diffrax takes them."""
    field, solver, h = EVEN.at_speed(speed), chosen.solver, 2 * np.pi / chosen.steps

    def image(y):
        def step(i, carry):
            y, state = carry
            t = i.astype(float) * h
            y, _, _, state, _ = solver.step(TERM, t, t + h, y, field, state, False)
            return y, state

        y = tuple(y)
        state = solver.init(TERM, 0.0, h, y, field)
        return jnp.stack(jax.lax.fori_loop(0, chosen.steps, step, (y, state))[0])

    return jax.jvp(image, (y,), (direction,))


@pytest.mark.parametrize("name", wide_but(["rk4", "tsit5", "rodas3", "rodas4"], "rk4"))
def test_kernels_give_the_strobe_map_and_its_derivative(name):
    """Two programs for one method: the loop of kernels, and the solver's own step under `jax.jvp`."""
    chosen = method(name, steps=256)
    direction = np.array([1.0, -0.4, 300.0, 200.0])
    y, (tangent,), peak, _ = by_lanes(chosen, [direction])
    for i, (speed, state) in enumerate(zip(SPEEDS, STATES, strict=True)):
        image, slope = by_solver(chosen, speed, jnp.asarray(state), jnp.asarray(direction))
        scale = CLEARANCE * np.array([1, 1, speed, speed])
        np.testing.assert_allclose(y[:, i] / scale, image / scale, rtol=0, atol=1e-9)
        np.testing.assert_allclose(tangent[:, i], slope, rtol=0, atol=1e-7 * np.abs(slope).max())
    assert np.all(peak >= 0)


@pytest.mark.wide
def test_first_order_systems_and_oscillators_run_as_kernels():
    def oscillator(tau, q, v, speed):
        (x,), (u,) = q, v
        return (-0.2 * u - x - 0.1 * x**3 + 0.3 * jnp.cos(tau),)

    def rates(tau, y, speed):
        (a,) = oscillator(tau, y[:1], y[1:], speed)
        return (y[1], a)

    ends = []
    for system in (jc.ForcedOscillator(oscillator, coordinates=1), jc.ForcedSystem(rates, 2)):
        got = raw_sweep(system, np.array([0.9, 1.1]), discard=0, revolutions=4, blocks=1, exponents=2, keep=1)
        assert not np.any(got.failed)
        ends.append((got.last, got.exponents))
        trace = np.broadcast_to(-0.2 * 2 * np.pi / got.speed[:, None], (2, 3))
        np.testing.assert_allclose(np.sum(got.exponents, -1), trace, rtol=1e-5)
    np.testing.assert_allclose(ends[0][0], ends[1][0], atol=1e-9)
    np.testing.assert_allclose(ends[0][1], ends[1][1], atol=1e-7)


@pytest.mark.parametrize("film", wide_but(["fixed_half", "full"], "fixed_half"))
@pytest.mark.parametrize("cross", wide_but(["circulatory", "as_printed"], "as_printed"))
@pytest.mark.parametrize("smoothing", wide_but([1e-9, 5e-6], 5e-6))
def test_analytic_slopes_of_the_cage_against_autodiff(film, cross, smoothing):
    """Everywhere in the land, the middle too, where the film's smoothing rounds the line of centres off."""
    model = jc.replace(MODEL, supply_pressure=2e4, restitution=0.6, cross_cubic=1e9, **{"film.smoothing": smoothing})
    changed = dataclasses.replace(model.film, model=film), dataclasses.replace(model.support, cross=cross)
    model = eqx.tree_at(lambda m: (m.film, m.support), model, changed)
    law = model.at_speed(1200.0).acceleration
    rng = np.random.default_rng(3)
    for eps in (0.0, 0.01, 0.2, 0.9, 0.9699, 0.97, 0.9703, 0.99):
        angle = rng.uniform(0, 2 * np.pi)
        q = tuple(jnp.asarray(eps * CLEARANCE * c) for c in (np.cos(angle), np.sin(angle)))
        v = tuple(jnp.asarray(c) for c in rng.normal(size=2) * CLEARANCE * 600)
        of_q = np.array(_columns(lambda z: law(0.3, z, v), q))
        of_v = np.array(_columns(lambda z: law(0.3, q, z), v))
        found_q, found_v = map(np.array, law.slopes(q, v))
        np.testing.assert_allclose(found_q, of_q, rtol=0, atol=1e-11 * np.abs(of_q).max())
        np.testing.assert_allclose(found_v, of_v, rtol=0, atol=1e-11 * np.abs(of_v).max())


def test_the_positive_pressure_film_is_left_to_autodiff():
    film = dataclasses.replace(MODEL.film, model="positive_pressure")
    law = eqx.tree_at(lambda m: m.film, MODEL, film).at_speed(1200.0).acceleration
    assert law.slopes((1e-5, 1e-5), (0.0, 0.0)) is None


# --- the evaluator of orbits ----------------------------------------------------------------------------------------


@pytest.mark.wide
def test_one_program_serves_all_numbers_of_steps():
    y = tuple(jnp.asarray(STATES[3]))

    def image(steps):
        return jnp.stack(strobe_map(MODEL, SPEEDS[3], FixedSteps(ClassicalRK4(scan_kind="lax"), steps))(y).y)

    run = compiled(eqx.debug.assert_max_traces(image, max_traces=1))
    for steps in (384, 1000):
        np.testing.assert_allclose(run(jnp.asarray(steps)), compiled(image)(steps), rtol=1e-12)


@pytest.mark.wide
@pytest.mark.parametrize("solver", ["rk4", slow("rodas4")])
@pytest.mark.parametrize("kind", ["cage", slow("elastic rib")])
def test_a_column_for_each_unknown_beside_the_monodromy_matrix(kind, solver):
    """The orbit's equations linearised at once, against their derivative by `jacfwd`; away from any orbit."""
    system, speed = MODEL, jnp.asarray(SPEEDS[2])
    if kind == "elastic rib":
        rib = jc.forces.ElasticRib(mass=0.5, stiffness=1e8, damping=200.0, cubic_stiffness=0.0)
        system = eqx.tree_at(lambda m: m.rib, MODEL, rib, is_leaf=lambda x: isinstance(x, jc.forces.RigidRib))
    given, units = Given(system, speed), jnp.asarray([float(speed), float(MODEL.guidance_gap)]) / 10
    problem = make_problem(given, ("speed", "guidance_gap"), units, 2, method(solver, steps=96))
    u = jnp.append(jnp.asarray(system.starts(speed)[1]) / problem.scale, jnp.full(2, 10.0))
    equations = OrbitEquations(problem)
    r, jacobian, _ = compiled(lambda u: equations.linearised(u, given))(u)
    expected_r, expected, _ = compiled(lambda u: AbstractEquations.linearised(equations, u, given))(u)
    np.testing.assert_allclose(r, expected_r, rtol=0, atol=1e-10)
    np.testing.assert_allclose(jacobian, expected, rtol=0, atol=1e-9 * np.abs(expected).max())


# --- monodromy matrices -------------------------------------------------------------------------------------------


@pytest.mark.slow
def test_monodromy_matrices_against_the_strobe_map():
    chosen = method("rodas4", steps=256)
    image, matrix = jc.sweeps.monodromy(MODEL, SPEEDS, STATES, method=chosen)
    for i in (0, 2, 4):
        strobe = lambda y: jnp.stack(strobe_map(MODEL, SPEEDS[i], chosen)(tuple(y)).y)
        exact = np.asarray(jax.jit(jax.jacfwd(strobe))(jnp.asarray(STATES[i])))
        unit = np.array([1, 1, SPEEDS[i], SPEEDS[i]])
        np.testing.assert_allclose(matrix[i] * unit / unit[:, None], exact * unit / unit[:, None], atol=1e-7)
        after = np.asarray(strobe(jnp.asarray(STATES[i])))
        np.testing.assert_allclose(image[i] / unit / CLEARANCE, after / unit / CLEARANCE, rtol=0, atol=1e-9)


@pytest.mark.wide
def test_monodromy_of_bad_shapes_and_failed_lanes():
    with pytest.raises(ValueError, match="4 numbers for each of the 6 speeds"):
        jc.sweeps.monodromy(MODEL, SPEEDS, STATES[:, :3])
    states = STATES.copy()
    states[1] = np.nan
    image, matrix = jc.sweeps.monodromy(MODEL, SPEEDS, states)
    assert np.all(np.isnan(image[1])) and np.all(np.isnan(matrix[1]))
    others = [0, 2, 3, 4, 5]
    good = jc.sweeps.monodromy(MODEL, SPEEDS, STATES)
    np.testing.assert_array_equal(image[others], good[0][others])
    np.testing.assert_array_equal(matrix[others], good[1][others])


# --- error control ------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def attractor():
    speeds = jc.rpm(4000, 27000, 24)
    settling = dict(discard=150, revolutions=10, blocks=1, exponents=0, keep=1)
    last = raw_sweep(MODEL, speeds, method=method("rk4", steps=512), **settling).last
    return speeds, last


def one_revolution(speeds, states, chosen):
    return raw_sweep(
        MODEL, speeds, starts=states, method=chosen, discard=0, revolutions=1, blocks=1, exponents=0, keep=1
    )


@pytest.mark.wide
def test_controlled_steps_reach_1e_4_of_the_clearance(attractor):
    """The default of sweeps, over states on the attractors of case 1a, against 8192 steps."""
    speeds, states = attractor
    truth = one_revolution(speeds, states, method("rodas4", steps=8192))
    got = one_revolution(speeds, states, controlled())
    error = np.max(np.abs(got.last - truth.last)[..., :2], axis=-1) / CLEARANCE
    assert not np.any(got.failed)
    assert np.quantile(error, 0.95) < 1e-4
    assert error.max() < 5e-4
    coarse = one_revolution(speeds, states, method("rk4", steps=64))
    assert np.nanmax(np.abs(coarse.last - truth.last)[..., :2]) / CLEARANCE > 1e-3  # the control has work to do


@pytest.mark.slow
def test_a_lane_takes_the_rung_that_it_needs(attractor):
    """Where it agrees with half as many steps within the tolerance: the same end as that rung's fixed steps."""
    speeds, states = attractor
    ladder = [("rk4", 64 << i) for i in range(6)]
    got = one_revolution(speeds, states, controlled(1e-3, ladder))
    ends = np.stack([one_revolution(speeds, states, method(name, steps=n)).last for name, n in ladder])
    scale = got.scale[:, None, :]
    apart = np.max(np.abs(np.diff(ends, axis=0)) / scale, axis=-1)
    rung = np.argmin(np.max(np.abs(ends[1:] - got.last) / scale, axis=-1), axis=0)
    assert len(set(rung.ravel().tolist())) > 1  # the control has work to do
    i, j = np.indices(rung.shape)
    np.testing.assert_allclose(got.last / scale, ends[rung + 1, i, j] / scale, atol=1e-9)
    assert np.all(got.error >= apart[rung, i, j]) and np.all(got.error <= 1e-3)
    assert np.quantile(apart[rung - 1, i, j], 0.1) > 1e-3 / 32  # it does not take more than it needs


@pytest.mark.wide
def test_what_no_rung_can_is_inaccurate(attractor):
    """It is neither a failure nor a label, and lanes beside it are as they would be without it."""
    speeds, states = attractor
    chosen = controlled(1e-4, [("rk4", 64), ("rk4", 128)])
    got = one_revolution(speeds, states, chosen)
    lost = got.outcome == OUTCOMES.index("inaccurate")
    assert 0 < np.sum(lost) < lost.size and np.all(lost | (got.outcome == 0))
    assert np.all((got.label == "inaccurate") == lost)
    assert np.all(got.error[lost] > 1e-4) and np.all(got.error[~lost] <= 1e-4)
    some = np.flatnonzero(~np.any(lost, axis=1))
    alone = one_revolution(speeds[some], states[some], chosen)
    np.testing.assert_allclose(alone.last, got.last[some], rtol=1e-12)


@pytest.mark.wide
def test_an_exponent_that_is_the_damping_of_the_steps_is_found_out():
    """A light spring, 100 oscillations a revolution, whose exponent is -0.01 * 2 pi: L-stable steps damp them away."""
    light = lambda tau, q, v, speed: (-0.02 * v[0] - 1e4 * (q[0] - jnp.cos(tau)),)
    system = jc.ForcedOscillator(light, coordinates=1, scale=(1.0, 100.0), starts=((1.0, 0.0),))
    run = lambda chosen: raw_sweep(system, 1.0, discard=0, revolutions=10, blocks=2, keep=1, method=chosen)
    fixed = run(method("rodas4", steps=256))
    assert fixed.exponents[0, 0, 0] < -1 and fixed.standard_error[0, 0, 0] > 1  # wrong, and known to be
    assert run(controlled(1e-2, [("rodas4", 64 << i) for i in range(3)])).label[0, 0] == "inaccurate"
    right = run(controlled())
    assert abs(right.exponents[0, 0, 0] + 0.02 * np.pi) < 3 * right.standard_error[0, 0, 0] < 0.1


@pytest.mark.wide
def test_steps_are_shortened_where_the_cage_touches_the_land(attractor):
    """The onset of contact is a thousandth of the clearance wide; fourth order holds through it."""
    speeds, states = attractor
    runs = [
        raw_sweep(
            MODEL,
            speeds,
            starts=states,
            method=method("rk4", steps=n),
            discard=0,
            revolutions=1,
            blocks=1,
            exponents=0,
            keep=1,
        )
        for n in (256, 512, 1024, 8192)
    ]
    touches = runs[-1].peak > float(MODEL.contact.onset)
    assert np.sum(touches) > 5
    error = [
        np.max(np.abs(r.last - runs[-1].last)[touches] / runs[-1].scale[:, None][np.nonzero(touches)[0], 0])
        for r in runs[:-1]
    ]
    assert error[2] < 1e-6
    assert error[0] / error[1] > 8 and error[1] / error[2] > 8


@pytest.mark.wide
def test_stiff_lanes_end_on_the_l_stable_rung():
    """A damping of 1e6 per radian: no explicit rung can hold it, and the answer is that of a fine stiff method."""

    def stiff(tau, q, v, speed):
        (x,), (u,) = q, v
        return (-1e6 * (u - jnp.cos(tau)) - x,)

    system = jc.ForcedOscillator(stiff, coordinates=1)
    run = lambda chosen: raw_sweep(
        system, 1.0, starts=[(0.1, 1.0)], method=chosen, discard=0, revolutions=2, blocks=1, exponents=0, keep=1
    )
    got, fine = run(None), run(method("rodas4", steps=4096))
    assert not np.any(got.failed)
    np.testing.assert_allclose(got.last, fine.last, atol=1e-5)
    assert np.any(run(method("rk4", steps=768)).failed)


@pytest.mark.wide
def test_the_scalar_strobe_map_is_controlled_too(attractor):
    speeds, states = attractor
    chosen = controlled()
    one = eqx.filter_jit(lambda speed, y: jnp.stack(strobe_map(MODEL, speed, chosen)(tuple(y)).y))
    swept = one_revolution(speeds, states, chosen).last
    for i in (2, 20):
        np.testing.assert_allclose(one(speeds[i], states[i, 0])[:2], swept[i, 0, :2], atol=1e-4 * CLEARANCE)


@pytest.mark.parametrize(
    "arguments, sentence",
    [
        (dict(ladder=()), "two or more pairs"),
        (dict(ladder=(("rk4", 64),)), "two or more pairs"),
        (dict(ladder=(("euler", 64), ("euler", 128))), "must be one of"),
        (dict(error=0.0), "must be positive"),
    ],
)
def test_bad_ladders(arguments, sentence):
    with pytest.raises(ValueError, match=sentence):
        controlled(**arguments)


# --- the engine ---------------------------------------------------------------------------------------------------


@pytest.mark.wide
def test_results_do_not_depend_on_chunks_cores_or_lane_order(monkeypatch):
    """To the last bit."""
    speeds = jc.rpm(9000, 26000, 40)
    run = lambda: raw_sweep(MODEL, speeds, discard=20, revolutions=10, blocks=1, keep=4)
    fields = ("strobe", "last", "block_growth", "peak", "outcome")
    expected = run()
    for chunk, cores in ((16, 1), (16, 2), (128, 1)):
        monkeypatch.setattr(_engine, "CHUNKS", (chunk,))
        monkeypatch.setattr(_engine, "cores", lambda cores=cores: cores)
        got = run()
        for field in fields:
            np.testing.assert_array_equal(getattr(got, field), getattr(expected, field), err_msg=f"{chunk} {field}")


@pytest.mark.parametrize("lanes, size, least", [(1, 16, 2), (7, 16, 2), (40, 16, 2), (300, 64, 2), (300, 512, 4)])
def test_chunks_take_about_as_long(lanes: int, size: int, least: int):
    """Every lane once, no chunk above its size; while there is room none is behind another by more than a block."""
    cost = np.random.default_rng(lanes).choice([64.0, 128.0, 4096.0], lanes, p=[0.6, 0.38, 0.02])
    parts = _engine._dealt(cost, size, least)
    assert sorted(np.concatenate(parts)) == list(range(lanes)) and max(p.size for p in parts) <= size
    if max(p.size for p in parts) < size:
        blocks = lambda p: sum(c * -(-np.sum(cost[p] == c) // _engine.BLOCK) for c in np.unique(cost[p]))
        load = [blocks(p) for p in parts]
        assert max(load) - min(load) <= np.max(cost)


def test_the_dearest_lanes_do_not_wait_for_each_other():
    """Two levels of eight lanes each that cost most: one for each core."""
    cost = np.array([4096.0] * 8 + [2048.0] * 8 + [64.0] * 100)
    dear, other = _engine._dealt(cost, 128, 2)
    assert set(range(8)) == set(dear[:8]) and set(range(8, 116)) == set(other)


@pytest.mark.wide
def test_several_designs_in_one_batch_give_what_each_gives_alone():
    models = [MODEL, jc.replace(MODEL, guidance_gap=0.5e-3), jc.case("2b", "preliminary")]
    speeds = jc.rpm(8000, 24000, 5)
    options = dict(discard=2, revolutions=2, blocks=1, keep=2)  # chaos doubles rounding every few revolutions
    together = raw_sweeps(models, speeds, **options)
    assert len(together) == 3
    for model, got in zip(models, together, strict=True):
        alone = raw_sweep(model, speeds, **options)
        np.testing.assert_array_equal(got.outcome, alone.outcome)
        np.testing.assert_allclose(
            got.strobe / got.scale[:, None, None], alone.strobe / alone.scale[:, None, None], atol=1e-6
        )
    with pytest.raises(ValueError, match="at least one system"):
        raw_sweeps([], speeds)
    other = eqx.tree_at(lambda m: m.film, MODEL, dataclasses.replace(MODEL.film, model="full"))
    with pytest.raises(ValueError, match="differ in their numbers only"):
        raw_sweeps([MODEL, other], speeds)


@pytest.mark.slow
def test_run_up_and_down_of_several_designs():
    models = [MODEL, jc.case("1b", "preliminary")]
    speeds = jc.rpm(8000, 9000, 3)
    options = dict(discard=5, revolutions=10, blocks=1, keep=2)
    together = jc.sweeps.run_up_down_designs(models, speeds, **options)
    alone = jc.run_up_down(models[1], speeds, **options)
    for side in ("up", "down"):
        got, one = getattr(together[1], side), getattr(alone, side)
        np.testing.assert_allclose(got.last / got.scale[:, None], one.last / one.scale[:, None], atol=1e-6)


# --- other devices ------------------------------------------------------------------------------------------------


def test_another_backend_runs_the_step_itself(monkeypatch):
    one = jnp.asarray(float(SPEEDS[0]))
    pieces = MODEL.at_speed(one), MODEL, MODEL.scale(one)
    assert kernel_step(ClassicalRK4(), *pieces)[0].whole
    monkeypatch.setattr(jax, "default_backend", lambda: "gpu")
    assert not kernel_step(ClassicalRK4(), *pieces)[0].whole
