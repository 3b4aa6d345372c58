"""What every experiment shares: its size, its folder, kept programs, and figures that are saved and shown."""

import os
import sys
import time
from pathlib import Path

import jaxcage as jc  # before matplotlib and jax: it keeps XLA from talking of kept programs


# isort: split
from matplotlib.figure import Figure


SMOKE = "--smoke" in sys.argv or "JAXCAGE_SMOKE" in os.environ
"""Whether to run in the smallest size, as the tests do; a notebook is told by the environment."""
FOLDER = Path("out") if SMOKE else Path(__file__).parent
"""Where figures go."""
BEGAN = time.perf_counter()

jc.keep_compiled_programs()


def small(full: int, smoke: int) -> int:
    """A size: the full one, or that of the tests."""
    return smoke if SMOKE else full


class Picture:
    """A saved figure, which a notebook shows."""

    def __init__(self, path: Path):
        self.path = path

    def __repr__(self) -> str:
        return self.path.name

    def _repr_png_(self) -> bytes:
        return self.path.read_bytes()


def save(figure: Figure, name: str) -> Picture:
    """Save a figure as PNG."""
    FOLDER.mkdir(exist_ok=True)
    path = FOLDER / f"{name}.png"
    figure.savefig(path, dpi=110)
    print(f"{path.name} after {time.perf_counter() - BEGAN:.0f} s")
    return Picture(path)
