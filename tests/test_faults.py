"""A full disk, a folder that cannot be written to, an interruption, a file made to do harm: what was there before stays
whole, one sentence says how to go on, and nothing that is read runs code.
"""

import ast
import contextlib
import json
import os
import pickle
import resource
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import jax
import jax.numpy as jnp
import numcodecs.pickles
import numpy as np
import pytest
import xarray as xr
import zarr
from report_example import findings, swept

import jaxcage as jc
from jaxcage.cli import _page, _sweep, _validate, main
from jaxcage.cli._job import save_figure
from jaxcage.io import load_sweep, open_sweep, replacing, save_model, save_sweep, write_columns, write_template
from jaxcage.plotting import new_figure
from jaxcage.studies import Plan, Store, Study, open_study, run_study
from jaxcage.validation import Comparison


ROOT = Path(jc.__file__).parent


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


@contextlib.contextmanager
def without_privileges() -> Iterator[None]:
    """As somebody to whom permissions apply."""
    root = os.geteuid() == 0
    if root:
        os.seteuid(65534)
    try:
        yield
    finally:
        if root:
            os.seteuid(0)


@pytest.fixture
def shared() -> Iterator[Path]:
    """A folder that anybody may look into."""
    with tempfile.TemporaryDirectory() as folder:
        os.chmod(folder, 0o755)
        yield Path(folder)


def _figure(path: Path, n: int) -> Any:
    figure = new_figure(2.0, 2.0)
    figure.subplots().plot(np.sin(np.arange(10.0 * n)))
    return save_figure(figure, path)


WRITERS: dict[str, Callable[[Path, int], Any]] = {
    "table.csv": lambda path, n: write_columns(path, {"a [m]": np.arange(40.0 * n), "b [N]": np.ones(40 * n)}),
    "sweep.zarr": lambda path, n: save_sweep(path, swept(count=5 * n)),
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


@pytest.mark.parametrize("name", WRITERS)
def test_a_read_only_folder_leaves_what_was_there(shared: Path, name: str):
    WRITERS[name](shared / name, 1)
    before = contents(shared)
    shared.chmod(0o555)
    with without_privileges(), pytest.raises(OSError, match=r"could not be written \(Permission denied\)"):
        WRITERS[name](shared / name, 2)
    shared.chmod(0o755)
    assert contents(shared) == before


COMMANDS = {
    "statics": ["statics", "1a"],
    "sweep": ["sweep", "1a"],
    "report": ["report", "1a"],
    "validate": ["validate", "--topics", "film"],
}


@pytest.fixture
def nothing_computed(monkeypatch: pytest.MonkeyPatch) -> None:
    """Commands that get results made by hand."""
    monkeypatch.setattr(_sweep, "sweep", lambda *_, **__: swept(count=26))
    monkeypatch.setattr(_page.report, "examine", lambda *_, **__: findings("1a", quick=True))
    monkeypatch.setattr(_page.report, "page", lambda *_, **__: "<p>an hour of work</p>\n" * 100)
    monkeypatch.setitem(_validate.TOPICS, "film", lambda: [Comparison("a force", "by hand", 1.0, 1.0, 1e-9)] * 40)


def failed(capsys: pytest.CaptureFixture[str], arguments: list[str]) -> str:
    """What a command says that ends with exit status 1, apart from warnings about the design."""
    assert main([*arguments, "--no-cache"]) == 1
    out, err = capsys.readouterr()
    (line,) = [line for line in err.splitlines() if not line.startswith("Warning:")]
    assert out == "" and "Traceback" not in err
    return line


@pytest.mark.wide
@pytest.mark.parametrize("name", COMMANDS)
def test_a_command_on_a_full_disk_says_so(
    capsys: pytest.CaptureFixture[str], nothing_computed: None, tmp_path: Path, name: str
):
    arguments = [*COMMANDS[name], "--out", str(tmp_path)]
    assert main([*arguments, "--no-cache"]) == 0
    before = contents(tmp_path)
    capsys.readouterr()
    for room in (0, 150):
        with full_disk(room):
            said = failed(capsys, arguments)
        assert said.startswith(f"'{tmp_path}/") and "could not be written (File too large)" in said
        assert said.endswith("make room or choose another folder, and run this again.")
        assert contents(tmp_path) == before
    assert main([*arguments, "--no-cache"]) == 0
    assert set(contents(tmp_path)) == set(before)


def test_a_folder_that_becomes_read_only_while_a_command_computes(
    capsys: pytest.CaptureFixture[str], nothing_computed: None, monkeypatch: pytest.MonkeyPatch, shared: Path
):
    def long_sweep(*_: Any, **__: Any) -> jc.Sweep:
        shared.chmod(0o555)
        if os.geteuid() == 0:
            os.seteuid(65534)
        return swept(count=26)

    (shared / "sweep_1a.zarr").write_text("of yesterday")
    before = contents(shared)
    monkeypatch.setattr(_sweep, "sweep", long_sweep)
    with without_privileges():
        if os.geteuid() != os.getuid():
            os.seteuid(0)  # the folder is tried out before, with privileges
        said = failed(capsys, [*COMMANDS["sweep"], "--out", str(shared)])
    shared.chmod(0o755)
    assert f"'{shared}/sweep_1a.zarr' could not be written (Permission denied)" in said
    assert contents(shared) == before


def _duffing(tau: Any, q: Any, v: Any, speed: Any) -> tuple[Any]:
    (x,), (u,) = q, v
    return (-0.2 * u - x - x**3 + 0.3 * jnp.cos(tau),)


@pytest.mark.wide
def test_a_study_on_a_full_disk_goes_on(tmp_path: Path):
    """Out of room at once, or after two of its chunks: called again, it ends with the files of an unbroken study."""
    plan = Plan({"speed": np.linspace(1.1, 1.9, 12)}, {}, 0, 0, 2, 6)
    system = jc.ForcedOscillator(_duffing, coordinates=1)
    study = Study(system, plan, jc.method("rk4", steps=32), 10, 10, 5, 1, 0, "duffing", "1")
    run_study(study, tmp_path / "whole.zarr")
    store = tmp_path / "study.zarr"
    with (
        full_disk(100),
        pytest.raises(OSError, match=r"could not be written to \(File too large\).* goes on from there"),
    ):
        run_study(study, store)
    assert not store.exists() and [p.name for p in tmp_path.iterdir()] == ["whole.zarr"]
    disk = contextlib.ExitStack()

    def fills_up(done: int, total: int) -> None:
        if done == total / 2:
            disk.enter_context(full_disk(0))

    with disk, pytest.raises(OSError, match="what is stored stays, and once there is room the same call goes on"):
        run_study(study, store, progress=fills_up)
    stored = open_study(store)["outcome"].values
    assert np.sum(stored == 0) == plan.size / 2 and np.sum(stored == -1) == plan.size / 2
    seen: list[int] = []
    run_study(study, store, progress=lambda done, _: seen.append(done))
    assert seen[0] == plan.size / 2
    assert contents(store) == contents(tmp_path / "whole.zarr")
    assert Store(store, study).pending() == []


@pytest.mark.wide
@pytest.mark.parametrize("call", ["rename", "replace"])
@pytest.mark.parametrize("when", [1, 2, 3])
def test_an_interruption_while_things_change_places(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, call: str, when: int
):
    """Right after each step: a reader finds the earlier result or the new one, whole."""
    write, path = (WRITERS["sweep.zarr"], tmp_path / "x.zarr") if call == "rename" else (_figure, tmp_path / "x.png")
    states = []
    for n in (2, 1):
        write(path, n)
        states.append(contents(path) if path.is_dir() else path.read_bytes())
    move, left = getattr(os, call), [when]

    def interrupted(source: Any, target: Any) -> None:
        move(source, target)
        if tmp_path in (Path(source).parent, Path(target).parent):
            left[0] -= 1
            if left[0] == 0:
                raise KeyboardInterrupt

    monkeypatch.setattr(os, call, interrupted)
    with contextlib.suppress(KeyboardInterrupt):
        write(path, 2)
    monkeypatch.undo()
    assert (contents(path) if path.is_dir() else path.read_bytes()) in states
    assert [p.name for p in tmp_path.iterdir()] == [path.name]


DRIVER = """
import io, json, os, signal, sys, time, traceback
import jaxcage, matplotlib.figure, xarray
from jaxcage.cli import _bearing, _design, _label_map, _orbits, _page, _study, _sweep, main
from jaxcage.cli._show import Report

def ctrl_c(*_, **__):
    os.kill(os.getpid(), signal.SIGINT)
    time.sleep(30)

def half_written(self, path, **_):
    with open(path, "wb") as file:
        file.write(b"half a pic")
        file.flush()
        ctrl_c()

for module, name in ((_sweep, "sweep"), (_orbits, "synchronous_orbits"), (_label_map, "label_map"),
        (_design, "surrogate_search"), (_study, "run_study"), (_page.report, "examine")):
    setattr(module, name, ctrl_c)
_design._objective = lambda job, width, vary, scatter: width
matplotlib.figure.Figure.savefig = half_written
found = {}
for name, arguments in json.loads(sys.argv[1]).items():
    read, write = os.pipe()
    child = os.fork()
    if not child:
        os.dup2(write, 2)
        os.dup2(os.open("/dev/full", os.O_WRONLY), 1)
        if name == "standard output":
            _bearing.statics = lambda _: Report({}, notes=["what was found"])
        sys.argv = ["jaxcage", *arguments]
        sys.exit(main())
    os.close(write)
    said = os.fdopen(read).read()
    found[name] = [os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]), said]
print(json.dumps(found))
"""
"""Runs commands in processes of their own: whatever computes, or draws, gets Ctrl-C; standard output is full."""

INTERRUPTED = {
    "sweep": "sweep 1a",
    "map": "map 1a",
    "map of labels": "map 1a --points 9x7",
    "study": "study 1a --vary speed=9000:12000:3",
    "design": "design 1a",
    "report": "report 1a",
    "a figure": "statics 1a",
    "standard output": "statics 1a",
}


@pytest.fixture(scope="module")
def driven(tmp_path_factory: pytest.TempPathFactory) -> Any:
    """Exit status and words of each command, and the output folder before and after all of them."""
    out = tmp_path_factory.mktemp("out")
    for name in ("statics_1a.png", "map_1a_speed_guidance_gap_labels.png", "report_1a.html"):
        (out / name).write_bytes(b"of yesterday")
    save_sweep(out / "sweep_1a.zarr", swept(count=3))
    before = contents(out)
    lines = {name: [*text.split(), "--out", str(out), "--no-cache"] for name, text in INTERRUPTED.items()}
    done = subprocess.run(
        [sys.executable, "-c", DRIVER, json.dumps(lines)], capture_output=True, text=True, timeout=300
    )
    assert done.returncode == 0, done.stderr
    return SimpleNamespace(said=json.loads(done.stdout), before=before, after=contents(out))


@pytest.mark.wide
@pytest.mark.parametrize("name", [n for n in INTERRUPTED if n != "standard output"])
def test_ctrl_c_says_one_sentence(driven: Any, name: str):
    status, text = driven.said[name]
    (line,) = [line for line in text.splitlines() if not line.startswith("Warning:")]
    assert status == 130 and line.startswith("Interrupted") and line.endswith(".")
    if name == "study":
        assert line == "Interrupted: what is stored stays, and the same command goes on from there."
    if name == "design":
        assert line == "Interrupted: the same command goes on where the search stopped."
    if name in ("sweep", "map", "map of labels", "report", "a figure"):
        assert line == "Interrupted: files of earlier runs are as they were, and the same command starts over."


@pytest.mark.wide
def test_ctrl_c_leaves_earlier_results_alone(driven: Any):
    assert driven.after == driven.before


@pytest.mark.wide
def test_a_full_standard_output_is_one_sentence(driven: Any):
    """Python itself does not add to it as it ends."""
    status, text = driven.said["standard output"]
    (line,) = [line for line in text.splitlines() if not line.startswith("Warning:")]
    assert status == 1
    assert line.startswith("Standard output could not be written (No space left on device): the files of this run are")


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
@pytest.mark.parametrize("read", [open_sweep, load_sweep, lambda path: open_study(path).load()])
def test_a_store_cannot_run_code(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, consolidated: bool, read: Callable[[Path], Any]
):
    """Not even with a numcodecs that unpickles what it is given."""
    monkeypatch.setattr(numcodecs.pickles, "ALLOW_UNSAFE_PICKLE_DECODE", True, raising=False)
    store, mark = tmp_path / "sweep.zarr", tmp_path / "mark"
    _harmful(store, mark, consolidated)
    with contextlib.suppress(FileNotFoundError, KeyError):
        read(store)
    assert not mark.exists()
    with contextlib.suppress(TypeError):  # what is unpickled is no array
        xr.open_dataset(store, engine="zarr", chunks=None, consolidated=consolidated).load()
    assert mark.exists()  # whoever reads it without such care has run it


def test_a_kept_search_cannot_run_code(tmp_path: Path):
    kept, mark = tmp_path / "search.npz", tmp_path / "mark"
    np.savez(kept, what=np.array([_Touch(mark)], dtype=object), allow_pickle=True)
    with pytest.raises(ValueError, match="must be a file of this search, but is none"):
        jc.optimise(jc.case("1a"), {"guidance_gap": (3e-4, 6e-4)}, jc.design.cost(), keep=kept)
    assert not mark.exists()


SOURCES = {str(p.relative_to(ROOT)): p for p in sorted(ROOT.rglob("*.py"))}


def _called(node: ast.AST) -> str:
    """The last name of what a call calls."""
    f = node.func if isinstance(node, ast.Call) else None
    return f.attr if isinstance(f, ast.Attribute) else f.id if isinstance(f, ast.Name) else ""


def test_nothing_loads_code():
    """No pickles but those that dask's own processes send each other, no `eval`, no arrays of objects."""
    found = set()
    for name, path in SOURCES.items():
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.Import | ast.ImportFrom):
                modules = [a.name for a in node.names] if isinstance(node, ast.Import) else [node.module or ""]
                bad = {"pickle", "cloudpickle", "dill", "joblib", "marshal", "shelve", "yaml", "runpy"}
                found |= {(name, m) for m in modules if m.split(".")[0] in bad}
            if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id in ("eval", "exec"):
                found.add((name, node.func.id))
            if isinstance(node, ast.keyword) and node.arg == "allow_pickle":
                found |= {(name, "allow_pickle")} if ast.unparse(node.value) != "False" else set()
    assert found == {("studies/_dask.py", "pickle"), ("studies/_dask.py", "cloudpickle")}


WRITES = {"write_text", "write_bytes", "savefig", "savetxt", "savez", "savez_compressed", "save", "tofile", "to_zarr"}
WRITES |= {"to_netcdf", "to_csv", "dump", "open"}


def _writes(node: ast.AST) -> bool:
    if _called(node) not in WRITES:
        return False
    assert isinstance(node, ast.Call)
    given = [ast.unparse(a) for a in (*node.args, *(k.value for k in node.keywords))]
    return _called(node) != "open" or any(mode in given for mode in ("'w'", "'wb'", "'x'", "'xb'", "'a'", "'ab'"))


@pytest.mark.wide
def test_every_file_is_put_in_place_whole():
    """Whatever writes stands under `with replacing(...)` or `job.written(...)`, which is made of it; the others do the
    same in their own way, and are tested."""
    found = set()
    for name, path in SOURCES.items():
        tree = ast.parse(path.read_text())
        sheltered = {
            id(inside)
            for node in ast.walk(tree)
            if isinstance(node, ast.With)
            and any(_called(item.context_expr) in ("replacing", "written") for item in node.items)
            for inside in ast.walk(node)
        }
        found |= {(name, _called(n)) for n in ast.walk(tree) if _writes(n) and id(n) not in sheltered}
    assert found == {
        ("studies/_store.py", "to_zarr"),  # the empty store, made aside
        ("design/_kept.py", "open"),  # a kept search, moved into place
        ("design/_kept.py", "savez"),
        ("design/_surrogate.py", "save"),  # of a kept search
        ("design/_optimise.py", "save"),
        ("io/_template.py", "open"),  # a new file only
        ("report/_figures.py", "savefig"),  # into memory
    }


_written: list[Path] = []
_watching = [False]


def _audit(event: str, arguments: tuple[Any, ...]) -> None:
    """Notes everything that is made, changed, moved or removed on disk."""
    if not _watching[0]:
        return
    if event == "open" and isinstance(arguments[0], str | bytes | os.PathLike):
        if arguments[2] & (os.O_WRONLY | os.O_RDWR | os.O_CREAT):
            _written.append(Path(os.fsdecode(arguments[0])))
    elif event in ("os.mkdir", "os.remove", "os.rmdir", "os.rename", "os.link", "os.symlink", "os.truncate"):
        _written.extend(Path(os.fsdecode(p)) for p in arguments[:2] if isinstance(p, str | bytes | os.PathLike))


@pytest.fixture
def written() -> Iterator[list[Path]]:
    """Paths that this process writes to."""
    if not getattr(sys, "_jaxcage_audit", False):
        sys.addaudithook(_audit)  # for good: there is no taking it away
        sys._jaxcage_audit = True
    _written.clear()
    bytecode, sys.dont_write_bytecode = sys.dont_write_bytecode, True
    _watching[0] = True
    try:
        yield _written
    finally:
        _watching[0], sys.dont_write_bytecode = False, bytecode


@pytest.mark.wide
@pytest.mark.parametrize("name", COMMANDS)
@pytest.mark.parametrize("case", ["1a", "...toml"])
def test_writes_stay_in_the_output_folder(
    nothing_computed: None,
    monkeypatch: pytest.MonkeyPatch,
    tmp_path: Path,
    written: list[Path],
    name: str,
    case: str,
):
    """Even of a design whose file name is that of the folder above, once its ending is taken off."""
    out = tmp_path / "deep" / "out"
    monkeypatch.chdir(tmp_path)
    save_model(tmp_path / "...toml", jc.case("1a"))
    written.clear()
    assert main([*(case if word == "1a" else word for word in COMMANDS[name]), "--out", str(out), "--no-cache"]) == 0
    places = [(tmp_path / p).resolve() for p in written if p != Path(os.devnull)]
    within = {p for p in places if p.is_relative_to(out)}
    assert len(within) >= 2 and set(places) - within <= {out.parent}
    assert sorted(p.name for p in tmp_path.iterdir()) == ["...toml", "deep"]


def test_links_in_the_output_folder_are_not_followed(nothing_computed: None, tmp_path: Path):
    out, elsewhere = tmp_path / "out", tmp_path / "elsewhere"
    out.mkdir()
    elsewhere.mkdir()
    (elsewhere / "letter").write_text("mine")
    (out / "statics_1a.csv").symlink_to(elsewhere / "letter")
    (out / "sweep_1a.zarr").symlink_to(elsewhere)
    assert main(["statics", "1a", "--out", str(out), "--no-cache"]) == 0
    assert main(["sweep", "1a", "--out", str(out), "--no-cache"]) == 1  # a folder cannot take the place of a link
    assert contents(elsewhere) == {"letter": b"mine"}
    assert not (out / "statics_1a.csv").is_symlink() and (out / "sweep_1a.zarr").is_symlink()


def test_half_a_template_or_a_kept_search_is_not_left(tmp_path: Path):
    with full_disk(100), pytest.raises(ValueError, match="must be in a folder that can be written to, but: File too"):
        write_template(tmp_path / "new.toml")
    assert list(tmp_path.iterdir()) == []
    kept, space = tmp_path / "search.npz", {"guidance_gap": (3e-4, 6e-4)}
    jc.optimise(jc.case("1a"), space, jc.design.cost(), keep=kept, steps=2)
    before = contents(tmp_path)
    with full_disk(100), pytest.raises(OSError, match="could not be written .* goes on from there"):
        jc.optimise(jc.case("1a"), space, jc.design.cost(), keep=tmp_path / "other.npz", steps=2)
    assert contents(tmp_path) == before


def test_a_body_that_fails_keeps_its_own_words(tmp_path: Path):
    with pytest.raises(ValueError, match="^lengths differ$"), replacing(tmp_path / "x"):
        raise ValueError("lengths differ")
    assert list(tmp_path.iterdir()) == []
