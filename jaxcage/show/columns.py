"""Time histories, strobe points and branches as CSV: one column per quantity, its unit in the head."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import xarray as xr
from jaxtyping import Float, Shaped

from ..files import replacing
from ..quantities import component_names, quantity
from ..solve import Trajectory


if TYPE_CHECKING:
    from ..analysis import RollerHistory
    from ..orbits import Branch, Curve
    from .maps import Axis


def write_columns(path: str | Path, columns: Mapping[str, Shaped[np.ndarray, " rows"]]) -> Path:
    """Write columns of one length under their names; nothing is left behind if that fails."""
    table = np.column_stack([np.asarray(column) for column in columns.values()])
    with replacing(path) as temporary:
        np.savetxt(temporary, table, fmt="%.12g", delimiter=",", header=",".join(columns), comments="")
    return Path(path)


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


def strobe_columns(found: xr.Dataset) -> dict[str, Shaped[np.ndarray, " points"]]:
    """Strobe points of all lanes of a sweep at its first speed, in SI units."""
    states = found["strobe"].isel(speed=0).stack(point=("start", "revolution")).transpose("point", "component")
    columns = {"start": states["start"].values + 1, "revolution": states["revolution"].values}
    names = found["component"].values.tolist()
    return columns | {f"{name} [{quantity(name).unit}]": states.values[:, i] for i, name in enumerate(names)}


def branch_columns(branches: Sequence["Branch"]) -> dict[str, Shaped[np.ndarray, " orbits"]]:
    """All orbits of branches over speed: which branch, speed, state and multipliers."""
    count = branches[0].state.shape[1]
    joined = lambda rows: np.concatenate([np.asarray(row) for row in rows])
    columns = {
        "branch": joined(np.full(b.value.size, i) for i, b in enumerate(branches)),
        "speed [rpm]": joined(b.speed_rpm for b in branches),
        "stable": joined(b.stable for b in branches),
    }
    for k, name in enumerate(component_names(count)):
        columns[f"{name} [{quantity(name).unit}]"] = joined(b.state[:, k] for b in branches)
    for k in range(count):
        columns[f"multiplier {k + 1} (real part)"] = joined(np.real(b.multipliers[:, k]) for b in branches)
        columns[f"multiplier {k + 1} (imaginary part)"] = joined(np.imag(b.multipliers[:, k]) for b in branches)
    return columns


def roller_columns(history: "RollerHistory") -> dict[str, Shaped[np.ndarray, " samples"]]:
    """Time history of a bearing: cage, land, and each roller."""
    columns = {"time [s]": history.time, "cage angle [rad]": history.angle}
    columns |= {f"cage place {axis} over clearance": history.place[:, i] for i, axis in enumerate("xy")}
    for name in ("pocket_on_cage", "land_on_cage"):
        columns |= {f"{name}_{axis} [N]": getattr(history, name)[:, i] for i, axis in enumerate("xy")}
    for name, unit in {"pocket_force": "N", "inner_load": "N", "roller_slip": "1"}.items():
        columns |= {f"{name}_{j + 1} [{unit}]": x for j, x in enumerate(getattr(history, name).T)}
    return columns


def curve_columns(curves: Sequence["Curve"], axis: "Axis") -> dict[str, Shaped[np.ndarray, " points"]]:
    """Points of curves over speed and a parameter, in the units in which these are shown."""
    joined = lambda rows: np.concatenate([np.asarray(row) for row in rows])
    columns = {"curve": joined(np.full(c.x_value.size, i) for i, c in enumerate(curves, start=1))}
    columns["speed [rpm]"] = joined(c.x_value for c in curves) * 30 / np.pi
    columns[axis.head] = axis.shown(joined(c.y_value for c in curves))
    return columns | {"genuine": joined(c.genuine for c in curves)}
