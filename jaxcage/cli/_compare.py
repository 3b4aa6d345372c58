"""`jaxcage compare`: two designs beside each other on one scale."""

from functools import partial

import numpy as np

from .. import report
from .._errors import InputError
from ..analysis import zones
from ..design import land_loads
from ..models import FASTEST, fastest_speed
from ..plotting import over_speed, sweeps_beside
from ..sweeps import motions, rpm, sweep
from ._job import Job, Subject, blocks_of, read_subject
from ._options import CompareOptions
from ._show import Report


CHOSEN = 5
"""Speeds of the table, where none are named."""


def compare(job: Job[CompareOptions]) -> Report:
    """Carry out `jaxcage compare` of cages."""
    options, first = job.options, Subject(job.name, job.model, job.published, job.file)
    second = read_subject(options.other)
    if second.name == first.name:  # two files in two folders may have one
        second = second._replace(name=f"{second.name}_second")
    pair = [first, second]
    first_ratio, ratio = (float(s.model.bearing.cage_speed_ratio) for s in pair)
    wanted = [at.low_rpm for at in report.read_operating(options.at, first_ratio, job.speeds)]
    fastest = fastest_speed(second.model) * 30 / np.pi * first_ratio / ratio
    if options.last > fastest:
        raise InputError(
            f"Option --last must be at most {fastest:.0f} rpm of the first cage, at which the other's land runs at "
            f"{FASTEST:g} m/s, but {options.last:g} rpm was given."
        )
    speeds, at = _speeds(rpm(options.first, options.last, options.count or 2) * 30 / np.pi, wanted)
    with job.computing() as say:
        found = [
            _swept(job, one, speeds * factor, partial(say, f"{one.name}:"))
            for one, factor in zip(pair, (1.0, ratio / first_ratio), strict=True)
        ]
    names = [one.name for one in found]
    swept = [one.swept for one in found]
    for one in swept:
        report.require_some(one.outcome)
    beside = f"_{names[1]}"
    figure = sweeps_beside(names, swept, [one.zones for one in found], (first_ratio, ratio))
    job.listed("figure", job.saved(figure, job.path(f"{beside}.png")))
    curves = [
        ("largest exponent\n[1/rev]", [one.exponent for one in found]),
        ("size of the orbit\n[mm]", [1e3 * one.size for one in found]),
        ("peak land force\n[N]", [one.loads["peak land force"] for one in found]),
        ("wear load\n[N m/s]", [one.loads["wear load"] for one in found]),
    ]
    job.figure(over_speed(names, [found[0].rpm] * 2, curves), "measures", f"{beside}_measures")
    same = first_ratio == ratio
    changed = report.differences([s.model for s in pair])
    document = {
        "cases": names,
        "differences": {path: {"values": cells[:2], "unit": cells[2]} for path, (_, *cells, _) in changed.items()},
        "designs": {one.name: report.compared_document(one) for one in found},
    }
    tables = [
        report.differences_table(names, [s.model for s in pair]),
        report.overall_table(found),
        report.compared_zones_table(found),
        report.at_speeds_compared(found, at),
    ]
    return Report(document, tables, _notes(pair, same))


def _speeds(even: np.ndarray, wanted: list[float]) -> tuple[np.ndarray, list[int]]:
    """Speeds [rpm] that are swept, those that are named among them, and the places of the ones to be shown."""
    if not wanted:
        return even, np.unique(np.linspace(0, even.size - 1, CHOSEN).round().astype(int)).tolist()
    outside = [x for x in wanted if not even[0] <= x <= even[-1]]
    if outside:
        raise InputError(
            f"Option --at must lie between --first and --last, {even[0]:g} to {even[-1]:g} rpm of the cage, but "
            f"{outside[0]:g} rpm was given."
        )
    near = even[[int(np.argmin(np.abs(even - x))) for x in wanted]]
    new = [x for x, y in zip(wanted, near, strict=True) if abs(x - y) > 1e-6 * x]
    speeds = np.unique(np.concatenate([even, new]))
    return speeds, [int(np.argmin(np.abs(speeds - x))) for x in wanted]


def _swept(job: Job[CompareOptions], one: Subject, speeds: np.ndarray, say: object) -> report.Compared:
    options, model = job.options, one.model
    found = sweep(
        model,
        speeds * np.pi / 30,
        **job.given("discard revolutions confirm horizon"),
        blocks=blocks_of(options.revolutions),
        method=job.method,
        progress=say,  # pyright: ignore[reportArgumentType]
    )
    motion = motions([model], [found])[0]
    return report.Compared(one.name, model, found, zones(found), motion, land_loads(model, found))


def _notes(pair: list[Subject], same: bool) -> list[str]:
    notes = []
    if not same:
        notes.append("Swept at the same speeds of the shaft; the cage speeds of the measures are those of the first.")
    for one in pair[1:]:
        unknowns = [] if one.file is None else [u.label for u in one.file.unknowns]
        if unknowns:
            notes.append(f"{one.name}: best guesses of what is known within ranges only: {', '.join(unknowns)}")
    return notes
