"""Steps as one compiled loop over the lanes: values, tangents, error control."""

import functools

import diffrax as dfx
import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from helpers import even, preliminary, raw_sweep, wide_but

import jaxcage as jc
from jaxcage._pytrees import compiled
from jaxcage.analysis import failed
from jaxcage.solve import march, method, native, strobe_map
from jaxcage.solve.kernel import EXPLICIT, explicit_step, rosenbrock_step


MODEL = preliminary("1a")
SPEEDS = jc.rpm(4000, 27000, 6)
CLEARANCE = float(MODEL.clearance)
# Inside the film, at the onset of contact, and pressed into the rib.
STATES = np.array([[0.3, -0.5, 0.1, 0.2], [0.0, -0.97, 0.0, 0.0], [0.6, 0.77, -0.2, 0.3]] * 2)
STATES = STATES * np.stack([CLEARANCE * np.array([1, 1, w, w]) for w in SPEEDS])


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
    (x, v), (peak,) = march(heun, count, (z[0], z[1]), (0.0,), (2 * np.pi / 200, z[2]))
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


def test_each_lane_may_take_another_number_of_steps():
    counts = jnp.array([0, 3, 48, 5, 1, 12, 2])
    each = [by_loop(z, int(count)) for z, count in zip(LANES, counts, strict=True)]
    got, peak = jax.vmap(by_march)(LANES, counts)
    np.testing.assert_allclose(got, [z for z, _ in each], rtol=1e-12)
    np.testing.assert_allclose(peak, [p for _, p in each], rtol=1e-12)
    slope = lambda z, count: jax.jacfwd(lambda z: by_march(z, count)[0])(z)
    np.testing.assert_allclose(jax.vmap(slope)(LANES, counts)[2], slope(LANES[2], 48), rtol=1e-12)
    assert jax.vmap(by_march)(LANES[:0], counts[:0])[0].shape == (0, 2)


@pytest.mark.wide
@pytest.mark.parametrize("order, tolerance", [(1, 1e-12), (2, 1e-10), (3, 1e-8)])
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


# --- lanes against one lane alone, step by step by the solver -------------------------------------------------------


EVEN = even(MODEL)


def by_lanes(chosen, directions=()):
    @compiled
    def run(model, speed, y, tangents):
        one = lambda s, y, t: strobe_map(model, s, chosen)(y, [(one, None) for one in t])
        return jax.vmap(one)(speed, y, tangents)

    tangents = tuple(lane_state(np.broadcast_to(d, STATES.shape)) for d in directions)
    moved = run(EVEN, jnp.asarray(SPEEDS), lane_state(STATES), tangents)
    return jnp.stack(moved.y), [jnp.stack(t) for t in moved.tangents], moved.peak


@eqx.filter_jit
def by_solver(chosen, speed, y, direction):
    """The solver's own steps, one after the other, those of Tsitouras' method as diffrax takes them."""
    field, h = EVEN.at_speed(speed), 2 * np.pi / chosen.steps
    term, tsit5 = dfx.ODETerm(lambda tau, y, _: field(tau, y)), dfx.Tsit5(scan_kind="lax")

    def step(i, y):
        t = i.astype(float) * h
        if chosen.solver == "tsit5":
            return tsit5.step(term, t, t + h, y, None, tsit5.init(term, t, t + h, y, None), False)[0]
        if chosen.solver == "rk4":
            return explicit_step(EXPLICIT["rk4"], field, t, lambda _: h, y)[0]
        return rosenbrock_step(field, t, lambda _: h, y)[0]

    def image(y):
        return jnp.stack(jax.lax.fori_loop(0, chosen.steps, step, tuple(y)))

    return jax.jvp(image, (y,), (direction,))


@pytest.mark.parametrize("name", wide_but(["rk4", "tsit5", "rodas4"], "rk4"))
def test_kernels_give_the_strobe_map_and_its_derivative(name):
    """Two programs for one method: the loop of kernels, and the solver's own step under `jax.jvp`."""
    chosen = method(name, steps=256)
    direction = np.array([1.0, -0.4, 300.0, 200.0])
    y, (tangent,), peak = by_lanes(chosen, [direction])
    for i, (speed, state) in enumerate(zip(SPEEDS, STATES, strict=True)):
        image, slope = by_solver(chosen, speed, jnp.asarray(state), jnp.asarray(direction))
        scale = CLEARANCE * np.array([1, 1, speed, speed])
        np.testing.assert_allclose(y[:, i] / scale, image / scale, rtol=0, atol=1e-9)
        np.testing.assert_allclose(tangent[:, i], slope, rtol=0, atol=1e-7 * np.abs(slope).max())
    assert np.all(peak >= 0)


def test_reverse_mode_is_refused_in_a_sentence():
    image = lambda speed: strobe_map(MODEL, speed, method("rk4", steps=16))(tuple(STATES[0])).y[0]
    with pytest.raises(ValueError, match="A trajectory must be differentiated in forward mode"):
        jax.grad(image)(SPEEDS[0])
    with pytest.raises(ValueError, match="A trajectory must be differentiated in forward mode"):
        jax.jit(jax.grad(image))(SPEEDS[0])
    assert np.isfinite(jax.jacfwd(image)(SPEEDS[0]))


# --- error control ------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def attractor():
    speeds = jc.rpm(4000, 27000, 24)
    settling = dict(discard=150, revolutions=10, blocks=1, exponents=0, keep=1)
    last = raw_sweep(MODEL, speeds, method=method("rk4", steps=512), **settling).last.values
    return speeds, last


def one_revolution(speeds, states, chosen):
    return raw_sweep(
        MODEL, speeds, initial_states=states, method=chosen, discard=0, revolutions=1, blocks=1, exponents=0, keep=1
    )


@pytest.mark.wide
def test_the_default_reaches_1e_4_of_the_clearance(attractor):
    """The default of sweeps, over states on the attractors of case 1a, against 8192 steps."""
    speeds, states = attractor
    truth = one_revolution(speeds, states, method("rodas4", steps=8192))
    got = one_revolution(speeds, states, native())
    error = np.max(np.abs(got.last - truth.last).values[..., :2], axis=-1) / CLEARANCE
    assert not np.any(failed(got))
    assert np.quantile(error, 0.95) < 1e-4
    assert error.max() < 5e-4
    coarse = one_revolution(speeds, states, method("rk4", steps=64))
    assert np.nanmax(np.abs(coarse.last - truth.last).values[..., :2]) / CLEARANCE > 1e-3  # the control has work to do


@pytest.mark.wide
@pytest.mark.parametrize("name", ["dopri5", "bosh3", "dopri8", "rodas4"])
def test_methods_in_machine_code_agree(attractor, name):
    """Each beside 8192 steps, to the error that it states."""
    speeds, states = attractor
    truth = one_revolution(speeds, states, method("rodas4", steps=8192))
    got = one_revolution(speeds, states, native(1e-8, pair=name))
    error = np.max(np.abs(got.last - truth.last).values / got.scale.values, axis=-1)
    assert not np.any(failed(got)) and np.all(error <= got.error.values + 1e-8)


@pytest.mark.wide
def test_a_stiff_law_is_left_to_the_implicit_method():
    """Prothero and Robinson's problem, whose solution is cos(tau): stable explicit steps would be 1e-6 long."""
    system = jc.ForcedSystem(lambda tau, y, speed: (-1e6 * (y[0] - jnp.cos(tau)) - speed * jnp.sin(tau),), 1)
    got = raw_sweep(
        system, np.array([1.0]), initial_states=[(0.7,)], discard=0, revolutions=2, blocks=1, exponents=0, keep=2
    )
    assert got.outcome.item() == "successful" and abs(got.last.values[0, 0, 0] - 1) < 1e-6


@pytest.mark.wide
def test_what_no_tolerance_can_is_inaccurate(attractor):
    """It is neither a failure nor a label."""
    speeds, states = attractor
    got = one_revolution(speeds[:3], states[:3], native(1e-4, error=1e-14))
    assert np.all(got.outcome == "inaccurate") and np.all(got.label == "inaccurate")
    assert np.all(got.error > 1e-14)


@pytest.mark.parametrize(
    "arguments, sentence",
    [
        (dict(tolerance=2.0), "between 0 and 1"),
        (dict(pair="euler"), "must be one of"),
        (dict(error=0.0), "must be positive"),
    ],
)
def test_bad_settings(arguments, sentence):
    with pytest.raises(ValueError, match=sentence):
        native(**arguments)


# --- the engine ---------------------------------------------------------------------------------------------------


@pytest.mark.wide
def test_several_designs_in_one_batch_give_what_each_gives_alone():
    models, speeds = [MODEL, jc.replace(MODEL, guidance_gap=0.5e-3), preliminary("2b")], jc.rpm(8000, 24000, 5)
    options = dict(discard=2, revolutions=2, blocks=1, keep=2)  # chaos doubles rounding every few revolutions
    together = raw_sweep(models, speeds, **options)
    for i, model in enumerate(models):
        got, alone = together.isel(design=i), raw_sweep(model, speeds, **options)
        np.testing.assert_array_equal(got.outcome, alone.outcome)
        np.testing.assert_allclose((got.strobe / got.scale).values, (alone.strobe / alone.scale).values, atol=1e-6)
