"""Python that helps: ranges, revolutions per minute, printed models, traced sweeps, laws of one's own."""

import math

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxcage as jc
from jaxcage.io import ConfigError, model_from


CASE = jc.case("1a")


@pytest.mark.parametrize(
    "name, value, said",
    [
        ("guidance_gap", 0.5, "must be a number from 1e-05 to 0.005 m, but is 0.5 m"),
        ("guidance_gap", -1e-4, "must be a number from 1e-05 to 0.005 m, but is -0.0001 m"),
        ("cage_mass", math.nan, "must be a number from 0.001 to 100 kg, but is nan kg"),
        ("onset", 97.0, "must be a number from 0.5 to 0.999, but is 97"),
    ],
)
def test_replace_refuses_in_the_words_of_a_file(name: str, value: float, said: str):
    with pytest.raises(ValueError, match=f"Argument `{name}` {said}"):
        jc.replace(CASE, **{name: value})
    if name != "onset":
        with pytest.raises(ConfigError, match=f"`{name}` {said}"):
            model_from({"base": "1a", name: value})


@pytest.mark.parametrize(
    "run",
    [
        lambda: jc.sweep(CASE, np.array([8500.0, 9000.0])),
        lambda: jc.simulate(CASE, 9000.0, revolutions=1),
        lambda: jc.ramp(CASE, 900.0, 9000.0, revolutions=1),
        lambda: jc.periodic_orbit(CASE, 9000.0),
    ],
    ids=["sweep", "simulate", "ramp", "periodic_orbit"],
)
def test_revolutions_per_minute_for_radians_are_refused(run):
    with pytest.raises(ValueError, match=r"must be in rad/s, .* but 9000 was given, .* `jaxcage.rpm\(9000\)`"):
        run()


def test_a_printed_model_shows_values_units_and_sources():
    text = str(CASE)
    lines = {line.split()[0]: line.split(maxsplit=3) for line in text.splitlines()[1:]}
    assert lines["guidance_gap"][1:3] == ["0.00045", "m"] and lines["guidance_gap"][3].startswith("drawing")
    assert lines["support.stiffness_x"][1:3] == ["139446", "N/m"]
    assert lines["support.stiffness_x"][3].startswith("unknown, 10000 to 1e+06 if not measured: tap the cage")
    assert lines["lubricant.viscosity_1"][3].startswith("oil") and "f64[" not in text
    assert "c = C_r, as the paper uses it" in text


def chaotic_speeds(gap):
    return jc.sweep(jc.replace(CASE, guidance_gap=gap), np.array([900.0])).exponents[0, 0, 0]


@pytest.mark.parametrize(
    "run",
    [
        lambda: jax.grad(chaotic_speeds)(4.5e-4),
        lambda: jax.vmap(chaotic_speeds)(jnp.array([4e-4, 5e-4])),
        lambda: jax.jit(chaotic_speeds)(4.5e-4),
        lambda: jax.vmap(lambda w: jc.simulate(CASE, w, revolutions=1).state)(jnp.array([900.0, 950.0])),
    ],
    ids=["grad", "vmap", "jit", "simulate"],
)
def test_what_steers_by_its_findings_says_what_to_call_instead(run):
    with pytest.raises(ValueError, match="must be known numbers, but are traced by .*`jaxcage.sweep_designs"):
        run()


@pytest.mark.parametrize(
    "law, said",
    [
        (lambda tau, q, v, speed: (np.cos(tau) - q[0],), "must be made of functions of `jax.numpy`"),
        (lambda tau, q, v, speed: (math.cos(tau) - q[0],), "must be made of functions of `jax.numpy`"),
        (lambda tau, q, v, speed: (-q[0] if q[0] > 0 else q[0],), r"`jnp.where\(x > 0, a, b\)`"),
        (lambda tau, q, v, speed: -q[0], r"must return a tuple of 1 scalar, .*: a single one is written `\(a,\)`"),
        (lambda tau, q, v, speed: (-q[0], -v[0]), "must return a tuple of 1 scalar, .* but returned 2"),
        (lambda tau, q, v, speed: (jax.lax.complex(jnp.cos(tau), q[0]),), "one of them is complex: take `jnp.real`"),
        (lambda tau, q, v, speed: (-jnp.stack(q),), r"but one of them has shape \(1,\)"),
        (lambda tau, q, v, speed: None, r"but returned nothing \(is there a `return`\?\)"),
    ],
)
def test_a_law_of_ones_own_that_is_wrong_is_explained(law, said: str):
    system = jc.ForcedOscillator(law, coordinates=1)
    with pytest.raises(ValueError, match="The law `acceleration.*" + said):
        jc.simulate(system, 1.0, revolutions=1, method=jc.method("rk4", steps=64))
