"""Colours that colour-blind readers tell apart, and the dark and print styles of every figure."""

import io
import itertools
from pathlib import Path

import matplotlib.image
import numpy as np
import pytest
from matplotlib.colors import to_hex, to_rgb
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.text import Text

import jaxcage as jc
from jaxcage.cli import main
from jaxcage.models import FORCES
from jaxcage.plotting import (
    BLACK,
    BLUE,
    EDGE_COLOURS,
    FORCE_COLOURS,
    GREY,
    KIND_COLOURS,
    MARKS,
    OWN_COLOURS,
    PAPER,
    PERIOD_COLOURS,
    START_COLOURS,
    STYLES,
    ZONE,
    Halo,
    lighter,
    load_bars,
    new_figure,
    orbit_diagram,
    restyle,
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


def test_every_force_has_a_colour():
    assert set(FORCE_COLOURS) == set(FORCES)


@pytest.mark.parametrize("style", STYLES)
@pytest.mark.parametrize("reader", SEEN_BY)
@pytest.mark.parametrize("cycle", CYCLES)
def test_colours_of_a_cycle_are_told_apart(cycle: str, reader: str, style: str):
    shown = [STYLES[style].get(c, c) for c in CYCLES[cycle]]
    seen = [cielab(SEEN_BY[reader] @ linear(c)) for c in shown]
    nearest = min(np.linalg.norm(a - b) for a, b in itertools.combinations(seen, 2))
    assert nearest > CLEARLY_APART


def test_the_simulation_confuses_what_colour_blind_readers_confuse():
    pair = [cielab(SEEN_BY["deuteranopes"] @ linear(c)) for c in ("#A05A5A", "#6F6F5A")]
    whole = [cielab(linear(c)) for c in ("#A05A5A", "#6F6F5A")]
    assert np.linalg.norm(pair[0] - pair[1]) < 0.5 * np.linalg.norm(whole[0] - whole[1])


@pytest.mark.parametrize("style", STYLES)
def test_text_and_data_stand_out_from_the_paper(style: str):
    table = STYLES[style]
    paper = table.get(PAPER, PAPER)
    assert contrast(table.get(BLACK, BLACK), paper) > 7.0
    assert contrast(table.get(BLACK, BLACK), table.get(ZONE, ZONE)) > 7.0
    for colour in {c for cycle in CYCLES.values() for c in cycle}:
        assert contrast(table.get(colour, colour), paper) > 2.2, colour


def example() -> Figure:
    """One figure with every kind of artist that the house style uses."""
    figure = new_figure(5.0, 3.0)
    ax = load_bars(jc.bearing.load_distribution(jc.bearing.nu2310(), 4450.0), figure.subplots())
    ax.axvspan(-20, 20, color=ZONE)
    ax.plot([-90, 90], [100, 800], color=lighter(BLUE), path_effects=[Halo(3.0)], label="line")
    ax.plot([0], [500], "o", color=BLACK, markerfacecolor="white")
    ax.annotate("a point", (0, 500), (60, 1500), color=BLUE, arrowprops={"arrowstyle": "-", "color": GREY})
    ax.scatter([-60, 60], [300, 300], c=[0.0, 1.0], cmap="viridis")
    return figure


def pixels(figure: Figure) -> np.ndarray:
    box = io.BytesIO()
    figure.savefig(box, format="png", dpi=80)
    box.seek(0)
    return np.rint(255 * matplotlib.image.imread(box)[..., :3]).astype(int)


def test_a_dark_figure_has_nothing_left_of_the_light_one():
    figure = restyle(example(), "dark")
    image = pixels(figure)
    paper = np.array([int(STYLES["dark"][PAPER][i : i + 2], 16) for i in (1, 3, 5)])
    assert np.all(image[0, 0] == paper)
    assert np.mean(np.all(image == paper, axis=-1)) > 0.5
    assert not np.any(np.all(image >= 250, axis=-1))  # no white patch
    inks = {to_hex(t.get_color()) for t in figure.findobj(Text) if t.get_text().strip()}
    assert inks == {STYLES["dark"]["#000000"].lower(), STYLES["dark"][BLUE].lower()}
    bright = to_hex(lighter(STYLES["dark"][BLUE], STYLES["dark"][PAPER]))
    (line,) = [x for x in figure.axes[0].get_lines() if x.get_label() == "line"]
    assert to_hex(line.get_color()) == bright
    (effect,) = line.get_path_effects()
    assert effect._gc["foreground"] == STYLES["dark"][PAPER].lower()
    (cloud,) = [c for c in figure.axes[0].collections if c.get_array() is not None]
    assert cloud.get_cmap().name == "viridis"


def test_print_has_no_amber_and_heavier_lines():
    light, printed = example(), restyle(example(), "print")
    widths = [[line.get_linewidth() for line in f.axes[0].get_lines()] for f in (light, printed)]
    assert widths[1] == pytest.approx([1.25 * w for w in widths[0]])
    assert printed.dpi == 300
    amber = [int(ZONE[i : i + 2], 16) for i in (1, 3, 5)]
    assert np.any(np.all(pixels(light) == amber, axis=-1))
    assert not np.any(np.all(pixels(printed) == amber, axis=-1))


def test_light_is_left_as_it_is():
    assert np.array_equal(pixels(restyle(example(), "light")), pixels(example()))


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


def test_failed_lanes_are_seen_on_dark_paper():
    strobe = np.full((3, 1, 8, 4), np.nan)
    one = np.ones((3, 1))
    sweep = jc.Sweep(
        speed=jc.rpm(8000, 9000, 3),
        strobe=strobe,
        last=strobe[:, :, 0],
        block_growth=np.full((3, 1, 2, 1), np.nan),
        peak=one,
        outcome=one.astype(int),
        error=one,
        doubt=one[..., None],
        scale=np.ones((3, 4)),
        discard=1,
        revolutions=8,
    )
    figure = new_figure(4.0, 3.0)
    orbit_diagram(sweep, ax=figure.subplots())
    restyle(figure, "dark")
    (crosses,) = [x for x in figure.findobj(Line2D) if x.get_label() == "failed"]
    assert to_hex(crosses.get_markeredgecolor()) == STYLES["dark"][BLACK].lower()
