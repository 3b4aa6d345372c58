"""Refusals before anything is computed: wrong arguments, speeds in rpm, tracing, wrong laws, precision."""

import inspect
import math
from collections.abc import Callable
from functools import partial
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from helpers import elastic

import jaxcage as jc


DUFFING = jc.ForcedOscillator(lambda tau, q, v, speed: (-0.2 * v[0] - q[0] + 0.3 * jnp.cos(tau),), coordinates=1)
SPEEDS = np.array([1.0, 1.1])
CASE, WHOLE = jc.case("1a"), jc.whole_bearing("nu2310")
study = partial(jc.study, store="nowhere", name="duffing", version="1")
unwrap = inspect.unwrap
"""Without the types that tests check."""


@pytest.mark.parametrize(
    "call, said",
    [
        (lambda: jc.sweep(DUFFING, SPEEDS, blocks=-20), "`blocks` must be at least 1, but -20"),
        (lambda: jc.sweep(DUFFING, SPEEDS, blocks=7, revolutions=10), "divide"),
        (lambda: jc.sweep(DUFFING, SPEEDS, discard=2.5), "`discard` must be a whole number, but 2.5"),
        (lambda: jc.sweep(DUFFING, SPEEDS, exponents=3), "at most 2"),
        (lambda: jc.sweep(DUFFING, SPEEDS, revolution=9), "`revolution` must be a setting of a run, one of: discard, "),
        (lambda: jc.sweep(DUFFING, SPEEDS, tolerance=1e-9, method=jc.native()), "`method` and `tolerance` must not be"),
        (lambda: jc.zones(jc.sweep(DUFFING, SPEEDS, exponents=0, discard=1, revolutions=20)), "at least one exponent"),
        (
            lambda: jc.zones(jc.sweep([CASE, CASE], SPEEDS * 900, discard=1, revolutions=20, horizon=0)),
            r"must be over speed and initial state, but is over \('design', ",
        ),
        (lambda: jc.stretches(3), "`sweep` must be of kind Dataset, but 3"),
        (lambda: study(CASE, {"speed": np.zeros(1)}), "`speed` must be positive and finite, .* but 0 was given"),
        (lambda: study(CASE, {"speed": np.array([9000.0])}), "`speed` must be in rad/s"),
        (
            lambda: study(CASE, {"speed": 900 * SPEEDS, "guidance_gap": jc.files.Range(1e-4, 0.5)}, samples=8),
            "`guidance_gap` must be a number from 1e-05 to 0.005 m, but is 0.5 m",
        ),
        (lambda: study(DUFFING, {"speed": SPEEDS, "gap": SPEEDS}), "`vary` must be one of speed, but 'gap' was given"),
        (lambda: jc.sweep(DUFFING, np.array([])), "at least one speed"),
        (lambda: jc.sweep([], SPEEDS), "at least one design"),
        (lambda: jc.sweep(DUFFING, np.array([1.0, np.nan])), "positive and finite"),
        (lambda: jc.sweep(DUFFING, SPEEDS[::-1]), "ascending"),
        (lambda: jc.sweep(DUFFING, ["a", "b"]), "`speeds` must be a number or an array of numbers"),
        (lambda: jc.sweep(DUFFING, np.array(["2020"], dtype="datetime64[Y]")), "of real numbers"),
        (lambda: jc.sweep(DUFFING, SPEEDS, initial_states=[(1.0,)]), "states of 2 numbers"),
        (lambda: jc.sweep([CASE, elastic(CASE)], SPEEDS), "`model` must hold designs that differ in their numbers"),
        (lambda: jc.sweep("1a", SPEEDS), "`model` must be of kind AbstractForcedSystem or a row of things, but '1a'"),
        (lambda: jc.simulate(DUFFING, 1e300, revolutions=2), "`speed` must be positive and finite, at most"),
        (lambda: jc.simulate(DUFFING, 1.0, revolutions=1, start=(np.nan, 0.0)), r"finite numbers, but \(nan, 0.0\)"),
        (lambda: jc.periodic_orbit(DUFFING, 1.0, method="rk4"), "`method` must be of kind AbstractMethod, but 'rk4'"),
        (lambda: jc.periodic_orbit(DUFFING, 1.0, 1.5), "`periods` must be a whole number, but 1.5"),
        (lambda: jc.periodic_orbit(DUFFING, 1.0, guess=3), "`guess` must be a state of 2 numbers, but 3"),
        (lambda: jc.bifurcation(DUFFING, "fold", 1.0), "`guess` must be a state and a number, an `Orbit` or a `Point`"),
        (lambda: jc.bifurcation(DUFFING, "fold", (1, 2, 3)), r"`guess` must be .*, but \(1, 2, 3\) was given"),
        (lambda: jc.method(solver="euler"), "must be one of"),
        (lambda: jc.method(steps=10, tolerance=1e-3), "must not both"),
        (lambda: jc.method(tolerance=2.0), "between 0 and 1"),
        (lambda: jc.rpm(np.nan), "`first` must be a finite number, but nan"),
        (lambda: unwrap(jc.parameters)(3), "`module` must be a model or a part of one, but 3"),
        (lambda: jc.replace(CASE, load="x"), "`load` must be a number from 0 to 1e.07 N, but 'x'"),
        (lambda: jc.replace(CASE, guidance_gap=0.5), "`guidance_gap` must be a number from 1e-05 to 0.005 m"),
        (lambda: jc.replace(CASE, cage_mass=math.nan), "`cage_mass` must be a number from 0.001 to 100 kg"),
        (lambda: jc.bearing.Material("brass", 1e11), "must be a number from .* but 'brass' was given"),
        (lambda: jc.bearing.Material(7800.0, -1.0), "must be a number from .* but is -1 Pa"),
        (lambda: jc.ForcedOscillator(3, coordinates=1), "`acceleration` must be something that can be called, but 3"),
        (lambda: jc.ForcedSystem(DUFFING.acceleration, 2.5), "`dimension` must be a whole number"),
    ],
)
def test_wrong_arguments_get_a_sentence(call: Callable[[], Any], said: str):
    with pytest.raises(ValueError, match=said):
        call()


@pytest.mark.parametrize(
    "run",
    [
        lambda: jc.sweep(CASE, np.array([8500.0, 9000.0])),
        lambda: jc.simulate(CASE, 9000.0, revolutions=1),
        lambda: jc.ramp(CASE, 900.0, 9000.0, revolutions=1),
        lambda: jc.periodic_orbit(CASE, 9000.0),
    ],
)
def test_revolutions_per_minute_for_radians_are_refused(run):
    with pytest.raises(ValueError, match=r"must be in rad/s .* but 9000 was given, .* `jaxcage.rpm\(9000\)`"):
        run()


def exponent(gap):
    return jc.sweep(jc.replace(CASE, guidance_gap=gap), np.array([900.0])).exponents[0, 0, 0]


@pytest.mark.parametrize(
    "run",
    [
        lambda: jax.grad(exponent)(4.5e-4),
        lambda: jax.vmap(lambda w: jc.simulate(CASE, w, revolutions=1).state)(jnp.array([900.0, 950.0])),
    ],
)
def test_what_steers_by_its_findings_says_what_to_call_instead(run):
    with pytest.raises(ValueError, match="must be known numbers, but are traced by .*`jaxcage.sweep"):
        run()


@pytest.mark.parametrize(
    "law, said",
    [
        (lambda tau, q, v, speed: (math.cos(tau) - q[0],), "must be made of functions of `jax.numpy`"),
        (lambda tau, q, v, speed: (-q[0] if q[0] > 0 else q[0],), r"`jnp.where\(x > 0, a, b\)`"),
        (lambda tau, q, v, speed: (-q[0], -v[0]), "must return a tuple of 1 scalar, .* but returned 2"),
        (lambda tau, q, v, speed: (jax.lax.complex(jnp.cos(tau), q[0]),), "one of them is complex"),
        (lambda tau, q, v, speed: None, "but returned nothing"),
    ],
)
def test_a_law_of_ones_own_that_is_wrong_is_explained(law, said: str):
    system = jc.ForcedOscillator(law, coordinates=1)
    with pytest.raises(ValueError, match="The law `acceleration.*" + said):
        jc.simulate(system, 1.0, revolutions=1, method=jc.method("rk4", steps=64))


ENTRIES: dict[str, Callable[[], Any]] = {
    "branch": lambda: jc.branch(DUFFING, np.zeros(2), lower=1.0, upper=2.0),
    "case": lambda: jc.case("1a"),
    "surrogate_search": lambda: jc.design.surrogate_search(CASE, {"guidance_gap": (3e-4, 6e-4)}, lambda models: SPEEDS),
    "periodic_orbit": lambda: jc.periodic_orbit(DUFFING, 1.0),
    "simulate": lambda: jc.simulate(DUFFING, 1.0, revolutions=1),
    "study": lambda: jc.study(DUFFING, {"speed": SPEEDS}, store="nowhere", name="duffing", version="1"),
    "sweep": lambda: jc.sweep(DUFFING, SPEEDS),
    "sweep of a whole bearing": lambda: jc.sweep(WHOLE, 1000.0),
}


@pytest.mark.parametrize("name", ENTRIES)
def test_single_precision_is_refused(name: str):
    with jax.enable_x64(False), pytest.raises(RuntimeError, match=r"double precision: call `jaxcage.enable_x64\(\)`"):
        ENTRIES[name]()


@pytest.mark.parametrize("bad", ["0.10.2", "0.11.0"])
@pytest.mark.parametrize("name", ["case", "sweep", "simulate"])
def test_versions_of_jax_that_give_wrong_numbers_are_refused(monkeypatch: pytest.MonkeyPatch, name: str, bad: str):
    monkeypatch.setattr(jax, "__version__", bad)
    with pytest.raises(RuntimeError, match=f"JAX {bad} gives wrong results"):
        ENTRIES[name]()
