"""Steps as one compiled loop over the lanes: values, tangents, error control, other devices."""

import dataclasses
import functools

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxcage as jc
from jaxcage.integrate import (
    ClassicalRK4,
    ControlledSteps,
    Rodas3,
    Rodas4,
    StrobeLanes,
    controlled,
    is_lanewise,
    lanewise,
    method,
    strobe_map,
)
from jaxcage.integrate._device import steps_on_device
from jaxcage.integrate._kernel import Step, run_steps, start_lane
from jaxcage.models._field import _columns
from jaxcage.sweeps import _engine
from jaxcage.sweeps._engine import compiled


MODEL = jc.case("1a", "preliminary")
SPEEDS = jc.rpm(4000, 27000, 6)
CLEARANCE = float(MODEL.clearance)
# Inside the film, at the onset of contact, and pressed into the rib.
STATES = np.array([[0.3, -0.5, 0.1, 0.2], [0.0, -0.97, 0.0, 0.0], [0.6, 0.77, -0.2, 0.3]] * 2)
STATES = STATES * np.stack([CLEARANCE * np.array([1, 1, w, w]) for w in SPEEDS])


slow = functools.partial(pytest.param, marks=pytest.mark.slow)


def lane_state(states):
    return tuple(jnp.asarray(c) for c in np.asarray(states).T)


# --- the compiled loop --------------------------------------------------------------------------------------------


def test_lanewise_gives_each_lane_its_value():
    f = lambda shared, lane: (shared[0] - 3 * lane[0], jnp.sin(lane[1]) * shared[1] + lane[0])
    x, y = jnp.linspace(-1, 2, 7), jnp.linspace(0, 3, 7)
    first, second = lanewise(f, (2.0, 0.5), (x, y))
    np.testing.assert_allclose(first, 2 - 3 * x, rtol=1e-15)
    np.testing.assert_allclose(second, np.sin(y) * 0.5 + x, rtol=1e-15)


@pytest.mark.parametrize(
    "f, plain",
    [
        (lambda s, x: (jnp.where(x[0] > s[0], jnp.exp(x[0]), 0.0),), True),
        (lambda s, x: (jnp.sum(jnp.stack([x[0], s[0]])),), False),  # arrays
        (lambda s, x: (jax.lax.fori_loop(0, 3, lambda i, v: v * s[0], x[0]),), False),  # control flow
        (lambda s, x: (jnp.asarray([1.0, 2.0])[0] * x[0],), False),  # a caught array
    ],
)
def test_what_can_be_one_loop(f, plain):
    assert is_lanewise(f, 1, 1) == plain


def test_a_caught_tracer_cannot_be_in_the_loop():
    seen = []

    def outer(a):
        seen.append(is_lanewise(lambda s, x: (a * x[0],), 1, 1))
        return a

    jax.make_jaxpr(outer)(1.0)
    assert seen == [False]


# --- against the strobe map, which does not use it ------------------------------------------------------------------


def by_lanes(chosen, directions=()):
    @compiled
    def run(model, speed, y, tangents):
        moved = StrobeLanes.of(model, chosen, speed).revolution(y, tangents)
        return jnp.stack(moved.y), [jnp.stack(t) for t in moved.tangents], moved.peak, moved.level

    tangents = tuple(lane_state(np.broadcast_to(d, STATES.shape)) for d in directions)
    return run(MODEL, jnp.asarray(SPEEDS), lane_state(STATES), tangents)


@eqx.filter_jit
def by_map(chosen, speed, y, direction):
    image = lambda y: jnp.stack(strobe_map(MODEL, speed, chosen)(tuple(y)).y)
    return jax.jvp(image, (y,), (direction,))


@pytest.mark.parametrize("name", ["rk4", "tsit5", "rodas3", "rodas4"])
def test_kernels_give_the_strobe_map_and_its_derivative(name):
    """Two programs for one method: the loop of kernels, and the solver's own step under `jax.jvp`."""
    chosen = method(name, steps=256)
    direction = np.array([1.0, -0.4, 300.0, 200.0])
    y, (tangent,), peak, _ = by_lanes(chosen, [direction])
    for i, (speed, state) in enumerate(zip(SPEEDS, STATES, strict=True)):
        image, slope = by_map(chosen, speed, jnp.asarray(state), jnp.asarray(direction))
        scale = CLEARANCE * np.array([1, 1, speed, speed])
        np.testing.assert_allclose(y[:, i] / scale, image / scale, rtol=0, atol=1e-9)
        np.testing.assert_allclose(tangent[:, i], slope, rtol=0, atol=1e-7 * np.abs(slope).max())
    assert np.all(peak >= 0)


def test_first_order_systems_and_oscillators_run_as_kernels():
    def oscillator(tau, q, v, speed):
        (x,), (u,) = q, v
        return (-0.2 * u - x - 0.1 * x**3 + 0.3 * jnp.cos(tau),)

    def rates(tau, y, speed):
        (a,) = oscillator(tau, y[:1], y[1:], speed)
        return (y[1], a)

    ends = []
    for system in (jc.ForcedOscillator(oscillator, coordinates=1), jc.ForcedSystem(rates, 2)):
        got = jc.sweep(system, np.array([0.9, 1.1]), discard=0, revolutions=4, blocks=1, exponents=2, keep=1)
        assert not np.any(got.failed)
        ends.append((got.last, got.exponents))
        trace = np.broadcast_to(-0.2 * 2 * np.pi / got.speed[:, None], (2, 3))
        np.testing.assert_allclose(np.sum(got.exponents, -1), trace, rtol=1e-5)
    np.testing.assert_allclose(ends[0][0], ends[1][0], atol=1e-9)
    np.testing.assert_allclose(ends[0][1], ends[1][1], atol=1e-7)


@pytest.mark.parametrize("film", ["fixed_half", "full"])
@pytest.mark.parametrize("cross", ["circulatory", "as_printed"])
def test_analytic_slopes_of_the_cage_against_autodiff(film, cross):
    model = jc.replace(MODEL, supply_pressure=2e4, restitution=0.6, cross_cubic=1e9)
    changed = dataclasses.replace(model.film, model=film), dataclasses.replace(model.support, cross=cross)
    model = eqx.tree_at(lambda m: (m.film, m.support), model, changed)
    law = model.at_speed(1200.0).acceleration
    rng = np.random.default_rng(3)
    for eps in (0.2, 0.9, 0.9699, 0.97, 0.9703, 0.99):
        angle = rng.uniform(0, 2 * np.pi)
        q = tuple(jnp.asarray(eps * CLEARANCE * c) for c in (np.cos(angle), np.sin(angle)))
        v = tuple(jnp.asarray(c) for c in rng.normal(size=2) * CLEARANCE * 600)
        of_q = np.array(_columns(lambda z: law(0.3, z, v), q))
        of_v = np.array(_columns(lambda z: law(0.3, q, z), v))
        found_q, found_v = map(np.array, law.slopes(q, v))
        np.testing.assert_allclose(found_q, of_q, rtol=0, atol=1e-8 * np.abs(of_q).max())  # film smoothing 2e-6 of c
        np.testing.assert_allclose(found_v, of_v, rtol=0, atol=1e-8 * np.abs(of_v).max())


def test_the_positive_pressure_film_is_left_to_autodiff():
    film = dataclasses.replace(MODEL.film, model="positive_pressure")
    law = eqx.tree_at(lambda m: m.film, MODEL, film).at_speed(1200.0).acceleration
    assert law.slopes((1e-5, 1e-5), (0.0, 0.0)) is None


# --- monodromy matrices -------------------------------------------------------------------------------------------


@pytest.mark.slow
def test_monodromy_matrices_against_the_strobe_map():
    chosen = method("rodas4", steps=256)
    image, matrix = jc.monodromy(MODEL, SPEEDS, STATES, method=chosen)
    for i in (0, 2, 4):
        strobe = lambda y: jnp.stack(strobe_map(MODEL, SPEEDS[i], chosen)(tuple(y)).y)
        exact = np.asarray(jax.jit(jax.jacfwd(strobe))(jnp.asarray(STATES[i])))
        unit = np.array([1, 1, SPEEDS[i], SPEEDS[i]])
        np.testing.assert_allclose(matrix[i] * unit / unit[:, None], exact * unit / unit[:, None], atol=1e-7)
        after = np.asarray(strobe(jnp.asarray(STATES[i])))
        np.testing.assert_allclose(image[i] / unit / CLEARANCE, after / unit / CLEARANCE, rtol=0, atol=1e-9)


def test_monodromy_of_bad_shapes_and_failed_lanes():
    with pytest.raises(ValueError, match="4 numbers for each of the 6 speeds"):
        jc.monodromy(MODEL, SPEEDS, STATES[:, :3])
    states = STATES.copy()
    states[1] = np.nan
    image, matrix = jc.monodromy(MODEL, SPEEDS, states)
    assert np.all(np.isnan(image[1])) and np.all(np.isnan(matrix[1]))
    others = [0, 2, 3, 4, 5]
    good = jc.monodromy(MODEL, SPEEDS, STATES)
    np.testing.assert_array_equal(image[others], good[0][others])
    np.testing.assert_array_equal(matrix[others], good[1][others])


# --- error control ------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def attractor():
    speeds = jc.rpm(4000, 27000, 24)
    last = jc.sweep(MODEL, speeds, discard=150, revolutions=10, blocks=1, exponents=0, keep=1).last
    return speeds, last


def one_revolution(speeds, states, chosen):
    return jc.sweep(
        MODEL, speeds, starts=states, method=chosen, discard=0, revolutions=1, blocks=1, exponents=0, keep=1
    )


def test_controlled_steps_reach_1e_4_of_the_clearance(attractor):
    """The default of sweeps, over states on the attractors of case 1a, against 8192 steps."""
    speeds, states = attractor
    truth = one_revolution(speeds, states, method("rodas4", steps=8192))
    got = one_revolution(speeds, states, controlled())
    error = np.max(np.abs(got.last - truth.last)[..., :2], axis=-1) / CLEARANCE
    assert not np.any(got.failed)
    assert np.quantile(error, 0.95) < 1e-4
    assert error.max() < 5e-4
    coarse = one_revolution(speeds, states, method("rk4", steps=128))
    assert np.nanmax(np.abs(coarse.last - truth.last)[..., :2]) / CLEARANCE > 1e-3  # the control has work to do


@pytest.mark.slow
def test_a_lane_takes_the_rung_that_it_needs():
    """The same end as fixed steps of the rung it took, to the rounding of hundreds of steps."""
    chosen = controlled()
    y, _, _, level = by_lanes(chosen)
    assert set(np.asarray(level).tolist()) > {0}
    for rung, (solver, steps) in enumerate(chosen.rungs):
        name = {ClassicalRK4: "rk4", Rodas4: "rodas4"}[type(solver)]
        fixed = by_lanes(method(name, steps=steps))[0]
        mine = np.asarray(level) == rung
        np.testing.assert_allclose(np.asarray(y)[:, mine], np.asarray(fixed)[:, mine], rtol=1e-10)


def test_stiff_lanes_end_on_the_l_stable_rung():
    """A damping of 1e6 per radian: no explicit rung can hold it, and the answer is that of a fine stiff method."""

    def stiff(tau, q, v, speed):
        (x,), (u,) = q, v
        return (-1e6 * (u - jnp.cos(tau)) - x,)

    system = jc.ForcedOscillator(stiff, coordinates=1)
    run = lambda chosen: jc.sweep(
        system, 1.0, starts=[(0.1, 1.0)], method=chosen, discard=0, revolutions=2, blocks=1, exponents=0, keep=1
    )
    got, fine = run(None), run(method("rodas4", steps=4096))
    assert not np.any(got.failed)
    np.testing.assert_allclose(got.last, fine.last, atol=1e-5)
    assert np.any(run(method("rk4", steps=768)).failed)


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
        (dict(ladder=()), "must be made of"),
        (dict(ladder=(("newmark", 64),)), "must be made of"),
        (dict(ladder=(("euler", 64),)), "must be made of"),
        (dict(error=0.0), "must be positive"),
    ],
)
def test_bad_ladders(arguments, sentence):
    with pytest.raises(ValueError, match=sentence):
        controlled(**arguments)


def test_parts_of_a_controlled_revolution_must_divide_its_steps():
    chosen = controlled(ladder=(("rk4", 96),))
    assert isinstance(chosen, ControlledSteps)
    with pytest.raises(ValueError, match="must divide the 96 steps"):
        strobe_map(MODEL, SPEEDS[0], chosen).part(tuple(STATES[0]), 0, 64)


# --- the engine ---------------------------------------------------------------------------------------------------


def test_results_do_not_depend_on_chunks_cores_or_lane_order(monkeypatch):
    """To the last bit."""
    speeds = jc.rpm(9000, 26000, 40)
    run = lambda: jc.sweep(MODEL, speeds, discard=20, revolutions=10, blocks=1, keep=4)
    fields = ("strobe", "last", "block_growth", "peak", "outcome")
    expected = run()
    for chunk, cores in ((16, 1), (16, 2), (128, 1)):
        monkeypatch.setattr(_engine, "CHUNKS", (chunk,))
        monkeypatch.setattr(_engine, "cores", lambda cores=cores: cores)
        got = run()
        for field in fields:
            np.testing.assert_array_equal(getattr(got, field), getattr(expected, field), err_msg=f"{chunk} {field}")


def test_several_designs_in_one_batch_give_what_each_gives_alone():
    models = [MODEL, jc.replace(MODEL, guidance_gap=0.5e-3), jc.case("2b", "preliminary")]
    speeds = jc.rpm(8000, 24000, 5)
    options = dict(discard=2, revolutions=2, blocks=1, keep=2)  # chaos doubles rounding every few revolutions
    together = jc.sweep_designs(models, speeds, **options)
    assert len(together) == 3
    for model, got in zip(models, together, strict=True):
        alone = jc.sweep(model, speeds, **options)
        np.testing.assert_array_equal(got.outcome, alone.outcome)
        np.testing.assert_allclose(
            got.strobe / got.scale[:, None, None], alone.strobe / alone.scale[:, None, None], atol=1e-6
        )
    with pytest.raises(ValueError, match="at least one system"):
        jc.sweep_designs([], speeds)
    other = eqx.tree_at(lambda m: m.film, MODEL, dataclasses.replace(MODEL.film, model="full"))
    with pytest.raises(ValueError, match="differ in their numbers only"):
        jc.sweep_designs([MODEL, other], speeds)


@pytest.mark.slow
def test_run_up_and_down_of_several_designs():
    models = [MODEL, jc.case("1b", "preliminary")]
    speeds = jc.rpm(8000, 9000, 3)
    options = dict(discard=5, revolutions=10, blocks=1, keep=2)
    together = jc.run_up_down_designs(models, speeds, **options)
    alone = jc.run_up_down(models[1], speeds, **options)
    for side in ("up", "down"):
        got, one = getattr(together[1], side), getattr(alone, side)
        np.testing.assert_allclose(got.last / got.scale[:, None], one.last / one.scale[:, None], atol=1e-6)


# --- other devices ------------------------------------------------------------------------------------------------


def pieces(solver, tangents):
    speed = jnp.asarray(np.resize(SPEEDS, 200))
    maps = StrobeLanes.of(MODEL, method("rodas4"), speed)
    y = lane_state(np.resize(STATES, (200, 4)))
    direction = tuple(jnp.ones(200) for _ in range(4))
    return maps._pieces(), start_lane(solver, y, (direction,) * tangents)


@pytest.mark.parametrize(
    "solver, tangents", [(ClassicalRK4(), 0), slow(ClassicalRK4(), 2), (Rodas3(), 0), slow(Rodas4(), 0)]
)
def test_the_gpu_kernel_in_interpret_mode(solver, tangents):
    """Blocks with a lane that asks for it go through all steps; the others stay where they are."""
    numbers, lane = pieces(solver, tangents)
    mine = jnp.arange(200) < 100
    expected = compiled(lambda lane: run_steps(solver, numbers, lane, 0.02, 12, True))(lane).row()
    step = Step.of(solver, numbers, lane, True)
    got = steps_on_device(step, numbers.shared, lane.row(), numbers.own, 0.02, 12, mine, interpret=True)
    for new, old, ran in zip(got, lane.row(), expected, strict=True):
        scale = np.nanmax(np.abs(ran)) + 1e-300
        np.testing.assert_allclose(new[:128] / scale, ran[:128] / scale, atol=1e-11)
        np.testing.assert_array_equal(new[128:], old[128:])


@pytest.mark.parametrize("solver, tangents", [(ClassicalRK4(), 0), (ClassicalRK4(), 4), (Rodas4(), 1)])
def test_the_gpu_kernel_translates_for_cuda(solver, tangents):
    """Every operation of the step has its counterpart in Triton; no GPU is needed to see that."""
    numbers, lane = pieces(solver, tangents)
    step = Step.of(solver, numbers, lane, True)
    run = jax.jit(lambda row: steps_on_device(step, numbers.shared, row, numbers.own, 0.02, 12, jnp.ones(200, bool)))
    assert "triton" in run.trace(lane.row()).lower(lowering_platforms=("cuda",)).as_text()
