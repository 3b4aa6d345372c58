"""Bad input is answered with one sentence that names the argument; the design rule is a warning."""

import equinox as eqx
import jax
import jax.numpy as jnp
import pytest

import jaxcage.bearing as jb
from jaxcage import replace


@pytest.mark.parametrize("load", [0.0, -3.0, float("nan")])
def test_load_must_be_positive(load):
    with pytest.raises(ValueError, match=f"`load` must be (positive|a number), but {load:g} was given."):
        jb.load_distribution(jb.nu2310(), load)


def test_load_must_be_positive_under_a_gradient():
    with pytest.raises(ValueError, match="Argument `load` must be positive."):
        jax.grad(lambda load: jb.load_distribution(jb.nu2310(), load).shaft_shift)(-1.0)


@pytest.mark.wide
def test_traced_load_must_be_positive():
    solve = eqx.filter_jit(lambda load: jb.load_distribution(jb.nu2310(), load).shaft_shift)
    with pytest.raises(eqx.EquinoxRuntimeError, match="Argument `load` must be positive."):
        solve(jnp.asarray(-1.0))


def test_centrifugal_force_must_not_be_negative():
    with pytest.raises(ValueError, match="Argument `centrifugal_force` must not be negative"):
        jb.load_distribution(jb.nu2310(), 100.0, -1.0)


def test_unknown_guidance():
    with pytest.raises(ValueError, match="outer_rib, inner_rib, roller, but 'shaft' was given"):
        jb.static_cage_displacement(
            "shaft",
            guidance_gap=1e-3,
            pocket_clearance=1e-3,
            radial_clearance=1e-5,
            elastic_approach=1e-6,
        )


def test_unknown_case():
    with pytest.raises(ValueError, match="one of 1a, 1b, 2a, 2b, 3a, 3b, but '4c' was given"):
        jb.published_case("4c")


def test_grade_must_be_positive():
    with pytest.raises(ValueError, match="Argument `grade` must be positive, but -56 was given."):
        jb.vg(-56)


def test_two_points_of_an_oil_must_differ():
    with pytest.raises(ValueError, match="both are 313.15 K"):
        jb.Lubricant(870.0, 56e-6, 313.15, 7e-6, 313.15)


@pytest.mark.parametrize("first, second", [((2e-5, 313.15), (5e-5, 373.15)), ((5e-5, 373.15), (2e-5, 313.15))])
def test_an_oil_does_not_thicken_when_hot(first, second):
    with pytest.raises(ValueError, match="must not rise with the temperature, but .* m.2/s at 3.*15 K were given"):
        jb.Lubricant(870.0, *first, *second)
    (nu, _), (_, t) = first, second
    assert float(jb.Lubricant(870.0, *first, nu, t).kinematic_viscosity) == pytest.approx(nu, rel=1e-12)


@pytest.mark.parametrize("load, force, said", [
    (1e300, 0.0, "`load` must be at most 1e.12 N, but 1e.300"),
    (4450.0, 1e300, "`centrifugal_force` must be at most 1e.12 N, but 1e.300"),
    (1.0, 1e7, "`load` and `centrifugal_force` must be of sizes that can be added, but 1 and 1e.07 N were given"),
])  # fmt: skip
def test_loads_beyond_all_sense(load, force, said):
    with pytest.raises(ValueError, match=said):
        jb.load_distribution(jb.nu2310(), load, force)


@pytest.mark.parametrize(
    "change, message",
    [
        (dict(bore=0.08), "must grow, but are 80, 65, 92.1, 110 mm"),
        (dict(n_rollers=16), "16 rollers overlap on the pitch circle"),
    ],
)
def test_impossible_bearings(change, message):
    sizes = dict(
        bore=50e-3,
        outside_diameter=110e-3,
        width=40e-3,
        n_rollers=13,
        roller_diameter=16e-3,
        roller_length=27e-3,
        rib_diameter=92.1e-3,
        inner_raceway_diameter=65e-3,
        radial_clearance=40e-6,
        pocket_clearance=0.3e-3,
    )
    with pytest.raises(ValueError, match=message):
        jb.Bearing(**(sizes | change))


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
    bearing = replace(jb.nu2310(), pocket_clearance=pocket_clearance)
    found = jb.design_rule_violations(bearing, guidance_gap)
    assert len(found) == len(broken)
    assert all(part in sentence for part, sentence in zip(broken, found, strict=True))
