"""The validation page and its command: what passes, what fails, and that a failure is told."""

import json
import math
from pathlib import Path

import pytest

from jaxcage.cli import main
from jaxcage.validation import TOPICS, Comparison, page


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


@pytest.mark.parametrize("topic", ["statics", "contact"])
def test_quick_topics_pass(topic: str):
    found = TOPICS[topic]()
    assert len(found) >= 8
    assert [c.what for c in found if not c.passed] == []
    assert all(c.source and c.tolerance > 0 for c in found)


def test_page_at_the_root_is_whole():
    """What is committed was made by the whole command: every topic, far more than 40 numbers, none of which fails."""
    text = (Path(__file__).parents[1] / "VALIDATION.md").read_text(encoding="utf-8")
    assert all(f"## {topic.capitalize()}" in text for topic in TOPICS)
    assert text.count("| pass |") >= 100 and "FAILS**" not in text and "`jaxcage validate`." in text


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
