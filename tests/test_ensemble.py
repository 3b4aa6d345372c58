"""Ranges in a file, what is drawn from them, and the chances that come of it."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import jaxcage as jc
from jaxcage.cli import main
from jaxcage.io import (
    ConfigError,
    Range,
    Unknown,
    model_from,
    read_bearing,
    read_range,
    write_template,
)
from jaxcage.report import chances_notes, chances_table, operating_chances, read_operating
from jaxcage.studies import Band, Ensemble, binomial_interval, draw, ensemble, sobol, verdict_of


STIFF = Unknown("support.stiffness", ("stiffness_x", "stiffness_y"), Range(1e4, 1e6))
HIT = Unknown("impact.amplitude", ("amplitude",), Range(5.0, 300.0))


def planted(chaotic: np.ndarray, place: np.ndarray) -> Ensemble:
    speeds = jc.rpm(5000, 9000, chaotic.shape[1])
    none = np.zeros(chaotic.shape, dtype=bool)
    sources = ("tap the cage", "measure its acceleration")
    return Ensemble(
        (STIFF, HIT), sources, place, speeds, chaotic, none, (Band("zone 1 onset", 0.5, (1.0, 2.0, 3.0)),), 100, 100
    )


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
        ("1e4..1e6", "N/m", 1e4, 1e6, 1e5),
        ("0.2 mm .. 300 um", "m", 2e-4, 3e-4, 2.5e-4),
        ("139400 (1e4 .. 1e6) N/m", "N/m", 1e4, 1e6, 139400.0),
        ("2.4e9 (2e8 .. 2e10) N/m^(10/9)", "N/m^(10/9)", 2e8, 2e10, 2.4e9),
        ("-5e3 .. 5e3 N/m", "N/m", -5e3, 5e3, 0.0),
        ("40 .. 60 degC", "K", 313.15, 333.15, 323.15),
        ("20 um +- 3 um", "m", 17e-6, 23e-6, 20e-6),
        ("0.9 .. 0.99", "1", 0.9, 0.99, 0.945),
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
        ("1e4 .. stiff", "which is not a range such as"),
        ("1e4 .. 1e6 mm", 'has the unit "mm", where a unit like "N/m" is wanted'),
        ("1e4 .. 1e12 N/m", r"must be a number from 0 to 1e\+09 N/m, but is 1e\+12 N/m"),
    ],
)
def test_ranges_that_are_none_are_refused(value: str, said: str):
    with pytest.raises(ConfigError, match=f"`support.stiffness` .*{said}"):
        model_from({"base": "1a", "support": {"stiffness": value}})


def test_one_key_for_both_stiffnesses_is_one_unknown():
    found: list[Unknown] = []
    model = model_from({"base": "1a", "support": {"stiffness": "1e4 .. 1e6 N/m"}}, found)
    assert found == [STIFF] and float(model.support.stiffness_x) == float(model.support.stiffness_y) == pytest.approx(
        1e5
    )
    models = draw(model, found, np.array([[0.0], [0.75]]))
    assert [float(m.support.stiffness_y) for m in models] == pytest.approx([1e4, 10**5.5])


def test_binomial_bars_against_printed_ones():
    """0 of 10: 0 to 0.3085; 5 of 10: 0.1871 to 0.8129 (Clopper and Pearson's tables)."""
    low, high = binomial_interval([0, 5, 10], [10, 10, 10])
    assert low == pytest.approx([0.0, 0.1871, 0.6915], abs=1e-4) and high == pytest.approx(
        [0.3085, 0.8129, 1.0], abs=1e-4
    )


def test_what_is_not_decided_says_what_to_measure():
    found = by_stiffness()
    assert found.verdict == ["chaotic", "not decided", "not decided", "calm"]
    assert found.chance == pytest.approx([1.0, 0.4, 0.4, 0.0], abs=0.02)
    first, second = found.clues()
    assert first.label == "support.stiffness" and first.share > 0.5 > 0.1 > second.share
    note = chances_notes(found)[0]
    assert note.startswith("Not decided by what is known at 2 of 4 speeds. Measure support.stiffness (tap the cage)")
    rows = chances_table("mine", found).rows
    assert [row[2] for row in rows] == ["chaotic", "not decided by what is known", "calm"]
    at = operating_chances(found, read_operating("6500, 9000"), 0.4).rows
    assert at[0][3] == "not decided by what is known" and "tap the cage" in at[0][4] and at[1][3:] == ("calm", "-")


def test_verdicts_and_lanes_that_failed():
    assert [verdict_of(k, 64, 64) for k in (3, 4, 60, 61)] == ["calm", "not decided", "not decided", "chaotic"]
    assert [verdict_of(0, n, 64) for n in (61, 60)] == ["calm", "calm as computed"]  # those that failed may be chaotic
    assert [verdict_of(k, 60, 64) for k in (3, 4, 56, 57, 60)] == [
        "calm as computed",
        *2 * ["not decided"],
        *2 * ["chaotic as computed"],
    ]
    assert verdict_of(0, 28, 28) == "too few draws" and binomial_interval(0, 29)[1] < 0.12
    found = by_stiffness()
    lost = np.zeros((64, 4), dtype=bool)
    lost[:, 3] = True
    failed = Ensemble(*(lost if name == "failed" else value for name, value in vars(found).items()))
    assert failed.verdict[3] == "too few draws" and np.isnan(failed.chance[3])
    assert [bound[3] for bound in failed.interval] == [0.0, 1.0]


def test_commands_answer_a_file_with_ranges_by_chances(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path
):
    asked: dict[str, Any] = {}

    def stub(model: Any, unknowns: Any, speeds: np.ndarray, **options: Any) -> Ensemble:
        asked.update(options, speeds=speeds, unknowns=unknowns)
        return by_stiffness()

    monkeypatch.setattr("jaxcage.cli._chances.ensemble", stub)
    path = str(write_template(tmp_path / "mine.toml"))
    assert main(["sweep", path, "--out", str(tmp_path), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert asked["speeds"].size == 40 and asked["draws"] == 64 and len(asked["unknowns"]) == 9
    assert found["verdict"] == ["chaotic", "not decided", "not decided", "calm"] and len(found["chance_lower"]) == 4
    assert found["measure"][0]["what"] == "support.stiffness" and Path(found["figure"]).exists()
    assert "guidance_gap" in found["left_as_in_template"] and "best_guesses" not in found
    assert main(["zones", path, "--out", str(tmp_path)]) == 0
    text = capsys.readouterr().out
    assert (
        "not decided by what is known" in text and "As the template has them, of another bearing: guidance_gap" in text
    )


def test_an_ensemble_of_no_draws_is_refused():
    with pytest.raises(ValueError, match="`draws` must be at least 1, but 0 was given"):
        ensemble(jc.case("1a"), [STIFF], jc.rpm(6000, 7000, 2), draws=0)


def test_unknowns_names_the_measurement(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path
):
    """A verdict that hangs on the support alone: its total index is 1, those of the others 0."""
    path = str(write_template(tmp_path / "mine.toml"))
    labels = [u.label for u in read_bearing(path).unknowns]
    column = labels.index("support.stiffness")

    def stub(model: Any, unknowns: Any, speeds: np.ndarray, place: np.ndarray, **options: Any) -> np.ndarray:
        return (place[column] < 0.4).astype(float)[None]

    monkeypatch.setattr("jaxcage.cli._unknowns.chaotic_shares", stub)
    assert main(["unknowns", path, "--samples", "256", "--out", str(tmp_path), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["measure"]["what"] == "support.stiffness" and found["designs"] == 256 * (len(labels) + 2)
    assert found["total"]["support.stiffness"] == pytest.approx(1.0, abs=0.1)
    assert all(abs(v) < 0.05 for n, v in found["total"].items() if n != "support.stiffness")
    seldom = lambda *_, **__: (np.arange(16 * (len(labels) + 2)) == 3)[None].astype(float)
    monkeypatch.setattr(
        "jaxcage.cli._unknowns.chaotic_shares", lambda m, u, s, place, **_: seldom()[:, : place.shape[1]]
    )
    capsys.readouterr()
    assert main(["unknowns", path, "--out", str(tmp_path)]) == 0
    said = capsys.readouterr().out
    assert "do not tell what to measure first" in said and "Too few samples" in said and "nan" not in said
    assert main(["unknowns", "1a", "--out", str(tmp_path)]) == 2
    assert "Case 1a must be a TOML file with ranges" in capsys.readouterr().err
