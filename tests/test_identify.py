"""Measurements from a file, ranges that close around them, and a file with the new ranges."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import jaxcage as jc
from jaxcage.cli import main
from jaxcage.io import (
    ConfigError,
    Measurement,
    Range,
    Unknown,
    read_bearing,
    read_measurements,
    with_ranges,
    write_template,
)
from jaxcage.studies import misses, narrow


STIFF = Unknown("support.stiffness", ("stiffness_x", "stiffness_y"), Range(1e4, 1e6))
HIT = Unknown("impact.amplitude", ("amplitude",), Range(5.0, 300.0))
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
        ("orbit size, 5000, 0.12 mm", '`tolerance` must be like "10 um", but is ""'),
        ("orbit size, 5000, -1 mm, 1 um", '`value` must be above 0, like "0.12 mm", but is "-1 mm"'),
        ("orbit size, fast, 1 mm, 1 um", '`speed` must be like "12000 rpm shaft", but is "fast"'),
        ("whirl frequency, 5000, 83 mm, 1 Hz", '`value` must be like "83 Hz", but has the unit "mm"'),
        ("noise, 5000", '`quantity` must be one of whirl frequency, orbit size, rattles, calm, but is "noise"'),
        ("calm, 5000, 3 mm", "`calm` is seen or not and must have no value"),
        ("calm, 5000, , , x", "must have 4 columns, but has 5"),
    ],
)
def test_rows_that_are_refused(tmp_path: Path, row: str, said: str):
    (tmp_path / "m.csv").write_text(f"quantity, speed, value, tolerance\n{row}\n")
    with pytest.raises(ConfigError) as error:
        read_measurements(tmp_path / "m.csv")
    assert said in str(error.value)


@pytest.mark.parametrize("text, said", [("", "the first line must be"), (CSV.splitlines()[0], "has none under its")])
def test_files_that_are_none(tmp_path: Path, text: str, said: str):
    (tmp_path / "m.csv").write_text(text)
    with pytest.raises(ConfigError, match=said):
        read_measurements(tmp_path / "m.csv")


def probe(truth: np.ndarray, tolerance: float) -> Any:
    """One measurement of the first place, and one of a mixture of the first two; the third plays no part."""
    seen = lambda place: np.stack([place[:, 0], 0.5 * place[:, 0] + 0.5 * place[:, 1] ** 2], axis=1)
    return lambda place: np.abs(seen(place) - seen(truth[None])) / tolerance


def test_ranges_close_around_the_truth_and_only_where_something_was_measured():
    unknowns = (STIFF, HIT, Unknown("support.damping", ("damping",), Range(0.3, 30.0)))
    truth = np.array([0.62, 0.35, 0.8])
    found = narrow(unknowns, probe(truth, 0.05))
    assert found.met and found.share[0] < 0.5 and found.share[1] < 0.8 and found.share[2] == 1.0
    assert np.all((found.lower < truth) & (truth < found.upper))
    assert found.ranges[2] == unknowns[2].range and found.ranges[0].upper < 1e6
    assert found.ranges[0].lower < found.ranges[0].best < found.ranges[0].upper


def test_the_truth_is_seldom_given_up():
    """Planted at random, of 100 the truth stays within all new ranges."""
    rng, kept = np.random.default_rng(0), 0
    for seed in range(100):
        truth = rng.uniform(size=2)
        found = narrow((STIFF, HIT), probe(truth, 0.05), draws=64, seed=seed)
        kept += bool(np.all((found.lower <= truth) & (truth <= found.upper)))
    assert kept >= 97


def test_what_no_draw_does_is_said():
    found = narrow((STIFF, HIT), lambda place: np.full((len(place), 1), 7.0), stages=2)
    assert not found.met and found.stages == 2 and found.nearest.tolist() == [7.0]
    lost = narrow((STIFF,), lambda place: np.full((len(place), 1), np.nan), stages=1)
    assert not lost.met


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
    assert found["impact.amplitude"] == {u.label: u.range for u in read_bearing(path).unknowns}["impact.amplitude"]
    with pytest.raises(ConfigError, match="`rib.mass` must be written as key"):
        with_ranges(text, {"rib.mass": (Range(1.0, 2.0), "kg")})


def test_the_command_writes_a_file_with_narrower_ranges(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path
):
    path, csv = write_template(tmp_path / "mine.toml"), tmp_path / "m.csv"
    csv.write_text("quantity, speed, value, tolerance\norbit size, 20000, 0.2 mm, 20 um\n")
    labels = [u.label for u in read_bearing(path).unknowns]
    k = labels.index("support.stiffness")
    monkeypatch.setattr(
        "jaxcage.studies._identify.misses", lambda _m, _u, _d, place, **_: np.abs(place[:, k : k + 1] - 0.5) / 0.1
    )
    arguments = ["identify", str(path), str(csv), "--out", str(tmp_path / "out")]
    assert main([*arguments, "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["measurements"][0]["off_by_tolerances"] < 1 and found["ranges"]["support.stiffness"]["narrowed"]
    new = {u.label: u.range for u in read_bearing(found["file"]).unknowns}
    low, high = new["support.stiffness"].lower, new["support.stiffness"].upper
    assert 2e4 < low < 1e5 < high < 5e5 and new["impact.amplitude"].lower == 5.0
    monkeypatch.setattr("jaxcage.studies._identify.misses", lambda *_, **__: np.full((128, 1), 3.0))
    assert main(arguments) == 1
    assert "None of 128 draws does what was measured" in capsys.readouterr().err
    assert main(["identify", "1a", str(csv), "--out", str(tmp_path)]) == 2
    assert "must be a TOML file with ranges" in capsys.readouterr().err


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


def test_a_tight_tolerance_closes_a_range_as_a_wide_one_does():
    """What counted no more than 5 tolerances left all draws alike where three in four were further off."""
    tight = narrow([STIFF, HIT], lambda place: np.abs(place[:, :1] - 0.3) / 1e-3, draws=64)
    assert tight.lower[0] < 0.3 < tight.upper[0] and tight.share[0] < 0.05
    assert tight.share[1] > 0.7
