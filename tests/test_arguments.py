"""Public functions compare their arguments with their annotations, and numbers with their bounds."""

import inspect
from collections.abc import Callable
from typing import Any

import jax.numpy as jnp
import numpy as np
import pytest

import jaxcage as jc


DUFFING = jc.ForcedOscillator(lambda tau, q, v, speed: (-0.2 * v[0] - q[0] + 0.3 * jnp.cos(tau),), coordinates=1)
SPEEDS = np.array([1.0, 1.1])


@pytest.mark.parametrize(
    "call, said",
    [
        (lambda: jc.sweep(DUFFING, SPEEDS, blocks=-20), "`blocks` must be at least 1, but -20"),
        (
            lambda: jc.sweep(DUFFING, SPEEDS, discard=-1),
            "`discard` must be at least 0, but -1",
        ),
        (lambda: jc.sweep(DUFFING, SPEEDS, horizon=-1), "`horizon` must be at least 0, but -1"),
        (lambda: jc.sweep(DUFFING, SPEEDS, keep=0), "`keep` must be at least 1, but 0"),
        (
            lambda: jc.sweep(DUFFING, SPEEDS, discard=2.5),
            "`discard` must be a whole number, but 2.5",
        ),
        (lambda: jc.sweep(DUFFING, SPEEDS + 1j), "`speeds` must be of real numbers, without a mask, but an array"),
        (lambda: jc.sweep(DUFFING, np.ma.array(SPEEDS, mask=[0, 1])), "without a mask, but a masked array of shape"),
        (lambda: jc.sweep(DUFFING, np.array(["2020"], dtype="datetime64[Y]")), "of real numbers"),
        (lambda: jc.sweep(DUFFING, ["a", "b"]), "`speeds` must be a number or an array of numbers"),
        (lambda: jc.sweep(DUFFING, ["a", 10**5000]), "`speeds` must be .*, but a very large list was given"),
        (lambda: jc.sweep("1a", SPEEDS), "`system` must be of kind AbstractForcedSystem, but '1a' was given"),
        (lambda: jc.sweep_designs(DUFFING, SPEEDS), "`systems` must be a row of things, but something of kind Forced"),
        (
            lambda: jc.simulate(DUFFING, 1e300, revolutions=2),
            "`speed` must be positive and finite, at most 1e.09",
        ),
        (lambda: jc.simulate(DUFFING, 1.0, revolutions=10**9), "`revolutions` must be a whole number"),
        (lambda: jc.periodic_orbit(DUFFING, 1.0, method="rk4"), "`method` must be of kind AbstractMethod, but 'rk4'"),
        (lambda: jc.periodic_orbit(DUFFING, 1.0, periods=0), "`periods` must be at least 1, but 0 was given"),
        (lambda: jc.periodic_orbit(DUFFING, 1.0, revolutions=-1), "`revolutions` must be at least 0, but -1 was given"),
        (lambda: jc.bifurcation(DUFFING, "fold", 1.0, reach=np.inf), "`reach` must be at least 0 and finite, but inf"),
        (lambda: jc.study(DUFFING, {"speed": SPEEDS + 0j}, store="s"), "`vary` must be a mapping to what is"),
        (lambda: jc.study(DUFFING, {"speed": SPEEDS}, store="s", executor="slurm"), "one of local, dask, but 'slurm'"),
        (lambda: jc.study(DUFFING, {"speed": SPEEDS}, store="s", shard=(1, 2, 3)), "`shard` must be a row of 2"),
    ],
)
def test_what_was_taken_in_silence(call: Callable[[], Any], said: str):
    with pytest.raises(ValueError, match=said):
        call()


DUFFING_LAW = DUFFING.acceleration
unwrap = inspect.unwrap
"""Without the types that tests check."""


@pytest.mark.parametrize(
    "call, said",
    [
        (lambda: unwrap(jc.rpm)("a"), "`first` must be a finite number, but 'a'"),
        (lambda: jc.rpm(np.nan), "`first` must be a finite number, but nan"),
        (lambda: jc.rpm(1, 2, -3), "`count` must be at least 1, but -3"),
        (lambda: unwrap(jc.rpm)(1, 2, 2.5), "`count` must be a whole number"),
        (lambda: unwrap(jc.parameters)(3), "`module` must be a model or a part of one, but 3"),
        (lambda: unwrap(jc.parameter_info)("1a"), "`module` must be a model or a part of one, but '1a'"),
        (lambda: unwrap(jc.replace)("1a", load=1.0), "`module` must be a model"),
        (lambda: jc.replace(jc.case("1a"), load="x"), "`load` must be a number from 0 to 1e.07 N, but 'x'"),
        (lambda: jc.replace(jc.case("1a"), load=True), "`load` must be a number from 0 to 1e.07 N, but True"),
        (lambda: jc.bearing.Material("brass", 1e11, 0.3), "must be a number from .* but 'brass' was given"),
        (lambda: unwrap(jc.keep_compiled_programs)(3), "`folder` must be a path, but 3"),
        (lambda: jc.ForcedOscillator(3, coordinates=1), "`acceleration` must be something that can be called, but 3"),
        (lambda: jc.ForcedOscillator(DUFFING_LAW, coordinates=-1), "`coordinates` must be at least 1, but -1"),
        (lambda: jc.ForcedSystem(DUFFING_LAW, 2.5), "`dimension` must be a whole number"),
        (lambda: jc.ForcedOscillator(DUFFING_LAW, 1, scale="x"), "`scale` must be a number or a row of them, but 'x'"),
        (lambda: jc.simulate(DUFFING, 1.0, revolutions=1, start=(np.nan, 0.0)), r"finite numbers, but \(nan, 0.0\)"),
        (lambda: jc.orbits.coexisting_orbits(DUFFING, 1.0, seed=-1), "`seed` must be at least 0, but -1"),
        (lambda: jc.equilibrium(jc.case("1a"), -900.0), "`speed` must be positive and finite, at most .*, but -900"),
        (lambda: jc.bearing.vg(100.0, -3.0), "`temperature` must be positive and finite, but -3.0"),
        (lambda: jc.forces.film_scale(0.1, 1.0, 0.0, 1.0), "`width` must be positive and finite, but 0.0"),
        (lambda: jc.periodic_orbit(DUFFING, 1.0, guess="x"), "`guess` must be a state of 2 numbers, but 'x'"),
        (lambda: jc.periodic_orbit(DUFFING, 1.0, guess=3), "`guess` must be a state of 2 numbers, but 3"),
        (lambda: jc.bifurcation(DUFFING, "fold", SPEEDS), "`guess` must be a number, a state and a number, an `Orbit`"),
        (lambda: jc.bifurcation(DUFFING, "fold", (1, 2, 3)), r"`guess` must be .*, but \(1, 2, 3\) was given"),
    ],
)
def test_what_was_said_by_others(call: Callable[[], Any], said: str):
    """By Python, NumPy or JAX, in words of theirs, or by nobody."""
    with pytest.raises(ValueError, match=said):
        call()


def test_numbers_that_no_formula_takes_are_refused():
    """Found by random calls: a whole number beyond 64 bits, and a gap that divides by nothing."""
    with pytest.raises(ValueError, match="`tau` must be a number, of 64 bits if it is whole"):
        jc.forces.synchronous_force(tau=2**63, amplitude=1.0)
    with pytest.raises(ValueError, match="`raceway_diameter` must be positive and finite"):
        jc.bearing.raceway_surface_speed(1.0, 0.0)
