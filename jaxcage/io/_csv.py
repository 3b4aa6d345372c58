"""Time histories as CSV: one column per quantity, its unit in the head."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from jaxtyping import Float, Shaped

from .._glossary import component_names, quantity
from ..integrate import Trajectory
from ._files import replacing


def write_columns(path: str | Path, columns: Mapping[str, Shaped[np.ndarray, " rows"]]) -> Path:
    """Write columns of one length under their names; nothing is left behind if that fails."""
    table = np.column_stack([np.asarray(column) for column in columns.values()])
    with replacing(path) as temporary:
        np.savetxt(temporary, table, fmt="%.12g", delimiter=",", header=",".join(columns), comments="")
    return Path(path)


def read_columns(path: str | Path) -> dict[str, Float[np.ndarray, " rows"]]:
    """The columns of a file that `write_columns` wrote, by their heads.

    **Raises:** `ValueError` for what is no table of numbers with a head over each column.
    """
    with open(path, encoding="utf-8") as file:
        names = file.readline().strip().split(",")
    table = np.loadtxt(path, delimiter=",", skiprows=1, ndmin=2)
    return dict(zip(names, table.T, strict=True))


def trajectory_columns(
    trajectory: Trajectory, forces: Mapping[str, Float[np.ndarray, "samples 2"]] | None = None
) -> dict[str, Float[np.ndarray, " samples"]]:
    """Time, phase, state and each force of a trajectory in SI units, heads such as `y_C [m]` and
    `film_y [N]`.
    """
    columns = {"time [s]": trajectory.time, "tau [rad]": trajectory.tau}
    for i, name in enumerate(component_names(trajectory.state.shape[1])):
        columns[f"{name} [{quantity(name).unit}]"] = trajectory.state[:, i]
    for name, force in (forces or {}).items():
        columns |= {f"{name}_{axis} [N]": force[:, i] for i, axis in enumerate("xy")}
    return {name: np.asarray(column) for name, column in columns.items()}


def write_trajectory(
    path: str | Path,
    trajectory: Trajectory,
    forces: Mapping[str, Float[np.ndarray, "samples 2"]] | None = None,
) -> Path:
    """Write a trajectory, with the forces on the cage if given, as CSV in SI units."""
    return write_columns(path, trajectory_columns(trajectory, forces))
