"""Plans of lanes: the design, speed and initial state of each, and their layout over axes."""

import dataclasses
import math
from collections.abc import Mapping, Sequence
from typing import Any, overload

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from .._arguments import require_at_least, wrong
from .._errors import ArgumentError, shown
from ..models import AbstractForcedSystem, require_speeds
from ..solve import Lanes


Speeds = float | Float[Array, " speeds"] | Float[np.ndarray, " speeds"]
States = int | Sequence[Any] | Float[np.ndarray, "speeds states dim"] | None
"""Initial states: number of the model's own (None for all), states used at every speed, or states for each speed."""
Coordinate = tuple[tuple[str, ...], np.ndarray]
"""Axes and values [SI] of a coordinate."""
DESIGN, SPEED, START = "design", "speed", "initial_state"


@overload
def rpm(first: float | int) -> float: ...
@overload
def rpm(first: float | int, last: float | int, count: int = 2) -> Float[np.ndarray, " count"]: ...
def rpm(first: float | int, last: float | int | None = None, count: int = 2) -> float | Float[np.ndarray, " count"]:
    """Convert speeds from rpm to rad/s: one number, or an array of `count` from `first` to `last`.

    **Raises:** `ValueError` for anything but finite numbers, and for a count below 1.
    """
    for name, value in {"first": first, **({} if last is None else {"last": last})}.items():
        if wrong(float, value) or not math.isfinite(value):
            raise ArgumentError(name, said=f"must be a finite number, but {shown(value)} was given.")
    if said := wrong(int, count):
        raise ArgumentError("count", said=f"must be {said}, but {count!r} was given.")
    require_at_least(1, count=count)
    if last is None:
        return float(first) * math.pi / 30
    return np.linspace(first, last, count) * math.pi / 30


@dataclasses.dataclass(frozen=True, eq=False)
class Plan:
    """Lanes and their layout over axes."""

    lanes: Lanes
    """Design and speed of each lane."""
    states: Float[np.ndarray, "lanes dim"]
    """Initial state of each lane [SI]."""
    axes: Mapping[str, int]
    """Length of each axis, slowest first; their product is the number of lanes."""
    coordinates: Mapping[str, Coordinate]

    @property
    def model(self) -> AbstractForcedSystem:
        """One of the designs."""
        return self.lanes.system

    @property
    def shape(self) -> tuple[int, ...]:
        """Number of lanes along each axis."""
        return tuple(self.axes.values())

    @classmethod
    def over_speed(
        cls, designs: AbstractForcedSystem | Sequence[AbstractForcedSystem], speeds: Speeds, states: States = None
    ) -> "Plan":
        """Plan of designs at speeds from initial states: axes `design` (if several), `speed` and `initial_state`.

        **Arguments:** a model, or several that differ in their numbers only; ascending speeds [rad/s]; initial states.

        **Raises:** `ValueError` for speeds that are empty, not positive or not ascending, and states that do not fit.
        """
        models = _models(designs)
        speed = _checked_speeds(models[0], speeds)
        begins = [states_at(model, speed, states) for model in models]
        shape = len(models), *begins[0].shape[:2]
        which, at = (np.repeat(x.ravel(), shape[2]) for x in np.indices(shape[:2]))
        axes: dict[str, int] = dict(zip((DESIGN, SPEED, START), shape, strict=True))
        if not isinstance(designs, Sequence):
            del axes[DESIGN]
        lanes, dim = Lanes.of(models, speed[at], which), models[0].dimension
        return cls(lanes, np.stack(begins).reshape(-1, dim), axes, {SPEED: ((SPEED,), speed)})

    @classmethod
    def one_speed_each(cls, designs: Sequence[AbstractForcedSystem], speeds: Float[np.ndarray, " designs"]) -> "Plan":
        """Plan of designs, each at its own speed [rad/s], from all their initial states (axes as in `over_speed`)."""
        models = _models(designs)
        begin = np.stack([states_at(m, s, None)[0] for m, s in zip(models, speeds[:, None], strict=True)])
        count, initial_states, _ = begin.shape
        lanes = Lanes.of(models, np.repeat(speeds, initial_states), np.repeat(np.arange(count), initial_states))
        axes = {DESIGN: count, START: initial_states}
        return cls(lanes, begin.reshape(count * initial_states, -1), axes, {SPEED: ((DESIGN,), speeds)})

    @property
    def scale(self) -> Float[np.ndarray, "lanes dim"]:
        """Characteristic magnitude of each state component in each lane."""
        return self.lanes.begin(np.arange(len(self.states)), self.states)[0]


def _checked_speeds(model: AbstractForcedSystem, speeds: Any) -> Float[np.ndarray, " speeds"]:
    """Speeds as an array. **Raises:** `ValueError` for speeds that are empty, not positive, or not ascending."""
    speed = np.atleast_1d(np.asarray(speeds, dtype=float))
    if speed.size == 0:
        raise ArgumentError("speeds", said="must hold at least one speed, but it is empty.")
    require_speeds(model, speed, "speeds")
    if np.any(np.diff(speed) <= 0):
        raise ArgumentError("speeds", said="must be in ascending order without repetition, but it is not.")
    return speed


def _models(designs: AbstractForcedSystem | Sequence[AbstractForcedSystem]) -> list[AbstractForcedSystem]:
    models = list(designs) if isinstance(designs, Sequence) else [designs]
    if not models:
        raise ArgumentError("model", said="must hold at least one design, but it is empty.")
    return models


def states_at(
    model: AbstractForcedSystem, speed: Float[np.ndarray, " speeds"], states: States
) -> Float[np.ndarray, "speeds states dim"]:
    """Initial states at each speed: all or some of the model's own, or the given ones."""
    if states is None or isinstance(states, int | np.integer):
        own = Lanes.of([model], speed).each(own_states, np.arange(speed.size))
        if states is not None and not 1 <= states <= own.shape[1]:
            raise ArgumentError(
                "initial_states", said=f"must be 1 to {own.shape[1]}, as many as the model has, but {states} was given."
            )
        return own[:, :states]
    wanted = f"states of {model.dimension} numbers"
    if isinstance(states, np.ndarray):
        if states.ndim != 3 or states.shape[::2] != (speed.size, model.dimension):
            raise ArgumentError(
                "initial_states",
                said=f"must hold {wanted} for each of {speed.size} speeds, but has shape {states.shape}.",
            )
        return states
    rows = [np.asarray(getattr(y, "row", y), dtype=float) for y in states]
    if not rows or any(row.shape != (model.dimension,) for row in rows):
        raise ArgumentError("initial_states", said=f"must hold {wanted}, but holds {states}.")
    return np.broadcast_to(np.stack(rows), (speed.size, len(rows), model.dimension)).copy()


def own_states(model: AbstractForcedSystem, speed: Any) -> Float[Array, "states dim"]:
    """The model's own initial states at a speed."""
    row = lambda y: jnp.stack([jnp.asarray(c, dtype=float) for c in y])
    return jnp.stack([row(y) for y in model.initial_states(speed)])
