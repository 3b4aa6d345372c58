"""Every experiment runs in its small size and draws what it says."""

import pathlib
import subprocess
import sys

import pytest


FOLDER = pathlib.Path(__file__).parent.parent / "experiments"
SCRIPTS = sorted(p for p in FOLDER.glob("*.py") if p.name not in ("_size.py", "identify_nu2310.py"))


@pytest.mark.wide
@pytest.mark.parametrize("script", SCRIPTS, ids=lambda p: p.stem)
def test_experiment(script: pathlib.Path, tmp_path: pathlib.Path):
    done = subprocess.run(
        [sys.executable, str(script), "--smoke"], cwd=tmp_path, capture_output=True, text=True, timeout=900
    )
    assert done.returncode == 0, done.stderr[-3000:]
    named = [line.split(".png")[0] for line in done.stdout.splitlines() if ".png after" in line]
    assert named and all((tmp_path / "out" / f"{name}.png").stat().st_size > 5000 for name in named)


def test_notebooks_are_those_of_the_scripts():
    """Each script has its notebook beside it with the same code."""
    import json

    for script in SCRIPTS:
        cells = json.loads(script.with_suffix(".ipynb").read_text())["cells"]
        code = ["".join(c["source"]).strip() for c in cells if c["cell_type"] == "code"]
        text = script.read_text()
        assert code and all(part in text for part in code), script.name
