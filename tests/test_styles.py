"""Colours that colour-blind readers tell apart, and the dark and print styles of every figure."""

import itertools
from pathlib import Path

import matplotlib.image
import numpy as np
import pytest
from matplotlib.colors import to_hex, to_rgb

from jaxcage.cli import main
from jaxcage.plotting import (
    BLACK,
    EDGE_COLOURS,
    FORCE_COLOURS,
    KIND_COLOURS,
    MARKS,
    OWN_COLOURS,
    PAPER,
    PERIOD_COLOURS,
    START_COLOURS,
    STYLES,
    ZONE,
)


# G. M. Machado, M. M. Oliveira, L. A. F. Fernandes, IEEE Trans. Vis. Comput. Graph. 15 (2009) 1291, severity 1.0.
SEEN_BY = {
    "everybody": np.eye(3),
    "protanopes": np.array(
        [[0.152286, 1.052583, -0.204868], [0.114503, 0.786281, 0.099216], [-0.003882, -0.048116, 1.051998]]
    ),
    "deuteranopes": np.array(
        [[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413], [-0.011820, 0.042940, 0.968881]]
    ),
}
CYCLES = {
    "kinds of motion": tuple(KIND_COLOURS.values()),
    "forces": tuple(FORCE_COLOURS.values()),
    "forces of one's own": OWN_COLOURS,
    "kinds of bifurcation": tuple(mark.colour for mark in MARKS.values()),
    "periods": tuple(PERIOD_COLOURS.values()),
    "edges": tuple(EDGE_COLOURS),
    "starts": tuple(START_COLOURS),
}
CLEARLY_APART = 12.0
"""Five times the just noticeable CIE 1976 difference of 2.3."""


def linear(colour: str) -> np.ndarray:
    c = np.array(to_rgb(colour))
    return np.where(c <= 0.04045, c / 12.92, ((c + 0.055) / 1.055) ** 2.4)


def cielab(rgb: np.ndarray) -> np.ndarray:
    """CIE L*a*b* (D65) of linear sRGB."""
    to_xyz = np.array(
        [[0.4124564, 0.3575761, 0.1804375], [0.2126729, 0.7151522, 0.0721750], [0.0193339, 0.1191920, 0.9503041]]
    )
    x = to_xyz @ np.clip(rgb, 0, 1) / np.array([0.95047, 1.0, 1.08883])
    f = np.where(x > (6 / 29) ** 3, np.cbrt(x), x / (3 * (6 / 29) ** 2) + 4 / 29)
    return np.array([116 * f[1] - 16, 500 * (f[0] - f[1]), 200 * (f[1] - f[2])])


def contrast(a: str, b: str) -> float:
    """Contrast ratio of WCAG 2."""
    light = sorted(float(np.array([0.2126, 0.7152, 0.0722]) @ linear(c)) for c in (a, b))
    return (light[1] + 0.05) / (light[0] + 0.05)


@pytest.mark.parametrize("style", STYLES)
@pytest.mark.parametrize("reader", SEEN_BY)
@pytest.mark.parametrize("cycle", CYCLES)
def test_colours_of_a_cycle_are_told_apart(cycle: str, reader: str, style: str):
    shown = [STYLES[style].get(c, c) for c in CYCLES[cycle]]
    seen = [cielab(SEEN_BY[reader] @ linear(c)) for c in shown]
    nearest = min(np.linalg.norm(a - b) for a, b in itertools.combinations(seen, 2))
    assert nearest > CLEARLY_APART


@pytest.mark.parametrize("style", STYLES)
def test_text_and_data_stand_out_from_the_paper(style: str):
    table = STYLES[style]
    paper = table.get(PAPER, PAPER)
    assert contrast(table.get(BLACK, BLACK), paper) > 7.0
    assert contrast(table.get(BLACK, BLACK), table.get(ZONE, ZONE)) > 7.0
    for colour in {c for cycle in CYCLES.values() for c in cycle}:
        assert contrast(table.get(colour, colour), paper) > 2.2, colour


def test_an_unknown_style_is_refused(capsys: pytest.CaptureFixture[str], tmp_path: Path):
    assert main(["statics", "1a", "--out", str(tmp_path / "out"), "--style", "sepia"]) == 2
    out, err = capsys.readouterr()
    assert out == "" and err.count("\n") == 1
    assert "--style" in err and "light" in err and "dark" in err and "print" in err and "sepia" in err


@pytest.mark.parametrize("style", ["dark", "print"])
def test_commands_draw_in_the_style_asked_for(capsys: pytest.CaptureFixture[str], tmp_path: Path, style: str):
    assert main(["statics", "1a", "--out", str(tmp_path), "--style", style]) == 0
    capsys.readouterr()
    image = matplotlib.image.imread(tmp_path / "statics_1a.png")
    paper = STYLES[style].get(PAPER, PAPER)
    assert to_hex(image[0, 0, :3]) == paper.lower()
    assert image.shape[1] == pytest.approx(7.0 * (300 if style == "print" else 200), abs=2)
