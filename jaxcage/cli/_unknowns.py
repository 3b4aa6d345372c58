"""`jaxcage unknowns`: which measurement would decide."""

from functools import partial

import numpy as np

from .. import report
from .._errors import InputError
from .._parameters import parameter_info
from ..design import sobol_of
from ..studies import chaotic_shares
from ..sweeps import rpm
from ._job import Job
from ._options import UnknownsOptions
from ._show import Report


def unknowns(job: Job[UnknownsOptions]) -> Report:
    """Sobol indices of the chaotic share over the ranges of the file."""
    options = job.options
    if not job.unknowns:
        raise InputError(
            f'Case {job.name} must be a TOML file with ranges, such as stiffness = "1e4 .. 1e6 N/m", but has none.'
        )
    speeds = rpm(options.first, options.last, options.speeds) if options.speeds > 1 else np.array([rpm(options.first)])
    with job.computing("draws") as say:
        share = partial(
            chaotic_shares, job.model, job.unknowns, speeds, method=job.asked, progress=partial(say, "draws")
        )
        found = sobol_of(share, [u.label for u in job.unknowns], samples=options.samples, seed=options.seed)
    info = parameter_info(job.model)
    sources = {u.label: info[u.names[0]].source for u in job.unknowns}
    most = max(found.total, key=lambda name: found.total[name])
    document = report.chosen(found, "first total first_interval total_interval samples_wanted") | {
        "doubtful": list(found.doubtful),
        "designs": found.evaluations,
        "speeds_rpm": np.asarray(speeds) * 30 / np.pi,
        "measure": {"what": most, "how": sources[most]},
    }
    told = f"Measure {most} first: {sources[most]}."
    if not any(abs(value) > 0 for value in found.total.values()):
        told = "Nothing to decide: every draw does the same."
    elif most in found.doubtful:
        told = "These draws do not tell what to measure first."
    notes = [told, *([found.warning] if found.warning else [])]
    return Report(document, [report.verdict_table(job.name, found, sources)], notes)
