"""The paper's figures 5, 7, 8 and 9 with what this model gives."""

from collections.abc import Iterator, Sequence

import jax.numpy as jnp
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from .._glossary import quantity
from ..bearing import FIGURE_AXES, PUBLISHED_CASES
from ..forces import PocketImpact, approach_speed, impact_history
from ..reproduction import SECTION_RPM, ReadingResult, Runs
from ..sweeps import rpm
from ._marks import mark_published
from ._orbit_diagram import orbit_diagram, zoomed_diagram
from ._section import strobe_section
from ._statics import impact_forces
from ._style import GREY, new_figure


PAIRS = {"a": ("1a", "1b"), "b": ("2a", "2b"), "c": ("3a", "3b")}
"""Cases of each panel of figs. 7 and 8."""
ZOOM = {"a": (7000.0, 22000.0), "b": (7500.0, 14000.0), "c": (7500.0, 14000.0)}
"""Speed axes of fig. 8 [rpm]."""


def paper_figures(runs: Runs) -> Iterator[tuple[str, Figure]]:
    """Name and figure, one after the other; panels of cases that were not run are left out."""
    yield "fig5", _impact(runs)
    for panel, pair in PAIRS.items():
        if all(case in runs.sweeps for case in pair):
            yield f"fig7{panel}", _diagrams(runs, pair, None)
            yield f"fig8{panel}", _diagrams(runs, pair, ZOOM[panel])
    yield "fig9", _sections(runs)


def _impact(runs: Runs) -> Figure:
    model = next(iter(runs.models.values()))
    law = PocketImpact()
    v0 = approach_speed(law.approach_ratio, float(rpm(SECTION_RPM)), model.bearing.pocket_clearance)
    figure = new_figure(7.0, 4.0)
    ax = impact_forces(impact_history(law, model.bearing.roller_mass, v0, jnp.asarray(6e-4)), figure.subplots())
    ax.set_title(f"Fig. 5: one impact at {SECTION_RPM:.0f} rpm; dotted, the axis printed", loc="left", fontsize=11)
    _box(ax, "5", "cage-roller contact force", vertical=True)
    return figure


def _box(ax: Axes, figure: str, what: str, vertical: bool) -> None:
    """The limits of the printed axis as dotted lines."""
    for axis in (a for a in FIGURE_AXES if a.figure == figure and a.quantity == what):
        for limit in (axis.lower, axis.upper):
            (ax.axhline if vertical else ax.axvline)(limit, color=GREY, linewidth=0.8, linestyle=":")
        low, high = ax.get_ylim() if vertical else ax.get_xlim()
        (ax.set_ylim if vertical else ax.set_xlim)(min(low, 1.05 * axis.lower), max(high, 1.05 * axis.upper))


def _diagrams(runs: Runs, pair: tuple[str, str], zoom: tuple[float, float] | None) -> Figure:
    figure = new_figure(9.5, 6.4)
    cells = figure.subplots(2, 1, sharex=True)
    for case, ax in zip(pair, cells, strict=True):
        swept, published = runs.sweeps[case], PUBLISHED_CASES[case]
        orbit_diagram(swept, 1, ax, limits_rpm=zoom)
        mark_published(ax, published, text=False)
        oil, gap = f"VG{published.viscosity_grade:g}", f"gap {published.guidance_gap_mm} mm"
        text = f"Case {case}: {gap}, eccentricity {published.eccentricity_um:g} um, {oil}; dotted, published edges"
        ax.set_title(text, loc="left", fontsize=10)
    cells[0].set_xlabel("")
    cells[1].set_xlabel(quantity("speed_rpm").label)
    return figure


def _sections(runs: Runs) -> Figure:
    """Strobe points from the paper's start, transient and all, as fig. 9 shows them."""
    figure = new_figure(9.5, 9.5)
    cells = figure.subplots(3, 2).ravel()
    for ax, (case, section) in zip(cells, runs.sections.items(), strict=False):
        strobe_section(np.asarray(section.strobe[0]), ax, names=[f"Case {case}: {section.label[0, 0]}"])
        _box(ax, "9", "vertical displacement", vertical=False)
        _box(ax, "9", "vertical velocity", vertical=True)
    for ax in cells[len(runs.sections) :]:
        ax.set_visible(False)
    figure.suptitle(f"Fig. 9: strobe sections at {SECTION_RPM:.0f} rpm; dotted, the axes printed", fontsize=11)
    return figure


def readings_figure(read: Sequence[ReadingResult]) -> Figure:
    """The orbit diagram of each reading of the paper."""
    columns = 3
    figure = new_figure(12.0, 2.4 * -(-len(read) // columns))
    cells = figure.subplots(-(-len(read) // columns), columns, sharex=True, squeeze=False).ravel()
    for ax, r in zip(cells, read, strict=False):
        zoomed_diagram(r.sweep, 4000.0, 27500.0, 1, ax)
        ax.set_title(f"{r.reading.case}, {r.reading.question}: {r.reading.answer}", loc="left", fontsize=9)
        ax.set_xlabel("")
    for ax in cells[len(read) :]:
        ax.set_visible(False)
    return figure
