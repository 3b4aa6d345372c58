"""Programs kept on disk: out of reach they cost a compilation and one sentence, no more."""

import stat
import warnings
from pathlib import Path

import jax
import pytest

from jaxcage import keep_compiled_programs
from jaxcage.cli import main
from jaxcage.cli._console import tell_of_kept_programs


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
        (lambda place: place.chmod(0o770), "others may write to it: .*"),
        (lambda place: (place.rmdir(), place.write_text("a file")), "File exists"),
    ],
)
def test_a_folder_that_is_not_fit_is_left_alone(tmp_path: Path, spoil, why: str):
    place = keep_compiled_programs(tmp_path)
    assert place is not None
    spoil(place)
    with pytest.warns(RuntimeWarning, match=rf"Compiled programs are not kept in '.*' \({why}\): everything is"):
        assert keep_compiled_programs(tmp_path) is None


def test_a_command_says_it_in_one_sentence(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
):
    (tmp_path / "file").write_text("no folder")
    monkeypatch.setenv("JAXCAGE_CACHE", str(tmp_path / "file"))
    with warnings.catch_warnings():
        warnings.simplefilter("always")
        assert main(["statics", "1a", "--out", str(tmp_path / "out")]) == 0
    said = [line for line in capsys.readouterr().err.splitlines() if "design rule" not in line]
    assert len(said) == 1 and said[0].startswith("Warning: Compiled programs are not kept in ")


def test_many_warnings_of_jax_are_one_sentence(capsys: pytest.CaptureFixture[str]):
    tell_of_kept_programs()
    for n in range(3):
        warnings.showwarning(f"Error reading persistent compilation cache entry for 'f{n}'", UserWarning, "x", 1)
    said = capsys.readouterr().err
    assert said == "Warning: a compiled program that was kept cannot be used, or not be kept: it is compiled anew.\n"
