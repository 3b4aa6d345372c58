"""The validation page and its command: what passes, what fails, and that a failure is told."""

import json
import math
from pathlib import Path

import pytest
from helpers import wide_but

from jaxcage.cli import main
from jaxcage.validation import (
    FEIGENBAUM,
    FULL_BEARINGS,
    TOPICS,
    Comparison,
    full_bearing_comparisons,
    grooved_whirl,
    lund_thomsen_comparisons,
    nicholas_comparisons,
    page,
    pendulum_comparisons,
)


def made(theirs=1.0, ours=1.004, tolerance=0.005):
    return Comparison("a | b", "source", theirs, ours, tolerance)


def test_a_comparison_passes_within_its_tolerance_only():
    assert made().passed and made(ours=0.9951).passed
    assert not made(ours=1.0051).passed
    assert not made(ours=math.nan).passed and not made(ours=math.inf).passed
    assert made().difference == pytest.approx(0.004)


def test_page():
    text = page({"film": [made(), made(ours=2.0)], "cage": [made()]}, "Made by hand.")
    assert "2 of 3 comparisons pass. Made by hand." in text
    assert text.count("**FAILS**") == 1 and text.count("| pass |") == 2
    assert "a \\| b | 1 | 1.004 | +0.004 | 0.005 | pass | source" in text
    assert text.index("## Film") < text.index("## Cage")


@pytest.mark.parametrize("topic", wide_but(["statics", "contact", "cage"], "contact", "statics"))
def test_topics_pass(topic: str):
    found = TOPICS[topic]()
    assert len(found) >= 8
    assert [c.what for c in found if not c.passed] == []
    assert all(c.source and c.tolerance > 0 for c in found)


def failures(rows: list[Comparison]) -> list[str]:
    return [c.what for c in rows if not c.passed]


@pytest.mark.wide
@pytest.mark.parametrize("slenderness", [1.0, 0.5, 0.25])
def test_full_bearing(slenderness: float):
    rows = full_bearing_comparisons([b for b in FULL_BEARINGS if b[0] == slenderness])
    assert len(rows) == 8 and failures(rows) == []


@pytest.mark.wide
def test_lund_thomsen():
    """Every number of their table, with two axial grooves and Reynolds cavitation, within 6 %."""
    rows = lund_thomsen_comparisons()
    assert len(rows) == 12 * 9 and failures(rows) == []


@pytest.mark.wide
def test_two_grooves_whirl_near_half_speed():
    rows = nicholas_comparisons()
    assert len(rows) == 5 and failures(rows) == []
    assert all(0.45 < float(grooved_whirl(eps).whirl_ratio) < 0.52 for eps in (0.03, 0.04))


@pytest.mark.wide
def test_cascade_of_the_driven_pendulum():
    rows = pendulum_comparisons((2, 4, 8))
    assert len(rows) == 3 and failures(rows) == []
    before, middle, last = (row.ours for row in rows)
    assert (middle - before) / (last - middle) == pytest.approx(FEIGENBAUM.value, rel=0.02)


def test_page_at_the_root_is_whole():
    """What is committed was made by the whole command: every topic, far more than 40 numbers, none of which fails."""
    root = Path(__file__).parents[1]
    text = (root / "VALIDATION.md").read_text(encoding="utf-8")
    assert all(f"## {topic.capitalize()}" in text for topic in TOPICS)
    count = text.count("| pass |")
    assert count >= 100 and "FAILS**" not in text and "`jaxcage validate`." in text
    assert f"{count} of {count} comparisons pass" in text
    assert f" {count} numbers beside independent ones" in (root / "README.md").read_text(encoding="utf-8")


def test_command(capsys: pytest.CaptureFixture[str], tmp_path: Path):
    assert main(["validate", "--topics", "contact", "--json", "--out", str(tmp_path)]) == 0
    out, err = capsys.readouterr()
    document = json.loads(out)
    assert err == "" and document["failed"] == 0 and document["passed"] == len(document["comparisons"])
    assert {row["topic"] for row in document["comparisons"]} == {"contact"}
    text = Path(document["page"]).read_text(encoding="utf-8")
    assert text.count("| pass |") == document["passed"]


def test_a_failure_is_shown_and_told(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
):
    monkeypatch.setitem(TOPICS, "contact", lambda: [made(), made(ours=3.0)])
    assert main(["validate", "--topics", "contact", "--out", str(tmp_path)]) == 1
    out, err = capsys.readouterr()
    assert "1 of 2 comparisons pass" in out and "FAILS" in out
    assert err == "1 of 2 comparisons fail, the first of them: a | b.\n"
    assert "**FAILS**" in (tmp_path / "VALIDATION.md").read_text(encoding="utf-8")
