"""HTML report in one self-contained page, with a section for each answer of a command."""

import base64
import dataclasses
import datetime
import io
import json
import os
import platform
from collections.abc import Mapping, Sequence
from pathlib import Path

import jinja2
import matplotlib
import numpy as np
import xarray as xr
from matplotlib.collections import Collection
from matplotlib.figure import Figure

from .. import __version__
from .diagrams import CAGE, SHAFT, add_shaft_axes, mark_operating
from .tables import Table, table


RASTER_DPI = 150
"""Resolution of scatter plots, which would take megabytes as vectors."""
PAPER = (
    "Equations: L. Chen, X. Xia, H. Zheng, M. Qiu, Chaotic Dynamics of Cage Behavior in a High-Speed Cylindrical "
    "Roller Bearing, Shock and Vibration 2016, article 9120505, with its misprints corrected."
)


@dataclasses.dataclass(frozen=True)
class Section:
    """Section of the report."""

    title: str
    sentences: Sequence[str] = ()
    figures: Mapping[str, tuple[Figure, str]] = dataclasses.field(default_factory=dict)
    """Figures by name, each with its caption."""
    tables: Sequence[Table] = ()
    notes: Sequence[str] = ()

    @property
    def key(self) -> str:
        """Anchor of the section within the page."""
        return self.title.lower().replace(" ", "-")


def page(
    title: str,
    subtitle: str,
    sections: Sequence[Section],
    *,
    sweep: xr.Dataset,
    operating: tuple[float, float] | None = None,
    command: str = "",
) -> str:
    """Render the report as HTML.

    **Arguments:** title and subtitle; sections, whose figures get axes of the shaft speed and marks of the operating
    range; the sweep that has both speeds; operating range of its speed [rad/s]; the command line that made the page.
    """
    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader(Path(__file__).parent),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
    )

    def picture(figure: Figure) -> tuple[str, int, int, str]:
        marked = ""
        for ax in figure.axes:
            speed = any(each.get_xlabel() in (CAGE, SHAFT) for each in ax.get_shared_x_axes().get_siblings(ax))
            if speed and operating is not None:
                mark_operating(ax, *(end * 30 / np.pi for end in operating))
                marked = ". The operating range is between the dashed lines."
        return *_picture(add_shaft_axes(figure, sweep)), marked

    made = {"version": __version__, "command": command, "date": datetime.date.today().isoformat()}
    template = environment.get_template("page.html.j2")
    return template.render(title=title, subtitle=subtitle, sections=sections, picture=picture, **made)


def _picture(figure: Figure) -> tuple[str, int, int]:
    """SVG of a figure as a data URI, its width and its height [px at 96 per inch]."""
    for cloud in figure.findobj(Collection):
        cloud.set_rasterized(True)
    width, height = (round(96 * float(x)) for x in figure.get_size_inches())
    box = io.BytesIO()
    with matplotlib.rc_context({"svg.fonttype": "path", "svg.hashsalt": "jaxcage"}):
        figure.savefig(box, format="svg", dpi=RASTER_DPI, metadata={"Date": None, "Creator": None})
    return "data:image/svg+xml;base64," + base64.b64encode(box.getvalue()).decode("ascii"), width, height


def settings_table(sweep: xr.Dataset, seconds: float) -> Table:
    """Table of versions, machine and settings of a report."""
    settings = json.loads(sweep.attrs["settings"])
    versions = [f"{k.removeprefix('version_')} {v}" for k, v in settings.items() if k.startswith("version_")]
    rows = {
        "versions": ", ".join([*versions, f"Python {platform.python_version()}"]),
        "machine": f"{platform.system()} {platform.machine()}, {os.cpu_count()} cores",
        "steps of the sweep": " ".join(str(settings.get("method", "")).split()),
        "time": f"{seconds:.0f} s",
    }
    return table("Settings", [{"what": what, "value": said} for what, said in rows.items() if said], ["what", "value"])
