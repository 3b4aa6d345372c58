"""A study that goes on is of the very system that began it: closures, globals, classes, arrays, versions, machine."""

import copy
import functools
import random
import types
from collections.abc import Callable
from pathlib import Path
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxcage as jc
from jaxcage.studies import OtherStudy, Plan, Study, _fingerprint
from jaxcage.studies._fingerprint import fingerprint
from jaxcage.studies._references import Unknown
from jaxcage.studies._store import Store


DAMPING = 0.1
TABLE = np.array([0.0, 1.0, 3.0])


def restoring(x: Any) -> Any:
    return jnp.interp(x, TABLE, TABLE)


def by_global(tau: Any, q: Any, v: Any, speed: Any) -> tuple[Any]:
    return (-DAMPING * v[0] - restoring(q[0]) + 0.3 * jnp.cos(tau),)


def by_closure(damping: Any) -> Callable[..., tuple[Any]]:
    def law(tau: Any, q: Any, v: Any, speed: Any) -> tuple[Any]:
        return (-damping * v[0] - q[0] + 0.3 * jnp.cos(tau),)

    return law


class Law(eqx.Module):
    damping: jax.Array
    factor = 2.0

    def __call__(self, tau: Any, q: Any, v: Any, speed: Any) -> tuple[Any]:
        return (-self.damping * v[0] - self.stiff(q[0]) + 0.3 * jnp.cos(tau),)

    def stiff(self, x: Any) -> Any:
        return self.factor * x


def study_of(law: Any, method: Any = None) -> Study:
    system = law if isinstance(law, jc.CageModel) else jc.ForcedOscillator(law, coordinates=1)
    plan = Plan({"speed": np.array([1.1, 1.9])}, {}, 0, 0, 1, 2)
    return Study(system, plan, method or jc.method("rk4", steps=32), 10, 20, 4, 1, 0)


def refused(tmp_path: Path, law: Any, words: str) -> None:
    """A store of another law, or of another machine, refuses this one."""
    with pytest.raises(OtherStudy, match=words):
        Store(tmp_path / "study.zarr", study_of(law))


def test_another_closure_value_is_another_study(tmp_path: Path):
    Store(tmp_path / "study.zarr", study_of(by_closure(0.1)))
    Store(tmp_path / "study.zarr", study_of(by_closure(0.1)))
    refused(tmp_path, by_closure(0.5), "differs in closure value damping of by_closure.law: choose")


@pytest.mark.parametrize("name, other", [("DAMPING", 0.5), ("TABLE", np.array([0.0, 1.0, 3.5]))])
def test_another_global_is_another_study(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str, other: Any):
    """Read by the law itself, or by a function that it calls."""
    Store(tmp_path / "study.zarr", study_of(by_global))
    monkeypatch.setitem(globals(), name, other)
    refused(tmp_path, by_global, f"differs in global {name}: choose")


def test_a_function_that_the_law_calls_is_part_of_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    Store(tmp_path / "study.zarr", study_of(by_global))
    monkeypatch.setitem(globals(), "restoring", lambda x: 2 * x)
    refused(tmp_path, by_global, "differs in .*lambda")


@pytest.mark.parametrize(
    "name, other",
    [
        ("__call__", lambda self, tau, q, v, speed: (-q[0],)),
        ("stiff", lambda self, x: x**3),
        ("factor", 3.0),
    ],
)
def test_another_class_is_another_study(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str, other: Any):
    Store(tmp_path / "study.zarr", study_of(Law(jnp.array(0.1))))
    monkeypatch.setattr(Law, name, other)
    refused(tmp_path, Law(jnp.array(0.1)), "holds another study, which differs in")


def test_a_cage_of_a_class_of_ones_own_is_not_the_cage(tmp_path: Path):
    from helpers import even

    model = jc.case("1a")
    Store(tmp_path / "study.zarr", study_of(model))
    refused(tmp_path, even(model), "differs in")


def test_a_method_is_known_by_all_its_numbers():
    """Its text does not show them all: of an array it has the shape."""
    few, many = (jc.integrate.FixedSteps(jc.method("rk4").solver, jnp.array([n, 64])) for n in (16, 32))
    assert str(few) == str(many)
    assert study_of(Law(jnp.array(0.1)), few).fingerprint != study_of(Law(jnp.array(0.1)), many).fingerprint


def test_a_system_that_was_copied_or_sent_is_still_the_same():
    """Copying and pickling leave a list of its slots on a class, which a study on a cluster would count as a change."""

    class Sent(Law):
        pass

    before = study_of(Sent(jnp.array(0.1))).fingerprint
    copy.copy(Sent(jnp.array(0.1)))
    assert "__slotnames__" in vars(Sent) and study_of(Sent(jnp.array(0.1))).fingerprint == before


@pytest.mark.parametrize("name, other", [("package_digest", "other"), ("platform_traits", {"arithmetic": "none"})])
def test_another_version_or_machine_is_another_study(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str, other: Any
):
    Store(tmp_path / "study.zarr", study_of(by_global))
    monkeypatch.setattr(f"jaxcage.studies._stored.{name}", lambda: other)
    refused(tmp_path, by_global, "differs in package" if isinstance(other, str) else "differs in platform.*arithmetic")


def test_a_users_module_is_followed(monkeypatch: pytest.MonkeyPatch):
    """What is taken from it counts, through modules within it; what is not does not."""
    inner, outer = types.ModuleType("inner"), types.ModuleType("outer")
    inner.K, outer.inner, outer.unused = 1.0, inner, 1.0
    monkeypatch.setitem(globals(), "outer", outer)
    law = lambda x: outer.inner.K * x  # type: ignore[name-defined]  # noqa: F821
    before = fingerprint(law=law)
    outer.unused = 2.0
    assert fingerprint(law=law) == before
    inner.K = 2.0
    assert fingerprint(law=law) != before
    with pytest.raises(Unknown, match="the module outer is used as a whole"):
        fingerprint(law=lambda x: vars(outer))  # type: ignore[name-defined]  # noqa: F821


def recursive(n: Any) -> Any:
    return recursive(n - 1) if n else by_global


@pytest.mark.parametrize(
    "same",
    [
        lambda: jax.jit(restoring),
        lambda: functools.partial(by_closure, 3),
        lambda: recursive,
        lambda: {"a": [np.float32(1), jnp.ones(2)], "b": {1, 2, 3}},
        lambda: jc.case("1a"),
        lambda: jc.controlled(),
        lambda: jc.method("kvaerno5", steps=64),
        lambda: Law(jnp.array(0.1)).stiff,
        lambda: np.sin,
        lambda: jax.random.key(3),
    ],
)
def test_what_is_made_again_is_the_same(same: Callable[[], Any]):
    assert fingerprint(x=same()) == fingerprint(x=same())


@pytest.mark.parametrize(
    "one, other",
    [
        (lambda: np.sin, lambda: np.cos),
        (lambda: 1, lambda: 1.0),
        (lambda: 0.0, lambda: -0.0),
        (lambda: np.float32(1), lambda: np.float64(1)),
        (lambda: jnp.array([1.0, jnp.nan]), lambda: jnp.array([jnp.nan, 1.0])),
        (lambda: np.ma.array([1.0, 2.0], mask=[0, 1]), lambda: np.ma.array([1.0, 2.0], mask=[1, 0])),
        (lambda: jax.random.key(3), lambda: jax.random.key(4)),
        (lambda: lambda x: x + 1, lambda: lambda x: x + 2),
        (lambda: lambda x, k=1: x + k, lambda: lambda x, k=2: x + k),
        (lambda: Law(jnp.array(0.1)).stiff, lambda: Law(jnp.array(0.2)).stiff),
        (lambda: functools.partial(by_closure, 3), lambda: functools.partial(by_closure, 4)),
        (lambda: jax.jit(lambda x: x), lambda: jax.jit(lambda x: 2 * x)),
    ],
)
def test_what_differs_has_another_fingerprint(one: Callable[[], Any], other: Callable[[], Any]):
    assert fingerprint(x=one()) != fingerprint(x=other())


def test_where_code_stands_does_not_matter():
    text = "def law(tau, q, v, speed):\n    return (-q[0],)\n"
    one, other = {}, {}
    exec(compile(text, "one.py", "exec"), one)
    exec(compile("\n\n# a comment\n" + text, "other.py", "exec"), other)
    assert fingerprint(law=one["law"]) == fingerprint(law=other["law"])


@pytest.mark.parametrize(
    "law, why",
    [
        (lambda tau, q, v, speed: (random.random() * q[0],), "random may give something else every time"),
        (lambda tau, q, v, speed: (np.random.normal() * q[0],), "numpy.random.* may give something else every time"),
        (lambda tau, q, v, speed: (float(open("k").read()) * q[0],), "may give something else|outside"),
        (lambda tau, q, v, speed: (eval("DAMPING") * q[0],), r"eval\(\) reads what lies outside of the law"),
    ],
)
def test_what_has_no_fingerprint_is_run_once_and_not_resumed(tmp_path: Path, law: Any, why: str):
    """The reason is given; a new folder is fine."""
    study = study_of(law)
    Store(tmp_path / "study.zarr", study)
    with pytest.raises(OtherStudy, match=f"must be a new folder, since nobody can tell whether .* {why}"):
        Store(tmp_path / "study.zarr", study)


def test_the_package_counts_by_its_sources(monkeypatch: pytest.MonkeyPatch, tmp_path: Path):
    _fingerprint.package_digest.cache_clear()
    before = _fingerprint.package_digest()
    (tmp_path / "studies").mkdir()
    (tmp_path / "forces").mkdir()
    (tmp_path / "forces" / "_law.py").write_text("K = 1")
    monkeypatch.setattr(_fingerprint, "__file__", str(tmp_path / "studies" / "_fingerprint.py"))
    found = []
    for text in ("K = 1", "K = 2"):
        (tmp_path / "forces" / "_law.py").write_text(text)
        _fingerprint.package_digest.cache_clear()
        found.append(_fingerprint.package_digest())
    _fingerprint.package_digest.cache_clear()
    assert len({before, *found}) == 3
