"""Results in a notebook: the same numbers as in print."""

import functools
import html
import re
from typing import Any

import pytest
from report_example import findings, orbits, slopes, swept

import jaxcage as jc
from jaxcage.orbits import loss_zones


NAMES = ("sweep", "zones", "loss", "orbits", "branch", "curve", "slopes")


@functools.cache
def results() -> dict[str, Any]:
    sweep = swept()
    found = orbits(sweep)
    chart = findings().map
    assert chart is not None
    return {
        "sweep": sweep,
        "zones": jc.zones(sweep),
        "loss": loss_zones(found),
        "orbits": found,
        "branch": found.branches[0],
        "curve": chart.curves[0],
        "slopes": slopes(jc.case("1a"), "zone 1 onset", "fold", 7000.0, 0.5),
    }


@pytest.mark.parametrize("name", NAMES)
def test_html_has_the_words_and_numbers_of_the_text(name: str):
    result = results()[name]
    shown = result._repr_html_()
    assert html.unescape(re.sub(r"<[^>]*>", " ", shown)).split() == str(result).split()
    assert shown.count("<tr>") == len(str(result).splitlines()) - 1
    assert "<strong>" in shown


def test_words_are_escaped():
    class Result:
        _repr_html_ = jc.Zones._repr_html_

        def __str__(self) -> str:
            return "a < b\n  c & d:  1"

    assert Result()._repr_html_() == (
        '<div><strong>a &lt; b</strong><table><tbody><tr><td style="text-align: left">c &amp; d:</td>'
        '<td style="text-align: left">1</td></tr></tbody></table></div>'
    )
