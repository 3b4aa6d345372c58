"""Run-up and run-down: the pace of a ramp, what counts as hysteresis, the command."""

import json
from pathlib import Path

import numpy as np
import pytest

import jaxcage as jc
from jaxcage.cli import main
from jaxcage.io import read_columns
from jaxcage.plotting import ramp_figure
from jaxcage.sweeps import Ramped, RampUpDown, ramp_revolutions, ramp_up_down


def planted(up: np.ndarray, down: np.ndarray, scatter: float) -> RampUpDown:
    rpm = np.linspace(5000.0, 9000.0, up.size)
    way = lambda size: Ramped(rpm, size, np.full(size.size, scatter), size / 4e-4)
    return RampUpDown(way(up), way(down), 400, 2.0, (1000.0, 1800.0))


def test_a_ramp_takes_as_long_as_its_rate_says():
    first, last, seconds = 300.0, 1500.0, 7.0
    count = ramp_revolutions(first, last, seconds)
    speed = first + (last - first) * (np.arange(64 * count) + 0.5) / (64 * count)
    assert np.sum(2 * np.pi / 64 / speed) == pytest.approx(seconds, rel=1e-3)


def test_a_jump_in_one_direction_is_hysteresis_and_scatter_is_not():
    size = np.linspace(1e-4, 3e-4, 40)
    late = size.copy()
    late[15:22] += 1e-4
    found = planted(size, late, 2e-6)
    assert np.flatnonzero(found.apart).tolist() == list(range(15, 22))
    ((low, high),) = found.stretches
    assert (low, high) == pytest.approx((found.up.rpm[15], found.up.rpm[21]))
    assert not np.any(planted(size, late, 6e-5).apart)
    alone = size.copy()
    alone[10] += 1e-4
    assert not np.any(planted(size, alone, 2e-6).apart)
    labels = {text.get_text() for legend in ramp_figure(found).legends for text in legend.get_texts()}
    assert {"run-up", "run-down", "differs: hysteresis"} <= labels


def test_chaos_alone_is_no_hysteresis():
    """Sizes and halves that scatter alike both ways: of 2000 windows hardly any is taken for a difference."""
    rng, rpm = np.random.default_rng(0), np.linspace(5000.0, 9000.0, 2000)

    def way() -> Ramped:
        half = 1e-4 * (1 + 0.2 * rng.standard_normal((2000, 2)))
        return Ramped(rpm, half.max(axis=1), np.abs(half[:, 1] - half[:, 0]), half[:, 0])

    assert np.sum(RampUpDown(way(), way(), 400, 2.0, (1.0, 1.0)).apart) <= 10


def test_too_fast_a_ramp_is_refused(capsys: pytest.CaptureFixture[str], tmp_path: Path):
    assert main(["runup", "1a", "--rate", "1e6", "--out", str(tmp_path)]) == 2
    said = capsys.readouterr().err
    assert "Option --rate must leave two revolutions for each of 100 windows" in said and "choose at most" in said


@pytest.mark.wide
def test_the_command(capsys: pytest.CaptureFixture[str], tmp_path: Path):
    asked = "--first 14000 --last 15000 --rate 2000 --windows 10 --discard 20 --solver rk4 --steps 256".split()
    assert main(["runup", "1a", *asked, "--out", str(tmp_path), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["ramp_seconds"] == pytest.approx(0.5, rel=0.1)
    up, down = found["up"], found["down"]
    assert len(up["orbit_size_m"]) == len(down["orbit_size_m"]) > 9
    assert up["speeds_rpm"] == pytest.approx(down["speeds_rpm"], rel=2e-3) and up["speeds_rpm"][0] < 14100
    columns = read_columns(found["data"])
    assert columns["orbit size up [m]"] == pytest.approx(up["orbit_size_m"])
    assert columns["shaft speed [rpm]"] * found["cage_speed_ratio"] == pytest.approx(columns["cage speed [rpm]"])


@pytest.mark.wide
def test_at_a_crawl_it_is_the_orbit_at_that_speed():
    model, method = jc.case("1a"), jc.method("rk4", steps=256)
    found = ramp_up_down(model, *jc.rpm(15000, 15001), jc.rpm(0.5), windows=4, settle=200, method=method)
    run = jc.simulate(model, jc.rpm(15000), revolutions=200, samples=32, discard=200, method=method)
    size = float(np.max(np.ptp(run.state[:, :2], axis=0)))
    assert found.up.size == pytest.approx(size, rel=0.05) and found.down.size == pytest.approx(size, rel=0.05)
