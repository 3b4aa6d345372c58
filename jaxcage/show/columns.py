"""Time histories, strobe points and branches as CSV: one column per quantity, with its SI unit in the header."""

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

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

Columns = dict[str, Shaped[np.ndarray, " rows"]]


def write_columns(path: str | Path, columns: Mapping[str, Shaped[np.ndarray, " rows"]]) -> Path:
    """Write columns of one length under their names to a CSV file, whole or not at all."""
    table = np.column_stack([np.asarray(column) for column in columns.values()])
    with replacing(path) as temporary:
        np.savetxt(temporary, table, fmt="%.12g", delimiter=",", header=",".join(columns), comments="")
    return Path(path)


def _joined(parts: Iterable[Any]) -> np.ndarray:
    return np.concatenate([np.asarray(part) for part in parts])


def _of_states(states: Float[np.ndarray, "rows dim"]) -> Columns:
    names = component_names(states.shape[1])
    return {f"{name} [{quantity(name).unit}]": states[:, i] for i, name in enumerate(names)}


def trajectory_columns(trajectory: Trajectory, forces: Mapping[str, Float[np.ndarray, "samples 2"]]) -> Columns:
    """Time, phase, state and each force of a trajectory, with headers such as `y_C [m]` and `film_y [N]`."""
    columns = {"time [s]": trajectory.time, "tau [rad]": trajectory.tau, **_of_states(trajectory.state)}
    for name, force in forces.items():
        columns |= {f"{name}_{axis} [N]": force[:, i] for i, axis in enumerate("xy")}
    return {name: np.asarray(column) for name, column in columns.items()}


def roller_columns(history: "RollerHistory") -> Columns:
    """Time history of a bearing: cage, land and each roller."""
    columns = {"time [s]": history.time, "cage angle [rad]": history.angle}
    columns |= {f"cage place {axis} over clearance": history.place[:, i] for i, axis in enumerate("xy")}
    for name in ("pocket_on_cage", "land_on_cage"):
        columns |= {f"{name}_{axis} [N]": getattr(history, name)[:, i] for i, axis in enumerate("xy")}
    for name, unit in {"pocket_force": "N", "inner_load": "N", "roller_slip": "1"}.items():
        columns |= {f"{name}_{j + 1} [{unit}]": x for j, x in enumerate(getattr(history, name).T)}
    return columns


def strobe_columns(found: xr.Dataset) -> Columns:
    """Strobe points of all lanes of a sweep at its first speed."""
    states = found["strobe"].isel(speed=0).stack(point=("initial_state", "revolution")).transpose("point", "component")
    columns = {"initial_state": states["initial_state"].values + 1, "revolution": states["revolution"].values}
    return columns | _of_states(states.values)


def branch_columns(branches: Sequence["Branch"]) -> Columns:
    """All orbits of branches over speed: number of the branch, speed, stability, state and multipliers."""
    columns = {
        "branch": _joined(np.full(b.value.size, i) for i, b in enumerate(branches)),
        "speed [rpm]": _joined(b.speed_rpm for b in branches),
        "stable": _joined(b.stable for b in branches),
        **_of_states(_joined(b.state for b in branches)),
    }
    for k, mu in enumerate(_joined(b.multipliers for b in branches).T, start=1):
        columns |= {f"multiplier {k} (real part)": mu.real, f"multiplier {k} (imaginary part)": mu.imag}
    return columns


def curve_columns(curves: Sequence["Curve"], axis: "Axis") -> Columns:
    """Points of curves over speed and a parameter, in display units."""
    columns = {"curve": _joined(np.full(c.x_value.size, i) for i, c in enumerate(curves, start=1))}
    columns["speed [rpm]"] = _joined(c.x_value for c in curves) * 30 / np.pi
    columns[axis.column.title] = axis.shown(_joined(c.y_value for c in curves))
    return columns | {"genuine": _joined(c.genuine for c in curves)}
