"""`jaxcage reproduce`: the published edges, conclusions and orbit diagrams beside ours."""

from typing import Any

from ..bearing import PUBLISHED_CASES
from ..models import case
from ..report import chosen, paper_diagrams, reproduction, run_all
from ._job import Job
from ._options import ReproduceOptions
from ._show import Report


QUICK: Any = {"speeds": 101, "discard": 150, "revolutions": 100, "section_revolutions": 504, "orbits": False}


def reproduce(job: Job[ReproduceOptions]) -> Report:
    """Carry out `jaxcage reproduce`."""
    options = job.options
    models = {name: case(name, options.constants) for name in PUBLISHED_CASES}
    with job.computing() as say:
        runs = run_all(models, report=say, **(QUICK if options.quick else {}))
        document, tables, notes = reproduction(runs)
    figures = [str(job.saved(figure, job.folder / f"{name}.png")) for name, figure in paper_diagrams(runs)]
    document = chosen(options, "quick constants") | document | {"figures": figures}
    return Report(document, tables, [*notes, f"Figures: {job.folder}"])
