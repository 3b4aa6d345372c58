"""The forced-system protocol: any y' = f(tau, y; speed) that is 2 pi-periodic in its phase tau = speed * t.

Everything above this layer (integration, analysis, design) works on `AbstractForcedSystem` and knows nothing of cages.
`ForcedSystem` and `ForcedOscillator` wrap a user's function; `CageModel` is one of our own.
"""

import abc
import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any, ClassVar

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

from .._arguments import checked, require_at_least, shown
from .._errors import ArgumentError
from .._types import Scalar, State
from ..quantities import Quantity
from ._field import AbstractField, FirstOrderField, SecondOrderField
from ._user_law import components, require_repeats


ESCAPE = 2.0
"""Excursion beyond which a lane has left the model for good."""
MOST_HARMONICS = 4096
"""Of a law: a sweep takes a few steps in the period of the highest."""
Numbers = Sequence[Scalar] | np.ndarray | Array


class AbstractForcedSystem(eqx.Module):
    """What integration and analysis ask of a system."""

    @property
    @abc.abstractmethod
    def dimension(self) -> int:
        """Number of state components; a second-order system has its velocities behind its coordinates."""

    @property
    def beside(self) -> tuple[str, ...]:
        """Names of the quantities that are integrated beside the state; the state does not follow from them."""
        return ()

    @property
    def beside_start(self) -> tuple[float, ...]:
        """Values of the quantities beside the state at the beginning of a run."""
        return (0.0,) * len(self.beside)

    @property
    def watched(self) -> tuple[str, ...]:
        """Names of the quantities whose largest values are recorded."""
        return ("excursion",)

    @property
    def samples(self) -> int:
        """Number of strobe states of a revolution that a sweep records."""
        return 1

    def comparable(self, speed: float) -> float:
        """Phase [rad] over which a run is compared with a more exact one: its error is stated for such a stretch."""
        return 2 * math.pi

    @property
    def harmonics(self) -> int:
        """The highest harmonic of the revolution in the forcing, a static number; 1 by default.

        Fewer than two steps in its period cannot tell it from a slower one, whatever an error estimate says. A system
        of one's own whose law holds cos(k tau) with k > 1 says so: by an argument of `ForcedSystem` and
        `ForcedOscillator`, in a class of one's own with a property of this name.
        """
        return 1

    def abrupt(self, y: State, rate: State) -> tuple[Scalar, Scalar] | None:
        """Where the law changes abruptly: how far a state is from there, not below the width of the change, and how
        fast it comes there [1/rad] where it changes by `rate`. Steps are shortened in proportion to their ratio. None,
        as here, where the law has no such place.
        """
        return None

    run_defaults: ClassVar[Mapping[str, Any]] = {}
    """Settings of a run (`jaxcage.lanes.Run`) that suit the model better than the general ones."""
    speed_text: ClassVar[str] = "speed"
    """Words for the model's speed."""
    quantities: ClassVar[tuple[Quantity, ...]] = ()
    """Quantities that the model reports of a run, from averages of `beside` and `watched`."""

    @property
    def components(self) -> tuple[str, ...]:
        """Names of the state components."""
        return tuple(f"y{i}" for i in range(self.dimension))

    def other_speed(self, speed: Scalar) -> tuple[str, Scalar] | None:
        """Words for a speed that goes with the model's, and its value [rad/s]: a cage's shaft speed."""
        return None

    def turning_speed(self, speed: Scalar) -> Scalar:
        """Speed at which the phase advances, in the mean [rad/s]; the model's own unless its revolutions are others."""
        return speed

    def centre(self, y: State) -> tuple[Scalar, Scalar]:
        """Centre of the cage from that of its land, over the clearance, of models that have one."""
        raise NotImplementedError

    def reference(self, speed: Scalar) -> dict[str, Scalar]:
        """Numbers by name that the quantities refer to, such as the cage speed in pure rolling."""
        return {}

    @abc.abstractmethod
    def at_speed(self, speed: Scalar) -> AbstractField:
        """The field dy/dtau at `speed` [rad/s], with all that depends on the speed alone worked out once."""

    @abc.abstractmethod
    def scale(self, speed: Scalar) -> State:
        """Characteristic magnitude of each state component: tolerances and tangent vectors are measured in it."""

    @abc.abstractmethod
    def starts(self, speed: Scalar) -> tuple[State, ...]:
        """Initial states a sweep runs from unless told otherwise, the conventional one first."""

    @abc.abstractmethod
    def excursion(self, y: State) -> Scalar:
        """How far the state is towards the edge of what the model holds for, 1 at the edge (a cage: eps).

        A lane must start at 1 or less, is flagged when it goes beyond 1, and fails beyond `ESCAPE`. A system without
        such an edge returns 0.
        """


def _default_starts(scale: Sequence[float]) -> tuple[tuple[float, ...], ...]:
    """Three distinct states of the order of the scale: no symmetry of the system should map one to another."""
    patterns = ((0.1, 0.2, -0.1, 0.15), (0.9, -0.4, 0.3, 0.7), (-0.6, 0.8, -0.5, -0.2))
    return tuple(tuple(p[i % 4] * (1 + i // 4) * s for i, s in enumerate(scale)) for p in patterns)


def _finite(values: Any) -> tuple[float, ...] | None:
    """A row of finite numbers as floats, None if it is anything else."""
    try:
        row = tuple(map(float, values))
    except (TypeError, ValueError, OverflowError):  # of another kind, ragged, or traced
        return None
    return row if all(map(math.isfinite, row)) else None


def _kept_scale(scale: Any, dimension: int) -> float | tuple[float, ...]:
    """The scale as it is kept."""
    single = isinstance(scale, int | float) or np.shape(scale) == ()
    row = _finite((scale,) if single else scale)
    if row is None or min(row, default=0.0) <= 0 or (not single and len(row) != dimension):
        said = f"must be a positive finite number or {dimension} of them, one for each component of the state"
        raise ArgumentError("scale", said=f"{said}, but {shown(scale)} was given.")
    return row[0] if single else row


def _kept_starts(starts: Any, dimension: int) -> tuple[tuple[float, ...], ...]:
    """The starts as they are kept."""
    rows = tuple(map(_finite, starts))
    for given, row in zip(starts, rows, strict=True):
        if row is None or len(row) != dimension:
            said = f"must be states of {dimension} finite number{'s' if dimension > 1 else ''} each"
            raise ArgumentError("starts", said=f"{said}, but {shown(given)} is among them.")
    return tuple(row for row in rows if row is not None)


def _kept_harmonics(harmonics: int) -> int:
    """The highest harmonic as it is kept."""
    if not 1 <= harmonics <= MOST_HARMONICS:
        said = f"must be a whole number from 1 to {MOST_HARMONICS}, but {shown(harmonics)} was given."
        raise ArgumentError("harmonics", said=said)
    return int(harmonics)


_RATES = "The law `rates(tau, y, speed)`"
_ACCELERATION = "The law `acceleration(tau, q, v, speed)`"


class _UsersSystem(AbstractForcedSystem):
    """What a user's function does not say: it is the same for first and second order."""

    _scale: eqx.AbstractVar[float | tuple[float, ...]]
    _starts: eqx.AbstractVar[tuple[tuple[float, ...], ...]]
    _harmonics: eqx.AbstractVar[int]

    @property
    def harmonics(self) -> int:
        return self._harmonics

    def scale(self, speed: Scalar) -> State:
        return tuple(jnp.asarray(s, dtype=float) for s in self._magnitudes)

    @property
    def _magnitudes(self) -> tuple[float, ...]:
        return self._scale if isinstance(self._scale, tuple) else (self._scale,) * self.dimension

    def starts(self, speed: Scalar) -> tuple[State, ...]:
        given = tuple(tuple(jnp.asarray(c, dtype=float) for c in s) for s in self._starts)
        return given or tuple(tuple(map(jnp.asarray, s)) for s in _default_starts(self._magnitudes))

    def _probes(self) -> list[State]:
        """States in which the law is looked at: at rest only the forcing is seen."""
        rows = [(0.0,) * self.dimension, *(self._starts or _default_starts(self._magnitudes))[:2]]
        return [tuple(map(np.float64, row)) for row in rows]

    def excursion(self, y: State) -> Scalar:
        return 0.0


class ForcedSystem(_UsersSystem):
    """A first-order system from a function `rates(tau, y, speed) -> dy/dt`, all tuples of scalars."""

    rates: Callable[[Scalar, State, Scalar], State]
    _dimension: int = eqx.field(static=True)
    _scale: float | tuple[float, ...] = eqx.field(static=True)
    _starts: tuple[tuple[float, ...], ...] = eqx.field(static=True)
    _harmonics: int = eqx.field(static=True, default=1)

    @checked
    def __init__(
        self,
        rates: Callable[[Scalar, State, Scalar], State],
        dimension: int,
        scale: Scalar | Numbers = 1.0,
        starts: Sequence[Numbers] | np.ndarray | Array = (),
        harmonics: int = 1,
    ):
        """**Arguments:** `rates(tau, y, speed)`, a function or a module (whose arrays are then differentiable
        parameters), the same at tau and tau + 2 pi; number of state components; characteristic magnitude of the
        components; initial states for sweeps; highest harmonic of the revolution in the law.

        **Raises:** `ValueError` for settings that do not fit, and for a law that does not repeat after one revolution.
        """
        require_at_least(1, dimension=dimension)
        self.rates, self._dimension = rates, dimension
        self._scale, self._starts = _kept_scale(scale, dimension), _kept_starts(starts, dimension)
        self._harmonics = _kept_harmonics(harmonics)
        require_repeats(_RATES, rates, [(y,) for y in self._probes()], dimension, harmonics)

    @property
    def dimension(self) -> int:
        return self._dimension

    def at_speed(self, speed: Scalar) -> AbstractField:
        return FirstOrderField(_Bound(self.rates, speed, _RATES), speed)


class ForcedOscillator(_UsersSystem):
    """A second-order system from a function `acceleration(tau, q, v, speed) -> d2q/dt2`, all tuples of scalars.

    !!! example
        def duffing(tau, q, v, speed):
            (x,), (u,) = q, v
            return (-0.25 * u + x - x**3 + 0.4 * jnp.cos(tau),)

        system = jc.ForcedOscillator(duffing, coordinates=1)
    """

    acceleration: Callable[[Scalar, State, State, Scalar], State]
    coordinates: int = eqx.field(static=True)
    _scale: float | tuple[float, ...] = eqx.field(static=True)
    _starts: tuple[tuple[float, ...], ...] = eqx.field(static=True)
    _harmonics: int = eqx.field(static=True, default=1)

    @checked
    def __init__(
        self,
        acceleration: Callable[[Scalar, State, State, Scalar], State],
        coordinates: int,
        scale: Scalar | Numbers = 1.0,
        starts: Sequence[Numbers] | np.ndarray | Array = (),
        harmonics: int = 1,
    ):
        """**Arguments:** `acceleration(tau, q, v, speed)`, a function or a module (whose arrays are then differentiable
        parameters), the same at tau and tau + 2 pi, with velocities v = dq/dt; number of coordinates; characteristic
        magnitude of the state components (coordinates first); initial states (q, v) for sweeps; highest harmonic of
        the revolution in the law.

        **Raises:** `ValueError` for settings that do not fit, and for a law that does not repeat after one revolution.
        """
        require_at_least(1, coordinates=coordinates)
        self.acceleration, self.coordinates = acceleration, coordinates
        self._scale, self._starts = _kept_scale(scale, 2 * coordinates), _kept_starts(starts, 2 * coordinates)
        self._harmonics = _kept_harmonics(harmonics)
        states = [(y[:coordinates], y[coordinates:]) for y in self._probes()]
        require_repeats(_ACCELERATION, acceleration, states, coordinates, harmonics)

    @property
    def dimension(self) -> int:
        return 2 * self.coordinates

    def at_speed(self, speed: Scalar) -> AbstractField:
        return SecondOrderField(_Bound(self.acceleration, speed, _ACCELERATION), speed)


class _Bound(eqx.Module):
    """A user's law with its last argument, the speed, filled in."""

    law: Callable[..., State]
    speed: Scalar
    what: str = eqx.field(static=True)
    """What a refusal calls it."""

    def __call__(self, *state: Any) -> State:
        return components(self.what, self.law, *state, self.speed, number=len(state[-1]))
