"""The package against the reference: the whole model written a second time, and its integrals by quadrature."""

import math

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
import reference
from helpers import wide_but

import jaxcage as jc
from jaxcage.forces import pulse_spectrum
from jaxcage.lanes import start_tangents


def as_state(y):
    return tuple(map(jnp.asarray, y))


FIRST = False, (0, 1, 2, 3, 10)


@pytest.mark.parametrize("wide, seeds", wide_but([FIRST, (False, range(4, 10)), (True, range(10))], FIRST))
def test_accelerations_of_random_models_inside_and_in_contact(wide, seeds):
    """The first few have every film, reading and form of support, an elastic rib, and impacts of both kinds."""
    for seed in seeds:
        model, speed = reference.random_model(seed, wide), reference.random_speeds(seed, 1, wide)[0]
        ours, theirs = model.at_speed(jnp.asarray(speed)), reference.field(model, speed)
        for i, reach in enumerate((0.5, 0.95, 1.1, 1.1)):
            y = reference.random_state(10 * seed + i, theirs, reach)
            found = np.array([float(c) for c in ours(jnp.asarray(0.7), as_state(y))])
            expected = np.array(theirs(0.7, y.tolist()))
            for k in range(0, theirs.coordinates, 2):  # cage and rib, each against the size of its own acceleration
                part = slice(theirs.coordinates + k, theirs.coordinates + k + 2)
                size = np.linalg.norm(expected[part])
                np.testing.assert_allclose(found[part], expected[part], rtol=0, atol=1e-9 * size, err_msg=f"{seed} {y}")


@pytest.mark.wide
def test_pulses_of_rollers():
    """At 27500 rpm they overlap."""
    model = jc.replace(jc.case("1a"), impact=jc.forces.RollerPassImpact(jc.forces.PocketImpact()))
    phases = np.linspace(0, 2 * np.pi / 13, 50)
    at = lambda speed, tau: model.cage_at(speed).forces(tau, 0.0, 0.0, 0.0, 0.0)["impact"][:2]
    force = eqx.filter_jit(lambda speed: jax.vmap(lambda tau: at(speed, tau))(jnp.asarray(phases)))
    for speed in (300.0, 2880.0):
        found, theirs = np.stack(force(jnp.asarray(speed)), axis=1), reference.field(model, speed)
        expected = np.array([theirs.impact(tau) for tau in phases])
        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-10 * np.abs(expected).max())


OSCILLATOR = {"contact_stiffness": 2e8, "bar_stiffness": 2.5e6, "bar_mass": 4e-3, "approach_ratio": 0.45}
LIMITS = {
    name: (info.lower, info.upper)
    for name, info in jc.parameter_info(jc.forces.PocketImpact()).items()
    if name in OSCILLATOR
}
spectrum = eqx.filter_jit(pulse_spectrum)


BOUNCING = {"contact_stiffness": 1e13, "bar_stiffness": 1e5}  # it bounces from the bar, and meets it again
SLOW, FAST, HEAVY = {"omega": 30.0}, {"omega": 6300.0}, {"roller_mass": 5.0}
EXTREMES = [
    *({name: limit} for name, limits in LIMITS.items() for limit in limits),
    BOUNCING,
    HEAVY,
    {"roller_mass": 1e-6},
    SLOW,
    FAST,
    {"pocket_clearance": 1e-2},
    {"pocket_clearance": 1e-9},
]


@pytest.mark.wide
@pytest.mark.parametrize("changed", EXTREMES, ids=str)
def test_spectrum_of_a_pulse_at_the_ends_of_the_ranges(changed):
    given = {"roller_mass": 0.0423, "pocket_clearance": 3e-4, "omega": 1000.0, **OSCILLATOR, **changed}
    oscillator, omega, clearance = {name: given[name] for name in OSCILLATOR}, given["omega"], given["pocket_clearance"]
    law, mass = jc.forces.RollerPassImpact(jc.forces.PocketImpact(**oscillator), harmonics=128), given["roller_mass"]
    cosine, sine = map(np.asarray, spectrum(law, jnp.asarray(omega), 13, jnp.asarray(mass), jnp.asarray(clearance)))
    waves = 13 * omega * np.arange(129)
    speed = oscillator["approach_ratio"] * omega * clearance
    hit = reference.pulse(oscillator, mass, speed, fastest=float(waves[-1]))
    expected = np.exp(1j * np.outer(waves, hit.time)) @ (hit.force * hit.weight) * 13 * omega / math.pi
    expected[0] /= 2
    found = cosine + 1j * sine
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-9 * np.abs(expected).max())


def test_an_impact_on_a_stiff_bar():
    """It turns the roller round, and takes the time of a Hertz contact with the force K d^(10/9)."""
    stiffness, mass, speed = 2e8, 0.04, 0.2
    hit = reference.pulse({"contact_stiffness": stiffness, "bar_stiffness": 1e10, "bar_mass": 1e-2}, mass, speed)
    assert hit.force @ hit.weight == pytest.approx(2 * mass * speed, rel=1e-3)
    depth = (19 / 18 * mass * speed**2 / stiffness) ** (9 / 19)
    spent = 2 * depth / speed * math.sqrt(math.pi) * math.gamma(28 / 19) / math.gamma(1 / 2 + 9 / 19)
    assert hit.time[-1] == pytest.approx(spent, rel=1e-2)


@pytest.mark.parametrize("film", wide_but(["fixed_half", "positive_pressure", "full"], "positive_pressure"))
def test_one_revolution_of_each_film(film):
    """At 24000 rpm the cage touches the land, where the package's equal steps are good to 1e-6."""
    model = jc.replace(jc.case("1a"), **{"film.model": film})
    image = eqx.filter_jit(lambda speed, y: jc.strobe_map(model, speed, jc.method("rk4", steps=8192))(y))
    for rpm, tolerance in ((6000, 1e-9), (24000, 1e-6)):
        speed = jc.rpm(rpm)
        field, start = reference.field(model, speed), [float(c) for c in model.initial_states(speed)[0]]
        found, expected = image(jnp.asarray(speed), as_state(start)), reference.confirmed(field, start)
        apart = (np.array([float(c) for c in found.y]) - expected.strobe[-1]) / field.scale
        assert expected.spread < 1e-8
        np.testing.assert_allclose(apart, 0, atol=tolerance)
        assert expected.peak == pytest.approx(float(found.peak), abs=1e-6)


def test_one_revolution_of_cage_and_rib():
    """Printed cross-coupling, supply pressure, both stiffnesses, an elastic rib."""
    model = reference.random_model(11)
    assert reference.numbers_of(model)["rib"]["kind"] == "elastic"
    speed = float(reference.random_speeds(11, 1)[0])
    field = reference.field(model, speed)
    start = reference.random_state(3, field, 0.5)
    found = jc.strobe_map(model, speed, jc.method("rk4", steps=8192))(as_state(start))
    exact = reference.confirmed(field, start)
    apart = (np.array([float(c) for c in found.y]) - exact.strobe[-1]) / field.scale
    np.testing.assert_allclose(apart, 0, atol=1e-7)


def test_growth_is_that_of_neighbouring_trajectories():
    model, speed = jc.case("1a"), jc.rpm(9000)
    field, direction = reference.field(model, speed), np.array([0.6, -0.3, 0.1, 0.7])
    start = reference.random_state(1, field, 0.5)
    found = np.sum(reference.growth(field, start, 3, direction=direction))
    unit, h = field.scale, 1e-6 / np.linalg.norm(direction)
    ahead, behind = (
        reference.revolutions(field, start + s * h * direction * unit, 3, tolerance=1e-12).strobe[-1] for s in (1, -1)
    )
    expected = math.log(np.linalg.norm((ahead - behind) / unit) / 2e-6)
    assert found == pytest.approx(expected, abs=1e-5)


@pytest.mark.wide
@pytest.mark.parametrize("rpm", [10250.0, 24500.0])
def test_growth_in_chaos(rpm):
    """Revolution by revolution, from a state of the attractor: nothing depends on how long one looks."""
    model, speed = jc.case("1a"), jc.rpm(rpm)
    settled = jc.sweep(model, speed, discard=150, revolutions=100, horizon=0)
    at = settled.last.values[0, list(settled.label.values[0]).index("chaotic")]
    brief = dict(discard=0, revolutions=6, blocks=6, confirm=False, horizon=0)
    ours = jc.sweep(model, speed, initial_states=at[None, None], method=jc.method("rk4", steps=8192), **brief)
    theirs = reference.growth(reference.field(model, speed), at, 6, direction=start_tangents(4, 1)[0])
    np.testing.assert_allclose(ours.block_growth.values[0, 0, :, 0], theirs, rtol=0, atol=1e-4)
