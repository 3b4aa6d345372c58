"""Time histories at constant speed and through a speed ramp, both made of parts of the strobe map's revolution."""

import dataclasses
import math
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from .._arguments import require_at_least, shown
from .._checks import require_x64
from .._errors import ArgumentError
from .._form import compiled
from .._notebook import notebook_html
from .._types import Scalar, State
from ..models import INSTEAD, AbstractForcedSystem, require_known, require_speeds
from ._controlled import ControlledSteps, controlled, stated
from ._method import REVOLUTION, AbstractMethod, FixedSteps
from ._results import INACCURATE, OUTCOMES, outcome_code
from ._strobe import strobe_map


@dataclasses.dataclass(frozen=True)
class Trajectory:
    """States at equally spaced phases."""

    time: Float[np.ndarray, " n"]
    """Time from the first sample [s]."""
    tau: Float[np.ndarray, " n"]
    """Phase [rad], 0 at the beginning of the run (before any discarded revolutions)."""
    state: Float[np.ndarray, "n dim"]
    """State in SI units; NaN from the sample after a failure."""
    speed: Float[np.ndarray, " n"]
    """Speed at each sample [rad/s]."""
    samples: int
    """Samples per revolution."""
    peak: float
    """Largest excursion of the first sample and at any step after it, between the samples too; for a cage eps."""
    outcome: str
    """`successful`, or the name of what went wrong."""
    error: float = math.nan
    """Largest error of a revolution, in units of the system's scale (for a cage: clearances): how far the ends of its
    parts move, in all, with half as many steps. NaN for a trajectory that no integration has made."""

    @property
    def rpm(self) -> Float[np.ndarray, " n"]:
        """Speed in revolutions per minute."""
        return self.speed * 30 / np.pi

    def __str__(self) -> str:
        revolutions = self.time.size / self.samples
        return (
            f"Trajectory of {revolutions:g} revolutions, {self.samples} samples each, "
            f"{self.rpm[0]:.0f} to {self.rpm[-1]:.0f} rpm, {self.outcome}, largest excursion {self.peak:.3f}, "
            f"error of a revolution at most {self.error:.0e}"
        )

    _repr_html_ = notebook_html


@compiled
def _run(
    system: AbstractForcedSystem,
    method: ControlledSteps,
    speeds: Float[Array, " revolutions"],
    rises: Float[Array, " revolutions"],
    y0: State,
    samples: int,
) -> tuple[Float[Array, "revolutions samples dim"], Float[Array, " revolutions"], Float[Array, " revolutions"], Array]:
    """Whole revolutions one after the other; within one the speed rises by one of `rises`, in `samples` steps."""

    def part(carry: tuple, i: Array, first: Array, rise: Array) -> tuple[tuple, Array]:
        y, peak, error, outcome = carry
        strobe = strobe_map(system, first + rise * (i.astype(float) + 0.5) / samples, method)
        stretch = strobe.part(y, i, samples)
        error = error + stretch.error
        now = outcome_code(stretch.result)
        code = jnp.where(outcome == 0, jnp.where((now == 0) & (error > method.tolerance), INACCURATE, now), outcome)
        y1 = tuple(jnp.where(code == 0, c, jnp.nan) for c in stretch.y)
        return (y1, jnp.maximum(peak, stretch.peak), error, code), jnp.stack(y)

    def revolution(carry: tuple, speeds: tuple[Array, Array]) -> tuple[tuple, tuple[Array, ...]]:
        carry = (carry[0], jnp.asarray(system.excursion(carry[0]), dtype=float), jnp.zeros(()), carry[3])
        carry, states = jax.lax.scan(lambda c, i: part(c, i, *speeds), carry, jnp.arange(samples))
        return carry, (states, *carry[1:3])

    admitted = outcome_code(strobe_map(system, speeds[0], method).admit(y0))
    y0 = tuple(jnp.where(admitted == 0, c, jnp.nan) for c in y0)
    start = (y0, jnp.zeros(()), jnp.zeros(()), admitted)
    (*_, code), (states, peaks, errors) = jax.lax.scan(revolution, start, (speeds, rises))
    return states, peaks, errors, code


def _start(system: AbstractForcedSystem, speed: float, start: State | None) -> State:
    y0 = system.starts(jnp.asarray(speed))[0] if start is None else start
    if len(y0) != system.dimension:
        raise ArgumentError("start", said=f"must be a state of {system.dimension} numbers, but has {len(y0)}.")
    if not np.all(np.isfinite(np.asarray(y0, dtype=float))):
        raise ArgumentError("start", said=f"must be finite numbers, but {shown(y0)} was given.")
    return tuple(jnp.asarray(c, dtype=float) for c in y0)


def require_counts(revolutions: int, samples: int, discard: int) -> None:
    """**Raises:** `ValueError` for what no history can have."""
    require_at_least(1, revolutions=revolutions, samples=samples)
    require_at_least(0, discard=discard)


def _method(method: AbstractMethod | None, samples: int) -> ControlledSteps:
    if isinstance(method, FixedSteps) and method.steps % samples:
        raise ArgumentError(
            "samples", said=f"must divide the {method.steps} steps per revolution of the method, but is {samples}."
        )
    return stated(controlled() if method is None else method)


def _trajectory(ran: tuple[Array, ...], speeds: np.ndarray, rise: float, samples: int, discard: int) -> Trajectory:
    states, peaks, errors, code = ran
    grid = np.arange(samples) / samples
    speed = (speeds[:, None] + rise * grid).ravel()[discard * samples :]
    tau = REVOLUTION * (np.arange(speeds.size)[:, None] + grid).ravel()[discard * samples :]
    step = REVOLUTION / samples
    time = np.concatenate([[0.0], np.cumsum(step / (speed[:-1] + 0.5 * rise / samples))])
    state = np.asarray(states).reshape(-1, states.shape[-1])[discard * samples :]
    peak = float(np.max(np.asarray(peaks)[discard:]))
    return Trajectory(time, tau, state, speed, samples, peak, OUTCOMES[int(code)], float(np.max(errors)))


def simulate(
    system: AbstractForcedSystem,
    speed: Scalar,
    *,
    revolutions: int,
    samples: int = 64,
    discard: int = 0,
    start: State | None = None,
    method: AbstractMethod | None = None,
) -> Trajectory:
    """Time history at one speed.

    **Arguments:** system; speed [rad/s]; revolutions recorded and discarded before; samples per revolution (they must
    divide the steps per revolution of a method with fixed steps); initial state, by default the system's first start;
    integration method, by default `jaxcage.controlled()`.

    **Returns:** `Trajectory`; a run that fails, or is `inaccurate`, is NaN from there on and says why in `outcome`.

    **Raises:** `ValueError` for a speed that is not positive, or impossible counts.
    """
    require_x64()
    require_known("simulate", INSTEAD, system, speed, start)
    options: dict[str, Any] = dict(revolutions=revolutions, samples=samples, discard=discard)
    return ramp(system, speed, speed, **options, start=start, method=method)  # one that does not rise


def ramp(
    system: AbstractForcedSystem,
    first: Scalar,
    last: Scalar,
    *,
    revolutions: int,
    samples: int = 64,
    discard: int = 0,
    start: State | None = None,
    method: AbstractMethod | None = None,
) -> Trajectory:
    """Time history of a true speed ramp: the speed changes continuously, by the same amount in every revolution.

    Within a revolution the speed rises in `samples` steps. The tangential force M e dw/dt of the unbalance is left out:
    its ratio to M e w^2 is the relative change of speed in one radian.

    **Arguments:** system; first and last speed [rad/s]; number of revolutions of the whole ramp; `discard`:
    revolutions at the first speed before it, which are left out; the rest as in `simulate`.

    **Returns:** `Trajectory` with the speed of each sample.
    """
    require_x64()
    require_known("ramp", INSTEAD, system, first, last, start)
    low, high = float(first), float(last)
    require_speeds(system, (low, high))
    require_counts(revolutions, samples, discard)
    chosen = _method(method, samples)
    rise = (high - low) / revolutions
    speeds = low + rise * np.maximum(np.arange(-discard, revolutions), 0)
    rises = np.where(np.arange(-discard, revolutions) < 0, 0.0, rise)
    ran = _run(system, chosen, jnp.asarray(speeds), jnp.asarray(rises), _start(system, low, start), samples)
    return _trajectory(ran, speeds, rise, samples, discard)
