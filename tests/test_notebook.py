"""Results in a notebook: the same numbers as in print."""

import functools
import html
import re
from typing import Any

import jax.numpy as jnp
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


def words(text: str) -> list[str]:
    """Everything that is not a gap."""
    return text.split()


@pytest.mark.parametrize("name", NAMES)
def test_html_has_the_words_and_numbers_of_the_text(name: str):
    result = results()[name]
    shown = result._repr_html_()
    assert words(html.unescape(re.sub(r"<[^>]*>", " ", shown))) == words(str(result))
    assert shown.count("<tr>") == len(str(result).splitlines()) - 1
    assert "<strong>" in shown


def test_loss_zones_say_their_edges():
    text = str(results()["loss"])
    assert "zone 1: 7000.00 rpm (fold) to 12000.00 rpm (period-doubling), 5000.00 rpm wide" in text
    assert "zone 2: 20000.00 rpm (Neimark-Sacker) to above the range, open" in text


def test_words_are_escaped():
    class Result:
        _repr_html_ = jc.Zones._repr_html_

        def __str__(self) -> str:
            return "a < b\n  c & d:  1"

    assert Result()._repr_html_() == (
        '<div><strong>a &lt; b</strong><table><tbody><tr><td style="text-align: left">c &amp; d:</td>'
        '<td style="text-align: left">1</td></tr></tbody></table></div>'
    )


def test_an_orbit_shows_its_multipliers():
    orbit = jc.Orbit(
        state=jnp.zeros(4),
        speed=jnp.array(900.0),
        multipliers=jnp.array([0.5 + 0.1j, 0.5 - 0.1j, 0.2, 0.1]),
        monodromy=jnp.eye(4),
        residual=jnp.array(1e-12),
        liouville=jnp.array(0.0),
        converged=jnp.array(True),
        iterations=jnp.array(3),
        periods=jnp.array(1),
        steps=jnp.array(512),
        error=jnp.array(1e-8),
        solver=jc.method(),
    )
    assert "0.5+0.1j" in orbit._repr_html_() and "8594.4 rpm" in orbit._repr_html_()
