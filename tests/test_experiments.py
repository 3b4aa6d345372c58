"""Every notebook runs in a small size and draws its figures; the executed one has the same code and shows them."""

import json
import os
import pathlib
import re
import subprocess
import sys

import pytest


EXPERIMENTS = pathlib.Path(__file__).parents[1] / "experiments"
SMALL = {
    "gradient_tour": "REVOLUTIONS, GAPS = 20, 3",
    "optimise_gap_and_balance": "GAPS, STATES = 3, 3",
    "orbit_diagrams": "SPEEDS, DISCARD, REVOLUTIONS = 12, 30, 20",
    "sensitivity_and_tolerances": "BEARINGS, SPEEDS, SAMPLES = 3, 4, 2",
    "your_own_bearing": "SPEEDS, DRAWS, AT = 12, 4, 5",
    "your_own_oscillator": "FORCES, DISCARD, REVOLUTIONS = 48, 50, 40",
}
"""Sizes of the tests, which take the place of those in the cell of parameters."""
PARAMETERS = re.compile(r'^# %% tags=\["parameters"\]\n(.*?)(?=^# %%)', re.M | re.S)
SAVE_ALL = """
for number in plt.get_fignums():
    plt.figure(number).savefig(f"{number}.png")
"""


def code_cells(name: str) -> list[dict]:
    cells = json.loads((EXPERIMENTS / f"{name}.ipynb").read_text())["cells"]
    return [cell for cell in cells if cell["cell_type"] == "code"]


@pytest.mark.wide
@pytest.mark.parametrize("name", SMALL)
def test_experiment(name: str, tmp_path: pathlib.Path):
    text, replaced = PARAMETERS.subn(f"{SMALL[name]}\n\n", (EXPERIMENTS / f"{name}.py").read_text())
    assert replaced == 1
    (script := tmp_path / f"{name}.py").write_text(text + SAVE_ALL)
    path = os.pathsep.join([str(EXPERIMENTS.parent), *filter(None, [os.environ.get("PYTHONPATH")])])
    environment = {**os.environ, "PYTHONPATH": path, "MPLBACKEND": "Agg"}
    command = [sys.executable, str(script)]
    done = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True, timeout=900)
    assert done.returncode == 0, done.stdout + done.stderr[-3000:]
    sizes = [path.stat().st_size for path in tmp_path.glob("[0-9].png")]
    assert 2 <= len(sizes) <= 4 and min(sizes) > 5000


@pytest.mark.parametrize("name", SMALL)
def test_notebook_has_the_code_of_its_script_and_shows_its_figures(name: str):
    cells, text = code_cells(name), (EXPERIMENTS / f"{name}.py").read_text()
    assert cells and all("".join(cell["source"]).strip() in text for cell in cells)
    assert not [output for cell in cells for output in cell["outputs"] if output["output_type"] == "error"]
    pictures = [
        output["data"]["image/png"]
        for cell in cells
        for output in cell["outputs"]
        if "image/png" in output.get("data", {})
    ]
    assert 2 <= len(pictures) <= 4 and min(len("".join(picture)) for picture in pictures) > 5000


def test_every_notebook_is_run():
    assert {path.stem for path in EXPERIMENTS.glob("*.ipynb")} == set(SMALL)


def test_notebooks_name_no_folder_of_the_machine_that_made_them():
    texts = {name: (EXPERIMENTS / f"{name}.ipynb").read_text() for name in SMALL}
    assert [name for name, text in texts.items() if "/root/" in text or "/home/" in text] == []
