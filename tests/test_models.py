"""The cage model as a whole: thresholds, limits, scaling identities, derivatives."""

import equinox as eqx
import helpers
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from helpers import wide_but

import jaxcage as jc
from jaxcage import parameters


MODELS = {
    "rigid": lambda: helpers.preliminary("2a"),
    "elastic": lambda: helpers.elastic(helpers.preliminary("1b")),
    "roller-pass": lambda: helpers.roller_pass(helpers.preliminary("3b")),
    "dimensionless cubic": lambda: jc.replace(
        helpers.preliminary("1a"), cubic_ratio=50.0, **{"support.cubic": "dimensionless"}
    ),
    "printed unbalance": lambda: jc.replace(helpers.preliminary("1a"), unbalance="as_printed"),
    "positive pressure": lambda: jc.replace(helpers.preliminary("1a"), **{"film.model": "positive_pressure"}),
    "restitution": lambda: jc.replace(helpers.preliminary("1a"), restitution=0.5),
}
METHOD = jc.method("rodas4", steps=64)


@eqx.filter_jit
def revolve(model: jc.CageModel, speed, y):
    return jnp.stack(jc.strobe_map(model, speed, METHOD)(tuple(y)).y)


def state(model: jc.CageModel, speed: float):
    y = model.initial_states(jnp.asarray(speed))[2]
    return jnp.stack([jnp.asarray(c) for c in y])


@pytest.mark.parametrize("name", wide_but(MODELS, "rigid", "restitution"))
@pytest.mark.parametrize("base", ["mass", "length", "time"])
def test_strobe_map_does_not_depend_on_units(name: str, base: str):
    """Exact scaling identity: every dimensional constant must be a parameter with the right unit."""
    model, speed, factor = MODELS[name](), 1000.0, 1.7
    other = helpers.in_other_units(model, base, factor)
    dim = model.dimension
    power = {"mass": [0.0] * dim, "length": [1.0] * dim, "time": [0.0] * (dim // 2) + [-1.0] * (dim // 2)}[base]
    units = factor ** np.array(power)
    rate = factor ** (-1.0 if base == "time" else 0.0)
    y = state(model, speed)
    here = revolve(model, jnp.asarray(speed), y)
    there = revolve(other, jnp.asarray(speed * rate), y * units)
    scale = np.array([float(c) for c in model.scale(jnp.asarray(speed))])
    assert np.max(np.abs(there / units - here) / scale) < 1e-8


@pytest.mark.wide
@pytest.mark.parametrize(
    "name", ["rigid", *(pytest.param(n, marks=pytest.mark.slow) for n in ("elastic", "restitution"))]
)
def test_strobe_map_derivatives_match_finite_differences(name: str):
    """jacfwd with respect to every parameter against central differences, in elasticities; none is NaN."""
    model, speed = MODELS[name](), jnp.asarray(900.0)
    y = state(model, 900.0)
    scale = jnp.stack([jnp.asarray(c) for c in model.scale(speed)])
    names = list(parameters(model))
    values = jnp.stack(list(parameters(model).values()))

    # Steps are shortened by how far the land is, which the derivative by its onset leaves out: with many it is nothing.
    method = jc.method("rk4", steps=4096)

    @jax.jit
    def scaled_map(shares):
        changed = jc.replace(model, **dict(zip(names, values * shares, strict=True)))
        return jnp.stack(jc.strobe_map(changed, speed, method)(tuple(y)).y) / scale

    ones = jnp.ones(len(names))
    exact = np.asarray(jax.jacfwd(scaled_map)(ones))
    assert np.all(np.isfinite(exact))
    h = 1e-6
    for i, key in enumerate(names):
        if key == "restitution" and float(values[i]) == 1.0:  # at the end of its range, where it cannot be raised
            continue
        step = h * np.eye(len(names))[i]
        central = np.asarray(scaled_map(ones + step) - scaled_map(ones - step)) / (2 * h)
        assert np.max(np.abs(central - exact[:, i])) < 1e-5 * np.max(np.abs(exact[:, i])) + 1e-7, key
    assert np.sum(np.max(np.abs(exact), axis=0) > 1e-5) >= 10


@pytest.mark.wide
def test_stiff_heavy_rib_is_the_rigid_rib():
    """Same cage, rib on a spring of 1e12 N/m: the strobe state agrees to the rib's static deflection."""
    model, speed = helpers.preliminary("1a"), jnp.asarray(1500.0)
    held = helpers.elastic(model, mass=50.0, stiffness=1e12, damping=1e5)
    rigid, moving = revolve(model, speed, state(model, 1500.0)), revolve(held, speed, state(held, 1500.0))
    cage = np.asarray(moving)[[0, 1, 4, 5]]
    scale = np.array([float(c) for c in model.scale(speed)])
    assert np.max(np.abs(cage - rigid) / scale) < 1e-5
    assert np.max(np.abs(moving[2:4])) < 1e-8


@pytest.mark.slow
@pytest.mark.parametrize("film", ["fixed_half", "positive_pressure"])
@pytest.mark.parametrize("share, grows", [(0.99, False), (1.01, True)])
def test_whirl_threshold_in_the_time_domain(film: str, share: float, grows: bool):
    """A rigid cage in its film under gravity alone, held at eps = 0.5: omega sqrt(c/g) = 2.5417 at the threshold, whirl
    at 0.5146 omega there (Routh on the short-bearing coefficients)."""
    eps, load_number, attitude, threshold = 0.5, 0.750381081812, np.deg2rad(53.68020060), 2.54170
    base = jc.replace(helpers.unforced(helpers.preliminary("1a")), **{"film.model": film})
    c, g = float(base.clearance), float(base.gravity)
    speed = share * threshold * np.sqrt(g / c)
    weight = float(base.cage_mass) * g
    viscosity = weight * c**2 / (load_number * speed * float(base.land_radius) * float(base.film.land_width) ** 3 * 2)
    density = viscosity / float(base.lubricant.kinematic_viscosity)
    model = eqx.tree_at(lambda m: m.lubricant.density, base, jnp.asarray(density))
    place = -np.pi / 2 + attitude  # from the load line in the sense of rotation
    rest = eps * c * np.array([np.cos(place), np.sin(place)])
    start = (*(rest + np.array([1e-3, 0.0]) * c), 0.0, 0.0)
    run = jc.simulate(model, speed, revolutions=400, samples=8, start=start, method=jc.method("rodas4", steps=64))
    away = np.hypot(*(run.state[:, :2] - rest).T).reshape(-1, 80)
    late = np.max(away[-4:]) / np.max(away[8:12])
    assert late > 1.5 if grows else late < 0.67
    turns = np.unwrap(np.arctan2(*(run.state[800:, :2] - rest).T[::-1]))
    assert abs(turns[-1] - turns[0]) / (run.tau[-1] - run.tau[800]) == pytest.approx(0.5146, abs=0.01)


@pytest.mark.wide
@pytest.mark.parametrize("harmonics", [1, 5])
@pytest.mark.parametrize("name", ["rigid", "elastic", "roller-pass"])
def test_harmonics_are_where_the_spectrum_of_the_forcing_ends(name: str, harmonics: int):
    model = MODELS[name]()
    if name == "roller-pass":
        model = jc.replace(model, **{"impact.harmonics": harmonics, "bearing.n_rollers": 12})
        assert model.harmonics == 12 * harmonics
    highest = model.harmonics
    speed, count = jnp.asarray(900.0), 4 * highest + 4
    y = tuple(state(model, 900.0))
    tau = 2 * np.pi * np.arange(count) / count
    rates = jax.jit(jax.vmap(lambda t: jnp.stack(model.at_speed(speed)(t, y))))(tau)
    size = np.abs(np.fft.rfft(rates[:, model.dimension // 2 :], axis=0)).max(axis=1) / count
    assert size[highest] > 1e-4 * size[1:].max()
    assert size[highest + 1 :].max() < 1e-9 * size[1:].max()


SPRING = lambda tau, q, v, speed: (-q[0] - 0.1 * v[0] + jnp.cos(tau),)


@pytest.mark.parametrize(
    "settings, said",
    [
        (dict(scale=0.0), "`scale` must be a positive finite number or 2 of them.*, but 0.0 was given"),
        (dict(scale=-1), "`scale` must be .*, but -1 was given"),
        (dict(scale=np.inf), "`scale` must be .*, but inf was given"),
        (dict(scale=(1.0,)), r"`scale` must be .* 2 of them, .*, but \(1.0,\) was given"),
        (dict(scale=()), r"`scale` must be .*, but \(\) was given"),
        (dict(scale=[1.0, -2.0]), r"`scale` must be .*, but \[1.0, -2.0\] was given"),
        (dict(scale=np.ones((2, 2))), r"`scale` must be .*, but an array of shape \(2, 2\)"),
        (
            dict(initial_states=((0.1, 0.2, 0.3),)),
            r"`initial_states` must be states of 2 finite numbers each, but \(0.1, 0.2, 0.3\) is",
        ),
        (
            dict(initial_states=((0.1, 0.2), (0.1, np.nan))),
            r"`initial_states` must be .*, but \(0.1, nan\) is among them",
        ),
        (dict(initial_states=(0.1, 0.2)), "`initial_states` must be "),
        (dict(initial_states=3.0), "`initial_states` must be "),
        (dict(harmonics=0), "`harmonics` must be a whole number from 1 to 4096, but 0 was given"),
        (dict(harmonics=5000), "`harmonics` must be .*, but 5000 was given"),
        (dict(harmonics=2.5), "`harmonics` must be a whole number, but 2.5"),
    ],
)
def test_settings_of_a_system_of_ones_own_are_compared(settings, said):
    rates = lambda tau, y, speed: (y[1], -y[0] - 0.1 * y[1] + jnp.cos(tau))
    with pytest.raises(ValueError, match=said):
        jc.ForcedOscillator(SPRING, 1, **settings)
    with pytest.raises(ValueError, match=said):
        jc.ForcedSystem(rates, 2, **settings)


class Driven(eqx.Module):
    """A pendulum that is driven at a multiple of the revolution."""

    multiple: jax.Array

    def __call__(self, tau, q, v, speed):
        return (-0.1 * v[0] - 1e6 * jnp.sin(q[0]) + 0.3 * jnp.cos(self.multiple * tau),)


@pytest.mark.parametrize("multiple", [1.5, 0.5, 1.01, jnp.sqrt(2.0), 1 / 3])
def test_a_law_that_does_not_repeat_is_refused(multiple):
    """The phase begins anew every revolution: its motion would be another one, and nothing said so."""
    with pytest.raises(
        ValueError, match=r"The law `acceleration.* must repeat after one revolution \(tau -> tau \+ 2 pi"
    ):
        jc.ForcedOscillator(Driven(jnp.asarray(multiple)), coordinates=1)
    with pytest.raises(ValueError, match="The law `rates.*take the slowest forcing as the revolution"):
        jc.ForcedSystem(lambda tau, y, speed: (-y[0] + jnp.cos(multiple * tau),), 1)
    with pytest.raises(ValueError, match="must repeat after one revolution"):  # in time
        jc.ForcedSystem(lambda tau, y, speed: (-y[0] + jnp.cos(3 * tau / speed),), 1)


SMOOTH = jc.case("1a")


@pytest.mark.parametrize(
    "change, said",
    [
        (
            {"contact.smoothing": 1e-5, "guidance_gap": 1e-5},
            "`contact.smoothing` .* 0.01 mm, but is 0.01 mm",
        ),
        ({"film.smoothing": 9e-6, "guidance_gap": 8e-5}, "`film.smoothing` .* clearance, 0.08 mm, but is 0.009 mm"),
        ({"contact.smoothing": 6e-6, "guidance_gap": 1e-4, "clearance_reading": "radial"}, "clearance, 0.05 mm"),
        ({"contact": jc.replace(SMOOTH.contact, smoothing=1e-5), "guidance_gap": 5e-5}, "`contact.smoothing`"),
    ],
)
def test_smoothing_beyond_a_tenth_of_the_clearance_is_refused(change: dict, said: str):
    with pytest.raises(ValueError, match=said):
        jc.replace(SMOOTH, **change)
    eqx.filter_jit(lambda gap: jc.replace(SMOOTH, **{**change, "guidance_gap": gap}).clearance)(jnp.asarray(1e-5))
    jax.vmap(lambda gap: jc.replace(SMOOTH, **{**change, "guidance_gap": gap}).clearance)(jnp.array([1e-5, 1e-3]))
    jax.grad(lambda gap: jc.replace(SMOOTH, **{**change, "guidance_gap": gap}).clearance)(1e-5)
