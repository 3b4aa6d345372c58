"""What was found of a whole bearing as one page of HTML that needs nothing from outside."""

import dataclasses
from collections.abc import Mapping, Sequence

from matplotlib.figure import Figure

from .._parameters import parameter_info, parameters
from ..models import BearingModel
from ._figures import picture_of
from ._page import rendered
from ._sources import shown
from ._table import Table


@dataclasses.dataclass(frozen=True)
class Section:
    """A part of the page."""

    key: str
    title: str
    sentences: Sequence[str] = ()
    key_figures: Sequence[tuple[str, str]] = ()
    figures: Mapping[str, tuple[Figure, str]] = dataclasses.field(default_factory=dict)
    """Figures by name, each with what it shows."""
    tables: Sequence[Table] = ()

    @property
    def pictures(self) -> list[str]:
        """Names of its figures."""
        return list(self.figures)


def bearing_page(title: str, subtitle: str, sections: Sequence[Section], version: str, command: str = "") -> str:
    """The report of a whole bearing as HTML.

    **Arguments:** title; what stands beneath it; parts; version of the package; the command line that asked for it.
    """
    drawn = {key: picture_of(figure, words, words) for s in sections for key, (figure, words) in s.figures.items()}
    return rendered(
        "bearing_page.html.j2",
        title=title,
        subtitle=subtitle,
        links=[(s.key, s.title) for s in sections],
        sections=sections,
        pictures=drawn,
        version=version,
        command=command,
    )


def bearing_parameters_table(model: BearingModel) -> Table:
    """Every number of the bearing, in the units people read, and where such a number is known from."""
    info = parameter_info(model)
    rows = []
    for name, value in parameters(model).items():
        unit, number = shown(float(value), info[name].unit)
        rows.append((info[name].text, f"{number:.6g}", unit, info[name].source or info[name].kind))
    return Table("All parameters", ("parameter", "value", "unit", "known from"), rows)
