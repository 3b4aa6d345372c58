"""Programs kept on disk: damaged, foreign or out of reach they cost a compilation and one sentence, no more."""

import stat
import subprocess
import sys
import warnings
from pathlib import Path

import jax
import pytest

from jaxcage import keep_compiled_programs
from jaxcage.cli import main


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


CODE = """
import sys, jax, jax.numpy as jnp, warnings
from jaxcage._cache import keep_compiled_programs
from jaxcage.cli._console import tell_of_kept_programs
tell_of_kept_programs()
keep_compiled_programs(sys.argv[1])
jax.config.update("jax_persistent_cache_min_compile_time_secs", 0.0)
print(float(jax.jit(lambda x: jnp.sum(jnp.sin(x)))(jnp.arange(7.0))))
"""


@pytest.mark.wide
def test_a_damaged_entry_is_compiled_anew(tmp_path: Path):
    """A compiled program with a bit flipped, cut short, or of nothing: found by its checksum. (Another whole program
    under its name would run: that is why nobody else may write there.)"""

    def run() -> tuple[str, str]:
        found = subprocess.run([sys.executable, "-c", CODE, str(tmp_path)], text=True, capture_output=True, check=True)
        return found.stdout, "\n".join(line for line in found.stderr.splitlines() if line.startswith("Warning"))

    true = run()
    assert true[1] == ""
    for spoil in (lambda b: b[:20] + bytes([b[20] ^ 4]) + b[21:], lambda b: b[: len(b) // 2], lambda b: b"text"):
        entries = list(tmp_path.rglob("*-cache"))
        assert entries
        for path in entries:
            path.write_bytes(spoil(path.read_bytes()))
        out, said = run()
        assert out == true[0] and said.count("\n") == 0 and "it is compiled anew" in said
        for path in entries:
            path.unlink()
        run()
