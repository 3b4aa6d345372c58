"""`jaxcage poincare`: strobe section at one speed, from all starts."""

import numpy as np

from .._glossary import component_names, quantity
from ..analysis import Sweep
from ..integrate import OUTCOMES
from ..io import write_columns
from ..plotting import new_figure, strobe_section
from ..sweeps import sweep
from ._console import progress
from ._errors import ComputationError, require_at_least, require_blocks, require_speed
from ._inputs import angular_speed, output_folder, save_figure, subject, sweep_integration
from ._options import PoincareOptions
from ._report import Report, Table, number


def run(options: PoincareOptions) -> Report:
    """Carry out `jaxcage poincare`."""
    require_speed("--speed", options.speed)
    require_at_least("--discard", options.discard, 0)
    blocks = require_blocks("--revolutions", options.revolutions)
    chosen, about, folder = sweep_integration(options), subject(options), output_folder(options)
    with progress(f"poincare {about.name}") as bar:
        found = sweep(
            about.model,
            np.array([angular_speed(options.speed)]),
            discard=options.discard,
            revolutions=options.revolutions,
            blocks=blocks,
            keep=options.revolutions,
            method=chosen,
            progress=bar,
        )
    if np.all(found.failed):
        raise ComputationError(f"Every start failed at {options.speed:g} rpm ({OUTCOMES[found.outcome[0, 0]]}).")
    stem = folder / f"poincare_{about.name}_{options.speed:g}rpm"
    figure = new_figure(6.5, 5.4)
    names = [f"start {i + 1}: {label}" for i, label in enumerate(found.label[0])]
    strobe_section(found.strobe[0], figure.subplots(), names=names)
    figure.suptitle(f"{about.name}, {options.speed:g} rpm, {options.revolutions} revolutions", fontsize=11)
    paths = {
        "figure": save_figure(figure, stem.with_name(stem.name + ".png")),
        "data": str(write_columns(stem.with_name(stem.name + ".csv"), _columns(found))),
    }
    starts = _starts(found)
    document = {"case": about.name, "speed_rpm": options.speed, "starts": starts, **paths}
    rows = [
        (
            str(s["start"]),
            s["label"],
            f"{number(s['exponent'], 4)} ± {number(s['standard_error'], 4)}",
        )
        for s in starts
    ]
    length = f"{options.discard} + {options.revolutions} revolutions"
    table = Table(
        f"Strobe section of {about.name} at {options.speed:g} rpm, {length}",
        ("start", "label", "largest exponent per revolution"),
        rows,
    )
    return Report(document, [table], [f"Figure: {paths['figure']}", f"Data: {paths['data']}"])


def _starts(found: Sweep) -> list[dict]:
    """For every start its label, exponent, and strobe points (Y, Y')."""
    half = found.strobe.shape[-1] // 2
    return [
        {
            "start": i + 1,
            "label": str(found.label[0, i]),
            "outcome": OUTCOMES[found.outcome[0, i]],
            "exponent": float(found.exponents[0, i, 0]),
            "standard_error": float(found.standard_error[0, i, 0]),
            "y_C": found.strobe[0, i, :, 1],
            "vy_C": found.strobe[0, i, :, 1 + half],
        }
        for i in range(found.strobe.shape[1])
    ]


def _columns(found: Sweep) -> dict[str, np.ndarray]:
    _, starts, keep, dimension = found.strobe.shape
    states = found.strobe[0].reshape(-1, dimension)
    first = found.discard + found.revolutions - keep + 1
    columns = {
        "start": np.repeat(np.arange(1, starts + 1), keep),
        "revolution": np.tile(np.arange(first, first + keep), starts),
    }
    for i, name in enumerate(component_names(dimension)):
        columns[f"{name} [{quantity(name).unit}]"] = states[:, i]
    return columns
