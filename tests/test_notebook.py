"""Results in a notebook: the same words and numbers as in print."""

import html
import re

import pytest
from report_example import orbits, slopes, swept

import jaxcage as jc
from jaxcage.orbits import unstable_ranges


SWEEP = swept()
FOUND = orbits(SWEEP)
RESULTS = [
    jc.zones(SWEEP),
    FOUND,
    unstable_ranges(FOUND),
    FOUND.branches[0],
    slopes(jc.case("1a"), "zone 1 onset", "fold", 7000.0, 0.5),
]


@pytest.mark.parametrize("result", RESULTS[:5], ids=lambda result: type(result).__name__)
def test_html_has_the_words_and_numbers_of_the_text(result):
    shown = result._repr_html_()
    assert html.unescape(re.sub(r"<[^>]*>", " ", shown)).split() == str(result).split()
    assert shown.count("<tr>") == len(str(result).splitlines()) - 1


def test_words_are_escaped():
    class Result:
        _repr_html_ = jc.analysis.Zones._repr_html_

        def __str__(self) -> str:
            return "a < b\n  c & d:  1"

    shown = Result()._repr_html_()
    assert "a &lt; b" in shown and "c &amp; d:" in shown and "a < b" not in shown
