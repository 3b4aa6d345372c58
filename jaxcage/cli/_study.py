"""`jaxcage study`: a sweep over any grid or sample of parameters, stored as it goes."""

import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from .._errors import InputError, NoResult
from ..analysis import CAGE_STATES
from ..models import CAGE_STARTS, BearingModel, CageModel
from ..report import require_some, shares_table
from ..solve import OUTCOMES
from ..studies import (
    LABELS,
    WHOLE_TOLERANCE,
    AbstractStudy,
    BearingStudy,
    Plan,
    Spread,
    Study,
    check_study,
    open_study,
    run_study,
    too_short,
)
from ._console import say, warn_of_short
from ._job import Job, blocks_of
from ._options import StudyOptions
from ._show import Report
from ._vary import read_vary


if TYPE_CHECKING:
    import xarray as xr

MOST_LANES = 100_000_000
"""A week at a rate of 150 a second; what is kept of them in memory is a small part of it."""
MEASURES = ("cage_slip", "pocket_force_max_N", "land_force_max_N", "friction_power_W", "eccentricity_mean", "exponent")
"""Of a whole bearing, what is told of all lanes together."""
ADVICE = "what is stored stays, and the same command goes on from there"
AGAIN = "the same command without --check and --shard computes again what is damaged and leaves the rest"


def study(job: Job[StudyOptions], whole: BearingModel | None = None) -> Report:
    """Carry out `jaxcage study`, of a cage or of a whole bearing."""
    options = job.options
    if options.verify:
        return _verify(job)
    length: dict[str, Any] = job.given("discard revolutions exponents") | {"blocks": blocks_of(options.revolutions)}
    if whole is not None:
        given = WHOLE_TOLERANCE if options.tolerance is None else options.tolerance
        work = BearingStudy(whole, _plan(job, whole, len(CAGE_STARTS)), **length, tolerance=given)
    else:
        plan = _plan(job, job.model, len(job.model.starts(1.0)))
        work = Study(job.model, plan, job.method, **length, strobe=options.strobe)
    path = job.folder / _name(job)
    began, done = time.perf_counter(), [0]
    with job.computing(unit="lanes", advice=ADVICE) as bar:

        def progress(so_far: int, total: int) -> None:
            done.append(so_far)
            bar("", so_far, total)

        try:
            run_study(work, path, **job.given("shard executor scheduler workers"), progress=progress)
        except ImportError as error:  # of an extra
            raise InputError(str(error)) from error
    computed = done[-1] - done[1]  # the first number is of those that were stored before
    document = _document(work, path, computed, time.perf_counter() - began)
    warn_of_short(document.get("too_short", 0))
    if document["stored"] < work.plan.size:
        say(f"Warning: {work.plan.size - document['stored']} lanes are left for the other shards.")
    job.listed("store", path)
    shape = " x ".join(f"{n} {axis}" for axis, n in document["axes"].items())
    kind = "label" if "labels" in document else "state"
    table = shares_table(f"Lanes: {shape}", f"{kind} lanes", document[f"{kind}s"])
    rate = document["lanes_per_second"]
    notes = [
        f"Failed lanes: {', '.join(f'{n} {what}' for what, n in document['failed'].items()) or 'none'}",
        f"Computed: {computed} lanes" + (f", {rate:.3g} a second" if rate else ""),
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
    counts = {"chunks": state.chunks, "finished": state.finished, "damaged": damaged}
    failure = f"The store '{path}' is damaged: {AGAIN}." if damaged else ""
    return Report({"store": str(path), **counts}, notes=str(state).splitlines(), failure=failure)


def _plan(job: Job[StudyOptions], model: CageModel | BearingModel, own: int) -> Plan:
    """What the options vary; `own` is how many starts the model has."""
    options, vary = job.options, read_vary(job.options.vary, model, job.speeds)
    sampled = {name: how for name, how in vary.items() if isinstance(how, Spread)}
    grid = {name: how for name, how in vary.items() if not isinstance(how, Spread)}
    assert options.chunk is not None
    plan = Plan(grid, sampled, options.sample, options.seed, options.starts or own, options.chunk)
    if plan.size > MOST_LANES:
        raise InputError(
            f"Options --vary, --sample and --starts must make at most {MOST_LANES} lanes, not {plan.size}."
        )
    return plan


def _document(work: AbstractStudy, path: Path, computed: int, seconds: float) -> dict[str, Any]:
    try:
        with open_study(path) as dataset:
            outcome = dataset["outcome"].values
            done = outcome >= 0
            about = _of_bearings(dataset, done) if isinstance(work, BearingStudy) else _of_cages(dataset, done, work)
    except ValueError as error:  # a chunk that another shard has written
        raise NoResult(f"The store '{path}' is damaged: {AGAIN}.") from error
    stored = int(np.sum(done))
    if stored:
        require_some(outcome[done])
    return {
        "axes": work.plan.axes,
        "lanes": work.plan.size,
        "stored": stored,
        "stored_before": stored - computed,
        "chunks": work.plan.chunks,
        **about,
        "failed": _named(outcome[outcome > 0], OUTCOMES),
        "lanes_per_second": round(computed / seconds, 3) if computed else None,
    }


def _named(codes: np.ndarray, names: tuple[str, ...]) -> dict[str, int]:
    """How many there are of each code, by its name."""
    return {names[c]: int(n) for c, n in zip(*np.unique(codes, return_counts=True), strict=True)}


def _of_cages(dataset: "xr.Dataset", done: np.ndarray, work: AbstractStudy) -> dict[str, Any]:
    judged = {name: dataset[name].values for name in ("label", "largest_exponent", "standard_error")}
    return {
        "labels": _named(judged["label"][done], LABELS),
        "too_short": int(np.sum(too_short(judged, work.revolutions))),
    }


def _of_bearings(dataset: "xr.Dataset", done: np.ndarray) -> dict[str, Any]:
    """States, and the smallest, median and largest of some measures over all lanes."""

    def spread(values: np.ndarray) -> list[float | None]:
        known = values[np.isfinite(values)]
        return [float(x) for x in np.percentile(known, (0, 50, 100))] if known.size else [None] * 3

    measures = {name: spread(dataset[name].values) for name in MEASURES}
    return {"states": _named(dataset["state"].values[done], CAGE_STATES), "least_median_most": measures}
