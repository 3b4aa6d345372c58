"""Programs that a process finds traced by another one: the same numbers, and nothing kept that has no name."""

import dataclasses
import pathlib

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxcage as jc
from jaxcage import _cache
from jaxcage.integrate import compiled
from jaxcage.integrate._traced import Kept, Unnamed, named


@pytest.fixture
def folder(tmp_path: pathlib.Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(_cache, "traced", tmp_path / "traced")
    return tmp_path / "traced"


class Shifted(eqx.Module):
    by: jax.Array
    power: int


def powers(shift: Shifted, x: jax.Array) -> dict[str, jax.Array]:
    return {"sum": jnp.sum((x + shift.by) ** shift.power), "each": (x + shift.by) ** shift.power}


def kept() -> Kept:
    return Kept(powers, "powers", {})


def test_the_second_process_does_not_trace(folder: pathlib.Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr("jaxcage.integrate._traced.OURS", ("jaxcage", "test_traced", "builtins"))
    given = Shifted(jnp.asarray(2.0), 3), np.arange(4.0)
    first = kept()(*given)
    (path,) = folder.iterdir()
    assert np.array_equal(first["each"], (np.arange(4.0) + 2) ** 3) and first["sum"] == 8 + 27 + 64 + 125
    monkeypatch.setattr(Kept, "_lowered", lambda *_: pytest.fail("it is traced again"))
    again = kept()(Shifted(jnp.asarray(1.0), 3), np.arange(4.0))
    assert np.array_equal(again["each"], (np.arange(4.0) + 1) ** 3)


@pytest.mark.parametrize(
    "other", [(Shifted(jnp.asarray(2.0), 2), np.arange(4.0)), (Shifted(jnp.asarray(2.0), 3), np.arange(5.0))]
)
def test_another_form_is_another_program(folder: pathlib.Path, monkeypatch: pytest.MonkeyPatch, other):
    monkeypatch.setattr("jaxcage.integrate._traced.OURS", ("jaxcage", "test_traced", "builtins"))
    program = kept()
    program(Shifted(jnp.asarray(2.0), 3), np.arange(4.0))
    found = program(*other)
    assert np.array_equal(found["each"], (np.asarray(other[1]) + 2) ** other[0].power)
    assert len(list(folder.iterdir())) == 2


def test_another_source_is_another_program(folder: pathlib.Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr("jaxcage.integrate._traced.OURS", ("jaxcage", "test_traced", "builtins"))
    given = Shifted(jnp.asarray(2.0), 3), np.arange(4.0)
    kept()(*given)
    monkeypatch.setattr("jaxcage.integrate._traced.sources", lambda: "changed")
    kept()(*given)
    assert len(list(folder.iterdir())) == 2


def test_what_is_damaged_is_made_again(folder: pathlib.Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr("jaxcage.integrate._traced.OURS", ("jaxcage", "test_traced", "builtins"))
    given = Shifted(jnp.asarray(2.0), 3), np.arange(4.0)
    kept()(*given)
    (path,) = folder.iterdir()
    path.write_bytes(path.read_bytes()[:100])
    found = kept()(*given)
    assert found["sum"] == 224 and path.stat().st_size > 100


def test_numbers_that_are_no_arguments_are_part_of_the_name():
    """Those of arrays are not, nor those of a module's fields; those of a static field are, and of what is no tree."""

    @dataclasses.dataclass(frozen=True)
    class Table:
        row: np.ndarray

    class Scaled(eqx.Module):
        by: jax.Array
        table: Table = eqx.field(static=True)

    Table.__qualname__, Scaled.__qualname__, ones, twos = "Table", "Scaled", np.ones(2), 2 * np.ones(2)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("jaxcage.integrate._traced.OURS", ("jaxcage", "test_traced", "builtins"))
        assert named((ones, Scaled(jnp.ones(2), Table(ones)))) == named((twos, Scaled(2 * jnp.ones(2), Table(ones))))
        assert named(Scaled(jnp.ones(2), Table(ones))) != named(Scaled(jnp.ones(2), Table(twos)))
        assert named(Table(ones)) != named(Table(twos)) and named(1) != named(1.0) != named(True)


def test_a_function_made_within_a_function_has_no_name(folder: pathlib.Path):
    """A law of one's own: two of the same name are two laws."""

    def law(tau, q, v, speed):
        return (jnp.cos(tau) - q[0] - 0.1 * v[0],)

    system = jc.ForcedOscillator(law, coordinates=1)
    with pytest.raises(Unnamed):
        named(system)
    assert "jaxcage.models" in named(jc.case("1a"))
    program = compiled(lambda system, x: system.dimension + x)
    assert program(system, jnp.asarray(1.0)) == 3 and not folder.exists()


@pytest.mark.wide
def test_a_sweep_by_kept_programs_is_the_same(folder: pathlib.Path):
    """Case 1a, one speed; the second model has other numbers and the same program."""
    options = dict(
        discard=2,
        revolutions=4,
        blocks=2,
        keep=4,
        exponents=0,
        confirm=False,
        horizon=0,
        method=jc.method("rk4", steps=64),
    )
    models = jc.case("1a"), jc.replace(jc.case("1a"), eccentricity=4e-5)
    found = [jc.sweep(m, 900.0, **options) for m in models]
    count = len(list(folder.iterdir()))
    _cache.traced = None
    for m, f in zip(models, found, strict=True):
        np.testing.assert_array_equal(f.strobe, jc.sweep(m, 900.0, **options).strobe)
    assert count == 2
