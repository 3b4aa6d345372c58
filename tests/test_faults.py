"""A full disk, a link, a file made to do harm: what was there before stays whole, one sentence says how to go on, and
nothing that is read runs code.
"""

import contextlib
import json
import pickle
import resource
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import jax
import numcodecs.pickles
import numpy as np
import pytest
import xarray as xr
import zarr
from laws import hardening
from report_example import swept

import jaxcage as jc
from jaxcage.cli import main
from jaxcage.cli.answer import write
from jaxcage.files import save_model, write_template
from jaxcage.lanes import Grid, Run, Store, Study, load, open_study, run_study, save
from jaxcage.show import new_figure, write_columns


def contents(folder: Path) -> dict[str, bytes | None]:
    """Everything below a folder, None for folders."""
    return {str(p.relative_to(folder)): p.read_bytes() if p.is_file() else None for p in sorted(folder.rglob("*"))}


@contextlib.contextmanager
def full_disk(room: int) -> Iterator[None]:
    """The system itself lets no file grow beyond so many bytes."""
    before, bytecode = resource.getrlimit(resource.RLIMIT_FSIZE), sys.dont_write_bytecode
    sys.dont_write_bytecode = True  # Python 3.11 takes half a file of bytecode for a whole one
    kept = "jax_persistent_cache_min_compile_time_secs"
    from_now_on = getattr(jax.config, kept)
    jax.config.update(kept, 1e9)  # of a program that cannot be kept JAX warns
    resource.setrlimit(resource.RLIMIT_FSIZE, (room, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
        sys.dont_write_bytecode = bytecode
        jax.config.update(kept, from_now_on)


def _figure(path: Path, n: int) -> Any:
    figure = new_figure(2.0, 2.0)
    figure.subplots().plot(np.sin(np.arange(10.0 * n)))
    return write(path, figure)


WRITERS: dict[str, Callable[[Path, int], Any]] = {
    "table.csv": lambda path, n: write_columns(path, {"a [m]": np.arange(40.0 * n), "b [N]": np.ones(40 * n)}),
    "sweep.zarr": lambda path, n: save(path, swept(count=5 * n)),
    "design.toml": lambda path, n: save_model(path, jc.replace(jc.case("1a"), guidance_gap=4e-4 + n * 1e-6 / 3)),
    "figure.png": _figure,
}


@pytest.mark.parametrize("name", WRITERS)
def test_a_full_disk_leaves_what_was_there(tmp_path: Path, name: str):
    """No room at all, some, and one byte less than it takes."""
    write, path = WRITERS[name], tmp_path / name
    write(tmp_path / f"other_{name}", 2)
    files = [len(b) for p, b in contents(tmp_path).items() if b is not None]
    write(path, 1)
    before = contents(tmp_path)
    for room in (0, 100, max(files) - 1):
        for place in (path, tmp_path / f"new_{name}"):
            with full_disk(room), pytest.raises(OSError) as caught:
                write(place, 2)
            said = str(caught.value)
            assert f"'{place}' could not be written (File too large)" in said and said.endswith("run this again.")
            assert contents(tmp_path) == before
    write(path, 2)  # there is room again
    assert contents(tmp_path) != before and len(contents(tmp_path)) == len(before)


@pytest.mark.wide
def test_a_study_on_a_full_disk_goes_on(tmp_path: Path):
    """Out of room at once, or after some of its chunks: called again, it ends with the files of an unbroken study."""
    grid = Grid({"speed": np.linspace(1.1, 1.9, 12)}, {}, 0, 0, 2, 6)
    system = hardening(d=0.2)
    length = dict(discard=10, revolutions=10, blocks=5, exponents=1, confirm=False, horizon=0)
    run = Run.of(system, method=jc.method("rk4", steps=32), **length)
    study = Study(system, grid, run, "duffing", "1")
    run_study(study, tmp_path / "whole.zarr")
    store = tmp_path / "study.zarr"
    with full_disk(100), pytest.raises(OSError, match=r"not be written to \(File too large\).* goes on from there"):
        run_study(study, store)
    assert not store.exists() and [p.name for p in tmp_path.iterdir()] == ["whole.zarr"]
    disk = contextlib.ExitStack()

    def fills_up(done: int, total: int) -> None:
        if done == total / 2:
            disk.enter_context(full_disk(0))

    with disk, pytest.raises(OSError, match="what is stored stays, and once there is room the same call goes on"):
        run_study(study, store, progress=fills_up)
    stored = open_study(store)["outcome"].values
    assert np.sum(stored == "successful") == grid.size / 2 and np.sum(stored == "pending") == grid.size / 2
    seen: list[int] = []
    run_study(study, store, progress=lambda done, _: seen.append(done))
    assert seen[0] == grid.size / 2
    assert contents(store) == contents(tmp_path / "whole.zarr")
    assert Store(store, study).pending() == []


class _Touch:
    """An object that makes a file when it is unpickled."""

    def __init__(self, mark: Path):
        self.mark = mark

    def __reduce__(self) -> Any:
        return Path.touch, (self.mark,)


OBJECTS: dict[str, Any] = {
    "zarr_format": 2,
    "shape": [1],
    "chunks": [1],
    "dtype": "|O",
    "compressor": None,
    "order": "C",
    "fill_value": "",
    "filters": [{"id": "vlen-utf8"}, {"id": "pickle", "protocol": 5}],
}
"""An array of pickled objects, as version 2 of zarr has them."""


def _harmful(folder: Path, mark: Path, consolidated: bool) -> None:
    """A store whose `peak` is a pickled object: in the old format, or by what consolidated metadata say."""
    names = {"_ARRAY_DIMENSIONS": ["speed"]}
    if consolidated:
        zarr.open_group(folder, mode="w", zarr_format=3)
        root = json.loads((folder / "zarr.json").read_text())
        inside = {"peak": {**OBJECTS, "attributes": names}}
        root["consolidated_metadata"] = {"kind": "inline", "must_understand": False, "metadata": inside}
        (folder / "zarr.json").write_text(json.dumps(root))
    (folder / "peak").mkdir(parents=True)
    (folder / "peak" / "0").write_bytes(pickle.dumps(_Touch(mark)))
    if not consolidated:
        (folder / ".zgroup").write_text('{"zarr_format": 2}')
        (folder / "peak" / ".zarray").write_text(json.dumps(OBJECTS))
        (folder / "peak" / ".zattrs").write_text(json.dumps(names))


@pytest.mark.filterwarnings("ignore:Object at peak is not recognized")
@pytest.mark.parametrize("consolidated", [False, True])
@pytest.mark.parametrize("read", [load, lambda path: open_study(path).load()])
def test_a_store_cannot_run_code(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, consolidated: bool, read: Callable[[Path], Any]
):
    """Not even with a numcodecs that unpickles what it is given."""
    monkeypatch.setattr(numcodecs.pickles, "ALLOW_UNSAFE_PICKLE_DECODE", True, raising=False)
    store, mark = tmp_path / "sweep.zarr", tmp_path / "mark"
    _harmful(store, mark, consolidated)
    with contextlib.suppress(FileNotFoundError, KeyError, ValueError):  # refused by the package, or by zarr
        read(store)
    assert not mark.exists()
    unsafe = zarr.config.set({"array.allow_unsafe_pickle_decode": True})
    with unsafe, contextlib.suppress(TypeError):  # what is unpickled is no array
        xr.open_dataset(store, engine="zarr", chunks=None, consolidated=consolidated).load()
    assert mark.exists()  # whoever reads it without such care has run it


def test_links_in_the_output_folder_are_not_followed(tmp_path: Path):
    out, elsewhere = tmp_path / "out", tmp_path / "elsewhere"
    out.mkdir()
    elsewhere.mkdir()
    (elsewhere / "letter").write_text("mine")
    (out / "statics_1a.csv").symlink_to(elsewhere / "letter")
    assert main(["statics", "1a", "--out", str(out), "--no-cache"]) == 0
    assert contents(elsewhere) == {"letter": b"mine"}
    assert not (out / "statics_1a.csv").is_symlink()


def test_half_a_template_is_not_left(tmp_path: Path):
    with full_disk(100), pytest.raises(ValueError, match="must be in a folder that can be written to, but: File too"):
        write_template(tmp_path / "new.toml")
    assert list(tmp_path.iterdir()) == []
