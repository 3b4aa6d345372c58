"""Statics, kinematics and masses against printed numbers of the paper, and discrete rollers against SciPy."""

import jax.numpy as jnp
import numpy as np
import pytest
from literature import loads_by_scipy

import jaxcage.bearing as jb


RPM = np.pi / 30


def crb209(clearance):
    """Roller bearing 209: 14 rollers of 10 mm x 9.6 mm, pitch diameter 65 mm."""
    return jb.Bearing(
        bore=45e-3,
        outside_diameter=85e-3,
        width=19e-3,
        n_rollers=14,
        roller_diameter=10e-3,
        roller_length=9.6e-3,
        rib_diameter=70e-3,
        inner_raceway_diameter=55e-3,
        radial_clearance=clearance,
        pocket_clearance=0.2e-3,
    )


@pytest.mark.parametrize("clearance", [0.0, 41e-6])
def test_discrete_rollers(clearance):
    """Shift and every load as SciPy finds them."""
    load = 4450.0
    shift, loads = loads_by_scipy(load, clearance, 14, 9.6)
    result = jb.load_distribution(crb209(clearance), load)
    assert float(result.shaft_shift) == pytest.approx(shift, rel=1e-6)
    np.testing.assert_allclose(result.inner_loads, loads, rtol=1e-6, atol=1e-6 * load)
    assert float(result.max_load) == pytest.approx(loads[0], rel=1e-6)
    assert float(result.elastic_approach) == pytest.approx(shift - clearance / 2, rel=1e-6)
    half_angle = np.arccos(clearance / 2 / shift)
    assert float(result.half_angle) == pytest.approx(half_angle, rel=1e-6)


@pytest.mark.parametrize(
    "bearing, raceway, series",
    [(jb.nu2310, 1.509e6, 6.985e5), (lambda: crb209(0.0), None, 2.786e5)],
)
def test_contact_stiffness(bearing, raceway, series):
    per_millimetre = 1e3 ** (10 / 9)
    assert float(bearing().contact_stiffness) / per_millimetre == pytest.approx(series, rel=1e-3)
    if raceway is not None:
        assert float(bearing().raceway_stiffness) / per_millimetre == pytest.approx(raceway, rel=1e-3)


@pytest.mark.parametrize("rpm, force", [(3000, 27.2), (12000, 435.9)])
def test_roller_centrifugal_force(rpm, force):
    found = float(jb.nu2310().roller_centrifugal_force(rpm * RPM))
    assert found == pytest.approx(force, rel=2e-3)


def test_sizes_that_follow_from_table_1():
    bearing = jb.nu2310()
    assert float(bearing.pitch_diameter) == pytest.approx(81e-3)
    assert float(bearing.outer_raceway_diameter) == pytest.approx(97e-3)
    assert float(bearing.land_width_limit) == pytest.approx(6.5e-3)
    assert float(bearing.roller_mass) == pytest.approx(42.3e-3, abs=0.05e-3)


def test_end_of_the_published_speed_axis_as_shaft_speed():
    shaft = float(jb.nu2310().shaft_speed(jb.PUBLISHED_SPEED_RANGE_RPM[1] * RPM)) / RPM
    assert shaft == pytest.approx(68500, rel=1e-3)
    assert shaft > 5 * jb.NU2310_RATINGS.limiting_speed_rpm


def test_cage_mass_of_plausible_cages():
    default = float(jb.cage_mass(jb.nu2310(), 0.45e-3))
    assert default == pytest.approx(0.25495, rel=1e-4)
    light = jb.CageGeometry(inner_diameter=76e-3, cage_width=34e-3)
    heavy = jb.CageGeometry(inner_diameter=73e-3, cage_width=36e-3)
    assert float(jb.cage_mass(jb.nu2310(), 0.45e-3, light)) == pytest.approx(0.22, abs=0.006)
    assert float(jb.cage_mass(jb.nu2310(), 0.45e-3, heavy)) == pytest.approx(0.30, abs=0.006)


def test_pocket_area_against_counting_points():
    inner, outer, pocket, pitch = 37.5e-3, 45.825e-3, 8.15e-3, 40.5e-3
    x, y = np.meshgrid(np.linspace(pitch - pocket, pitch + pocket, 1501), np.linspace(-pocket, pocket, 1501))
    radius = np.hypot(x, y)
    inside = (np.hypot(x - pitch, y) < pocket) & (radius > inner) & (radius < outer)
    counted = inside.mean() * (2 * pocket) ** 2
    found = float(jb.clipped_pocket_area(inner, outer, pocket, pitch))
    assert found == pytest.approx(counted, rel=2e-3)
    whole = float(jb.clipped_pocket_area(0.01, 0.06, pocket, pitch))
    assert whole == pytest.approx(np.pi * pocket**2, rel=1e-12)


@pytest.mark.parametrize("guidance, expected", [("outer_rib", 225e-6), ("inner_rib", 251.1e-6), ("roller", 326.1e-6)])
def test_static_cage_displacement(guidance, expected):
    bearing = jb.nu2310()
    found = jb.static_cage_displacement(
        guidance,
        guidance_gap=0.45e-3,
        pocket_clearance=bearing.pocket_clearance,
        radial_clearance=bearing.radial_clearance,
        elastic_approach=jb.load_distribution(bearing, 4450.0).elastic_approach,
    )
    assert float(found) == pytest.approx(expected, rel=1e-3)


@pytest.mark.parametrize("outer_speed", [0.0, 35.0])
def test_cage_speed_is_rolling_between_the_raceway_speeds(outer_speed):
    bearing, inner_speed = jb.nu2310(), 200.0
    inner = jb.raceway_surface_speed(inner_speed, bearing.inner_raceway_diameter)
    outer = jb.raceway_surface_speed(outer_speed, bearing.outer_raceway_diameter)
    cage = jb.cage_speed(inner_speed, outer_speed, 16e-3, 81e-3)
    assert float(cage) * 40.5e-3 == pytest.approx(float(inner + outer) / 2, rel=1e-12)
    assert float(cage) - outer_speed == pytest.approx((inner_speed - outer_speed) * 65 / 162, rel=1e-12)


def test_gap_and_radius():
    gap = jb.guidance_gap(92.1e-3, 91.65e-3)
    assert float(gap) == pytest.approx(0.45e-3, rel=1e-10)
    assert float(jb.guiding_radius(92.1e-3, gap)) == pytest.approx(45.825e-3, rel=1e-12)


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


def test_materials():
    assert float(jb.brass().density) == 8430.0
    assert float(jb.bearing_steel().youngs_modulus) == 210e9
    shear = jb.bearing_steel().youngs_modulus / (2 * (1 + jb.bearing_steel().poisson_ratio))
    # Lucefin's card for 100Cr6 gives a modulus of 80 GPa in shear.
    assert float(jnp.asarray(shear)) == pytest.approx(80e9, rel=0.02)
