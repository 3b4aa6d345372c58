"""`jaxcage init`: a commented description of a bearing to fill in."""

from ..io import write_template
from ._errors import refusing
from ._options import InitOptions
from ._report import Report


def run(options: InitOptions) -> Report:
    """Carry out `jaxcage init`."""
    with refusing():
        path = write_template(options.path)
    notes = [
        f"Written: {path}",
        "It describes the NU2310 of case 1a: change the values and go on with",
        *(f"  jaxcage {command} {path}" for command in ("statics", "sweep", "zones", "report")),
    ]
    return Report({"file": str(path)}, notes=notes)
