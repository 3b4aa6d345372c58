"""`jaxcage impact`: one roller on a cage bar, the history of (14) and fig. 5."""

from typing import Any

import jax.numpy as jnp
import numpy as np

from ..forces import ImpactHistory, PocketImpact, RollerPassImpact, approach_speed, impact_history
from ..io import write_columns
from ..plotting import impact_forces, new_figure
from ._errors import UsageError, require_speed
from ._inputs import angular_speed, output_folder, save_figure, subject
from ._options import ImpactOptions
from ._report import Report, Table


def run(options: ImpactOptions) -> Report:
    """Carry out `jaxcage impact`."""
    require_speed("--speed", options.speed)
    if not 0 < options.duration <= 1000:
        raise UsageError(f"Option --duration must lie between 0 and 1000 ms, but {options.duration:g} was given.")
    about, folder = subject(options), output_folder(options)
    model = about.model
    # The synchronous law has no oscillator: its amplitude is all that it knows of the impact.
    law = model.impact.oscillator if isinstance(model.impact, RollerPassImpact) else PocketImpact()
    if not float(model.bearing.pocket_clearance) > 0:
        raise UsageError(f"The pocket clearance of {about.name} must be above 0 for an impact, but it is 0.")
    v0 = approach_speed(law.approach_ratio, angular_speed(options.speed), model.bearing.pocket_clearance)
    history = impact_history(law, model.bearing.roller_mass, v0, jnp.asarray(1e-3 * options.duration))
    stem = f"impact_{about.name}_{options.speed:g}rpm"
    figure = new_figure(7.0, 4.0)
    title = f"{about.name}, {options.speed:g} rpm, approach at {float(v0):.3g} m/s"
    impact_forces(history, figure.subplots()).set_title(title, loc="left", fontsize=11)
    paths = {
        "figure": save_figure(figure, folder / f"{stem}.png"),
        "data": str(write_columns(folder / f"{stem}.csv", _columns(history))),
    }
    values = {"approach_speed": float(v0)} | _summary(history)
    document = {"case": about.name, "speed_rpm": options.speed, **values, **paths}
    table = Table(
        f"Impact in {about.name} at {options.speed:g} rpm",
        ("quantity", "value", "unit"),
        _rows(values),
    )
    return Report(document, [table], [f"Figure: {paths['figure']}", f"Data: {paths['data']}"])


def _columns(history: ImpactHistory) -> dict[str, np.ndarray]:
    return {
        "time [s]": np.asarray(history.time),
        "contact_force [N]": np.asarray(history.contact_force),
        "bar_force [N]": np.asarray(history.bar_force),
        "roller_position [m]": np.asarray(history.roller_position),
        "bar_position [m]": np.asarray(history.bar_position),
    }


def _summary(history: ImpactHistory) -> dict[str, Any]:
    """Peaks, time in contact and impulse, over the whole history: a bar that swings back may be hit
    again.
    """
    touching = np.asarray(history.contact_force) > 0
    step = float(history.time[1] - history.time[0])
    return {
        "peak_contact_force": float(jnp.max(history.contact_force)),
        "peak_bar_force": float(jnp.max(history.bar_force)),
        "lowest_bar_force": float(jnp.min(history.bar_force)),
        "contact_duration": float(np.sum(touching)) * step,
        "contacts": int(np.sum(touching[1:] & ~touching[:-1])),
        "impulse": float(history.impulse),
        "ends_in_contact": bool(touching[-1]),
    }


def _rows(values: dict[str, Any]) -> list[tuple[str, str, str]]:
    shown = {
        "approach_speed": ("approach speed", 1.0, "m/s"),
        "peak_contact_force": ("peak contact force", 1.0, "N"),
        "peak_bar_force": ("peak bar force", 1.0, "N"),
        "lowest_bar_force": ("lowest bar force", 1.0, "N"),
        "contact_duration": ("time in contact", 1e3, "ms"),
        "contacts": ("contacts", 1.0, ""),
        "impulse": ("impulse of the contact force", 1e3, "mN s"),
    }
    rows = [(text, f"{factor * values[name]:.4g}", unit) for name, (text, factor, unit) in shown.items()]
    ends = "yes, give a longer --duration" if values["ends_in_contact"] else "no"
    return [*rows, ("still in contact at the end", ends, "")]
