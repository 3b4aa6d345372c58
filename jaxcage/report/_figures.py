"""The figures of a report as SVG that a page can hold, each for light and for dark screens."""

import base64
import dataclasses
import io
from collections.abc import Callable, Iterator, Sequence

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import Collection
from matplotlib.figure import Figure

from ..models import CageModel
from ..orbits import Sensitivity
from ..plotting import (
    add_shaft_axes,
    chance_of_chaos,
    elasticity_bars,
    load_bars,
    mark_operating,
    multiplier_circle,
    new_figure,
    orbit_diagram_with_branches,
    restyle,
    stability_map,
    sweep_figure,
    zone_strip,
)
from ..studies import Ensemble
from ._findings import MAP_PARAMETER, Findings, Map
from ._operating import Operating
from ._page_tables import with_full_names
from ._slopes import to_be_turned


RASTER_DPI = 150
"""Clouds of points are pictures inside the drawing: as points they would weigh megabytes."""


@dataclasses.dataclass(frozen=True)
class Picture:
    """A figure of the page."""

    alt: str
    """What it shows, for those who do not see it."""
    caption: str
    light: str
    """Address that holds the drawing itself."""
    dark: str
    width: int
    height: int
    """Size [px at 96 per inch]."""


def pictures(findings: Findings, operating: list[Operating], chances: Ensemble | None) -> dict[str, Picture]:
    """All figures that the findings allow, by name."""
    ratio = float(findings.model.bearing.cage_speed_ratio)
    return {
        key: picture_of(add_shaft_axes(figure, ratio), alt, caption)
        for key, figure, alt, caption in _draw(findings, operating, chances)
    }


def _draw(
    findings: Findings, operating: list[Operating], chances: Ensemble | None
) -> Iterator[tuple[str, Figure, str, str]]:
    """Name, figure, what it shows and caption, one after the other."""
    swept, found, name = findings.sweep, findings.found, findings.name
    spans = [(at.low_rpm, at.high_rpm) for at in operating]
    limits = float(swept.rpm[0]), float(swept.rpm[-1])
    strip = _alone(
        9.5,
        1.9 if spans else 1.5,
        lambda ax: zone_strip(findings.loss.zones, findings.zones.zones, limits, spans, findings.published, ax),
    )
    yield (
        "strip",
        strip,
        f"Bars over the cage speed: zones of {name} without a stable synchronous orbit, chaotic zones"
        + (", operating speeds." if spans else "."),
        "Zones of both kinds over the cage speed, with the operating speeds." if spans else "Zones of both kinds.",
    )
    diagram = sweep_figure(swept, findings.zones, findings.published)
    for ax in diagram.axes:
        mark_operating(ax, spans)
    yield (
        "orbits",
        diagram,
        f"Orbit diagram of {name}: strobe points of the vertical displacement over cage speed, with the largest "
        "Lyapunov exponent beneath.",
        "Vertical displacement once a revolution, over cage speed, from three starts; beneath it the largest exponent. "
        "Chaotic zones are shaded.",
    )
    if found.branches:
        yield (
            "branches",
            _alone(9.5, 5.4, lambda ax: orbit_diagram_with_branches(swept, found.branches, 1, ax)),
            f"Synchronous orbits of {name} over speed, stable parts thick, unstable ones thin, bifurcations marked.",
            "Orbits that turn with the cage, stable (thick) and unstable (thin), over the simulations (grey).",
        )
        principal = findings.loss.principal
        branch = found.branches[0 if principal is None else principal.branch]
        yield (
            "multipliers",
            _alone(7.0, 5.8, lambda ax: multiplier_circle(branch, ax)),
            "Floquet multipliers of the synchronous orbit in the complex plane with the unit circle.",
            "Floquet multipliers along the branch on which most simulations settled. The orbit is stable while all are "
            "inside the unit circle; how one leaves it tells what follows.",
        )
    if findings.map is not None:
        curves = " The lines are its edges, solved for." if findings.map.curves else ""
        yield (
            "map",
            _map(findings.model, findings.map, spans),
            f"Stability map of {name}: largest exponent over cage speed and guidance gap.",
            f"Largest exponent per revolution over speed and guidance gap (red: chaotic). Dotted: this design.{curves}",
        )
    edges = [s for n, s in findings.slopes.items() if s.trusted and n in findings.loss.edges]
    trusted = [with_full_names(findings, s) for s in to_be_turned(findings.model, edges)]
    if trusted:
        yield (
            "elasticities",
            _alone(9.5, 2.2 + 0.95 * len(trusted), lambda ax: _bars(trusted, ax)),
            "Bars: elasticities of the synchronous-loss edges with respect to the parameters that move them most.",
            "How much the synchronous-loss edges move: per cent of speed for one per cent of a parameter that a "
            "designer can turn. The axis is logarithmic beyond ±0.1.",
        )
    if findings.statics is not None:
        shared = findings.statics
        yield (
            "statics",
            _alone(7.0, 3.2, lambda ax: load_bars(shared, ax)),
            "Load of every roller over its angle from the load.",
            f"Load of every roller at rest under {float(findings.model.load):g} N.",
        )
    if chances is not None:
        bands = [(b.name, b.rpm) for b in chances.bands]
        chance = _alone(9.5, 4.6, lambda ax: chance_of_chaos(chances.rpm, chances.chance, chances.interval, bands, ax))
        mark_operating(chance.axes[0], spans)
        yield (
            "chance",
            chance,
            f"Chance of chaos of {name} over cage speed with 95 % bars, and bands of the edges beneath.",
            f"Share of {chances.place.shape[0]} draws from the ranges that are chaotic, with 95 % bars; beneath, where "
            "the edges lie in 90 % of the draws that have them.",
        )


def _alone(width: float, height: float, draw: Callable[[Axes], Axes]) -> Figure:
    figure = new_figure(width, height)
    draw(figure.subplots())
    return figure


def _bars(slopes: Sequence[Sensitivity], ax: Axes) -> Axes:
    """On an axis on which small elasticities are seen beside those that are a hundred times larger."""
    elasticity_bars(slopes, ax)
    largest = max(abs(x) for s in slopes for x in s.elasticity.values() if np.isfinite(x))
    ax.set_xscale("symlog", linthresh=0.1, linscale=0.7)
    reach = 2.5 * max(largest, 0.1)
    ticks = [t for t in (0.1, 1.0, 10.0, 100.0) if t < reach]
    ax.set(xlim=(-reach, reach))
    both = [-t for t in reversed(ticks)] + [0.0, *ticks]
    ax.set_xticks(both, [f"{t:g}".replace("-", "−") for t in both])
    ax.minorticks_off()
    return ax


def _map(model: CageModel, chart: Map, spans: list[tuple[float, float]]) -> Figure:
    name = MAP_PARAMETER.replace("_", " ").capitalize()
    figure = _alone(
        9.5,
        5.0,
        lambda ax: stability_map(
            chart.curves,
            ax,
            exponents=chart.exponents,
            y_unit=chart.axis.unit,
            y_factor=chart.axis.factor,
            y_label=name,
        ),
    )
    ax = figure.axes[0]
    ax.axhline(float(model.guidance_gap) * chart.axis.factor, color="#000000", linewidth=1.0, linestyle=":")
    mark_operating(ax, spans)
    return figure


def picture_of(figure: Figure, alt: str, caption: str) -> Picture:
    """A figure as the page holds it."""
    for cloud in figure.findobj(Collection):
        cloud.set_rasterized(True)
    width, height = (96 * float(x) for x in figure.get_size_inches())
    light, dark = (_address(restyle(figure, style)) for style in ("light", "dark"))
    return Picture(alt, caption, light, dark, round(width), round(height))


def _address(figure: Figure) -> str:
    box = io.BytesIO()
    with matplotlib.rc_context({"svg.fonttype": "path", "svg.hashsalt": "jaxcage"}):
        figure.savefig(box, format="svg", dpi=RASTER_DPI, metadata={"Date": None, "Creator": None})
    return "data:image/svg+xml;base64," + base64.b64encode(box.getvalue()).decode("ascii")
