"""What every experiment shares: its size, its folder, and figures that are saved and shown."""

import sys
import time
from pathlib import Path

from matplotlib.figure import Figure


SMOKE = "--smoke" in sys.argv
"""Whether to run in the smallest size, as the tests do."""
FOLDER = Path("out") if SMOKE else Path(__file__).parent
"""Where figures go."""
BEGAN = time.perf_counter()


def small(full: int, smoke: int) -> int:
    """A size: the full one, or that of the tests."""
    return smoke if SMOKE else full


def save(figure: Figure, name: str) -> Figure:
    """Save a figure as PNG and give it back, so that a notebook shows it."""
    FOLDER.mkdir(exist_ok=True)
    figure.savefig(FOLDER / f"{name}.png", dpi=110)
    print(f"{name}.png after {time.perf_counter() - BEGAN:.0f} s")
    return figure
