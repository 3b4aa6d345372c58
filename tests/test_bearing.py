"""Statics, kinematics and masses of the bearing: printed numbers, SciPy, invariants, and refused input."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from literature import loads_by_scipy
from scipy.optimize import brentq

import jaxcage as jc
import jaxcage.bearing as jb
from jaxcage import parameters, replace


RPM = np.pi / 30
ROLLER_BEARING_209 = dict(
    bore=45e-3,
    outside_diameter=85e-3,
    width=19e-3,
    n_rollers=14,
    roller_diameter=10e-3,
    roller_length=9.6e-3,
    rib_diameter=70e-3,
    inner_raceway_diameter=55e-3,
    radial_clearance=0.0,
    pocket_clearance=0.2e-3,
)


def crb209(**changes):
    return jb.Bearing(**(ROLLER_BEARING_209 | changes))


def distribution(clearance=40e-6, load=4450.0, centrifugal=0.0, angle=-np.pi / 2):
    bearing = replace(jb.nu2310(), radial_clearance=clearance)
    return bearing, jb.load_distribution(bearing, load, centrifugal, angle)


@pytest.mark.parametrize("clearance", [0.0, 41e-6])
def test_discrete_rollers(clearance):
    """Shift and every load as SciPy finds them."""
    load = 4450.0
    shift, loads = loads_by_scipy(load, clearance, 14, 9.6)
    result = jb.load_distribution(crb209(radial_clearance=clearance), load)
    assert float(result.shaft_shift) == pytest.approx(shift, rel=1e-6)
    np.testing.assert_allclose(result.inner_loads, loads, rtol=1e-6, atol=1e-6 * load)
    assert float(result.max_load) == pytest.approx(loads[0], rel=1e-6)
    assert float(result.elastic_approach) == pytest.approx(shift - clearance / 2, rel=1e-6)
    assert float(result.half_angle) == pytest.approx(np.arccos(clearance / 2 / shift), rel=1e-6)


@pytest.mark.parametrize("clearance", [-10e-6, -50e-6])
def test_a_ring_pressed_evenly(clearance):
    """Without load each roller bears K (-G_r/4)^(10/9) on both raceways, as each takes half of -G_r/2 of approach."""
    bearing, found = distribution(clearance, load=1e-3)
    each = 8.06e10 * 0.027 ** (8 / 9) * (-clearance / 4) ** (10 / 9)
    np.testing.assert_allclose(found.inner_loads, each, rtol=1e-6)
    np.testing.assert_allclose(found.outer_loads, each, rtol=1e-6)
    assert found.half_angle == pytest.approx(np.pi) and abs(float(found.shaft_shift)) < 1e-11
    modulus = 210e9 / (1 - 0.3**2) / 2
    pressure = np.sqrt(each * modulus * (1 / 8e-3 + 1 / 32.5e-3) / (np.pi * 27e-3))
    assert (pressure < 1.5e9) == (clearance > -50e-6)  # the fatigue limit of ISO 281


@pytest.mark.parametrize("load", [300.0, 20e3, 400e3])
@pytest.mark.parametrize("centrifugal", [0.0, 300.0])
def test_a_preloaded_bearing_under_load(load, centrifugal):
    """Against SciPy; under the largest load the rollers opposite to it come free."""
    bearing, found = distribution(-20e-6, load, centrifugal)
    k, cos = float(bearing.raceway_stiffness), np.cos(2 * np.pi / 13 * np.arange(13))

    def on_inner(approach):
        outer = lambda q: (q / k) ** 0.9 + ((q + centrifugal) / k) ** 0.9 - approach
        return brentq(outer, 0.0, 1e7, xtol=1e-9, rtol=1e-14) if outer(0.0) < 0 else 0.0

    loads = lambda shift: np.array([on_inner(shift * c + 10e-6) for c in cos])
    shift = brentq(lambda d: loads(d) @ cos - load, 0.0, 1e-3, xtol=1e-16, rtol=1e-14)
    assert float(found.shaft_shift) == pytest.approx(shift, rel=1e-8)
    np.testing.assert_allclose(found.inner_loads, loads(shift), atol=1e-8 * load)
    assert (found.half_angle < np.pi) == (np.min(found.inner_loads) == 0)


def test_a_cage_model_takes_no_preload():
    with pytest.raises(ValueError, match="radial_clearance` must be at least 0 for a cage model.*is -10 um"):
        jc.replace(jc.case("1a"), radial_clearance=-10e-6)
    with pytest.raises(ValueError, match="^Argument `bearing.radial_clearance` must be at least 0"):
        jc.files.model_from({"base": "1a", "bearing": {"radial_clearance": "-10 um"}})
    assert float(jc.replace(jc.whole_bearing("nu2310"), radial_clearance=-50e-6).bearing.radial_clearance) == -50e-6
    with pytest.raises(ValueError, match="from -5e-05 to 0.001 m, but is -6e-05 m"):
        jc.replace(jc.whole_bearing("nu2310"), radial_clearance=-60e-6)


def test_sizes_and_forces_that_follow_from_table_1():
    bearing = jb.nu2310()
    assert float(bearing.pitch_diameter) == pytest.approx(81e-3)
    assert float(bearing.outer_raceway_diameter) == pytest.approx(97e-3)
    assert float(bearing.land_width_limit) == pytest.approx(6.5e-3)
    assert float(bearing.roller_mass) == pytest.approx(42.3e-3, abs=0.05e-3)
    assert float(bearing.roller_centrifugal_force(3000 * RPM)) == pytest.approx(27.2, rel=2e-3)
    assert float(bearing.roller_centrifugal_force(12000 * RPM)) == pytest.approx(435.9, rel=2e-3)
    steel = jb.bearing_steel()
    # Lucefin's card for 100Cr6 gives a modulus of 80 GPa in shear, and a Poisson's ratio of 0.30.
    assert float(steel.youngs_modulus / (2 * (1 + 0.30))) == pytest.approx(80e9, rel=0.02)


@pytest.mark.parametrize("outer_speed", [0.0, 35.0])
def test_cage_speed_is_rolling_between_the_raceway_speeds(outer_speed):
    bearing, inner_speed = jb.nu2310(), 200.0
    inner, outer = inner_speed * bearing.inner_raceway_diameter / 2, outer_speed * bearing.outer_raceway_diameter / 2
    cage = bearing.cage_speed(inner_speed, outer_speed)
    assert float(cage) * 40.5e-3 == pytest.approx(float(inner + outer) / 2, rel=1e-12)
    assert float(cage) - outer_speed == pytest.approx((inner_speed - outer_speed) * 65 / 162, rel=1e-12)
    assert float(bearing.cage_speed(inner_speed)) == pytest.approx(inner_speed * float(bearing.cage_speed_ratio))


def test_published_table_2():
    cases = jb.PUBLISHED_CASES
    assert list(cases) == ["1a", "1b", "2a", "2b", "3a", "3b"]
    assert [c.zone_1_exit_rpm - c.zone_1_onset_rpm for c in cases.values()] == [2900, 14900, 6400, 5200, 5750, 5750]
    # Conclusion 3: the steady zone narrows as the eccentricity grows from 35 to 57 um.
    steady = lambda case: case.zone_2_onset_rpm - case.zone_1_exit_rpm
    assert (steady(cases["2a"]), steady(cases["2b"])) == (8500, 6800)
    assert jb.published_case("2b").eccentricity_um == 57
    low, high = jb.PUBLISHED_SPEED_RANGE_RPM
    for case in cases.values():
        edges = case.zone_1_onset_rpm, case.zone_1_exit_rpm, case.zone_2_onset_rpm
        assert low < edges[0] < edges[1] < edges[2] < high
        assert case.eccentricity_um * 1e-3 < case.guidance_gap_mm / 2
    assert float(jb.nu2310().shaft_speed(high * RPM)) / RPM == pytest.approx(68500, rel=1e-3)


@pytest.mark.wide
@pytest.mark.parametrize("clearance", [0.0, 40e-6])
@pytest.mark.parametrize("load, centrifugal", [(1.0, 0.0), (4450.0, 435.9), (18.6e3, 27.2), (50.0, 435.9)])
@pytest.mark.parametrize("angle", [-np.pi / 2, -np.pi / 2 + np.pi / 13, 0.7])
def test_rollers_carry_the_load_and_fill_the_gap(clearance, load, centrifugal, angle):
    bearing, result = distribution(clearance, load, centrifugal, angle)
    cosines = -np.sin(result.roller_angles)
    assert np.sum(result.inner_loads * cosines) == pytest.approx(load, rel=1e-10)
    np.testing.assert_allclose(result.outer_loads - result.inner_loads, centrifugal, atol=1e-9)
    room = result.shaft_shift * cosines - clearance / 2
    stiffness = bearing.raceway_stiffness
    approach = jax.vmap(jb.line_contact_approach, in_axes=(None, 0))
    inner, outer = approach(stiffness, result.inner_loads), approach(stiffness, result.outer_loads)
    loaded = np.asarray(result.inner_loads) > 0
    np.testing.assert_allclose((inner + outer)[loaded], room[loaded], rtol=1e-9)
    assert np.all(room[~loaded] <= outer[~loaded] * (1 + 1e-12))
    assert float(result.elastic_approach) == pytest.approx(float(room.max()), rel=1e-9)


@pytest.mark.parametrize("shaft_rpm", [0.0, 30000.0, 60000.0])
def test_loaded_rollers_lie_within_the_half_angle(shaft_rpm: float):
    bearing, _ = distribution()
    centrifugal = bearing.roller_centrifugal_force(shaft_rpm * RPM)
    result = jb.load_distribution(bearing, 4450.0, centrifugal)
    # At its ends the inner raceway just touches a roller that its own centrifugal force has pressed outwards.
    seat = float(jb.line_contact_approach(bearing.raceway_stiffness, centrifugal))
    ends = np.arccos((float(bearing.radial_clearance) / 2 + seat) / float(result.shaft_shift))
    assert float(result.half_angle) == pytest.approx(ends, rel=1e-9)
    off_load = np.abs(np.angle(np.exp(1j * (np.asarray(result.roller_angles) + np.pi / 2))))
    assert np.array_equal(off_load < result.half_angle, np.asarray(result.inner_loads) > 0)


def outputs(bearing, load, shaft_speed):
    result = jb.load_distribution(bearing, load, bearing.roller_centrifugal_force(shaft_speed))
    return jnp.stack([result.shaft_shift, result.max_load, result.half_angle])


def scaled(factors):
    """Outputs with load, speed and four parameters of the bearing multiplied by `factors`."""
    bearing = jb.nu2310()
    names = "radial_clearance", "palmgren_constant", "roller_length", "density"
    values = {n: parameters(bearing)[n] * factors[k + 2] for k, n in enumerate(names)}
    return outputs(replace(bearing, **values), 4450.0 * factors[0], 1256.6 * factors[1])


@pytest.mark.wide
@pytest.mark.parametrize("mode", [jax.jacfwd, jax.jacrev])
def test_gradients_against_central_differences(mode):
    ones, step = jnp.ones(6), 1e-4
    shifts = step * jnp.eye(6)
    value = jax.jit(jax.vmap(lambda d: scaled(ones + d)))
    difference = (value(shifts) - value(-shifts)).T / (2 * step)
    np.testing.assert_allclose(jax.jit(mode(scaled))(ones), difference, rtol=3e-5, atol=0)


@pytest.mark.wide
def test_second_derivative_against_difference_of_gradients():
    shift = lambda load: jb.load_distribution(jb.nu2310(), load, 100.0).shaft_shift * 1e6
    slope = jax.jit(jax.grad(shift))
    second = jax.jit(jax.grad(jax.grad(shift)))(4450.0)
    assert float(second) == pytest.approx(float(slope(4451.0) - slope(4449.0)) / 2, rel=1e-4)


@pytest.mark.wide
def test_gradient_in_speed_is_zero_at_rest():
    assert float(jax.grad(lambda speed: outputs(jb.nu2310(), 4450.0, speed)[0])(0.0)) == 0.0


@pytest.mark.parametrize("load, force, said", [
    (0.0, 0.0, "`load` must be positive and at most 1e.12 N, but 0 was given"),
    (-3.0, 0.0, "`load` must be positive .* -3"),
    (float("nan"), 0.0, "`load` must be positive .* nan"),
    (1e300, 0.0, "`load` must be .* at most 1e.12 N, but 1e.300"),
    (100.0, -1.0, "`centrifugal_force` must be from 0 to 1e.12 N, but -1"),
    (4450.0, 1e300, "`centrifugal_force` must be .* 1e.12 N, but 1e.300"),
    (1.0, 1e7, "`load` and `centrifugal_force` must be of sizes that can be added, but 1 and 1e.07 N were given"),
])  # fmt: skip
def test_impossible_loads(load, force, said):
    with pytest.raises(ValueError, match=said):
        jb.load_distribution(jb.nu2310(), load, force)


def test_impossible_loads_that_are_traced_give_nan():
    shift = eqx.filter_jit(lambda load, force: jb.load_distribution(jb.nu2310(), load, force).shaft_shift)
    found = [shift(jnp.asarray(load), jnp.asarray(force)) for load, force in [(-1.0, 0.0), (1.0, -1.0), (1.0, 1.0)]]
    assert list(np.isnan(found)) == [True, True, False]


@pytest.mark.parametrize("call, message", [
    (lambda: jb.published_case("4c"), "one of 1a, 1b, 2a, 2b, 3a, 3b, but '4c' was given"),
    (lambda: crb209(bore=0.06), "must grow, but are 60, 55, 70, 85 mm"),
    (lambda: crb209(n_rollers=21), "21 rollers overlap on the pitch circle"),
])  # fmt: skip
def test_impossible_bearings(call, message):
    with pytest.raises(ValueError, match=message):
        call()


@pytest.mark.parametrize(
    "pocket_clearance, guidance_gap, broken",
    [
        (0.3e-3, 0.45e-3, ["T = 0.3 mm should exceed the guidance gap C_r = 0.45 mm"]),
        (0.5e-3, 0.45e-3, []),
        (0.5e-3, 0.03e-3, ["C_r = 0.03 mm should exceed the radial clearance G_r = 0.04 mm"]),
        (0.02e-3, 0.03e-3, ["T = 0.02 mm", "C_r = 0.03 mm"]),
    ],
)
def test_design_rule(pocket_clearance, guidance_gap, broken):
    found = jb.design_rule_violations(replace(jb.nu2310(), pocket_clearance=pocket_clearance), guidance_gap)
    assert len(found) == len(broken)
    assert all(part in sentence for part, sentence in zip(broken, found, strict=True))
