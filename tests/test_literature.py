"""The rows of VALIDATION.md, the page itself, and the second computations that its numbers come from."""

import pathlib

import literature
import pytest
from helpers import wide_but
from literature import DUFFING_DOUBLINGS, EXPONENTS, LAWS, TOPICS


ROOT = pathlib.Path(__file__).parents[1]
GROUPS = [rows for of in TOPICS.values() for rows in of]
QUICK = "short_bearing film_limits lund_thomsen nicholas load_factors nu2310 contact".split()


@pytest.mark.parametrize("rows", wide_but(GROUPS, *(getattr(literature, name) for name in QUICK)))
def test_rows(rows: literature.Rows):
    found = list(rows())
    assert found and [r for r in found if not r.passed] == []


def test_a_row_fails_beyond_its_tolerance_and_the_page_says_so():
    made = lambda ours: literature.row("a", 1.0, ours, 0.005, "source")
    assert made(1.004).passed and not made(1.0051).passed and not made(float("nan")).passed
    text = literature.page({"film": [made(1.004), made(2.0)]})
    assert "1 of 2 comparisons pass" in text and "| a | 1 | 1.004 | +0.004 | 0.005 | pass | source |" in text
    assert text.count("**FAILS**") == 1


def test_page_at_the_root_is_whole():
    text = (ROOT / "VALIDATION.md").read_text(encoding="utf-8")
    count = text.count("| pass |")
    assert all(f"## {topic.capitalize()}" in text for topic in TOPICS)
    assert f"{count} of {count} comparisons pass" in text and "FAILS**" not in text
    assert f" {count} numbers beside independent ones" in (ROOT / "README.md").read_text(encoding="utf-8")


BRACKETS = {1: (0.262, 0.27), 2: (0.285, 0.288), 4: (0.2908, 0.2912), 8: (0.29196, 0.29205)}


@pytest.mark.wide
@pytest.mark.parametrize("periods", BRACKETS)
def test_shooting_finds_the_doublings_of_the_table(periods: int):
    number = DUFFING_DOUBLINGS[periods][1]
    found = literature.doubling(lambda g: literature.duffing(0.3, g, 1.2), periods, BRACKETS[periods], (1.0, 0.0))
    assert found == pytest.approx(number.value, abs=number.tolerance)


@pytest.mark.wide
@pytest.mark.parametrize("index", [0, 3])
def test_ensembles_find_the_exponents_of_the_table(index: int):
    """A smaller one than the table's."""
    number = list(EXPONENTS.values())[index]
    found, error = literature.largest_exponent(LAWS[index][1], starts=1024, discard=50, periods=150, steps=64)
    assert error < 6e-4 and abs(found - number.value) < number.tolerance + 3 * error
