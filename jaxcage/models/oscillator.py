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
PATTERNS = ((0.1, 0.2, -0.1, 0.15), (0.9, -0.4, 0.3, 0.7), (-0.6, 0.8, -0.5, -0.2))
"""Default initial states over the scale: no symmetry of the system should map one to another."""
REPEATS = 1e-3
"""Share of its size by which a law may differ after one revolution: pi in a law may have few digits."""
ROUNDING = 1e-6
"""Share of the largest value at any phase below which a value is rounding."""
COMPARED = ((0.4, 1.3717), (1.9, 41.31), (3.4, 1.3717), (5.3, 41.31))
"""Phases and speeds of the comparison: no simple fractions of a revolution, so that a law in time does not repeat by
chance."""
_RATES = "The law `rates(tau, y, speed)`"
_ACCELERATION = "The law `acceleration(tau, q, v, speed)`"
Numbers = Sequence[Scalar] | np.ndarray | Array


def _finite(values: Any, length: int) -> tuple[float, ...] | None:
    """A row of `length` finite numbers as floats, None if it is anything else."""
    try:
        row = tuple(map(float, values))
    except (TypeError, ValueError, OverflowError):  # of another kind, ragged, or traced
        return None
    return row if len(row) == length and all(map(math.isfinite, row)) else None


def components(what: str, law: Callable[..., State], *arguments: Any, number: int) -> State:
    """The result of `law`, a tuple of `number` scalars.

    **Raises:** `ValueError`, one sentence, for anything else.
    """
    with told(what):
        found = law(*arguments)
    shape = jnp.shape(arguments[1][0])
    wanted = f"{what} must return a tuple of {number} scalar{'s' if number > 1 else ''}, one for each component"
    if not isinstance(found, tuple | list) and not (isinstance(found, jax.Array | np.ndarray) and found.ndim):
        given = "nothing (is there a `return`?)" if found is None else f"one {type(found).__name__}"
        raise InputError(f"{wanted}, but returned {given}: a single one is written `(a,)`.")
    parts = tuple(found)
    if len(parts) != number:
        raise InputError(f"{wanted}, but returned {len(parts)}.")
    if any(jnp.issubdtype(jnp.result_type(part), jnp.complexfloating) for part in parts):
        raise InputError(f"{wanted}, but one of them is complex: take `jnp.real` or `jnp.abs` of it.")
    if wrong := [jnp.shape(part) for part in parts if jnp.shape(part) not in ((), shape)]:
        raise InputError(f"{wanted}, but one of them has shape {wrong[0]}.")
    whole = lambda part: not jnp.issubdtype(jnp.result_type(part), jnp.inexact)  # has no derivative as it is
    return tuple(jnp.asarray(part, dtype=float) if whole(part) else part for part in parts)


def require_repeats(
    what: str, law: Callable[..., State], states: Sequence[tuple[State, ...]], angles: Sequence[int] = ()
) -> None:
    """Compare the law at a few phases with itself one revolution later, and with all angles one revolution larger, in
    states as its arguments.

    **Raises:** `ValueError` where it differs. A law that cannot be compared passes: one that raises an error, holds
    traced numbers or has no row of real numbers as its result. It is reported where the law is used.
    """

    turned = [(tuple(c + 2 * np.pi * (i in angles) for i, c in enumerate(q)), *rest) for q, *rest in states]

    def row(turn: float, states: Sequence[tuple[State, ...]] = states) -> np.ndarray:
        with np.errstate(all="ignore"):
            found = [
                law(np.float64(tau + turn), *states[i % len(states)], np.float64(speed))
                for i, (tau, speed) in enumerate(COMPARED)
            ]
        if any(isinstance(part, Tracer) or np.iscomplexobj(part) for part in jax.tree.leaves(found)):
            raise TypeError
        return np.array(found, dtype=float)

    try:
        now, off = row(0.0), []
        for other in (row(2 * np.pi), row(0.0, turned)):
            size = np.nan_to_num(np.maximum(np.abs(now), np.abs(other)), posinf=0.0)
            with np.errstate(invalid="ignore"):
                off.append(np.any(np.abs(other - now) > REPEATS * np.maximum(size, ROUNDING * size.max(axis=0))))
        later, by_angle = off if np.array_equal(now, row(0.0), equal_nan=True) else (False, False)
    except Exception:
        return
    if by_angle:
        said = f"must be coordinates in which the law repeats after 2 pi, but {shown(angles)} was given."
        raise ArgumentError("angles", said=said)
    if later:
        raise InputError(
            f"{what} must repeat after one revolution (tau -> tau + 2 pi), but does not: all forcings must be whole "
            "multiples of the revolution (take the slowest forcing as the revolution, except of a cage), and pulses "
            "functions of `jnp.mod(tau, 2 * jnp.pi)`."
        )


class _Bound(eqx.Module):
    """A user's law with its last argument, the speed, filled in."""

    law: Callable[..., State]
    speed: Scalar
    what: str = eqx.field(static=True)
    """Name of the law in messages."""

    def __call__(self, *state: Any) -> State:
        return components(self.what, self.law, *state, self.speed, number=len(state[-1]))


class _UsersSystem(AbstractForcedSystem):
    """Scale, initial states and harmonics of a system from a user's function, of first or second order."""

    _scale: tuple[float, ...] = eqx.field(static=True)
    _starts: tuple[tuple[float, ...], ...] = eqx.field(static=True)
    _harmonics: int = eqx.field(static=True)
    _angles: tuple[int, ...] = eqx.field(static=True)

    def _set(self, scale: Any, initial_states: Any, harmonics: int, angles: Sequence[int], coordinates: int) -> None:
        """Keep what the user gave. **Raises:** `ValueError` for what does not fit the system."""
        n = self.dimension
        magnitudes = _finite((scale,) * n if np.ndim(scale) == 0 else scale, n)
        if magnitudes is None or min(magnitudes) <= 0:
            said = f"must be a positive finite number or {n} of them, one for each component of the state"
            raise ArgumentError("scale", said=f"{said}, but {shown(scale)} was given.")
        rows = []
        for start in initial_states:
            rows.append(_finite(start, n))
            if rows[-1] is None:
                said = f"must be states of {n} finite number{'s' if n > 1 else ''} each"
                raise ArgumentError("initial_states", said=f"{said}, but {shown(start)} is among them.")
        if not 1 <= harmonics <= MOST_HARMONICS:
            said = f"must be a whole number from 1 to {MOST_HARMONICS}, but {shown(harmonics)} was given."
            raise ArgumentError("harmonics", said=said)
        if wrong := [i for i in angles if not 0 <= i < coordinates]:
            said = f"must be numbers of coordinates, from 0 to {coordinates - 1}, but {wrong[0]} is among them."
            raise ArgumentError("angles", said=said)
        default = [tuple(p[i % 4] * (1 + i // 4) * s for i, s in enumerate(magnitudes)) for p in PATTERNS]
        self._scale, self._starts, self._harmonics = magnitudes, tuple(rows or default), int(harmonics)
        self._angles = tuple(map(int, angles))

    @property
    def _probes(self) -> list[State]:
        """States in which the law is evaluated to see that it repeats; at rest it shows the forcing alone."""
        return [tuple(map(np.float64, row)) for row in ((0.0,) * self.dimension, *self._starts[:2])]

    @property
    def harmonics(self) -> int:
        return self._harmonics

    @property
    def angles(self) -> tuple[int, ...]:
        return self._angles

    def scale(self, speed: Scalar) -> State:
        return tuple(jnp.asarray(s, dtype=float) for s in self._scale)

    def initial_states(self, speed: Scalar) -> tuple[State, ...]:
        return tuple(tuple(jnp.asarray(c, dtype=float) for c in s) for s in self._starts)


class ForcedSystem(_UsersSystem):
    """A first-order system from a function `rates(tau, y, speed) -> dy/dt`; y and dy/dt are tuples of scalars.

    The phase tau [rad] grows with time at the `speed` [rad/s]; the units of y are the user's.
    """

    rates: Callable[[Scalar, State, Scalar], State]
    _dimension: int = eqx.field(static=True)

    @checked
    def __init__(
        self,
        rates: Callable[[Scalar, State, Scalar], State],
        dimension: int,
        scale: Scalar | Numbers = 1.0,
        initial_states: Sequence[Numbers] | np.ndarray | Array = (),
        harmonics: int = 1,
        angles: Sequence[int] = (),
    ):
        """**Arguments:** `rates(tau, y, speed)`, a function or a module (whose arrays are then differentiable
        parameters), the same at tau and tau + 2 pi; number of state components; characteristic magnitude of the
        components; initial states for sweeps; highest harmonic of the revolution in the law; indices of the components
        that are angles.

        **Raises:** `ValueError` for settings that do not fit, and for a law that does not repeat after one revolution.
        """
        require_at_least(1, dimension=dimension)
        self.rates, self._dimension = rates, dimension
        self._set(scale, initial_states, harmonics, angles, dimension)
        require_repeats(_RATES, rates, [(y,) for y in self._probes], self._angles)

    @property
    def dimension(self) -> int:
        return self._dimension

    def at_speed(self, speed: Scalar) -> AbstractField:
        return FirstOrderField(_Bound(self.rates, speed, _RATES), speed)


class ForcedOscillator(_UsersSystem):
    """A second-order system from a function `acceleration(tau, q, v, speed) -> d2q/dt2`; q, v = dq/dt and d2q/dt2 are
    tuples of scalars.

    The phase tau [rad] grows with time at the `speed` [rad/s]; the units of q are the user's.

    !!! example
        def duffing(tau, q, v, speed):
            (x,), (u,) = q, v
            return (-0.25 * u + x - x**3 + 0.4 * jnp.cos(tau),)

        system = jc.ForcedOscillator(duffing, coordinates=1)
    """

    acceleration: Callable[[Scalar, State, State, Scalar], State]
    coordinates: int = eqx.field(static=True)

    @checked
    def __init__(
        self,
        acceleration: Callable[[Scalar, State, State, Scalar], State],
        coordinates: int,
        scale: Scalar | Numbers = 1.0,
        initial_states: Sequence[Numbers] | np.ndarray | Array = (),
        harmonics: int = 1,
        angles: Sequence[int] = (),
    ):
        """**Arguments:** `acceleration(tau, q, v, speed)`, a function or a module (whose arrays are then differentiable
        parameters), the same at tau and tau + 2 pi; number of coordinates; characteristic magnitude of the state
        components (coordinates first); initial states (q, v) for sweeps; highest harmonic of the revolution in the law;
        indices of the coordinates that are angles: periodic orbits may turn by whole revolutions in them, and states
        that differ by these are the same.

        **Raises:** `ValueError` for settings that do not fit, and for a law that does not repeat after one revolution.
        """
        require_at_least(1, coordinates=coordinates)
        self.acceleration, self.coordinates = acceleration, coordinates
        self._set(scale, initial_states, harmonics, angles, coordinates)
        probes = [(y[:coordinates], y[coordinates:]) for y in self._probes]
        require_repeats(_ACCELERATION, acceleration, probes, self._angles)

    @property
    def dimension(self) -> int:
        return 2 * self.coordinates

    def at_speed(self, speed: Scalar) -> AbstractField:
        return SecondOrderField(_Bound(self.acceleration, speed, _ACCELERATION), speed)
