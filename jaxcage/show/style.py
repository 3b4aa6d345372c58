"""Style of the figures: colours that colour-blind readers can tell apart, thin frames, light grids, no global state.

The colours are those of Okabe and Ito (https://jfly.uni-koeln.de/color), made for red-green blindness; the dark style
lightens them and keeps their hues. Figures are drawn light; `restyle` changes them to the dark or the print style.
"""

from collections.abc import Iterable
from typing import Any, Literal

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.collections import Collection
from matplotlib.colors import to_hex, to_rgb, to_rgba
from matplotlib.figure import Figure
from matplotlib.legend import Legend
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.patheffects import withStroke
from matplotlib.text import Annotation, Text


# Okabe and Ito's palette.
BLUE, VERMILION, GREEN, ORANGE = "#0072B2", "#D55E00", "#009E73", "#E69F00"
SKY, PURPLE, BLACK, GREY = "#56B4E9", "#CC79A7", "#222222", "#8A8A8A"
ZONE = "#F8EBC8"
"""Light amber behind chaotic zones, on which points keep their contrast."""
GRID, BAND, PAPER = "#E6E6E6", "#F5F5F5", "#FFFFFF"
RASTER_DPI = 200

Style = Literal["light", "dark", "print"]
STYLES: dict[Style, dict[str, str]] = {
    "light": {},
    "dark": {
        BLUE: "#3E9BE0",
        VERMILION: "#F2762B",
        GREEN: "#12B886",
        ORANGE: "#F4B942",
        SKY: "#9AD6FF",
        PURPLE: "#DE92BD",
        BLACK: "#E8E8E8",
        GREY: "#8C9199",
        ZONE: "#3B3220",
        GRID: "#2C3138",
        BAND: "#1E2228",
        PAPER: "#15181D",
        "#000000": "#E8E8E8",
    },
    "print": {BLACK: "#000000", GREY: "#555555", ZONE: "#E4E4E4", GRID: "#D4D4D4", BAND: "#F0F0F0"},
}
"""Replacements of the light colours in each style; print is white paper, black ink and no amber."""
PRINT_DPI, PRINT_LINES = 300, 1.25

KIND_COLOURS = {
    "periodic": BLUE,
    "quasi-periodic": GREEN,
    "chaotic": VERMILION,
    "transient": ORANGE,
    "undecided": PURPLE,
}
"""Colour of a strobe point by the label of its lane."""
MOTION_COLOURS = {"circular": GREEN, "locally_periodic": BLUE, "disordered": VERMILION}
"""Colour of a stretch of speeds by the motion of the cage's centre; other stretches are grey."""

FORCE_COLOURS = {
    "film": BLUE,
    "contact": VERMILION,
    "support": GREEN,
    "impact": ORANGE,
    "unbalance": PURPLE,
    "weight": BLACK,
}
OWN_COLOURS = (SKY, GREY)
"""A user's own forces take these in turn, with a dashed line."""
LINE_COLOURS = (BLUE, SKY, GREEN, PURPLE, VERMILION, ORANGE)
"""Colours of lines beside each other, such as those of initial states."""


class Halo(withStroke):
    """A rim in the colour of the paper around a line or a text, so that it can be read on any background."""

    def __init__(self, width: float, colour: str = PAPER):
        super().__init__(linewidth=width, foreground=colour)
        self.width = width


def lighter(colour: str, paper: str = PAPER) -> tuple[float, float, float]:
    """The colour half way between `colour` and the paper."""
    r, g, b = ((a + b) / 2 for a, b in zip(to_rgb(colour), to_rgb(paper), strict=True))
    return r, g, b


def new_figure(width: float = 8.0, height: float = 5.0) -> Figure:
    """A figure that belongs to no window and no global list, and is freed with its last use."""
    return Figure(figsize=(width, height), layout="constrained", dpi=RASTER_DPI)


def axes_or_new(ax: Axes | None, width: float = 7.0, height: float = 4.5) -> Axes:
    """`ax` or the only axes of a new figure, in this style."""
    return dress(new_figure(width, height).subplots() if ax is None else ax)


def dress(ax: Axes) -> Axes:
    """Give axes a thin frame and a light grid behind the data."""
    ax.spines[["top", "right"]].set_visible(False)
    ax.spines[["left", "bottom"]].set(color=GREY, linewidth=0.8)
    ax.tick_params(color=GREY, labelsize=9)
    ax.grid(True, color=GRID, linewidth=0.6)
    ax.set_axisbelow(True)
    return ax


def dots(colour: str, size: float | int) -> dict[str, Any]:
    """Style of a cloud of points without a line."""
    style = {"marker": ".", "linestyle": "none", "markeredgewidth": 0}
    return style | {"color": colour, "markersize": size}


def enlarge_dots(legend: Legend) -> Legend:
    """Draw small light points large and full in the legend, so that their colours can be told apart."""
    for handle in legend.get_lines():
        if handle.get_marker() == ".":
            handle.set(markersize=7, alpha=1.0)
    return legend


def legend_above(ax: Axes, ncols: int = 4, size: float | int = 9) -> Legend:
    """A legend above the frame, where it hides nothing."""
    place = {"loc": "lower center", "bbox_to_anchor": (0.5, 1.0), "ncols": ncols}
    return enlarge_dots(ax.legend(**place, frameon=False, fontsize=size))


def legend_beside(ax: Axes, size: float | int = 9) -> Legend:
    """A legend to the right of the frame."""
    place = {"loc": "center left", "bbox_to_anchor": (1.0, 0.5)}
    return ax.legend(**place, frameon=False, fontsize=size, handlelength=1.4)


def legend_below(figure: Figure, *axes: Axes, ncols: int = 5) -> None:
    """One legend for all axes, beneath them."""
    entries = {}
    for ax in axes:
        for handle, label in zip(*ax.get_legend_handles_labels(), strict=True):
            entries.setdefault(label, handle)
    place = "outside lower center"
    enlarge_dots(figure.legend(entries.values(), entries.keys(), loc=place, ncols=ncols, frameon=False, fontsize=9))


def entitled(figure: Figure, title: str) -> Figure:
    """The figure with a title at its upper left."""
    figure.suptitle(title, x=0.01, ha="left", fontsize=11)
    return figure


def readable(name: str) -> str:
    """A parameter's name as words."""
    return name.replace(".", " ").replace("_", " ")


def padded_limits(values: np.ndarray) -> tuple[float, float]:
    """Limits that include every finite value with a margin; (-1, 1) if there is none."""
    finite = values[np.isfinite(values)]
    if finite.size == 0:
        return -1.0, 1.0
    low, high = float(finite.min()), float(finite.max())
    pad = 0.05 * (high - low) or 0.1 * abs(high) or 1.0
    return low - pad, high + pad


def restyle(figure: Figure, style: Style) -> Figure:
    """Change the style of a drawn figure: each colour of this module becomes that of `style`; colour maps stay.

    **Arguments:** a figure drawn by the functions of this package; `light`, `dark` or `print`.

    **Returns:** the same figure.
    """
    if style == "light":
        return figure
    figure.draw_without_rendering()  # texts and ticks that are made on drawing
    colours = _Exchange(STYLES[style])
    for artist in _everything(figure):
        colours.change(artist)
    for axis in (axis for ax in figure.axes for axis in (ax.xaxis, ax.yaxis)):  # ticks that are still to come
        axis.set_tick_params(color=colours.of(GREY), labelcolor=colours.of("#000000"), grid_color=colours.of(GRID))
    if style == "print":
        figure.set_dpi(PRINT_DPI)
        for line in figure.findobj(Line2D):
            line.set_linewidth(PRINT_LINES * line.get_linewidth())
    return figure


def _everything(figure: Figure) -> Iterable[Artist]:
    for artist in figure.findobj():
        yield artist
        if isinstance(artist, Annotation) and artist.arrow_patch is not None:  # no child of its text
            yield artist.arrow_patch


class _Exchange:
    """Replaces colours by others; those that are not listed stay."""

    def __init__(self, table: dict[str, str]):
        paper = table.get(PAPER, PAPER)
        known = {PAPER: paper} | table
        half = {to_hex(lighter(old)): to_hex(lighter(new, paper)) for old, new in table.items()}
        self.table = {old.lower(): new for old, new in (half | known).items()}

    def of(self, colour: Any) -> Any:
        """The new colour for `colour`, with its transparency."""
        if isinstance(colour, str) and colour in ("none", "auto"):
            return colour
        r, g, b, alpha = to_rgba(colour)
        new = self.table.get(to_hex((r, g, b)))
        return (r, g, b, alpha) if new is None else to_rgba(new, alpha)

    def change(self, artist: Artist) -> None:
        if isinstance(artist, Line2D):
            artist.set(color=self.of(artist.get_color()))
            artist.set(markerfacecolor=self.of(artist.get_markerfacecolor()))
            artist.set(markeredgecolor=self.of(artist.get_markeredgecolor()))
        elif isinstance(artist, Text):
            artist.set_color(self.of(artist.get_color()))
        elif isinstance(artist, Patch):
            artist.set(facecolor=self.of(artist.get_facecolor()), edgecolor=self.of(artist.get_edgecolor()))
        elif isinstance(artist, Collection) and artist.get_array() is None:
            for name in ("facecolor", "edgecolor"):
                colours = np.atleast_2d(getattr(artist, f"get_{name}")())
                artist.set(**{name: [self.of(tuple(c)) for c in colours if len(c)]})
        if any(isinstance(effect, Halo) for effect in artist.get_path_effects() or ()):
            paper = to_hex(self.of(PAPER))
            artist.set_path_effects([Halo(e.width, paper) for e in artist.get_path_effects() if isinstance(e, Halo)])
