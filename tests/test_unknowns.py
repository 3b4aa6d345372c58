"""Ranges in a file, what is drawn from them, the chances that come of it, and measurements that narrow them."""

import dataclasses
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers import document, is_png

import jaxcage as jc
from jaxcage.design import Chance, Ensemble, ensemble, indices, misses, narrow, range_chance
from jaxcage.files import (
    ConfigError,
    Measurement,
    Range,
    Unknown,
    model_from,
    read_bearing,
    read_measurements,
    read_range,
    with_ranges,
    write_template,
)
from jaxcage.lanes import sobol
from jaxcage.show import indices_note


STIFF = Unknown("support.stiffness", ("stiffness_x", "stiffness_y"), Range(1e4, 1e6))
HIT = Unknown("impact.amplitude", ("amplitude",), Range(5.0, 300.0))


def planted(chaotic: np.ndarray, place: np.ndarray) -> Ensemble:
    speeds = jc.rpm(5000, 9000, chaotic.shape[1])
    none = np.zeros(chaotic.shape, dtype=bool)
    sources = ("tap the cage", "measure its acceleration")
    return Ensemble((STIFF, HIT), sources, place, speeds, chaotic, none, 100, 100)


def by_stiffness(draws: int = 64) -> Ensemble:
    """Chaotic at 5000 rpm always, at 9000 rpm never, between them where the support is soft."""
    place = sobol(2, draws, 0)
    soft = place[:, 0] < 0.4
    chaotic = np.stack([np.ones(draws, dtype=bool), soft, soft, np.zeros(draws, dtype=bool)], axis=1)
    return planted(chaotic, place)


@pytest.mark.parametrize(
    "text, unit, lower, upper, best",
    [
        ("1e4 .. 1e6 N/m", "N/m", 1e4, 1e6, 1e5),
        ("0.2 mm .. 300 um", "m", 2e-4, 3e-4, 2.5e-4),
        ("139400 (1e4 .. 1e6) N/m", "N/m", 1e4, 1e6, 139400.0),
        ("-5e3 .. 5e3 N/m", "N/m", -5e3, 5e3, 0.0),
        ("40 .. 60 degC", "K", 313.15, 333.15, 323.15),
        ("20 um +- 3 um", "m", 17e-6, 23e-6, 20e-6),
        ("0.40 ± 0.08 mm", "m", 0.32e-3, 0.48e-3, 0.4e-3),
        ("0.40 mm +/- 0.08", "m", 0.32e-3, 0.48e-3, 0.4e-3),
    ],
)
def test_ranges_as_they_are_written(text: str, unit: str, lower: float, upper: float, best: float):
    found = read_range(text, unit)
    assert (found.lower, found.upper, found.best) == pytest.approx((lower, upper, best), rel=1e-9, abs=1e-9)
    assert found.at(np.array([0.0, 1.0])) == pytest.approx([lower, upper], rel=1e-6)


@pytest.mark.parametrize(
    "value, said",
    [
        ("1e6 .. 1e4 N/m", "whose ends do not ascend"),
        ("2e6 (1e4 .. 1e6) N/m", "whose best guess lies outside it"),
        ("1e4 .. 1e12 N/m", r"must be a number from 0 to 1e\+09 N/m, but is 1e\+12 N/m"),
    ],
)
def test_ranges_that_are_none_are_refused(value: str, said: str):
    with pytest.raises(ConfigError, match=f"`support.stiffness` .*{said}"):
        model_from({"base": "1a", "support": {"stiffness": value}})


def test_binomial_bars_against_printed_ones():
    """0 of 10: 0 to 0.3085; 5 of 10: 0.1871 to 0.8129 (Clopper and Pearson's tables)."""
    for chaotic, bars in ((10, (0.0, 0.3085)), (5, (0.1871, 0.8129)), (0, (0.6915, 1.0))):
        assert Chance(chaotic, 10, 10).interval == pytest.approx(bars, abs=1e-4)


def test_what_is_not_decided_says_what_to_measure():
    found = by_stiffness()
    assert [each.state for each in found.chances] == ["rattles", "not decided", "not decided", "calm"]
    assert found.chance_of_chaos[:, 0] == pytest.approx([1.0, 0.4, 0.4, 0.0], abs=0.02)
    middle, chaotic, known = range_chance(found, 6000, 8000)
    assert middle.chaotic == np.sum(chaotic) == np.sum(found.place[:, 0] < 0.4)
    assert indices_note(indices(found, chaotic, known)) == "Measure support.stiffness first: tap the cage"


def test_verdicts_and_lanes_that_failed():
    states = [Chance(k, 64, 64).state for k in (3, 4, 60, 61)]
    assert states == ["calm", "not decided", "not decided", "rattles"]
    assert [Chance(0, n, 64).state for n in (61, 60)] == ["calm", "not decided"]  # those that failed may be chaotic
    assert Chance(0, 28, 28).state == "not decided" and Chance(0, 29, 29).interval[0] > 0.88
    found = by_stiffness()
    lost = np.zeros((64, 4), dtype=bool)
    lost[:, 3] = True
    failed = dataclasses.replace(found, failed=lost)
    assert failed.chances[3].state == "not decided" and np.isnan(failed.chance_of_chaos[3, 0])
    assert failed.chance_of_chaos[3, 1:].tolist() == [0.0, 1.0]


CSV = """quantity, speed, value, tolerance
# from the test bench
whirl frequency, 12000 rpm shaft, 83 Hz, 2 Hz
orbit size, 500 rad/s cage, 0.12 mm, 10 um

calm, 15000
Rattles, 24000
"""


def test_a_file_of_measurements(tmp_path: Path):
    (tmp_path / "m.csv").write_text(CSV)
    first, second, calm, rattles = read_measurements(tmp_path / "m.csv", "shaft", 0.4)
    assert (first.quantity, first.cage_rpm, first.value, first.tolerance) == ("whirl frequency", 4800.0, 83.0, 2.0)
    assert second.cage_rpm == pytest.approx(500 * 30 / np.pi)
    assert (second.value, second.tolerance) == pytest.approx((0.12e-3, 10e-6))
    assert str(second) == "orbit size at 4775 rpm of the cage: 0.12 ± 0.01 mm"
    assert (calm.quantity, calm.cage_rpm, rattles.quantity) == ("calm", 6000.0, "rattles")


@pytest.mark.parametrize(
    "row, said",
    [
        ("orbit size, 5000, 0.12, 1 um", 'line 2: `value` must have its unit, like "0.12 mm", but is "0.12"'),
        ("whirl frequency, 5000, 83 mm, 1 Hz", '`value` must be like "83 Hz", but has the unit "mm"'),
        ("noise, 5000", '`quantity` must be one of whirl frequency, orbit size, rattles, calm, but is "noise"'),
        ("calm, 5000, 3 mm", "`calm` is seen or not and must have no value"),
    ],
)
def test_rows_that_are_refused(tmp_path: Path, row: str, said: str):
    (tmp_path / "m.csv").write_text(f"quantity, speed, value, tolerance\n{row}\n")
    with pytest.raises(ConfigError) as error:
        read_measurements(tmp_path / "m.csv")
    assert said in str(error.value)


def probe(truth: np.ndarray, tolerance: float) -> Any:
    """One measurement of the first place, and one of a mixture of the first two; the third plays no part."""
    seen = lambda place: np.stack([place[:, 0], 0.5 * place[:, 0] + 0.5 * place[:, 1] ** 2], axis=1)
    return lambda place: np.abs(seen(place) - seen(truth[None])) / tolerance


def test_the_truth_is_seldom_given_up():
    """Planted at random, of 100 the truth stays within all new ranges."""
    rng, kept = np.random.default_rng(0), 0
    for seed in range(100):
        truth = rng.uniform(size=2)
        found = narrow((STIFF, HIT), probe(truth, 0.05), draws=64, seed=seed)
        kept += bool(np.all((found.lower <= truth) & (truth <= found.upper)))
    assert kept >= 97


def test_a_new_range_leaves_the_rest_of_the_file_alone(tmp_path: Path):
    path = write_template(tmp_path / "mine.toml")
    text = path.read_text()
    new = {"support.stiffness": (Range(2e4, 4e4, 3e4), "N/m"), "contact.onset": (Range(0.91, 0.95, 0.92), "1")}
    (tmp_path / "new.toml").write_text(with_ranges(text, new))
    before, after = text.splitlines(), (tmp_path / "new.toml").read_text().splitlines()
    changed = [(a, b) for a, b in zip(before, after, strict=True) if a != b]
    assert len(changed) == 2 and all(a.split("#")[1] == b.split("#")[1] for a, b in changed)
    found = {u.label: u.range for u in read_bearing(tmp_path / "new.toml").unknowns}
    assert found["support.stiffness"] == Range(2e4, 4e4, 3e4) and found["contact.onset"] == Range(0.91, 0.95, 0.92)
    assert found["impact.unmatched"] == {u.label: u.range for u in read_bearing(path).unknowns}["impact.unmatched"]
    with pytest.raises(ConfigError, match="`rib.mass` must be written as key"):
        with_ranges(text, {"rib.mass": (Range(1.0, 2.0), "kg")})


@pytest.mark.wide
def test_a_cage_meets_its_own_measurements():
    """Sizes and whirl frequencies of planted cages, measured on themselves, are met by them and not by others."""
    model = jc.replace(jc.case("1a"), clearance_reading="radial", unbalance="physical")
    place = np.array([[0.3, 0.2], [0.8, 0.9]])
    seen = [Measurement("orbit size", 12000.0, 1e-3, 1e-3), Measurement("whirl frequency", 12000.0, 1.0, 1.0)]
    method = jc.method("rk4", steps=1024)
    off = misses(model, (STIFF, HIT), seen, place, method=method)
    size, whirl = 1e-3 * (1 - off[0, 0]), 1.0 + off[0, 1]
    assert abs(whirl - 200 * round(whirl / 200)) < 1  # of the cage's 200 Hz
    own = [Measurement("orbit size", 12000.0, size, 1e-6), Measurement("whirl frequency", 12000.0, whirl, 1.0)]
    again = misses(model, (STIFF, HIT), own, place, method=method)
    assert np.all(again[0] <= 1e-6) and again[1, 0] > 1


@pytest.mark.wide
def test_draws_that_all_settle_early_are_calm():
    wide = jc.replace(jc.case("1a"), clearance_reading="radial", unbalance="physical", land_width=4e-3)
    stiff = Unknown("support.stiffness", ("stiffness_x", "stiffness_y"), Range(1e5, 1e6))
    found = ensemble(wide, (stiff,), jc.rpm(2000, 3000, 2), draws=4, method=jc.method("rk4", steps=1024))
    assert found.chaotic.shape == (4, 2) and not found.chaotic.any() and not found.failed.any()


@pytest.mark.wide
def test_commands_for_files_with_ranges(capsys: pytest.CaptureFixture[str], tmp_path: Path):
    """Few draws: chances with their bars, an answer to what to measure, a file of which no draw does what was seen."""
    path, out = str(write_template(tmp_path / "mine.toml")), ["--out", str(tmp_path)]
    found = document(capsys, "sweep", path, "--count", "2", "--draws", "2", *out)
    each = found["by_speed"]
    assert found["verdict"] == "not decided" and is_png(found["figure"])
    assert [speed["verdict"] for speed in each] == ["not decided"] * 2
    assert all(low <= high for low, high in (speed["calm_interval"] for speed in each))
    (csv := tmp_path / "m.csv").write_text("quantity, speed, value, tolerance\norbit size, 20000, 0.2 mm, 20 um\n")
    new = document(capsys, "identify", path, str(csv), *out)
    before, after = ({u.label: u.range for u in read_bearing(file).unknowns} for file in (path, new["file"]))
    assert set(before) == set(after) and new["measurements"][0]["off_by_tolerances"] <= 1
    assert all(before[n].lower <= after[n].lower < after[n].upper <= before[n].upper for n in before)
    assert any(before[n] != after[n] for n in before)
