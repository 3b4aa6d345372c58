"""Gradients of the whole bearing's statistics: a calm case by closed forms and differences, a rough one by differences,
refusals, tolerance budgets.
"""

import jax.numpy as jnp
import numpy as np
import pytest
from test_whole_motion import SPEED, bearing, moving

import jaxcage as jc
from jaxcage.design import Runs, gradient_of_pairs, mean_gradient
from jaxcage.models import rolling_start


CALM = ("guidance_gap", "pocket_clearance", "land_width", "viscosity_1+viscosity_2")


def calm():
    """Rollers pressed all round, without load, weight and unbalance: the film drags the cage against all of them alike,
    and nothing ever changes. And its start.
    """
    model = bearing(gravity=0.0, load=0.0, radial_clearance=-10e-6, eccentricity=0.0)
    omega = float(model.rolling_cage_speed(SPEED))
    pressed = float(model.outer_radius - model.bearing.roller_diameter / 2) + 3e-6
    return model, tuple(moving(model, orbit=omega, cage_speed=omega, radius=pressed).row)


@pytest.mark.wide
def test_a_calm_bearing_by_closed_form_and_by_differences():
    """Petroff's drag goes with viscosity, land width, and R^3 over the gap; its cage neither slips much nor rattles."""
    model, start = calm()
    length = dict(initial_states=[start], discard=4, revolutions=2)
    runs = Runs(SPEED, blocks=2, exponents=0, **length)
    found = mean_gradient(model, runs, directions=CALM, designs=16, spread=0.01)
    gap, wide = float(model.guidance_gap), float(model.bearing.rib_diameter)
    expected = [-1 - 3 * gap / (wide - gap), 0.0, 1.0, 1.0]
    for name in ("friction_power_W", "pocket_impulse_N_s"):
        each = found.statistics[name]
        np.testing.assert_allclose(each.elasticity, expected, atol=5e-4)
        assert np.all(each.elasticity_error < 2e-4) and each.settled
    slip = found.statistics["cage_slip"]
    assert 1e-4 < slip.value < 1e-3
    for i, name in enumerate(CALM[:1]):
        designs = [jc.replace(model, **{name: gap * (1 + side)}) for side in (1e-3, -1e-3)]
        ends = jc.sweep(designs, SPEED, **length, blocks=1, exponents=0)["cage_slip"].values.ravel()
        assert slip.elasticity[i] == pytest.approx(np.log(ends[0] / ends[1]) / 2e-3, rel=1e-3)
    value, error = found.slope("friction_power_W", "guidance_gap")
    assert value == pytest.approx(expected[0] * found.statistics["friction_power_W"].value / gap, rel=1e-3)
    assert 0 < error < 1e-3 * abs(value)


@pytest.mark.wide
def test_a_rattling_bearing_by_differences():
    """Power and impulse by the gap: scattered designs of two seeds against differences from common initial states."""
    model = bearing(load=1000.0)
    length = dict(discard=4, revolutions=6)
    initial_states = [rolling_start(model, SPEED, k) for k in range(3)]
    rng = np.random.default_rng(5)
    shaken = lambda s: s._replace(bodies=s.bodies.at[2:4].add(jnp.asarray(rng.normal(size=2) * 5e-3)))
    several = [tuple(shaken(start).row) for start in initial_states * 5]
    designs = [jc.replace(model, guidance_gap=float(model.guidance_gap) * (1 + side)) for side in (0.1, -0.1)]
    ends = jc.sweep(designs, SPEED, initial_states=several, blocks=1, exponents=0, **length)
    runs = Runs(SPEED, initial_states=2, blocks=2, exponents=0, **length)
    for seed in (1, 2):
        found = mean_gradient(model, runs, directions=("guidance_gap",), designs=16, spread=0.1, seed=seed)
        for name in ("friction_power_W", "land_impulse_N_s", "pocket_impulse_N_s"):
            each = found.statistics[name]
            change = ends[name].values[:, 0].T @ [1, -1] / 0.2
            error = np.hypot(change.std(ddof=1) / np.sqrt(change.size), each.change("guidance_gap")[1])
            assert abs(each.by_relative_change[0] - change.mean()) < 4 * error
        power = found.statistics["friction_power_W"]
        assert power.elasticity[0] < -10 * power.elasticity_error[0] < 0  # a wider gap drags less: known with its sign


def test_errors_are_those_of_noise():
    """Slopes of a made-up quantity with noise that grows along the first parameter: its scatter over many draws."""
    rng, true = np.random.default_rng(0), np.array([2.0, -1.0, 0.0])
    pairs, found = 24, []
    for _ in range(400):
        moved = 0.05 * rng.choice([-1.0, 1.0], size=(pairs, 3))
        curved = 300 * moved[:, 0] ** 2 + 200 * moved[:, 0] * moved[:, 1]
        sides = np.stack([7 + curved + side * moved @ true for side in (1, -1)])
        loud = np.linspace(0.5, 1.5, pairs)
        noise = 0.02 * loud[None, :, None] * rng.normal(size=(2, pairs, 2))
        found.append(gradient_of_pairs("x", "1", ("a", "b", "c"), moved, sides[..., None] + noise))
    slopes = np.array([each.by_relative_change for each in found])
    errors = np.array([[each.change(name)[1] for name in "abc"] for each in found])
    np.testing.assert_allclose(slopes.mean(axis=0), true, atol=4 * slopes.std() / 20)
    np.testing.assert_allclose(errors.mean(axis=0), slopes.std(axis=0), rtol=0.12)
    assert np.mean(np.abs(slopes - true) < 2 * errors) == pytest.approx(0.94, abs=0.03)
    moved = np.array([[0.05], [-0.05]] * 4)
    sides = 7 + np.stack([moved[:, 0], -moved[:, 0]])
    drifting = gradient_of_pairs("x", "1", ("a",), moved, np.stack([sides, sides + 1], axis=-1))
    assert drifting.drift == pytest.approx(1) and not drifting.settled and found[0].settled


@pytest.mark.parametrize(
    "options, said",
    [
        ({"directions": ("drag_coefficient",)}, "but has 'drag_coefficient'"),
        ({"directions": ("load", "load")}, "must name each parameter once, but has 'load' twice"),
        ({"designs": 16}, "`designs` must be an even number from 18 on, for so many directions, but 16 was given"),
        ({"spread": 0.5}, "`spread` must be above 0 and at most 0.3, but 0.5 was given"),
        ({"statistics": ("slip",)}, "`statistics` must hold some of cage_slip, roller_slip_max"),
    ],
)
def test_refusals(options, said):
    with pytest.raises(ValueError, match=said.replace("+", r"\+")):
        mean_gradient(jc.whole_bearing("nu2310"), Runs(SPEED), **options)
