"""Damaged stores: nothing false is read, what differs is computed again, the rest stays; two writers, old stores."""

import json
import os
import random
import shutil
import warnings
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import store_faults as faults
import xarray as xr
from hypothesis import HealthCheck, settings
from hypothesis.stateful import run_state_machine_as_test
from store_life import Other, StoreLife

import jaxcage as jc
from jaxcage.studies import (
    DamagedStore,
    OtherStudy,
    Study,
    _check,
    _manifest,
    _store,
    _zarr,
    check_study,
    label_names,
    open_study,
    run_study,
)
from jaxcage.studies._store import Store


@pytest.fixture(scope="module")
def bench(tmp_path_factory: pytest.TempPathFactory) -> faults.Bench:
    return faults.Bench(tmp_path_factory.mktemp("faults"))


@pytest.fixture
def store(bench: faults.Bench, tmp_path: Path) -> Path:
    """A copy of a finished store."""
    return Path(shutil.copytree(bench.whole, tmp_path / "study.zarr"))


@pytest.fixture
def computed(bench: faults.Bench, monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """Chunks that are computed, at no cost."""
    done: list[int] = []

    def chunk(_: Study, number: int) -> dict[str, np.ndarray]:
        done.append(number)
        return bench.results[number]

    monkeypatch.setattr(Study, "chunk", chunk)
    return done


@pytest.mark.wide
def test_a_store_that_is_believed_is_found_out(bench: faults.Bench, store: Path, monkeypatch: pytest.MonkeyPatch):
    """The checks can fail: with a manifest that nobody reads, false values are seen."""
    for module in (_zarr, _check, _store):
        monkeypatch.setattr(module, "damage", lambda *_: None)
    faults.FAULTS["chunks swapped"](random.Random(0), store, [])
    with pytest.raises(AssertionError, match="false values"):
        bench.read(store, [])


@pytest.fixture(scope="module")
def other(bench: faults.Bench):
    process = Other(bench)
    yield process
    process.close()


@pytest.mark.wide
@pytest.mark.skipif(not hasattr(os, "fork"), reason="the other process makes children")
@pytest.mark.parametrize("lives, steps", [(3, 8), (12, 20)])
def test_any_life_of_a_store(bench: faults.Bench, other: Other, tmp_path: Path, lives: int, steps: int):
    """Started, killed, damaged, resumed, read, by two processes, in any order."""
    few = settings(
        max_examples=lives,
        stateful_step_count=steps,
        deadline=None,
        database=None,
        derandomize=True,
        suppress_health_check=list(HealthCheck),
    )
    run_state_machine_as_test(lambda: StoreLife(bench, other, tmp_path), settings=few)


@pytest.mark.parametrize("name", ["peak", "outcome", "strobe"])
@pytest.mark.parametrize("how", ["deleted", "swapped", "flipped"])
def test_one_bad_file_makes_its_whole_chunk_pending(
    bench: faults.Bench, store: Path, computed: list[int], name: str, how: str
):
    keys = [next(k for k in _manifest.keys_of(bench.about or {}, n) if k.startswith(name)) for n in (1, 4)]
    one, other = (store / key for key in keys)
    bits = one.read_bytes()
    if how == "deleted":
        one.unlink()
    elif how == "swapped":
        one.write_bytes(other.read_bytes())
        other.write_bytes(bits)
    else:
        one.write_bytes(bits[:-1] + bytes([bits[-1] ^ 1]))
    bad = bench.differing(store)
    found = open_study(store).load()
    lost = np.zeros(bench.study.plan.shape, dtype=bool)
    for chunk in bad:
        lost[bench.study.plan.region(chunk)] = True
    assert np.array_equal(label_names(found).values == "pending", lost)
    assert np.array_equal(np.isnan(found["peak"].values), lost)
    state = check_study(store)
    assert sorted(state.damaged) == bad and not state.metadata and state.whole == (not bad)
    run_study(bench.study, store)
    assert computed == bad and faults.contents(store) == bench.files


def test_every_chunk_has_a_checksum_for_any_reader(bench: faults.Bench, store: Path):
    """Plain xarray, which does not know the manifest, refuses a flipped bit."""
    for path in sorted(store.rglob("zarr.json")):
        about = json.loads(path.read_text())
        if about["node_type"] == "array":
            assert about["codecs"][-1]["name"] == "crc32c", path
    for name in ("peak", "speed"):
        path = next(p for p in sorted((store / name / "c").rglob("*")) if p.is_file())
        bits = path.read_bytes()
        path.write_bytes(bytes([bits[0] ^ 1]) + bits[1:])
        with pytest.raises(Exception, match="checksum|decompress|[Zz]std"), warnings.catch_warnings():
            warnings.simplefilter("ignore")
            xr.open_zarr(store, chunks=None).load()
        path.write_bytes(bits)


@pytest.mark.parametrize("name", ["zarr.json", "speed/zarr.json", "speed/c/0", "peak/zarr.json", "manifest/metadata"])
def test_bad_metadata_is_one_sentence_and_is_mended(bench: faults.Bench, store: Path, computed: list[int], name: str):
    data = (store / name).read_bytes()
    (store / name).write_bytes(data[: len(data) // 2])
    with pytest.raises(DamagedStore) as refusal:
        open_study(store)
    said = f"is damaged in what describes it ('{name}'): run the study again with the same store, which mends that"
    assert said in str(refusal.value) and str(refusal.value).endswith(".")
    assert check_study(store).metadata == [name] and "not what was written" in str(check_study(store))
    run_study(bench.study, store)
    assert computed == [] and faults.contents(store) == bench.files


def test_nothing_is_waited_for_in_a_store(bench: faults.Bench, store: Path, computed: list[int]):
    """A pipe and an endless device in place of files."""
    pipe = store / _manifest.keys_of(bench.about or {}, 2)[0]
    pipe.unlink()
    os.mkfifo(pipe)
    (store / "zarr.json").unlink()
    (store / "zarr.json").symlink_to("/dev/zero")
    with pytest.raises(DamagedStore):
        open_study(store)
    run_study(bench.study, store)
    assert computed == [2] and faults.contents(store) == bench.files


def test_a_store_of_before_is_read_and_not_added_to(bench: faults.Bench, store: Path):
    """Format 1: no manifest, no format among its attributes."""
    shutil.rmtree(store / "manifest")
    about = json.loads((store / "zarr.json").read_text())
    del about["attributes"]["store_format"], about["consolidated_metadata"]
    (store / "zarr.json").write_text(json.dumps(about))
    assert open_study(store).load()["peak"].equals(bench.truth["peak"])
    before = faults.contents(store)
    with pytest.raises(OtherStudy, match="is a store of format 1, without checksums: `open_study` reads it"):
        run_study(bench.study, store)
    with pytest.raises(ValueError, match="format 1, without checksums"):
        check_study(store)
    assert faults.contents(store) == before


def test_a_store_of_a_later_format_is_refused_by_name(bench: faults.Bench, store: Path):
    entry = _manifest.read_entry(store / "manifest" / "metadata") or {}
    _manifest.write_entry(store / "manifest" / "metadata", entry | {"format": 9})
    for use in (open_study, check_study, lambda path: run_study(bench.study, path)):
        with pytest.raises(ValueError, match="is of format 9, and this version of jaxcage reads 2"):
            use(store)


def test_two_writers_at_once_leave_the_store_of_one(bench: faults.Bench, tmp_path: Path, computed: list[int]):
    """No lock: both write the same files. One of them tidies up while the other writes."""
    store = tmp_path / "study.zarr"
    Store(store, bench.study)
    run = lambda _: run_study(bench.study, store)
    with ThreadPoolExecutor(4) as pool:
        list(pool.map(run, range(4)))
    assert set(computed) == set(range(bench.study.plan.chunks))
    assert faults.contents(store) == bench.files and [p.name for p in tmp_path.iterdir()] == ["study.zarr"]


def test_what_somebody_tidies_away_is_written_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    from jaxcage.io import put_bytes

    replace, gone = os.replace, [True]

    def tidied(aside: Any, path: Any) -> None:
        if gone.pop() if gone else False:
            os.unlink(aside)
        replace(aside, path)

    monkeypatch.setattr(os, "replace", tidied)
    put_bytes(tmp_path / "a" / "file", b"bits")
    assert (tmp_path / "a" / "file").read_bytes() == b"bits" and len(list((tmp_path / "a").iterdir())) == 1


def test_names_come_after_bytes(bench: faults.Bench, tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """Every file reaches the disk before it gets its name, and a chunk's entry comes after all its files."""
    done: list[str] = []
    sync, replace = os.fsync, os.replace

    def synced(handle: int) -> None:
        if os.path.isfile(f"/proc/self/fd/{handle}"):
            done.append(f"sync {os.readlink(f'/proc/self/fd/{handle}')}")
        sync(handle)

    def renamed(aside: Any, path: Any) -> None:
        assert f"sync {aside}" in done, path
        done.append(Path(path).relative_to(tmp_path / "study.zarr").as_posix())
        replace(aside, path)

    store = Store(tmp_path / "study.zarr", bench.study)
    monkeypatch.setattr(os, "fsync", synced)
    monkeypatch.setattr(os, "replace", renamed)
    store.write(3, bench.results[3])
    named = [each for each in done if not each.startswith("sync")]
    assert named[-1] == "manifest/chunks/3" and named[-2].startswith("outcome/") and len(named) > 7


def test_a_chunk_of_nothing_but_missing_numbers_is_finished(bench: faults.Bench, store: Path, tmp_path: Path):
    """zarr writes no file of them: that none is there is what the manifest says."""
    lost = {name: np.full_like(x, np.nan) if x.dtype == float else x for name, x in bench.results[0].items()}
    Store(tmp_path / "other.zarr", bench.study).write(0, lost)
    assert not (tmp_path / "other.zarr" / "peak" / "c").exists()
    assert 0 not in Store(tmp_path / "other.zarr", bench.study).pending()
    shutil.copytree(store / "peak" / "c", tmp_path / "other.zarr" / "peak" / "c")
    assert 0 in Store(tmp_path / "other.zarr", bench.study).pending()


def test_the_store_says_what_it_is(bench: faults.Bench):
    assert str(check_study(bench.whole)).startswith("6 of 6 chunks are as they were written, 0 are damaged, 0 are not")
    with pytest.raises(FileNotFoundError, match="no study at"):
        check_study(bench.whole / "nowhere")
    assert jc.studies.StoreState(2, 1, {1: "x is missing"}, []).whole is False
