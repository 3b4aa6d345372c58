"""The cage model as a whole: scaling identities, derivatives, settings that are refused."""

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
