"""The open benchmark case: its constants are those of NU2310, its arcs are confirmed by both implementations."""

import json
import pathlib

import jax.numpy as jnp
import numpy as np
import pytest
from reference import WholeBearing

import jaxcage as jc
from jaxcage.io import configuration, whole_bearing_from
from jaxcage.models import BearingState, Bodies, Rollers, state_scale


jc.enable_x64()
CASE = json.loads((pathlib.Path(__file__).parents[1] / "benchmarks" / "bearing_case.json").read_text())
ARCS = CASE["arcs"]


def arrays(part: dict) -> tuple[np.ndarray, np.ndarray]:
    """Rollers and bodies of a state."""
    return np.array([part["rollers"][n] for n in Rollers._fields]), np.array(
        [part["bodies"][n] for n in Bodies._fields]
    )


def model_of(stretch: dict) -> jc.BearingModel:
    return jc.replace(whole_bearing_from(CASE["configuration"]), load=stretch["load_N"])


def apart(stretch: dict, found: tuple[np.ndarray, np.ndarray], i: int) -> float:
    """Largest difference from the state that is kept, in units of the scale."""
    rollers, bodies = arrays(stretch["states"][i])
    scale = np.array([stretch["scale"]["rollers"][n] for n in Rollers._fields])
    unit = np.array([stretch["scale"]["bodies"][n] for n in Bodies._fields])
    return max(np.abs((found[0] - rollers) / scale[:, None]).max(), np.abs((found[1] - bodies) / unit).max())


def test_constants():
    model = jc.whole_bearing("nu2310")
    assert whole_bearing_from(CASE["configuration"]).bearing.n_rollers == 13
    assert CASE["configuration"] == configuration(model)
    info = jc.parameter_info(model)
    assert {name: row["value"] for name, row in CASE["constants"].items()} == pytest.approx(
        {name: float(x) for name, x in jc.parameters(model).items()}, rel=1e-15
    )
    assert all(row["unit"] == info[name].unit and row["meaning"] for name, row in CASE["constants"].items())


def test_scale_and_errors():
    for stretch in ARCS:
        scale = state_scale(model_of(stretch), jc.rpm(stretch["shaft_speed_rpm"]))
        assert [stretch["scale"]["bodies"][n] for n in Bodies._fields] == pytest.approx(np.asarray(scale.bodies))
        assert 0 < stretch["error_of_an_arc"] < 1e-3
        angles = np.diff([state["cage_angle"] for state in stretch["states"]])
        np.testing.assert_allclose(angles, stretch["arc_rad"], rtol=1e-9)


@pytest.mark.wide
@pytest.mark.parametrize("which", range(len(ARCS)))
def test_an_arc_by_the_second_implementation(which: int):
    """Rollers and cage as free bodies, integrated over time by SciPy, until the cage has turned."""
    stretch = ARCS[which]
    state = stretch["states"][1]
    theirs = WholeBearing(model_of(stretch), jc.rpm(stretch["shaft_speed_rpm"]))
    end = theirs.arc(state["cage_angle"], *arrays(state), stretch["arc_rad"])
    assert apart(stretch, end, 2) < 1e-6 + 3 * stretch["error_of_an_arc"]
    assert apart(stretch, arrays(state), 2) > 1e-2


@pytest.mark.wide
def test_arcs_by_another_tolerance():
    """Each from its own beginning, by longer steps."""
    stretch = ARCS[0]
    model, speed = model_of(stretch), jc.rpm(stretch["shaft_speed_rpm"])
    for i in range(len(stretch["states"]) - 1):
        state = stretch["states"][i]
        rollers, bodies = arrays(state)
        start = BearingState(jnp.asarray(rollers), jnp.asarray(bodies), jnp.array([state["cage_angle"], 0.0]))
        run = jc.simulate(model, speed, revolutions=1, samples=32, start=start, method=jc.native(1e-5, 1e-2))
        assert apart(stretch, (run.rollers[1], run.bodies[1]), i + 1) < 1e-3


def test_statistics_have_errors_and_states():
    for row in CASE["statistics"]["at"]:
        assert 0 < row["cage_slip"]["standard_error"] < 0.02
        assert row["exponent"] is None or row["exponent"]["mean"] > 3 * row["exponent"]["standard_error"] > 0
        assert set(row["state"]) <= {"circular", "locally_periodic", "disordered"}
        assert set(row["outcome"]) <= {"successful", "inaccurate"}
