"""What a cage does of which some values are known within ranges only, and what the verdict hangs on."""

from functools import partial
from typing import Any

import numpy as np

from .. import report
from ..plotting import chance_of_chaos
from ..studies import ENSEMBLE_SPEEDS, REVOLUTIONS, Ensemble, ensemble
from ..sweeps import rpm
from ._console import Say
from ._job import Job, blocks_of
from ._options import SweepOptions
from ._show import Report


def chances(job: Job[SweepOptions]) -> Report:
    """`jaxcage sweep` and `jaxcage zones` of a file with ranges: chance of chaos by speed, bands of the edges."""
    options = job.options
    with job.computing("draws") as say:
        found = drawn_chances(job, options.draws, say)
    report.require_some(np.where(found.failed, 1, 0))
    bands = [(b.name, b.rpm) for b in found.bands]
    title = f"{job.name}: {options.draws} draws from {len(job.unknowns)} ranges, {report.short_readings(job.model)}"
    job.draw(lambda ax: chance_of_chaos(found.rpm, found.chance, found.interval, bands, ax), (9.0, 5.0), title)
    low, high = found.interval
    job.columns(
        {
            "cage speed [rpm]": found.rpm,
            "shaft speed [rpm]": found.rpm / job.ratio,
            "chance of chaos": found.chance,
            "lower bound": low,
            "upper bound": high,
        }
    )
    document = report.chances_document(found)
    document["failed"] = int(np.sum(found.failed))
    return Report(document, report.chances_tables(job.name, found), report.chances_notes(found))


def drawn_chances(job: Job[Any], draws: int, say: Say) -> Ensemble:
    """What `draws` draws from the ranges of the file do over the speeds of the options."""
    options = job.options
    revolutions = min(options.revolutions, REVOLUTIONS)
    return ensemble(
        job.model,
        job.unknowns,
        rpm(options.first, options.last, options.count or ENSEMBLE_SPEEDS),
        draws=draws,
        seed=options.seed,
        discard=min(options.discard, REVOLUTIONS),
        revolutions=revolutions,
        blocks=blocks_of(revolutions),
        method=job.asked,
        progress=partial(say, "draws"),
    )
