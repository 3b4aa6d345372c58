"""Every public function compares its arguments with their declarations: a table of wrong values for all of them."""

import inspect
import pickle
from collections.abc import Callable, Iterator
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxcage as jc
from jaxcage import _arguments
from jaxcage._arguments import check_call
from jaxcage._errors import ArgumentError


assert jc.studies  # loads all layers
FUNCTIONS = _arguments.CHECKED
UNDECLARED = {("guess", "Any"), ("speed", "Any"), ("which", "Any"), ("periods", "Any"), ("orbit", "Any")}
"""Arguments whose functions say themselves what they may be."""


def arguments() -> Iterator[Any]:
    """Every argument of every function."""
    for name, f in FUNCTIONS.items():
        for parameter in inspect.signature(f).parameters.values():
            if parameter.kind not in (parameter.VAR_POSITIONAL, parameter.VAR_KEYWORD):
                yield pytest.param(f, parameter, id=f"{name}-{parameter.name}")


def test_the_table_has_what_is_at_the_top():
    """All functions that compute, and no others are left out but those that only look something up."""
    top = {n for n, o in vars(jc).items() if inspect.isfunction(inspect.unwrap(o)) and not n.startswith("_")}
    looked_up = {"case", "rpm", "parameters", "parameter_info", "replace", "enable_x64", "keep_compiled_programs"}
    looked_up |= {"whole_bearing", "bearing_measures"}
    themselves = {"simulate_bearing", "bearing_over_time"}  # a shaft may turn either way
    assert top - set(FUNCTIONS) <= looked_up | themselves and len(FUNCTIONS) > 40


class Stranger:
    """Nothing that any argument may be."""


@pytest.mark.parametrize("f, parameter", list(arguments()))
def test_wrong_kinds_are_refused(f: Callable[..., Any], parameter: inspect.Parameter):
    if (parameter.name, getattr(parameter.annotation, "__name__", "")) in UNDECLARED:
        pytest.skip("says itself what it may be")
    for value in (Stranger(), np.ma.array([1.0, 2.0], mask=[0, 1]), np.array(["2020-01-01"], dtype="datetime64[D]")):
        with pytest.raises(ArgumentError, match=rf"^Argument `{parameter.name}` must be .*, but .* was given\.$"):
            check_call(f, **{parameter.name: value})


def _has(parameter: inspect.Parameter, kind: type) -> bool:
    return kind in _arguments.options(parameter.annotation)


@pytest.mark.parametrize("f, parameter", [p for p in arguments() if _has(p.values[1], int)])
def test_counts_are_whole_and_sensible(f: Callable[..., Any], parameter: inspect.Parameter):
    if _has(parameter, float):
        pytest.skip("a number")
    wrong = [2.5, True, "3", 1e3, 3j, 10**400, np.nan, {}, [3]]
    wrong += [] if any(map(_arguments.is_array_type, _arguments.options(parameter.annotation))) else [np.array([])]
    wrong += [-20] if parameter.name in _arguments.LEAST else []
    for value in wrong:
        with pytest.raises(ArgumentError, match=f"`{parameter.name}` must be (a whole number|at least)"):
            check_call(f, **{parameter.name: value})
    for value in (4, np.int64(4), jnp.asarray(4)):
        check_call(f, **{parameter.name: value})


@pytest.mark.parametrize("f, parameter", [p for p in arguments() if _has(p.values[1], float)])
def test_numbers_are_real(f: Callable[..., Any], parameter: inspect.Parameter):
    wrong = [1j, np.nan, np.array([1j, 2]), np.array([None, 1]), {}]
    wrong += [] if _has(parameter, str) else ["x"]
    wrong += [0.0, -3.0, np.inf, 1e300] if parameter.name in _arguments.SPEEDS else []
    for value in wrong:
        with pytest.raises(ArgumentError, match=f"`{parameter.name}` must be "):
            check_call(f, **{parameter.name: value})
    for value in (2, 2.0, np.float64(2.0), jnp.asarray(2.0)):
        check_call(f, **{parameter.name: value})


DUFFING = jc.ForcedOscillator(lambda tau, q, v, speed: (-0.2 * v[0] - q[0] + 0.3 * jnp.cos(tau),), coordinates=1)
SPEEDS = np.array([1.0, 1.1])


@pytest.mark.parametrize(
    "call, said",
    [
        (lambda: jc.sweep(DUFFING, SPEEDS, blocks=-20), "`blocks` must be at least 1, but -20"),
        (lambda: jc.sweep(DUFFING, SPEEDS, keep=0), "`keep` must be at least 1, but 0"),
        (
            lambda: jc.sweep(DUFFING, SPEEDS, discard=2.5),
            "`discard` must be a whole number from 0 to .*, but 2.5",
        ),
        (lambda: jc.sweep(DUFFING, SPEEDS + 1j), "`speeds` must be of real numbers, without a mask, but an array"),
        (lambda: jc.sweep(DUFFING, np.ma.array(SPEEDS, mask=[0, 1])), "without a mask, but a masked array of shape"),
        (lambda: jc.sweep(DUFFING, np.array(["2020"], dtype="datetime64[Y]")), "of real numbers"),
        (lambda: jc.sweep(DUFFING, ["a", "b"]), "`speeds` must be a number or an array of numbers"),
        (lambda: jc.sweep("1a", SPEEDS), "`system` must be of kind AbstractForcedSystem, but '1a' was given"),
        (lambda: jc.sweep_designs(DUFFING, SPEEDS), "`systems` must be a row of things, but something of kind Forced"),
        (
            lambda: jc.simulate(DUFFING, 1e300, revolutions=2),
            "`speed` must be positive and finite, at most 1e.09",
        ),
        (lambda: jc.simulate(DUFFING, 1.0, revolutions=10**9), "`revolutions` must be a whole number"),
        (lambda: jc.periodic_orbit(DUFFING, 1.0, method="rk4"), "`method` must be of kind AbstractMethod, but 'rk4'"),
        (lambda: jc.study(DUFFING, {"speed": SPEEDS + 0j}, store="s"), "`vary` must be a mapping to what is"),
        (lambda: jc.study(DUFFING, {"speed": SPEEDS}, store="s", executor="slurm"), "one of local, dask, but 'slurm'"),
        (lambda: jc.study(DUFFING, {"speed": SPEEDS}, store="s", shard=(1, 2, 3)), "`shard` must be a row of 2"),
    ],
)
def test_what_was_taken_in_silence(call: Callable[[], Any], said: str):
    with pytest.raises(ValueError, match=said):
        call()


def test_what_is_traced_has_no_value_yet():
    f = FUNCTIONS["simulate"]
    jax.make_jaxpr(lambda x: check_call(f, DUFFING, x, start=(x, 2.0)) or x)(1.0)


def test_a_checked_function_is_where_pickle_looks_for_it():
    for f in (jc.sweep, jc.studies.study, jc.simulate):
        assert pickle.loads(pickle.dumps(f)) is f
