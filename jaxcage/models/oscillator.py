"""Systems from a user's function, of first or second order, with the checks of what the function returns."""

import math
from collections.abc import Callable, Sequence
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax.core import Tracer
from jaxtyping import Array

from .._arguments import checked, require_at_least, shown
from .._errors import ArgumentError, InputError
from .._pytrees import Scalar, State
from .field import AbstractField, FirstOrderField, SecondOrderField
from .protocol import AbstractForcedSystem, told


MOST_HARMONICS = 4096
"""Highest harmonic that a law may declare: a sweep takes a few steps in its period."""
Numbers = Sequence[Scalar] | np.ndarray | Array


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


def _scale_of(scale: Any, dimension: int) -> float | tuple[float, ...]:
    """The scale as a number, or one for each component."""
    single = isinstance(scale, int | float) or np.shape(scale) == ()
    row = _finite((scale,) if single else scale)
    if row is None or min(row, default=0.0) <= 0 or (not single and len(row) != dimension):
        said = f"must be a positive finite number or {dimension} of them, one for each component of the state"
        raise ArgumentError("scale", said=f"{said}, but {shown(scale)} was given.")
    return row[0] if single else row


def _starts_of(starts: Any, dimension: int) -> tuple[tuple[float, ...], ...]:
    """The initial states as tuples of numbers."""
    rows = tuple(map(_finite, starts))
    for given, row in zip(starts, rows, strict=True):
        if row is None or len(row) != dimension:
            said = f"must be states of {dimension} finite number{'s' if dimension > 1 else ''} each"
            raise ArgumentError("starts", said=f"{said}, but {shown(given)} is among them.")
    return tuple(row for row in rows if row is not None)


def _harmonics_of(harmonics: int) -> int:
    """The highest harmonic as a whole number in its range."""
    if not 1 <= harmonics <= MOST_HARMONICS:
        said = f"must be a whole number from 1 to {MOST_HARMONICS}, but {shown(harmonics)} was given."
        raise ArgumentError("harmonics", said=said)
    return int(harmonics)


def components(what: str, law: Callable[..., State], *arguments: Any, number: int) -> State:
    """The result of `law`, a tuple of `number` scalars.

    **Raises:** `ValueError`, one sentence, for anything else.
    """
    with told(what):
        found = law(*arguments)
    shape = jnp.shape(arguments[1][0])
    wanted = f"{what} must return a tuple of {number} scalar{'s' if number > 1 else ''}, one for each component"
    if not isinstance(found, tuple | list) and not (isinstance(found, jax.Array | np.ndarray) and found.ndim):
        raise InputError(f"{wanted}, but returned {_named(found)}: a single one is written `(a,)`.")
    parts = tuple(found)
    if len(parts) != number:
        raise InputError(f"{wanted}, but returned {len(parts)}.")
    if any(jnp.issubdtype(jnp.result_type(part), jnp.complexfloating) for part in parts):
        raise InputError(f"{wanted}, but one of them is complex: take `jnp.real` or `jnp.abs` of it.")
    if wrong := [jnp.shape(part) for part in parts if jnp.shape(part) not in ((), shape)]:
        raise InputError(f"{wanted}, but one of them has shape {wrong[0]}.")
    whole = lambda part: not jnp.issubdtype(jnp.result_type(part), jnp.inexact)  # has no derivative as it is
    return tuple(jnp.asarray(part, dtype=float) if whole(part) else part for part in parts)


REPEATS = 1e-3
"""Share of its size by which a law may differ after one revolution: pi in a law may have few digits."""
PHASES, SPEEDS = (0.4, 1.9, 3.4, 5.3), (1.3717, 41.31)
"""Phases and speeds of the comparison: no simple fractions of a revolution, so that a law in time does not repeat by
chance."""


def require_repeats(
    what: str, law: Callable[..., State], states: Sequence[tuple[State, ...]], number: int, harmonics: int
) -> None:
    """Compare the law at a few phases with itself one revolution later, in states as its arguments.

    **Raises:** `ValueError` where it differs. A law that cannot be compared passes: one that raises an error, holds
    traced numbers, returns something else than `number` scalars, or a different result every time.
    """

    def row(i: int, turn: float = 0.0) -> tuple[float, ...] | None:
        found = _plain(law, PHASES[i] + turn, *states[i % len(states)], np.float64(SPEEDS[i % 2]))
        return None if found is None or len(found) != number else found

    pairs = []
    for i in range(len(PHASES)):
        pair = row(i), row(i, 2 * np.pi)
        if None in pair:
            return
        pairs.append(pair)
    found = np.array(pairs, dtype=float)
    eps = float(jnp.finfo(jnp.result_type(float)).eps)
    allowed = REPEATS * max(1.0, 1e7 * eps * harmonics)  # single precision rounds the phase
    size = abs(found).max(axis=1)
    rounding = 100 * math.sqrt(eps) * np.max(size, axis=0, where=np.isfinite(size), initial=0.0)
    with np.errstate(invalid="ignore"):
        off = abs(found[:, 1] - found[:, 0]) > allowed * np.maximum(size, rounding)
    off = np.any(off & np.isfinite(size), axis=1)
    if np.any(off) and row(i := int(np.argmax(off))) == pairs[i][0]:
        raise InputError(
            f"{what} must repeat after one revolution (tau -> tau + 2 pi), but does not: take the slowest forcing as "
            "the revolution, so that all others are whole multiples of it, and `jnp.mod(tau, 2 * jnp.pi)` in pulses."
        )


def _plain(law: Callable[..., State], tau: float, *rest: Any) -> tuple[float, ...] | None:
    """The result of a law as plain numbers, None if it has another form."""
    try:
        with np.errstate(all="ignore"):
            found = law(np.float64(tau), *rest)
        if any(jnp.shape(part) or isinstance(part, Tracer) or np.iscomplexobj(part) for part in found):
            return None
        return tuple(map(float, found))
    except Exception:  # of any kind: it is reported where the law is used
        return None


def _named(found: Any) -> str:
    return "nothing (is there a `return`?)" if found is None else f"one {type(found).__name__}"


_RATES = "The law `rates(tau, y, speed)`"
_ACCELERATION = "The law `acceleration(tau, q, v, speed)`"


class _UsersSystem(AbstractForcedSystem):
    """Scale, initial states and harmonics of a system from a user's function, of first or second order."""

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
        """States in which the law is evaluated to see that it repeats; at rest it shows the forcing alone."""
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
        self._scale, self._starts = _scale_of(scale, dimension), _starts_of(starts, dimension)
        self._harmonics = _harmonics_of(harmonics)
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
        self._scale, self._starts = _scale_of(scale, 2 * coordinates), _starts_of(starts, 2 * coordinates)
        self._harmonics = _harmonics_of(harmonics)
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
    """Name of the law in messages."""

    def __call__(self, *state: Any) -> State:
        return components(self.what, self.law, *state, self.speed, number=len(state[-1]))
