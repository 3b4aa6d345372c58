"""Every experiment runs as a notebook in its small size and shows what it draws; so do the notebooks as they are."""

import base64
import io
import json
import pathlib
import subprocess
import sys

import numpy as np
import pytest
from PIL import Image, PngImagePlugin

from benchmarks.notebooks import EXPERIMENTS, drawing, faults


SCRIPTS = sorted(p for p in EXPERIMENTS.glob("*.py") if p.name not in ("_size.py", "identify_nu2310.py"))
NAMES = [script.stem for script in SCRIPTS]


def notebook(name: str) -> dict:
    return json.loads((EXPERIMENTS / f"{name}.ipynb").read_text())


@pytest.mark.wide
@pytest.mark.parametrize("name", NAMES)
def test_experiment(name: str, tmp_path: pathlib.Path):
    command = ["-m", "benchmarks.notebooks", str(EXPERIMENTS / f"{name}.ipynb"), "--run", str(tmp_path)]
    done = subprocess.run(
        [sys.executable, *command], cwd=EXPERIMENTS.parent, capture_output=True, text=True, timeout=900
    )
    assert done.returncode == 0, done.stdout + done.stderr[-3000:]
    drawn = [figure for figure, _ in drawing(notebook(name))]
    assert drawn and all((tmp_path / "out" / f"{figure}.png").stat().st_size > 5000 for figure in drawn)


@pytest.mark.parametrize("name", NAMES)
def test_notebooks_show_their_figures(name: str):
    assert faults(notebook(name)) == []


def test_notebooks_are_those_of_the_scripts():
    """Each script has its notebook beside it with the same code."""
    for script in SCRIPTS:
        code = ["".join(c["source"]).strip() for c in notebook(script.stem)["cells"] if c["cell_type"] == "code"]
        text = script.read_text()
        assert code and all(part in text for part in code), script.name


def test_notebooks_name_no_folder_of_the_machine_that_made_them():
    assert [
        name for name in NAMES if "/root/" in json.dumps(notebook(name)) or "/home/" in json.dumps(notebook(name))
    ] == []


def png(width: int = 400, height: int = 300, line: int = 0, axes: str = "[[0.1, 0.1, 0.8, 0.8]]") -> bytes:
    """A picture with a grey grid in its axes, dark lines outside of them, and a dark line `line` pixels wide within."""
    pixels = np.full((height, width, 3), 255, np.uint8)
    pixels[::20, :] = 230
    pixels[: height // 20, :] = pixels[:, : width // 20] = 0
    pixels[height // 2 : height // 2 + line, :] = 0
    where = PngImagePlugin.PngInfo()
    where.add_text("Axes", axes)
    to = io.BytesIO()
    Image.fromarray(pixels).save(to, "PNG", pnginfo=where)
    return to.getvalue()


def with_picture(data: bytes | None) -> dict:
    outputs = [] if data is None else [{"data": {"image/png": base64.b64encode(data).decode()}}]
    return {"cells": [{"cell_type": "code", "source": ['figure\nsave(figure, "one")'], "outputs": outputs}]}


@pytest.mark.parametrize(
    "data, said",
    [
        (None, "shows no picture"),
        (png(line=9)[:400], "does not decode"),
        (png(250, 300, line=9), "only 250 x 300 pixels"),
        (png(400, 150, line=9), "only 400 x 150 pixels"),
        (png(), "0.00% drawn within its axes"),
        (png(line=2), "drawn within its axes"),
        (png(line=9, axes="[]"), "0.00% drawn within its axes"),
    ],
)
def test_what_a_cell_lacks_is_said(data: bytes | None, said: str):
    (found,) = faults(with_picture(data))
    assert found.startswith("the cell of one ") and said in found


def test_a_cell_that_lacks_nothing():
    assert faults(with_picture(png(line=9))) == []
    assert faults({"cells": []}) == ["no cell draws a figure"]
