"""Stores of studies: a damaged chunk is noticed and computed again; another study is refused by what differs."""

import json
import shutil
import warnings
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
import xarray as xr
from helpers import even

import jaxcage as jc
from jaxcage.studies import (
    BearingStudy,
    DamagedStore,
    OtherStudy,
    Plan,
    Store,
    Study,
    check_study,
    open_study,
    run_study,
)


class Law(eqx.Module):
    """x'' + damping x' + x + x^3 = 0.3 cos(speed t)."""

    damping: jax.Array

    def __call__(self, tau: Any, q: Any, v: Any, speed: Any) -> tuple[Any]:
        (x,), (u,) = q, v
        return (-self.damping * u - x - x**3 + 0.3 * jnp.cos(tau),)


def study_of(damping: float = 0.1, system: Any = None, name: str = "duffing", version: str = "1", **more: Any) -> Study:
    """Two axes and two starts, in six chunks; the last one of the speeds is smaller."""
    plan = Plan({"speed": np.linspace(1.1, 1.9, 11)}, {}, 0, 0, 2, 4)
    system = jc.ForcedOscillator(Law(jnp.array(damping)), coordinates=1) if system is None else system
    method = more.pop("method", jc.method("rk4", steps=32))
    return Study(system, plan, method, 10, 20, 4, 2, 3, name=name, version=version)


STUDY = study_of()


def contents(store: Path) -> dict[str, bytes]:
    """Every file of a store."""
    return {p.relative_to(store).as_posix(): p.read_bytes() for p in sorted(store.rglob("*")) if p.is_file()}


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("whole") / "study.zarr"
    run_study(STUDY, path)
    return path


@pytest.fixture
def store(whole: Path, tmp_path: Path) -> Path:
    """A copy of a finished store."""
    return Path(shutil.copytree(whole, tmp_path / "study.zarr"))


@pytest.fixture
def computed(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """The chunks that are computed."""
    done: list[int] = []
    chunk = Study.chunk
    monkeypatch.setattr(Study, "chunk", lambda self, number: done.append(number) or chunk(self, number))
    return done


def deleted(path: Path) -> None:
    path.unlink()


def flipped(path: Path) -> None:
    path.write_bytes(path.read_bytes()[:-1] + bytes([path.read_bytes()[-1] ^ 1]))


def cut(path: Path) -> None:
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])


def emptied(path: Path) -> None:
    path.write_bytes(b"")


@pytest.mark.parametrize("name", ["peak/c/1/0", "strobe/c/1/0/0/0", "label/c/5/0", "outcome/c/1/0"])
@pytest.mark.parametrize("spoil", [deleted, flipped, cut, emptied])
def test_a_damaged_chunk_is_noticed_and_computed_again(
    whole: Path, store: Path, computed: list[int], name: str, spoil: Callable[[Path], None]
):
    spoil(store / name)
    chunk, state = int(name.split("/")[2]), check_study(store)
    if name.startswith("outcome") and spoil is deleted:  # as if it had never been finished
        assert state.finished == 5 and not state.damaged
    else:
        what = "missing" if spoil is deleted else "not what was written"
        assert state.damaged == {chunk: f"{name} is {what}"} and state.finished == 5
        assert str(state).startswith("5 of 6 chunks are as they were written, 1 are damaged, 0 are not computed yet")
    if spoil is not deleted:
        with pytest.raises(ValueError, match="checksum"):
            open_study(store).load()
    run_study(STUDY, store)
    assert computed == [chunk] and contents(store) == contents(whole)


def test_every_chunk_has_a_checksum_for_any_reader(store: Path):
    """Plain xarray refuses a flipped bit, of coordinates as well."""
    for path in sorted(store.rglob("zarr.json")):
        about = json.loads(path.read_text())
        if about["node_type"] == "array":
            assert about["codecs"][-1]["name"] == "crc32c", path
    for name in ("peak/c/0/0", "speed/c/0"):
        bits = (store / name).read_bytes()
        flipped(store / name)
        with pytest.raises(ValueError, match="checksum"), warnings.catch_warnings():
            warnings.simplefilter("ignore")
            xr.open_zarr(store, chunks=None).load()
        (store / name).write_bytes(bits)


@pytest.mark.parametrize("name", ["zarr.json", "peak/zarr.json", "speed/c/0"])
def test_what_cannot_be_opened_is_refused_in_one_sentence(store: Path, name: str):
    cut(store / name)
    with pytest.raises(
        DamagedStore, match=r"^The store '.*' is damaged \(.*\): choose another folder, or delete"
    ) as said:
        open_study(store)
    assert "\n" not in str(said.value)
    if name != "speed/c/0":
        for use in (check_study, lambda path: run_study(STUDY, path)):
            with pytest.raises(DamagedStore):
                use(store)


def test_another_format_is_read_and_not_added_to(store: Path):
    about = json.loads((store / "zarr.json").read_text())
    about["attributes"]["store_format"] = 2
    (store / "zarr.json").write_text(json.dumps(about))
    assert open_study(store).load().sizes["speed"] == 11
    for use in (check_study, lambda path: run_study(STUDY, path)):
        with pytest.raises(ValueError, match="is of format 2, and this version of jaxcage writes format 3: it can be"):
            use(store)


@pytest.mark.parametrize(
    "other, words",
    [
        (study_of(damping=0.2), "differs in acceleration.damping: choose another folder"),
        (study_of(version="2"), "differs in version: choose another folder"),
        (study_of(name="pendulum"), "differs in name: choose another folder"),
        (study_of(method=jc.method("rk4", steps=64)), "differs in method, method_numbers.steps: choose"),
    ],
)
def test_another_study_is_refused_by_what_differs(whole: Path, other: Study, words: str):
    before = contents(whole)
    with pytest.raises(OtherStudy, match=words):
        run_study(other, whole)
    assert contents(whole) == before


def test_another_version_of_the_package_is_another_study(whole: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr("jaxcage.sweeps._speed.versions", lambda: {"version_jaxcage": "9.9"})
    with pytest.raises(OtherStudy, match="differs in .*version_jaxcage"):
        run_study(STUDY, whole)


def law(tau: Any, q: Any, v: Any, speed: Any) -> tuple[Any]:
    return (-q[0],)


@pytest.mark.parametrize("given", [{"name": ""}, {"version": ""}, {"name": "", "version": ""}])
@pytest.mark.parametrize(
    "system, own",
    [
        (jc.ForcedOscillator(Law(jnp.array(0.1)), coordinates=1), "Law"),
        (jc.ForcedOscillator(law, coordinates=1), "law"),
        (jc.ForcedOscillator(jax.jit(law), coordinates=1), "law"),
        (even(jc.case("1a")), "EvenSteps"),
    ],
)
def test_code_of_ones_own_needs_a_name_and_a_version(tmp_path: Path, system: Any, own: str, given: dict[str, str]):
    with pytest.raises(
        ValueError, match=f"`name` and `version` must be given, since a store cannot tell .* own {own} "
    ):
        run_study(study_of(system=system, **given), tmp_path / "study.zarr")
    assert list(tmp_path.iterdir()) == []


def test_what_the_package_has_needs_neither():
    for method in (jc.native(), jc.method("kvaerno5", steps=64)):
        assert study_of(system=jc.case("1a"), method=method).own_code is None
    assert BearingStudy(jc.whole_bearing("nu2310"), STUDY.plan, 1, 2, 1, 0, 1e-4).own_code is None


def test_two_writers_at_once_leave_the_store_of_one(whole: Path, tmp_path: Path, computed: list[int]):
    """No lock: both write the same files. One of them tidies up while the other writes."""
    store = tmp_path / "study.zarr"
    Store(store, STUDY)
    with ThreadPoolExecutor(4) as pool:
        list(pool.map(lambda _: run_study(STUDY, store), range(4)))
    assert set(computed) == set(range(STUDY.plan.chunks))
    assert contents(store) == contents(whole) and [p.name for p in tmp_path.iterdir()] == ["study.zarr"]


def test_a_chunk_of_nothing_but_missing_numbers_is_finished(tmp_path: Path):
    results = STUDY.chunk(0)
    lost = {name: np.full_like(x, np.nan) if x.dtype == float else x for name, x in results.items()}
    store = Store(tmp_path / "study.zarr", STUDY)
    store.write(0, lost)
    assert Store(tmp_path / "study.zarr", STUDY).pending() == [1, 2, 3, 4, 5]


def test_where_there_is_no_study(tmp_path: Path):
    for use in (open_study, check_study):
        with pytest.raises(FileNotFoundError, match="no study at"):
            use(tmp_path / "nowhere")
