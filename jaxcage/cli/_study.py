"""`jaxcage study`: a sweep over any grid or sample of parameters, stored as it goes."""

import time
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from .._errors import InputError
from ..integrate import OUTCOMES
from ..report import require_some, shares_table
from ..studies import LABELS, DamagedStore, Plan, Spread, Study, check_study, open_study, run_study, too_short
from ._console import say, warn_of_short
from ._job import Job, blocks_of
from ._limits import demand_of_study
from ._options import StudyOptions
from ._show import Report
from ._vary import read_vary


MOST_LANES = 100_000_000
"""A week at a rate of 150 a second; what is kept of them in memory is a small part of it."""
ADVICE = "what is stored stays, and the same command goes on from there"


def study(job: Job[StudyOptions]) -> Report:
    """Carry out `jaxcage study`."""
    options = job.options
    if options.verify:
        return _verify(job)
    length = job.given("discard revolutions exponents strobe")
    work = Study(job.model, _plan(job), job.method, blocks=blocks_of(options.revolutions), **length)
    job.require(demand_of_study(work))
    path = job.folder / _name(job)
    before, began = _lanes_stored(path), time.perf_counter()
    with job.computing(unit="lanes", advice=ADVICE) as bar:
        try:
            run_study(work, path, **job.given("shard executor scheduler workers"), progress=partial(bar, ""))
        except ImportError as error:  # of an extra
            raise InputError(str(error)) from error
    seconds = time.perf_counter() - began
    document = _document(work, path, before, seconds)
    warn_of_short(document["too_short"])
    if document["stored"] < work.plan.size:
        say(f"Warning: {work.plan.size - document['stored']} lanes are left for the other shards.")
    job.listed("store", path)
    shape = " x ".join(f"{n} {axis}" for axis, n in document["axes"].items())
    table = shares_table(f"Lanes: {shape}", "label lanes", document["labels"])
    rate = document["lanes_per_second"]
    notes = [
        f"Failed lanes: {', '.join(f'{n} {what}' for what, n in document['failed'].items()) or 'none'}",
        f"Computed: {document['stored'] - before} lanes" + (f", {rate:.0f} a second" if rate else ""),
        f"Open it: jaxcage.open_study({str(path)!r})",
    ]
    return Report(document, [table], notes)


def _name(job: Job[StudyOptions]) -> str:
    return job.options.store or f"study_{job.name}.zarr"


def _verify(job: Job[StudyOptions]) -> Report:
    """Compare a store with what was written."""
    path = Path(job.options.out) / _name(job)
    try:
        state = check_study(path)
    except FileNotFoundError as error:
        raise InputError(str(error)) from error
    damaged = {str(chunk): what for chunk, what in state.damaged.items()}
    counts = {"chunks": state.chunks, "finished": state.finished, "damaged": damaged, "metadata": state.metadata}
    again = "the same command without --check computes it again and leaves the rest"
    failure = "" if state.whole else f"The store '{path}' is damaged: {again}."
    return Report({"store": str(path), **counts}, notes=str(state).splitlines(), failure=failure)


def _plan(job: Job[StudyOptions]) -> Plan:
    options, vary = job.options, read_vary(job.options.vary, job.model, job.speeds)
    sampled = {name: how for name, how in vary.items() if isinstance(how, Spread)}
    grid = {name: how for name, how in vary.items() if not isinstance(how, Spread)}
    starts = options.starts or len(job.model.starts(1.0))
    plan = Plan(grid, sampled, options.sample, options.seed, starts, options.chunk)
    if plan.size > MOST_LANES:
        raise InputError(
            f"Options --vary, --sample and --starts must make at most {MOST_LANES} lanes, not {plan.size}."
        )
    return plan


def _lanes_stored(path: Path) -> int:
    try:
        with open_study(path) as dataset:
            return int(np.sum(dataset["outcome"].values >= 0))
    except (FileNotFoundError, KeyError, DamagedStore):
        return 0  # nothing yet, or nothing of ours: that is said later


def _document(work: Study, path: Path, before: int, seconds: float) -> dict[str, Any]:
    with open_study(path) as dataset:
        outcome = dataset["outcome"].values
        found = {name: dataset[name].values for name in ("label", "largest_exponent", "standard_error")}
    done = outcome >= 0
    stored = int(np.sum(done))
    if stored:
        require_some(outcome[done])
    named = lambda codes, names: {names[c]: int(n) for c, n in zip(*np.unique(codes, return_counts=True), strict=True)}
    return {
        "axes": work.plan.axes,
        "lanes": work.plan.size,
        "stored": stored,
        "stored_before": before,
        "chunks": work.plan.chunks,
        "labels": named(found["label"][done], LABELS),
        "failed": named(outcome[outcome > 0], OUTCOMES),
        "too_short": int(np.sum(too_short(found, work.revolutions))),
        "lanes_per_second": round((stored - before) / seconds, 1) if stored > before else None,
    }
