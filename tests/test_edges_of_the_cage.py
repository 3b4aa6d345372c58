"""Sensitivities of edges of a published cage: against differences of edges located anew, identities and other units.

The points are edges of case 1a as found by a search over its speed range, rounded:
Newton's method finds them again.
"""

import functools

import numpy as np
import pytest
from helpers import edge_speed, in_other_units, preliminary, wide_but

import jaxcage as jc
from jaxcage import parameter_info
from jaxcage.orbits import Point, sensitivity, width


CASE = preliminary("1a")
STATES = {
    "Neimark-Sacker": (11023.07, (1.33877e-5, -5.11828e-5, 0.520974, 0.0221109)),
    "period-doubling": (12266.09, (1.43798e-5, -8.77557e-5, 0.437277, 0.0136768)),
    "fold": (21250.392, (-2.54376e-4, -3.25831e-4, 0.463810, -0.0884847)),
}
# Of the three orbits only that of the fold touches the land.
CONTACT = {"stiffness", "onset", "restitution", "approach_speed", "contact.smoothing"}
# The impact is that of the published formula: roller and race, and the viscosity away from its reference, do not enter.
NEVER = {
    *("bore", "outside_diameter", "width", "roller_diameter", "roller_length", "inner_raceway_diameter"),
    *("radial_clearance", "pocket_clearance", "palmgren_constant", "bearing.roller_material.density"),
    *("youngs_modulus", "load", "printed_unit"),
}
# Zero in case 1a, or without effect at the temperature the viscosity is given for.
ZERO = {"viscosity_2", "temperature_2", "supply_pressure", "cubic_ratio", "cross_cubic"}


def point(kind, speed_factor=1.0, state_factors=(1.0, 1.0)):
    """A special point near the edge, as Newton's method may be given it."""
    rpm, state = STATES[kind]
    speed = jc.rpm(rpm) * speed_factor
    scaled = np.array(state) * np.repeat(state_factors, 2)
    return Point(kind, speed, scaled)


@functools.cache
def found(kind):
    """The sensitivity of an edge."""
    return sensitivity(CASE, point(kind), kind)


KINDS = wide_but(STATES, "period-doubling")


@pytest.mark.wide
@pytest.mark.parametrize("kind", KINDS)
def test_edges_are_found_again(kind):
    """From speed and state of six digits, on which the result does not depend."""
    edge = found(kind)
    assert edge.status == "converged" and edge.trusted and edge.kind == kind
    assert abs(edge.value_rpm - STATES[kind][0]) < 0.01
    assert abs(edge_speed(CASE, point(kind)) - jc.rpm(edge.value_rpm)) < 1e-12 * jc.rpm(edge.value_rpm)
    moved = edge_speed(CASE, point(kind, speed_factor=1 + 1e-5))
    assert abs(moved / jc.rpm(edge.value_rpm) - 1) < 1e-11


@pytest.mark.parametrize("kind", KINDS)
def test_sensitivities_are_homogeneous(kind):
    """Whatever the units of mass, length and time, the same physics comes out."""
    assert set(found(kind).homogeneity) == {"mass", "length", "time"}
    for residual in found(kind).homogeneity.values():
        assert abs(residual) < 1e-8
    values = jc.parameters(CASE)
    for name, e in found(kind).elasticity.items():
        slope = found(kind).derivative[name]
        assert abs(slope * float(values[name]) / found(kind).value_rpm - e) < 1e-12
    info = parameter_info(CASE)
    # The identity for mass, by hand: only these have a mass in their unit, and it is not that nothing depends on them.
    heavy = {n: e for n, e in found(kind).elasticity.items() if "kg" in info[n].unit or "N" in info[n].unit}
    assert max(abs(e) for e in heavy.values()) > 0.4


STEPS = {
    **{"guidance_gap": 1e-7, "eccentricity": 2e-8, "cage_mass": 2e-4, "rib_diameter": 1e-5, "land_width": 1e-7},
    **{"temperature": 1e-2, "viscosity_1": 1e-9, "amplitude": 1e-2, "exponent": 1e-4, "cubic_stiffness": 1e8},
    **{"stiffness_y": 1.0, "damping": 1e-3, "gravity": 1e-3, "supply_pressure": 1.0},
}
"""Steps of differences in SI units, a tenth for the fold: where the land is touched, Newton's method does not reach as
far."""
MOVES = [("period-doubling", name) for name in STEPS]
QUICK = [("period-doubling", name) for name in ("guidance_gap", "cage_mass", "temperature", "supply_pressure")]
MOVES += [(kind, name) for kind in ("Neimark-Sacker", "fold") for name in ("guidance_gap", "eccentricity", "cage_mass")]


@pytest.mark.parametrize("kind, name", wide_but(MOVES, *QUICK))
def test_derivatives_against_differences(kind, name):
    """Differences of fourth order, of edges located anew with the parameter changed; to one side of no pressure."""
    h, value = STEPS[name] / (10 if kind == "fold" else 1), float(jc.parameters(CASE)[name])
    shifts, weights = ((-2, -1, 1, 2), (1, -8, 8, -1)) if value else ((0, 1, 2), (-18, 24, -6))
    at = [edge_speed(jc.replace(CASE, **{name: value + i * h}), point(kind)) for i in shifts]
    slope = np.dot(weights, at) / (12 * h) * 30 / np.pi
    np.testing.assert_allclose(found(kind).derivative[name], slope, rtol=1e-6 if value else 2e-6)


@pytest.mark.parametrize("kind", KINDS)
def test_parameters_without_effect(kind):
    """Exactly zero, and the others are not."""
    silent = NEVER | ZERO | (set() if kind == "fold" else CONTACT)
    zero = {n for n, e in found(kind).elasticity.items() if e == 0.0}
    assert zero == silent
    if kind == "fold":
        assert found(kind).elasticity["onset"] < -1  # a later contact, a slower edge


@pytest.mark.wide
@pytest.mark.parametrize("base, factor", [("mass", 7.0), ("length", 1000.0), ("time", 60.0)])
@pytest.mark.parametrize("kind", KINDS)
def test_edges_in_other_units(kind, base, factor):
    """The speed is a rate: only the unit of time changes its number, and exactly."""
    length = factor if base == "length" else 1.0
    time = factor if base == "time" else 1.0
    other = point(kind, 1 / time, (length, length / time))
    speed = edge_speed(in_other_units(CASE, base, factor), other)
    assert abs(speed * time / jc.rpm(found(kind).value_rpm) - 1) < 1e-10


def test_width_between_two_edges():
    onset, leaves = found("Neimark-Sacker"), found("period-doubling")
    wide = width(onset, leaves)
    assert abs(wide.value_rpm - (leaves.value_rpm - onset.value_rpm)) < 1e-9
    assert wide.trusted and max(abs(r) for r in wide.homogeneity.values()) < 1e-8
    for name in ("guidance_gap", "cage_mass", "exponent"):
        slope = leaves.derivative[name] - onset.derivative[name]
        np.testing.assert_allclose(wide.derivative[name], slope, rtol=1e-12)
        elasticity = slope * float(jc.parameters(CASE)[name]) / wide.value_rpm
        np.testing.assert_allclose(wide.elasticity[name], elasticity, rtol=1e-9)
    assert wide.transversality == min(abs(onset.transversality), abs(leaves.transversality))
    assert str(wide).startswith("width: unstable at 1243.017 ± ")
    assert wide.error_rpm == onset.error_rpm + leaves.error_rpm < 1e-3


def test_edge_that_is_not_there():
    """A fold is asked for where the pair leaves as a torus: no number is better than a wrong one."""
    rpm, state = STATES["Neimark-Sacker"]
    speed = jc.rpm(rpm)
    wrong = Point("fold", speed, np.array(state))
    assert np.isnan(edge_speed(CASE, wrong))
    lost = sensitivity(CASE, wrong)
    assert lost.status == "no such point" and not lost.trusted
    assert np.isnan(lost.value_rpm) and np.isnan(lost.elasticity["cage_mass"]) and np.isnan(lost.homogeneity["time"])
    assert not width(lost, lost).trusted
