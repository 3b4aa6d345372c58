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
UNDECLARED = {"guess", "orbit"}
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
    themselves = {"rpm", "parameters", "parameter_info", "replace", "enable_x64", "keep_compiled_programs"}
    themselves |= {"simulate_bearing", "bearing_over_time", "bearing_measures"}  # a shaft may turn either way
    assert top - set(FUNCTIONS) <= themselves and len(FUNCTIONS) > 100


@pytest.mark.parametrize("layer", [jc.bearing, jc.forces, jc.models], ids=lambda layer: layer.__name__)
def test_every_formula_is_in_the_table(layer: Any):
    """But for what makes declarations, what takes no argument, and what only asks about what it is given."""
    public = {n for n, o in vars(layer).items() if inspect.isfunction(inspect.unwrap(o)) and not n.startswith("_")}
    declare = {"parameter", "choice", "count", "check_layer"}
    asked = {"is_concrete", "require_known", "require_speeds", "divide", "multiply"}
    plain = {n for n in public if not inspect.signature(vars(layer)[n]).parameters}
    assert public - declare - asked - plain <= set(FUNCTIONS)


class Stranger:
    """Nothing that any argument may be."""


@pytest.mark.parametrize("f, parameter", list(arguments()))
def test_wrong_kinds_are_refused(f: Callable[..., Any], parameter: inspect.Parameter):
    if parameter.name in UNDECLARED and _has(parameter, object):
        pytest.skip("says itself what it may be")
    for value in (Stranger(), np.ma.array([1.0, 2.0], mask=[0, 1]), np.array(["2020-01-01"], dtype="datetime64[D]")):
        with pytest.raises(ArgumentError, match=rf"^Argument `{parameter.name}` must be .*, but .* was given\.$"):
            check_call(f, **{parameter.name: value})


def _has(parameter: inspect.Parameter, kind: type) -> bool:
    return kind in _arguments.options(parameter.annotation)


@pytest.mark.parametrize("f, parameter", [p for p in arguments() if _has(p.values[1], int) > _has(p.values[1], float)])
def test_counts_are_whole_and_sensible(f: Callable[..., Any], parameter: inspect.Parameter):
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
    wrong = [1j, np.array([1j, 2]), np.array([None, 1]), {}]
    wrong += [] if parameter.name in _arguments.MAY_BE_NAN else [np.nan]
    wrong += [] if _has(parameter, str) else ["x"]
    wrong += [0.0, -3.0, np.inf, 1e300] if parameter.name in _arguments.SPEEDS else []
    wrong += [0.0, -3.0, np.inf] if parameter.name in _arguments.POSITIVE else []
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
        (lambda: jc.simulate(DUFFING, 1.0, revolutions=1, start=(np.nan, 0.0)), r"each a number, but \(nan, 0.0\)"),
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


def test_models_take_what_they_are_made_for():
    assert jc.ForcedOscillator(DUFFING_LAW, 1, scale=(1.0, 2.0), starts=((0.0, 1.0),)).dimension == 2
    assert np.isclose(jc.rpm(30), np.pi) and jc.rpm(1, 2, 3).size == 3 and jc.rpm(-30.0) < 0
    gradient = jax.grad(lambda gap: jc.replace(jc.case("1a"), guidance_gap=gap).clearance)(4e-4)
    assert gradient > 0


def test_what_is_traced_has_no_value_yet():
    f = FUNCTIONS["simulate"]
    jax.make_jaxpr(lambda x: check_call(f, DUFFING, x, start=(x, 2.0)) or x)(1.0)


def test_a_checked_function_is_where_pickle_looks_for_it():
    for f in (jc.sweep, jc.studies.study, jc.simulate):
        assert pickle.loads(pickle.dumps(f)) is f


def test_numbers_that_no_formula_takes_are_refused():
    """Found by random calls: a whole number beyond 64 bits, and a gap that divides by nothing."""
    with pytest.raises(ValueError, match="`tau` must be a number, of 64 bits if it is whole"):
        jc.forces.synchronous_force(tau=2**63, amplitude=1.0)
    with pytest.raises(ValueError, match="`guidance_gap` must be positive and finite"):
        jc.bearing.guiding_radius(92.1e-3, 0.0)
