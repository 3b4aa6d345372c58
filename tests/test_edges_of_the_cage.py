"""Edges of case 1a: located to rounding, their derivatives against edges that are solved anew, and exact identities.

States and speeds were found by `jaxcage bifurcations 1a` and are rounded; Newton's method polishes them. One program,
the second-order expansion of the return map, serves all edges and parameters.
"""

import dataclasses

import numpy as np
import pytest
from helpers import in_other_units

import jaxcage as jc
from jaxcage.orbits import SpecialPoint, edge_speed, limit_sensitivity, width


def point(kind, rpm, state):
    nothing = np.zeros(4)
    return SpecialPoint(kind, jc.rpm(rpm), jc.rpm(rpm), np.array(state), nothing.astype(complex), nothing, 0, True)


EDGES = {
    "torus": point("torus", 11023.068, [1.3387688e-05, -5.1182832e-05, 0.52097361, 0.02211094]),
    "period-doubling": point("period-doubling", 12266.086, [1.4379751e-05, -8.7755655e-05, 0.43727745, 0.013676826]),
    "fold in contact": point("fold", 21250.629, [-2.5437642e-4, -3.2583091e-4, 0.46381027, -0.088484656]),
}
MODEL = jc.case("1a")
STENCIL = {-2: 1 / 12, -1: -2 / 3, 1: 2 / 3, 2: -1 / 12}
STEP = 1e-5  # relative: the orbit in contact bends within the contact's regularisation length, 4e-4 of the gap


@pytest.fixture(scope="module")
def exact():
    return jc.sensitivities(MODEL, EDGES)


@pytest.mark.parametrize("name", EDGES)
def test_edges_are_found_again_and_obey_homogeneity(exact, name):
    edge = exact[name]
    assert edge.trusted
    assert edge.value_rpm == pytest.approx(EDGES[name].speed_rpm, abs=1e-3)
    for residual in edge.homogeneity.values():
        assert abs(residual) < 1e-8


@pytest.mark.parametrize("name", EDGES)
@pytest.mark.parametrize("parameter", ["guidance_gap", "eccentricity", "cage_mass", "stiffness"])
def test_elasticities_against_edges_solved_anew(exact, name, parameter):
    value = jc.parameters(MODEL)[parameter]
    speeds = {k: edge_speed(jc.replace(MODEL, **{parameter: value * (1 + k * STEP)}), EDGES[name]) for k in STENCIL}
    found = sum(w * speeds[k] for k, w in STENCIL.items()) / (STEP * EDGES[name].speed)
    elasticity = exact[name].elasticity[parameter]
    assert abs(found - elasticity) < 1e-6 * max(abs(elasticity), 0.01)


def test_orbits_without_contact_do_not_feel_it(exact):
    for name in ("stiffness", "restitution", "onset"):
        assert exact["torus"].elasticity[name] == 0.0
    assert abs(exact["fold in contact"].elasticity["onset"]) > 1.0


@pytest.mark.parametrize("base, power", [("mass", 0), ("length", 0), ("time", -1)])
def test_edge_in_other_units(base, power):
    """The whole model in units a thousandth off: the speed follows as a rate, to rounding."""
    factor = 1.001
    edge = EDGES["period-doubling"]
    scaled = edge.state * np.array(
        [factor if base == "length" else 1.0] * 2 + [factor ** {"mass": 0, "length": 1, "time": -1}[base]] * 2
    )
    moved = dataclasses.replace(edge, state=scaled, speed=edge.speed * factor**power)
    found = edge_speed(in_other_units(MODEL, base, factor), moved)
    assert found == pytest.approx(edge_speed(MODEL, edge) * factor**power, rel=1e-11)


def test_width_is_the_difference_of_its_edges(exact):
    onset, leaves = exact["torus"], exact["period-doubling"]
    wide = width(onset, leaves, "width")
    assert wide.value_rpm == pytest.approx(leaves.value_rpm - onset.value_rpm)
    for n in ("guidance_gap", "eccentricity"):
        slope = leaves.derivative[n] - onset.derivative[n]
        assert wide.derivative[n] == pytest.approx(slope)
        value = float(jc.parameters(MODEL)[n])
        assert wide.elasticity[n] == pytest.approx(slope * value / wide.value_rpm)
    assert all(abs(r) < 1e-8 for r in wide.homogeneity.values())


def test_limit_of_a_cascade_is_differentiated_as_it_is_extrapolated(exact):
    """With both points the same the limit is that point, and so are its derivatives."""
    same = jc.Cascade((EDGES["period-doubling"],) * 2, EDGES["period-doubling"].value, 0.0)
    limit = limit_sensitivity(MODEL, same)
    assert limit.value_rpm == pytest.approx(exact["period-doubling"].value_rpm)
    assert limit.elasticity["guidance_gap"] == pytest.approx(exact["period-doubling"].elasticity["guidance_gap"])


def test_point_that_is_not_there():
    lost = jc.sensitivity(MODEL, point("fold", 16000.0, [0.0, -1.6e-4, 0.46, 0.035]))
    assert lost.status == "no such point" and not lost.trusted
    assert np.isnan(lost.value_rpm) and np.isnan(lost.elasticity["guidance_gap"])
