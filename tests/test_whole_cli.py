"""`jaxcage simulate` of a whole bearing; speeds of the shaft."""

import json

import pytest

import jaxcage as jc
from jaxcage.cli import main


def test_simulate_prints_slips_forces_and_losses(capsys: pytest.CaptureFixture[str]):
    asked = ["simulate", "nu2310", "--speed", "10000 rpm shaft", "--revolutions", "1", "--json"]
    assert main(asked) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["outcome"] == "successful" and found["shaft_speed_rpm"] == 10000
    assert found["friction_power_W"] == pytest.approx(sum(found["power_parts_W"].values()))
    run = jc.simulate_bearing(jc.whole_bearing("nu2310"), jc.rpm(10000), revolutions=1, samples=32)
    expected = jc.bearing_measures(jc.whole_bearing("nu2310"), run, float(jc.rpm(10000)))
    names = "cage_slip roller_slip_max pocket_force_max_N pocket_force_mean_sum_N land_force_max_N eccentricity_mean"
    for name in names.split():
        assert found[name] == pytest.approx(getattr(expected, name), rel=1e-12)
    assert found["state"] == expected.state


def test_speed_of_the_cage(capsys: pytest.CaptureFixture[str]):
    cage = float(jc.whole_bearing("nu2310").rolling_cage_speed(1e4))
    assert main(["simulate", "nu2310", "--speed", f"{cage!r} rpm cage", "--revolutions", "1", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["shaft_speed_rpm"] == pytest.approx(1e4, rel=1e-12)


def test_what_a_whole_bearing_does_not_take(capsys: pytest.CaptureFixture[str]):
    assert main(["sweep", "nu2310"]) == 2
    assert "only `jaxcage simulate`" in capsys.readouterr().err
    assert main(["simulate", "nu2310", "--speed", "10000", "--solver", "rk4"]) == 2
    assert "--solver" in capsys.readouterr().err
