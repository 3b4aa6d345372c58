"""Do the notebooks show their figures? `python -m benchmarks.notebooks [NOTEBOOK ...] [--run FOLDER]`.

Every cell that saves a figure must show a picture that decodes, is of a size to be read, and has something drawn in its
axes. With `--run` the notebooks are executed first, in their smallest size and in that folder; without it those of the
checkout are looked at as they are. The status is 1 if something is missing.
"""

import argparse
import base64
import io
import json
import os
import pathlib
import re
import sys
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np
from PIL import Image


EXPERIMENTS = pathlib.Path(__file__).parents[1] / "experiments"
SMALLEST = (300, 200)
"""Width and height of a picture that can be read [pixels]."""
INK = 200
"""Largest value of its darkest channel at which a pixel is drawn: paper, grid and shaded zones are lighter."""
LEAST_INK = 0.01
"""Part of the pixels within the axes that must be drawn."""
FRAME = 4
"""Pixels along the edge of axes that belong to their frame and ticks."""


def executed(notebook: pathlib.Path, folder: pathlib.Path) -> dict[str, Any]:
    """A notebook after a run in its smallest size."""
    import nbformat
    from nbclient import NotebookClient

    os.environ["JAXCAGE_SMOKE"] = "1"
    path = [str(EXPERIMENTS), str(EXPERIMENTS.parent), *filter(None, [os.environ.get("PYTHONPATH")])]
    os.environ["PYTHONPATH"] = os.pathsep.join(path)
    content = nbformat.read(notebook, as_version=4)
    NotebookClient(content, timeout=900, resources={"metadata": {"path": str(folder)}}).execute()
    return json.loads(nbformat.writes(content))


def ink(picture: Image.Image) -> float:
    """Part of the pixels within the axes that is drawn; the file says where its axes are."""
    dark = np.asarray(picture.convert("RGB")).min(-1) < INK
    height, width = dark.shape
    inside = []
    for left, bottom, wide, high in json.loads(picture.info.get("Axes", "[]")):
        rows = slice(round((1 - bottom - high) * height) + FRAME, round((1 - bottom) * height) - FRAME)
        columns = slice(round(left * width) + FRAME, round((left + wide) * width) - FRAME)
        inside.append(dark[rows, columns].ravel())
    return float(np.concatenate(inside).mean()) if inside else 0.0


def lacking(outputs: Sequence[Mapping[str, Any]]) -> str:
    """What the outputs of a cell that draws lack; empty if nothing."""
    shown = [data["image/png"] for output in outputs if "image/png" in (data := output.get("data", {}))]
    if not shown:
        return "shows no picture"
    for png in shown:
        try:
            picture = Image.open(io.BytesIO(base64.b64decode("".join(png))))
            picture.load()
        except (OSError, ValueError) as error:
            return f"has a picture that does not decode ({error})"
        if picture.width < SMALLEST[0] or picture.height < SMALLEST[1]:
            return f"has a picture of only {picture.width} x {picture.height} pixels"
        if (drawn := ink(picture)) <= LEAST_INK:
            return f"has a picture with {drawn:.2%} drawn within its axes"
    return ""


def drawing(notebook: Mapping[str, Any]) -> Iterator[tuple[str, Sequence[Mapping[str, Any]]]]:
    """The figure that each drawing cell saves, and the cell's outputs."""
    for cell in notebook["cells"]:
        if cell["cell_type"] == "code" and (found := re.search(r'^save\(.*"(\w+)"\)', "".join(cell["source"]), re.M)):
            yield found[1], cell["outputs"]


def faults(notebook: Mapping[str, Any]) -> list[str]:
    """What is missing in a notebook."""
    found = [f"the cell of {name} {why}" for name, outputs in drawing(notebook) if (why := lacking(outputs))]
    return found if any(True for _ in drawing(notebook)) else ["no cell draws a figure"]


def main(words: Sequence[str] | None = None) -> int:
    """Carry the command out."""
    about = (__doc__ or "").split("\n\n")
    parser = argparse.ArgumentParser(prog="python -m benchmarks.notebooks", description=about[0], epilog=about[1])
    parser.add_argument("notebooks", nargs="*", type=pathlib.Path, default=sorted(EXPERIMENTS.glob("*.ipynb")))
    parser.add_argument(
        "--run", type=pathlib.Path, help="folder in which to execute them first, in their smallest size"
    )
    given = parser.parse_args(words)
    failed = 0
    for path in given.notebooks:
        content = executed(path, given.run) if given.run else json.loads(path.read_text(encoding="utf-8"))
        found = faults(content)
        failed += bool(found)
        print(f"{path.name}: {'; '.join(found) or ', '.join(name for name, _ in drawing(content))}", flush=True)
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
