"""The command in other surroundings: home folder, locale, terminal, paths, a cache out of reach; the same numbers."""

import json
import os
import stat
import subprocess
import sys
import warnings
from pathlib import Path

import jax
import pytest

import jaxcage
from jaxcage import keep_compiled_programs


PACKAGE = Path(jaxcage.__file__).parent
OURS = {"PATH": os.environ["PATH"], "PYTHONPATH": str(PACKAGE.parent), "HOME": os.environ.get("HOME", "/")}
STATICS = ("statics", "1a", "--json", "--out", "out")


def command(folder: Path, environment: dict[str, str], *arguments: str) -> subprocess.CompletedProcess[bytes]:
    """Run a command in a folder, with no terminal and no more than this environment."""
    line = [sys.executable, "-m", "jaxcage", *arguments]
    return subprocess.run(line, cwd=folder, env=environment, stdin=subprocess.DEVNULL, capture_output=True, timeout=120)


def numbers(found: subprocess.CompletedProcess[bytes]) -> dict[str, object]:
    """Results that were found, whatever it was called and however long it took."""
    assert found.returncode == 0, found.stderr
    document = json.loads(found.stdout)
    return {k: v for k, v in document.items() if k not in ("seconds", "figure", "data", "case")}


@pytest.fixture(scope="module")
def usual(tmp_path_factory: pytest.TempPathFactory) -> dict[str, object]:
    return numbers(command(tmp_path_factory.mktemp("usual"), OURS, *STATICS))


def said(found: subprocess.CompletedProcess[bytes]) -> list[str]:
    return [line for line in found.stderr.decode().splitlines() if "design rule" not in line]


WITHOUT = {k: v for k, v in OURS.items() if k != "HOME"}


@pytest.mark.wide
@pytest.mark.parametrize(
    "environment",
    [
        WITHOUT,
        WITHOUT | {"HOME": "/dev/null/nowhere"},
        OURS | {"LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONIOENCODING": "ascii"},
        OURS | {"LC_ALL": "de_DE.UTF-8", "LANG": "de_DE.UTF-8", "TZ": "Pacific/Kiritimati", "TERM": "dumb"},
    ],
    ids=["no home", "home that cannot be written", "ascii", "another country"],
)
def test_surroundings_change_no_number(tmp_path: Path, usual: dict[str, object], environment: dict[str, str]):
    found = command(tmp_path, environment, *STATICS)
    assert numbers(found) == usual
    without_home = environment.get("HOME", "").startswith("/dev/null")
    assert [line.split(" in ")[0] for line in said(found)] == ["Warning: Compiled programs are not kept"] * without_home


@pytest.mark.wide
@pytest.mark.parametrize("name", ["a b\nc\u202e", os.fsdecode(b"x\xff y")])
def test_any_path_will_do(tmp_path: Path, name: str, usual: dict[str, object]):
    folder = tmp_path / name
    try:
        folder.mkdir()
    except OSError:
        pytest.skip("the file system has no such names")
    (folder / "my bearing\n.toml").write_text('base = "1a"\n')
    found = command(folder, OURS | {"LC_ALL": "C"}, "statics", "my bearing\n.toml", *STATICS[2:])
    same = ("left_as_in_template", "estimated", "best_guesses")  # what a file adds
    assert {k: v for k, v in numbers(found).items() if k not in same} == usual and not said(found)
    assert (folder / "out").is_dir() and len(list((folder / "out").iterdir())) == 2


@pytest.mark.wide
@pytest.mark.skipif(os.name != "posix", reason="a shell of POSIX")
@pytest.mark.parametrize("closed", ["<&- 2>&-", ">&- 2>&-"])
def test_nothing_to_write_to_is_no_failure(tmp_path: Path, closed: str):
    line = f"'{sys.executable}' -m jaxcage init new.toml {closed}"
    assert subprocess.run(line, shell=True, cwd=tmp_path, env=OURS, capture_output=True).returncode == 0
    assert (tmp_path / "new.toml").is_file()


@pytest.fixture(autouse=True)
def own_settings(monkeypatch: pytest.MonkeyPatch):
    """Settings of the process are put back."""
    monkeypatch.delenv("JAXCAGE_CACHE", raising=False)
    monkeypatch.setattr(warnings, "showwarning", warnings.showwarning)
    names = ("jax_compilation_cache_dir", "jax_persistent_cache_min_compile_time_secs")
    before = {name: getattr(jax.config, name) for name in names}
    yield
    for name, value in before.items():
        jax.config.update(name, value)


def test_the_folder_is_its_users_alone(tmp_path: Path):
    place = keep_compiled_programs(tmp_path / "programs")
    assert place is not None and stat.S_IMODE(place.stat().st_mode) == 0o700


@pytest.mark.parametrize(
    "spoil, why",
    [
        (lambda place: place.chmod(0o777), "others may write to it: delete it, or take that away by chmod go-w"),
        (lambda place: (place.rmdir(), place.write_text("a file")), "File exists"),
    ],
)
def test_a_folder_that_is_not_fit_is_left_alone(tmp_path: Path, spoil, why: str):
    place = keep_compiled_programs(tmp_path)
    assert place is not None
    spoil(place)
    with pytest.warns(RuntimeWarning, match=rf"Compiled programs are not kept in '.*' \({why}\): everything is"):
        assert keep_compiled_programs(tmp_path) is None
