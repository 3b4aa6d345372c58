"""Measures of a time history: the quantities that its model reports, and the forces on a cage along it."""

from typing import NamedTuple

import jax
import numpy as np
from jaxtyping import Array, Float

from .._arguments import require_x64
from .._errors import ArgumentError
from .._pytrees import compiled
from ..forces import Force, ImpactFromBearing
from ..models import FORCES, AbstractForcedSystem, CageHistory, CageModel, cage_quantities
from ..quantities import Quantity, averaged, notebook_html
from ..solve import Trajectory, simulate
from .labels import scatter


BATCH = 256
"""Number of samples whose forces are computed at a time."""
ONE_ROLLER = "one roller on a bar"
"""Name of the largest force of one impact, which lasts a hundredth of a revolution."""
SETTLED, OBSERVED = 100, 8
"""Revolutions before those over which the largest forces are sought, and of these."""


@compiled
def _forces(
    model: CageModel, speed: Float[Array, " n"], tau: Float[Array, " n"], motion: Float[Array, "n 4"]
) -> dict[str, tuple[Array, Array, Array]]:
    """Components and moment (F_x, F_y, M) of each force at every sample."""

    def at(sample: tuple[Array, Array, Array]) -> dict[str, Force]:
        omega, t, m = sample
        return model.cage_at(omega).forces(t, *m)

    return jax.lax.map(at, (speed, tau, motion), batch_size=BATCH)


def cage_history(model: CageModel, trajectory: Trajectory) -> CageHistory:
    """Motion of a cage relative to the rib along a trajectory, and the forces on the cage.

    **Raises:** `ValueError` for a trajectory of another model.
    """
    require_x64()
    state, dim = trajectory.state, model.dimension
    if state.shape[-1] != dim:
        raise ArgumentError("trajectory", said=f"must have states of {dim} numbers, but has {state.shape[-1]}.")
    q, v = state[:, : dim // 2], state[:, dim // 2 :]
    position, velocity = (q, v) if dim == 4 else (q[:, :2] - q[:, 2:], v[:, :2] - v[:, 2:])
    motion = np.concatenate([position, velocity], axis=1)
    along = _forces(model, *map(jax.numpy.asarray, (trajectory.speed, trajectory.tau, motion)))
    own, extra = [law.law_name for law in model.forces if law.law_name], [type(law).__name__ for law in model.extra]
    names = dict.fromkeys([*own, *FORCES, *extra])  # compiled functions sort the keys of dictionaries
    return CageHistory(
        speed=trajectory.speed,
        phase=2 * np.pi * len(state) / trajectory.samples,
        position=position,
        velocity=velocity,
        forces={name: np.stack(along[name][:2], axis=1) for name in names},
        drag_power=-np.asarray(along["film"][2]) * trajectory.speed,
        clearance=float(model.clearance),
        peak=trajectory.peak,
        error=trajectory.error,
    )


def cage_forces(model: CageModel, trajectory: Trajectory) -> dict[str, Float[np.ndarray, "n 2"]]:
    """Every force on the cage along a trajectory of `model`.

    **Returns:** `film`, `contact`, `support`, `impact`, `unbalance`, `weight` and the model's `extra` laws by the names
    of their classes, each (F_x, F_y) [N] at every sample, at the speed of that sample.
    """
    return dict(cage_history(model, trajectory).forces)


def largest_forces(model: CageModel, speed: float) -> dict[str, float]:
    """Largest size [N] of every force on the cage at a speed [rad/s], over revolutions after the start has died out,
    NaN where they fail; and `ONE_ROLLER`, the largest force of a single impact, where it follows from the bearing."""
    forces = cage_forces(model, simulate(model, speed, revolutions=OBSERVED, discard=SETTLED))
    found = {name: float(np.max(np.hypot(*force.T))) for name, force in forces.items()}
    if isinstance(model.impact, ImpactFromBearing):
        found[ONE_ROLLER] = float(model.impact.pulse(model, speed).peak)
    return found


class Measured(NamedTuple):
    """A reported quantity with its value."""

    quantity: Quantity
    value: float
    error: float
    """Standard error from the scatter of revolutions, NaN if not known."""


class Measures(dict[str, Measured]):
    """Quantities of a time history by name; printed, a table with units."""

    def value(self, name: str) -> float:
        """Value of a quantity [SI]."""
        return self[name].value

    def __str__(self) -> str:
        lines = []
        for quantity, value, error in self.values():
            unit = "" if quantity.unit == "1" else quantity.unit
            spread = f" ± {error:.1g}" if np.isfinite(error) else ""
            lines.append(f"{quantity.text:<48s} {value:12.5g}{spread} {unit}".rstrip())
        return "\n".join(lines)

    _repr_html_ = notebook_html


def measures(model: AbstractForcedSystem, trajectory: Trajectory) -> Measures:
    """Compute the quantities that a model reports of a time history.

    **Arguments:** a cage or a whole bearing; its trajectory, preferably of whole revolutions without the transient, and
    with 512 samples per revolution where a cage touches its land.

    **Returns:** `Measures`, quantities [SI] by name, with their standard errors for a whole bearing.

    **Raises:** `ValueError` for a trajectory that failed, or of fewer than 3 samples; `RuntimeError` without double
    precision.
    """
    require_x64()
    allowed = ("successful", "inaccurate") if model.beside else ("successful",)
    if trajectory.outcome not in allowed or len(trajectory.tau) < 3:
        raise ArgumentError(
            "trajectory",
            said="must be a run that succeeded, of at least 3 samples, "
            f"but this one has {len(trajectory.tau)} and ended with: {trajectory.outcome}.",
        )
    if model.beside:
        return _from_integrals(model, trajectory)
    history = cage_history(model, trajectory)  # pyright: ignore[reportArgumentType]
    return Measures({each.name: Measured(each, value, np.nan) for each, value in cage_quantities(history)})


def _from_integrals(model: AbstractForcedSystem, trajectory: Trajectory) -> Measures:
    """Quantities from the integrals and the maxima over each revolution."""
    samples = trajectory.samples
    each = np.diff(trajectory.integrals[::samples], axis=0)
    largest = trajectory.peaks[: len(each) * samples].reshape(len(each), samples, -1).max(axis=1)
    numbers = {name: np.array([float(x)]) for name, x in model.reference(float(trajectory.speed[0])).items()}
    found = averaged(model.quantities, model.beside, model.watched, each[None], largest[None], numbers, 1.0)
    return Measures({q.name: Measured(q, float(whole[0]), float(scatter(blocks[0]))) for q, whole, blocks in found})
