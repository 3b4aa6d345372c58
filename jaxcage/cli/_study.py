"""`jaxcage study`: a sweep over any grid or sample of parameters, stored as it goes."""

import os
import re
import time
from pathlib import Path

import numpy as np

from ..integrate import OUTCOMES
from ..models import CageModel
from ..studies import LABELS, OtherStudy, Plan, Spread, Study, open_study, run_study, too_short
from ._console import progress_with_rate, say, warn_of_short
from ._errors import ComputationError, UsageError, require_at_least, require_blocks
from ._inputs import output_folder, subject, sweep_integration
from ._options import StudyOptions
from ._report import Report, Table
from ._vary import read_vary


MOST_LANES = 100_000_000
"""A week at a rate of 150 a second; what is kept of them in memory is a small part of it."""
LONGEST = 200
"""Bytes in the name of a store: file systems have room for 255, and what is written aside has a longer name."""
ADVICE = "what is stored stays, and the same command goes on from there"


def run(options: StudyOptions) -> Report:
    """Carry out `jaxcage study`."""
    shard = _shard(options.shard)
    blocks = require_blocks("--revolutions", options.revolutions)
    require_at_least("--discard", options.discard, 0)
    require_at_least("--chunk", options.chunk, 1)
    require_at_least("--sample", options.sample, 0)
    require_at_least("--seed", options.seed, 0)
    require_at_least("--strobe", options.strobe, 0)
    if options.executor == "local" and (options.scheduler is not None or options.workers is not None):
        raise UsageError("Options --scheduler and --workers go with --executor dask.")
    if options.workers is not None:
        require_at_least("--workers", options.workers, 1)
    method = sweep_integration(options)
    about = subject(options)
    counts = options.discard, options.revolutions, blocks, options.exponents, options.strobe
    try:
        work = Study(about.model, _plan(options, about.model), method, *counts)
    except ValueError as error:
        raise UsageError(_of_options(str(error))) from error
    path = _place(options, about.name)
    before = _lanes_stored(path)
    began = time.perf_counter()
    try:
        with progress_with_rate(f"study {about.name}", "lanes", ADVICE) as bar:
            report = lambda done, total: bar("", done, total)
            run_study(work, path, shard, options.executor, options.scheduler, options.workers, report)
    except (OtherStudy, ImportError) as error:
        raise UsageError(_of_options(str(error))) from error
    seconds = time.perf_counter() - began
    return _report(about.name, path, work, before, seconds)


def _plan(options: StudyOptions, model: CageModel) -> Plan:
    vary = read_vary(options.vary, model)
    sampled = {name: how for name, how in vary.items() if isinstance(how, Spread)}
    if sampled and options.sample < 1:
        raise UsageError(f"Option --sample must say how many samples to take of {', '.join(sampled)}.")
    if options.sample and not sampled:
        raise UsageError(
            "Option --sample needs a --vary with an interval or a tolerance, such as eccentricity=20um+-3um."
        )
    grid = {name: how for name, how in vary.items() if not isinstance(how, Spread)}
    starts = len(model.starts(1.0)) if options.starts is None else options.starts
    plan = Plan(grid, sampled, options.sample, options.seed, starts, options.chunk)
    if plan.size > MOST_LANES:
        raise UsageError(
            f"Options --vary, --sample and --starts must make at most {MOST_LANES} lanes, not {plan.size}."
        )
    return plan


def _shard(text: str) -> tuple[int, int]:
    match = re.fullmatch(r"(\d{1,9})/(\d{1,9})", text.strip())
    if match is None or not 1 <= int(match[1]) <= int(match[2]):
        raise UsageError(f"Option --shard must be I/N with I from 1 to N, e.g. 1/4, but '{text}' was given.")
    return int(match[1]), int(match[2])


def _place(options: StudyOptions, name: str) -> Path:
    """The store, which lies within the output folder."""
    wanted = Path(f"study_{name}.zarr" if options.store is None else options.store)
    parts = wanted.parts
    if not parts or wanted.is_absolute() or ".." in parts or any(len(os.fsencode(p)) > LONGEST for p in parts):
        raise UsageError(f"Option --store must name a folder within --out, but '{options.store}' was given.")
    return output_folder(options) / wanted


def _lanes_stored(path: Path) -> int:
    try:
        with open_study(path) as dataset:
            return int(np.sum(dataset["outcome"].values >= 0))
    except (FileNotFoundError, KeyError):
        return 0  # nothing yet, or nothing of ours: that is said later


def _of_options(sentence: str) -> str:
    """A library's sentence about arguments, said of options."""
    named = {"lanes": "chunk", "samples": "sample"}
    return re.sub(
        r"\bArgument(s?) ((?:`\w+`(?:, | and )?)+)",
        lambda m: f"Option{m[1]} " + re.sub(r"`(\w+)`", lambda n: f"--{named.get(n[1], n[1])}", m[2]),
        sentence,
    )


def _report(name: str, path: Path, work: Study, before: int, seconds: float) -> Report:
    with open_study(path) as dataset:
        label, outcome = dataset["label"].values, dataset["outcome"].values
        judged = {name: dataset[name].values for name in ("label", "largest_exponent", "standard_error")}
    done = outcome >= 0
    stored, new = int(np.sum(done)), int(np.sum(done)) - before
    counts = {LABELS[code]: int(n) for code, n in zip(*np.unique(label[done], return_counts=True), strict=True)}
    failed = {OUTCOMES[c]: int(n) for c, n in zip(*np.unique(outcome[outcome > 0], return_counts=True), strict=True)}
    if stored and sum(failed.values()) == stored:
        raise ComputationError(f"All {stored} lanes failed ({', '.join(failed)}): try more --steps.")
    axes = work.plan.axes
    document = {
        "case": name,
        "axes": axes,
        "lanes": work.plan.size,
        "stored": stored,
        "stored_before": before,
        "chunks": work.plan.chunks,
        "labels": counts,
        "failed": failed,
        "too_short": int(np.sum(too_short(judged, work.revolutions))),
        "seconds": round(seconds, 2),
        "lanes_per_second": round(new / seconds, 1) if new else None,
        "store": str(path),
    }
    warn_of_short(document["too_short"])
    if stored < work.plan.size:
        say(f"Warning: {work.plan.size - stored} lanes are left for the other shards.")
    shape = " x ".join(f"{n} {axis}" for axis, n in axes.items())
    rows = [(label, str(n), f"{n / stored:.1%}") for label, n in counts.items()]
    notes = [
        f"Failed lanes: {', '.join(f'{n} {what}' for what, n in failed.items()) or 'none'}",
        f"Time: {seconds:.1f} s for {new} lanes" + (f", {new / seconds:.0f} a second" if new else ""),
        f"Store: {path}",
        f"Open it: xarray.open_zarr({str(path)!r})",
    ]
    return Report(document, [Table(f"Lanes: {shape}", ("label", "lanes", "share"), rows)], notes)
