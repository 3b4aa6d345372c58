"""The rows of VALIDATION.md, the page itself, and the second computations that its numbers come from."""

import pathlib
import re

import jax.numpy as jnp
import literature
import literature_motion as motion
import numpy as np
import pytest
from helpers import wide_but
from literature import DUFFING_DOUBLINGS, EXPONENTS

import jaxcage as jc


ROOT = pathlib.Path(__file__).parents[1]
TOPICS = literature.topics()
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
    ours, reynolds = map(int, re.findall(r"(\d+) numbers of jaxcage, and (\d+)", text)[0])
    assert ours + reynolds == count
    readme = " ".join((ROOT / "README.md").read_text(encoding="utf-8").split())
    assert f"{ours} numbers of jaxcage and {reynolds} of" in readme


BRACKETS = {1: (0.262, 0.27), 2: (0.285, 0.288), 4: (0.2908, 0.2912), 8: (0.29196, 0.29205)}


@pytest.mark.wide
@pytest.mark.parametrize("periods", BRACKETS)
def test_shooting_finds_the_doublings_of_the_table(periods: int):
    number = DUFFING_DOUBLINGS[periods][1]
    found = motion.doubling(lambda g: motion.duffing(0.3, g, 1.2), periods, BRACKETS[periods], (1.0, 0.0))
    assert found == pytest.approx(number.value, abs=number.tolerance)


@pytest.mark.wide
@pytest.mark.parametrize("index", [0, 3])
def test_ensembles_find_the_exponents_of_the_table(index: int):
    """A smaller one than the table's."""
    number = list(EXPONENTS.values())[index]
    found, error = motion.largest_exponent(
        motion.LAWS[index][1], initial_states=1024, discard=50, periods=150, steps=64
    )
    assert error < 6e-4 and abs(found - number.value) < number.tolerance + 3 * error


def linear(zeta, natural):
    return lambda tau, q, v, speed: (-2 * zeta * natural * v[0] - natural**2 * q[0] + jnp.cos(tau),)


def test_error_of_an_exponent_whose_growth_oscillates_in_step_with_the_blocks():
    """A block of 15 revolutions holds 20.002 half turns of the tangent vectors, so that all blocks are wrong alike."""
    zeta, natural = 0.05, 2.0
    omega = 30 * natural * np.sqrt(1 - zeta**2) / 20.002
    oscillator = jc.ForcedOscillator(linear(zeta, natural), coordinates=1)
    result = jc.sweep(oscillator, np.array([omega]), exponents=2, horizon=0, confirm=False)
    error = np.abs(result.exponents + zeta * natural * 2 * np.pi / omega)
    assert np.all(error < 3 * result.standard_error) and np.all(result.standard_error < 3e-3)


UNDERSTATED = pytest.mark.xfail(reason="the error stated of an exponent of -24 a revolution is 0.3 of what it is")


@pytest.mark.wide
@pytest.mark.parametrize("omega", [pytest.param(0.9, marks=UNDERSTATED), 3.0])
def test_multipliers_of_the_linear_oscillator_overdamped(omega):
    """Real multipliers exp((-z +- sqrt(z^2 - 1)) w_0 T), one exponent each; `test_engine` has the underdamped one."""
    zeta, natural = 1.5, 1.3
    settings = dict(discard=20, revolutions=100, exponents=2, blocks=20, method=jc.method("rodas4", steps=256))
    result = jc.sweep(jc.ForcedOscillator(linear(zeta, natural), coordinates=1), np.array([omega]), **settings)
    roots = np.array([-zeta + np.sqrt(zeta**2 - 1), -zeta - np.sqrt(zeta**2 - 1)])
    exact = np.broadcast_to(roots * natural * 2 * np.pi / omega, result.exponents.shape)
    np.testing.assert_allclose(result.exponents, exact, rtol=1e-7)
    # Nothing scatters: what is stated is the error of the steps, which it covers.
    assert np.all(result.standard_error < 1e-6 * np.abs(exact))
    assert np.all(result.standard_error > np.abs(result.exponents - exact))
