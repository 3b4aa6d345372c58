"""Zones, maps and ramps of the whole bearing: from made-up sweeps, against sweeps of their parts, as commands."""

import dataclasses
import json
import pathlib
import re

import numpy as np
import pytest
from test_whole_motion import SPEED, bearing

import jaxcage as jc
from jaxcage.analysis import bearing_zones
from jaxcage.cli import _whole, _whole_page, main
from jaxcage.plotting import bearing_ramp_figure
from jaxcage.report import read_operating
from jaxcage.sweeps import BearingRamp, BearingUpDown, bearing_up_down


jc.enable_x64()


@pytest.fixture(scope="module")
def swept():
    """Two speeds, two starts, as short as can be."""
    return jc.sweep_bearing(
        bearing(), jc.rpm(6000, 10000, 2), starts=2, discard=0, revolutions=2, blocks=2, tolerance=1e-3
    )


def made_up(found, states, exponents):
    """A sweep over other speeds with these states, and exponents that scatter by 0.1."""
    n, starts = np.shape(states)

    def spread(x):
        if isinstance(x, dict):
            return {name: spread(each) for name, each in x.items()}
        of_lanes = isinstance(x, np.ndarray) and x.ndim >= 2
        return np.repeat(np.repeat(x[:1, :1], n, axis=0), starts, axis=1) if of_lanes else x

    same = {f.name: spread(getattr(found, f.name)) for f in dataclasses.fields(found)}
    speed = np.asarray(jc.rpm(1000.0, 1000.0 * n, n))
    blocks = np.array(exponents, dtype=float)[:, None, None] + 0.1 * np.array([-1.0, 1.0]) * np.ones((n, starts, 2))
    means = {name: np.zeros((n, starts, 2)) for name in found.block_means} | {"exponent": blocks}
    return dataclasses.replace(found, **same | {"speed": speed, "state": np.array(states), "block_means": means})


@pytest.mark.wide
def test_zones_are_stretches_of_the_same(swept):
    assert {name for zone in bearing_zones(swept) for name in zone.states} == set(swept.state.ravel().tolist())
    a, b, c = "disordered", "circular", "failed"
    states = [[a, a], [a, a], [a, b], [b, b], [b, c], [c, c], [b, b]]
    found = bearing_zones(made_up(swept, states, [3.0, 4.0, 4.0, 2.0, 0.0, np.nan, 0.0]))
    assert [zone.states for zone in found] == [(a,), (b, a), (b,), (b,), (c,), (b,)]
    assert [zone.chaotic for zone in found] == [True, True, True, False, False, False]
    edges = [found[0].low_rpm, *(zone.high_rpm for zone in found)]
    assert edges == pytest.approx([1000, 2500, 3500, 4500, 5500, 6500, 7000])
    assert [zone.speeds for zone in found] == [2, 1, 1, 1, 1, 1] and found[0].exponent == pytest.approx(3.5)
    expected = np.std([2.9, 3.1, 3.9, 4.1] * 2, ddof=1) / np.sqrt(8)
    assert found[0].exponent_error == pytest.approx(expected, rel=1e-9)


@pytest.mark.wide
def test_a_ramp_is_runs_one_after_the_other():
    """Up by two steps: what a sweep of the first speed leaves is where the second begins; and down again from there."""
    model, low, high = bearing(), float(jc.rpm(8000)), SPEED
    turn = 2 * np.pi / float(model.rolling_cage_speed(low))
    found = bearing_up_down(model, low, high, (high - low) / (2.0 * turn), steps=2, starts=1, settle=1)
    assert found.up.revolutions.tolist() == [2, 2] and found.rpm == pytest.approx([8000, 10000])
    one = jc.sweep_bearing(model, low, starts=1, discard=1, revolutions=2, blocks=2, exponents=0)
    assert found.up.cage_slip[0] == pytest.approx(one.cage_slip[0, 0], rel=1e-9)
    assert found.up.eccentricity[0] == pytest.approx(one.eccentricity_max[0, 0], rel=1e-9)
    assert np.all(np.isfinite(found.up.friction_power_W)) and not found.up.failed.any()


def ramp(slip, error=1e-4):
    """One way with these slips."""
    slip = np.array(slip)
    rest = {f.name: np.ones_like(slip) for f in dataclasses.fields(BearingRamp)}
    own = {"cage_slip": slip, "cage_slip_error": np.full_like(slip, error), "failed": np.zeros(slip.size, dtype=bool)}
    return BearingRamp(**rest | own)


def test_hysteresis_is_beyond_the_errors():
    up, down = ramp([0.01, 0.02, 0.05, 0.05, 0.02]), ramp([0.01, 0.0205, 0.02, 0.02, 0.025])
    found = BearingUpDown(np.asarray(jc.rpm(1000.0, 5000.0, 5)), 100.0, up, down)
    assert found.apart.tolist() == [False, False, True, True, True]
    assert found.stretches == [(pytest.approx(3000), pytest.approx(5000))]
    loud = BearingUpDown(found.speed, 100.0, dataclasses.replace(up, cage_slip_error=np.full(5, 0.02)), down)
    assert not loud.apart.any() and loud.stretches == []
    slip, *_ = bearing_ramp_figure(found).axes  # shaded half a step beyond the speeds
    assert [(p.get_x(), p.get_width()) for p in slip.patches] == [(pytest.approx(2500), pytest.approx(3000))]
    np.testing.assert_allclose(slip.containers[1].lines[0].get_ydata(), 100 * down.cage_slip)


@pytest.mark.parametrize(
    "given, said",
    [
        ((SPEED, SPEED, 1.0), "positive and ascending"),
        ((100.0, SPEED, 0.0), "`rate` must be positive, but 0 was given"),
    ],
)
def test_refusals_of_ramps(given, said):
    with pytest.raises(ValueError, match=said):
        bearing_up_down(jc.whole_bearing("nu2310"), *given)


@pytest.mark.wide
def test_commands(capsys: pytest.CaptureFixture[str], tmp_path: pathlib.Path):
    """Zones and map print what sweeps of the same say; the ramp is drawn."""
    common = ["nu2310", "--first", "8000", "--last", "10000", "--discard", "0", "--json", "--out", str(tmp_path)]
    assert main(["zones", *common, "--count", "2", "--revolutions", "10", "--load", "1 kN"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["load_N"] == 1000 and found["zones"][-1]["high_rpm"] == pytest.approx(1e4)
    assert {state for zone in found["zones"] for state in zone["states"]} <= {s for row in found["state"] for s in row}
    asked = ["--lower", "1 kN", "--rows", "2", "--columns", "2", "--revolutions", "2"]
    assert main(["map", *common, *asked]) == 0
    mapped = json.loads(capsys.readouterr().out)
    assert mapped["y"] == "load" and mapped["y_values"] == pytest.approx([1000, 1.25 * 4450])
    models = [jc.replace(jc.whole_bearing("nu2310"), load=x) for x in mapped["y_values"]]
    each = jc.sweep_bearings(models, jc.rpm(8000, 10000, 2), starts=1, discard=0, revolutions=2, blocks=2)
    np.testing.assert_allclose(mapped["friction_power_W"][1], each[1].friction_power_W[:, 0], rtol=0.05)
    assert pathlib.Path(mapped["figure"]).stat().st_size > 30_000 and len(mapped["state"]) == 2
    assert main(["runup", *common, "--windows", "2", "--rate", "40000"]) == 0
    ramped = json.loads(capsys.readouterr().out)
    assert len(ramped["up"]["cage_slip"]) == 2 and pathlib.Path(ramped["figure"]).stat().st_size > 20_000


@pytest.mark.parametrize(
    "arguments, said",
    [
        (["zones", "nu2310", "--quick"], "Option --quick does not go with a whole bearing."),
        (["zones", "1a", "--load", "1 kN"], "Option --load goes with a whole bearing, such as nu2310."),
        (["map", "nu2310", "--x", "load"], "Option --x does not go with a whole bearing."),
        (["map", "nu2310", "--points", "10x10"], "Option --points does not go with a whole bearing."),
        (["map", "nu2310", "--y", "speed"], "Option --y must be one of bore"),
        (["map", "nu2310", "--rows", "0"], "Option --rows must be at least 2 for a whole bearing, but 0 was given."),
        (["map", "nu2310", "--lower", "3 kg"], "Option --lower"),
        (["compare", "nu2310", "1a"], "Case '1a' must be a whole bearing, as the first one is"),
        (["compare", "nu2310", "nu2310", "--at", "9000"], "Option --at does not go with a whole bearing."),
        (["report", "nu2310", "--operating", "fast"], "Option --operating must be speeds and ranges"),
        (["report", "nu2310", "--draws", "3"], "Option --draws does not go with a whole bearing."),
        (["runup", "nu2310", "--solver", "rk4"], "Option --solver does not go with a whole bearing."),
        (["runup", "nu2310", "--last", "200000"], "must leave the cage at most 300 m/s"),
        (["compare", "nu2310", "nu2310", "--last", "200000"], "must leave the cage at most 300 m/s"),
    ],
)
def test_refusals(arguments: list[str], said: str, capsys: pytest.CaptureFixture[str], tmp_path: pathlib.Path):
    assert main([*arguments, "--out", str(tmp_path / "out")]) == 2
    assert said in capsys.readouterr().err and not (tmp_path / "out").exists()


def test_speeds_of_the_cage_with_a_turning_outer_ring(capsys: pytest.CaptureFixture[str], tmp_path: pathlib.Path):
    """The outer ring turns the cage by itself; what it does is neither forgotten nor asked back of the shaft."""
    (path := tmp_path / "planet.toml").write_text('base = "nu2310"\nouter_speed = "1500 rpm"')
    assert main(["sweep", str(path), "--first", "500 rpm cage", "--out", str(tmp_path / "out")]) == 2
    assert "--first must be above 898.075 rpm of the cage, which the outer ring makes" in capsys.readouterr().err
    planet = jc.replace(jc.whole_bearing("nu2310"), outer_speed=float(jc.rpm(1500)))
    ratio = float(planet.rolling_cage_speed(1.0) - planet.rolling_cage_speed(0.0))
    at_rest = float(planet.rolling_cage_speed(0.0)) * 30 / np.pi
    for text in ("1200 rpm cage", f"{(1200 - at_rest) / ratio:.6f} rpm shaft"):
        (at,) = read_operating(text, ratio, "cage", at_rest)
        assert at.low_rpm == pytest.approx(1200, abs=1e-3)


@pytest.mark.wide
def test_the_report(capsys: pytest.CaptureFixture[str], tmp_path: pathlib.Path, monkeypatch: pytest.MonkeyPatch):
    """A page that needs nothing from outside, with what sweep and simulate say."""
    monkeypatch.setattr(_whole_page, "REVOLUTIONS", 2)
    monkeypatch.setattr(_whole_page, "DISCARD", 0)
    monkeypatch.setattr(_whole, "SAMPLES", 32)
    asked = ["report", "nu2310", "--first", "8000", "--last", "10000", "--count", "2", "--quick", "--discard", "0"]
    asked += ["--revolutions", "10", "--operating", "9000 rpm shaft", "--json", "--out", str(tmp_path)]
    assert main(asked) == 0
    found = json.loads(capsys.readouterr().out)
    text = pathlib.Path(found["report"]).read_text()
    assert found["operating_shaft_rpm"] == pytest.approx([9000]) and found["gradient"] is None
    assert f"{100 * found['measures']['cage_slip']:.2f} %" in text and "At 9000 rpm of the shaft" in text
    assert text.count("data:image/svg+xml;base64,") == 4 and "http" not in text.replace("http-equiv", "")
    assert "Spectrum, Cage" in text and "guidance gap C_r between cage and land" in text
    ids = re.findall('id="([^"]+)"', text)
    assert len(ids) == len(set(ids)) and set(re.findall('href="#([^"]+)"', text)) <= set(ids)
