"""`jaxcage simulate`: time history, orbit and each force at one speed."""

import dataclasses

from ..analysis import OrbitMeasures, cage_forces, orbit_measures
from ..integrate import simulate
from ..io import write_trajectory
from ..plotting import simulation_figure
from ._console import progress
from ._errors import ComputationError, require_at_least, require_speed
from ._inputs import (
    angular_speed,
    output_folder,
    samples_per_revolution,
    save_figure,
    subject,
    sweep_integration,
)
from ._options import SimulateOptions
from ._report import Report, Table


def run(options: SimulateOptions) -> Report:
    """Carry out `jaxcage simulate`."""
    require_speed("--speed", options.speed)
    require_at_least("--revolutions", options.revolutions, 1)
    require_at_least("--discard", options.discard, 0)
    chosen, about, folder = sweep_integration(options), subject(options), output_folder(options)
    with progress(f"simulate {about.name}"):
        trajectory = simulate(
            about.model,
            angular_speed(options.speed),
            revolutions=options.revolutions,
            discard=options.discard,
            samples=samples_per_revolution(chosen, 128),
            method=chosen,
        )
    if trajectory.outcome != "successful":
        raise ComputationError(
            f"The simulation at {options.speed:g} rpm failed ({trajectory.outcome}): try more --steps."
        )
    forces = cage_forces(about.model, trajectory)
    measures = orbit_measures(about.model, trajectory)
    stem = folder / f"simulate_{about.name}_{options.speed:g}rpm"
    title = f"{about.name}, {options.speed:g} rpm, {options.revolutions} revolutions"
    figure = simulation_figure(trajectory, forces, float(about.model.clearance), title)
    paths = {
        "figure": save_figure(figure, stem.with_name(stem.name + ".png")),
        "data": str(write_trajectory(stem.with_name(stem.name + ".csv"), trajectory, forces)),
    }
    document = {
        "case": about.name,
        "speed_rpm": options.speed,
        "revolutions": options.revolutions,
        "outcome": trajectory.outcome,
        "peak": trajectory.peak,
        "error": trajectory.error,
        "measures": dataclasses.asdict(measures),
        **paths,
    }
    table = Table(title, ("measure", "value", "unit"), _rows(measures))
    error = f"Error of a revolution: at most {trajectory.error:.0e} of the clearance"
    return Report(document, [table], [error, f"Figure: {paths['figure']}", f"Data: {paths['data']}"])


def _rows(measures: OrbitMeasures) -> list[tuple[str, str, str]]:
    """Measures with their own words; lengths in millimetres."""
    shown = {"1": ("", 1.0), "m": ("mm", 1e3)}
    rows = []
    for field in dataclasses.fields(measures):
        unit, factor = shown.get(field.metadata["unit"], (field.metadata["unit"], 1.0))
        rows.append((field.metadata["text"], f"{factor * getattr(measures, field.name):.4g}", unit))
    return rows
