"""The design of a cage for calm operation, asked on the command line."""

import re
from typing import Any

import jaxcage as jc

from .._errors import InputError
from .answer import Answer
from .options import CalmOptions, ShowOptions
from .subject import RPM, Subject
from .values import read_each


GRADE = re.compile(r"G\s*(\d+(?:\.\d*)?)", re.IGNORECASE)
VERDICTS = {
    "calm": "Calm over {range}",
    "stable, not checked": "Stable over {range}, not checked by simulations",
    "stable, but not from every start": "Stable over {range}, but not from every initial state",
}


def calm_design(
    subject: Subject,
    bounds: dict[str, Any],
    calm: CalmOptions,
    show: ShowOptions,
    **searches: Any,
) -> Answer:
    """The answer of `jaxcage design` with an operating range."""
    model = subject.model
    found = jc.show.read_operating(calm.operating or "", model, subject.speeds)
    if len(found) != 1 or found[0].low_rpm == found[0].high_rpm:
        raise InputError(f"Option --operating must be one range of speed, but '{calm.operating}' was given.")
    operating = found[0].low_rpm / RPM, found[0].high_rpm / RPM
    film = None if calm.least_film is None else jc.files.to_si(calm.least_film, "m")
    keep = jc.Requirements(calm.margin, calm.decay, film, calm.land_force, calm.grade, calm.drag)
    tolerance = read_tolerances(calm.tolerance or "", subject, operating[1])
    given: dict[str, Any] = {"objective": calm.objective, "tolerance": tolerance, "check": calm.check}
    with show.computing(f"design {subject.name}") as say:
        best = jc.design_for(model, operating, bounds, keep, **given, **searches, progress=say)
    what = {"cost": "Cost", "width": "Width of the unstable ranges [rpm]"}[calm.objective]
    tables = [jc.show.changed_table(f"Design of {subject.name}", model, best, bounds)]
    tables += [jc.show.requirement_table("Requirements over the operating range", best, subject.beside)]
    if best.budget:
        tables.append(jc.show.budget_of_tolerances_table(model, best))
    notes = [f"{what}: {best.cost_before:.4g} before, {best.cost:.4g} after"]
    notes += [f"10 % stricter {name}: costs {price:.2g} more" for name, price in jc.show.stricter(best).items()]
    if best.stopped_by:
        notes.append(f"A further step would lose an edge: {best.stopped_by}")
    notes += [f"On the way: {note}" for note in best.notes]
    if best.checked is not None:
        notes.append(f"Checked: {best.checked} ({best.checked.method})")
    notes.append(f"Designs solved for: {best.evaluations}")
    document = {"verdict": best.verdict, "optimum": best.values, "vary": bounds, "checked": best.checked}
    document |= {"cost": best.cost, "cost_before": best.cost_before, "prices": best.prices, "conflict": best.conflict}
    document |= {
        "at_bound": best.at_bound,
        "stopped_by": best.stopped_by,
        "operating_rpm": [w * RPM for w in operating],
    }
    figure = jc.show.calm_figure(best, operating, subject.name)
    range_ = f"{found[0]} of the {subject.own}"
    said = _sentence(best, range_, calm.objective)
    return Answer(said, tables, notes, document, subject, {"figure": (".png", figure)})


def _sentence(best: Any, range_: str, objective: str) -> str:
    """The answer in a sentence or two."""
    if not best.feasible:
        short = ", ".join(f"{name} by {value:.3g}" for name, value in best.short.items()) or "an edge is lost"
        against = f" In conflict: {' and '.join(best.conflict)}." if best.conflict else ""
        return f"No design within the bounds keeps all requirements over {range_}: short are {short}.{against}"
    if objective == "width":
        return f"Over {range_} {best.cost:.0f} rpm are unstable, {best.cost_before:.0f} before."
    said = VERDICTS[best.verdict].format(range=range_)
    coexists = "" if best.checked is None or best.checked.calm else f": {best.checked}"
    return f"{said}, at a cost of {best.cost:.3g} (given design {best.cost_before:.3g}){coexists}."


def read_tolerances(text: str, subject: Subject, fastest: float) -> dict[str, Any]:
    """`NAME=±X, NAME=G6.3, ...` in SI units; a grade is that at the largest cage speed [rad/s].

    **Raises:** `InputError`.
    """
    info = jc.parameter_info(subject.model)
    now = {name: float(value) for name, value in jc.parameters(subject.model).items()}

    def read(name: str, words: str) -> Any:
        if name not in info:
            raise InputError(f"Option --tolerance must name a parameter of the cage, but names '{name}'.")
        if (grade := GRADE.fullmatch(words)) is not None:
            if name != "eccentricity":
                raise ValueError("cannot have a balance grade, which is one of the eccentricity.")
            return jc.Tolerance.balanced(float(grade[1]), fastest)
        if not (width := words.replace("+-", "±")).startswith("±"):
            raise ValueError(f"must be ±X with a unit, ±X % or a grade such as G6.3, but is {words}.")
        width = width[1:].strip()
        if width.endswith("%"):
            half = abs(now[name]) * float(width[:-1]) / 100
        else:
            half = jc.files.to_si(width, info[name].unit)
        return jc.Tolerance(-half, half)

    parts = [part.strip() for part in text.split(",") if part.strip()]
    return read_each("--tolerance", parts, "NAME=±X or eccentricity=G6.3", read)
