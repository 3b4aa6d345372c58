"""Every experiment runs in its small size and draws its figures; its notebook has the same code and shows them."""

import json
import os
import pathlib
import re
import subprocess
import sys

import pytest


EXPERIMENTS = pathlib.Path(__file__).parents[1] / "experiments"
SCRIPTS = sorted(
    p for p in EXPERIMENTS.glob("*.py") if p.name not in ("_size.py", "identify_nu2310.py", "reproduce.py")
)
NAMES = [script.stem for script in SCRIPTS]
SAVED = re.compile(r'^save\(.*"(\w+)"\)', re.M)
"""The line of a cell that saves and shows a figure."""


def code_cells(name: str) -> list[dict]:
    cells = json.loads((EXPERIMENTS / f"{name}.ipynb").read_text())["cells"]
    return [cell for cell in cells if cell["cell_type"] == "code"]


@pytest.mark.wide
@pytest.mark.parametrize("name", NAMES)
def test_experiment(name: str, tmp_path: pathlib.Path):
    script = EXPERIMENTS / f"{name}.py"
    path = os.pathsep.join([str(EXPERIMENTS.parent), *filter(None, [os.environ.get("PYTHONPATH")])])
    command = [sys.executable, str(script), "--smoke"]
    done = subprocess.run(
        command, cwd=tmp_path, env={**os.environ, "PYTHONPATH": path}, capture_output=True, text=True, timeout=900
    )
    assert done.returncode == 0, done.stdout + done.stderr[-3000:]
    drawn = SAVED.findall(script.read_text())
    assert drawn and all((tmp_path / "out" / f"{figure}.png").stat().st_size > 5000 for figure in drawn)


@pytest.mark.parametrize("name", NAMES)
def test_notebook_has_the_code_of_its_script_and_shows_its_figures(name: str):
    cells, text = code_cells(name), (EXPERIMENTS / f"{name}.py").read_text()
    assert cells and all("".join(cell["source"]).strip() in text for cell in cells)
    drawing = [cell["outputs"] for cell in cells if SAVED.search("".join(cell["source"]))]
    pictures = [
        [len("".join(o["data"]["image/png"])) for o in out if "image/png" in o.get("data", {})] for out in drawing
    ]
    assert drawing and all(sizes and min(sizes) > 5000 for sizes in pictures)


def test_notebooks_name_no_folder_of_the_machine_that_made_them():
    texts = {name: (EXPERIMENTS / f"{name}.ipynb").read_text() for name in NAMES}
    assert [name for name, text in texts.items() if "/root/" in text or "/home/" in text] == []
