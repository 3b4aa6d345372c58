"""The report as one page of HTML that needs nothing from outside, made of sections."""

import base64
import dataclasses
import datetime
import io
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import jinja2
import matplotlib
from matplotlib.collections import Collection
from matplotlib.figure import Figure

from .. import __version__
from .findings import Findings
from .sections import Section, sections_of
from .speed_axes import add_shaft_axes
from .style import restyle
from .tables import Table


if TYPE_CHECKING:
    from ..design import Ensemble


RASTER_DPI = 150
"""Resolution of clouds of points, which would weigh megabytes as points."""


@dataclasses.dataclass(frozen=True)
class Picture:
    """A figure of the page as addresses that hold the drawing itself, for light and for dark screens."""

    caption: str
    light: str
    dark: str
    width: int
    height: int
    """Size [px at 96 per inch]."""


def page(
    findings: Findings,
    *,
    table: Mapping[str, Any] | None = None,
    command: str = "",
    chances: "Ensemble | None" = None,
    left: Sequence[str] = (),
    more: Sequence[Section] = (),
) -> str:
    """The report as HTML.

    **Arguments:** findings; the nested mapping that the design was read from (None: a published case); the command line
    that asked for the page; the results of draws from its ranges (None: all values are known); values that are still
    those of the template, by dotted name; further sections, which come before the statics.
    """
    model, rpm = findings.model, findings.sweep["rpm"].values
    own = model.speed_text.split()[0]
    what = f"Case {findings.name}" if findings.published is not None else findings.name
    about = "where the cage moves chaotically" if findings.orbits is not None else "slip, forces and wear"
    quick = ", quick report: no gradients, a coarser sweep" if findings.quick else ""
    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader(Path(__file__).parent),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
    )
    return environment.get_template("page.html.j2").render(
        title=f"{what}: {about}",
        subtitle=f"Cylindrical roller bearing, {rpm[0]:.0f} to {rpm[-1]:.0f} rpm of the {own}{quick}",
        sections=sections_of(findings, table, chances, left, more),
        picture=lambda figure, caption: picture_of(add_shaft_axes(figure, findings.sweep), caption),
        words=_words,
        version=__version__,
        command=command,
        date=datetime.date.today().isoformat(),
    )


def _words(table: Table) -> list[bool]:
    """True for each column of texts, which are aligned at their left."""
    return [all(v is None or isinstance(v, str) for v in column.values) for column in table.columns]


def picture_of(figure: Figure, caption: str) -> Picture:
    """A figure in the form in which the page holds it."""
    for cloud in figure.findobj(Collection):
        cloud.set_rasterized(True)
    width, height = (round(96 * float(x)) for x in figure.get_size_inches())
    return Picture(caption, _address(restyle(figure, "light")), _address(restyle(figure, "dark")), width, height)


def _address(figure: Figure) -> str:
    box = io.BytesIO()
    with matplotlib.rc_context({"svg.fonttype": "path", "svg.hashsalt": "jaxcage"}):
        figure.savefig(box, format="svg", dpi=RASTER_DPI, metadata={"Date": None, "Creator": None})
    return "data:image/svg+xml;base64," + base64.b64encode(box.getvalue()).decode("ascii")
