"""What every computation asks of its arguments before it begins: known numbers, and speeds that a cage can have."""

import math
from typing import Any

import jax
import numpy as np

from .._errors import ArgumentError
from ..bearing import is_concrete
from ._cage import CageModel
from ._system import AbstractForcedSystem
from .whole import BearingModel


MOST = 1e9
"""Of speeds [rad/s]: beyond, nothing that is computed means anything."""
FASTEST = 300.0
"""Surface speed of the cage at its land [m/s] beyond which no cage runs: rho v^2 alone is 765 MPa of hoop stress in
brass, twice what it bears, and what is given in rpm for rad/s is 9.5 times as fast as meant."""


SLOWEST_CAGE = 0.01
"""Smallest speed of a whole bearing's cage in pure rolling over that of the faster ring: a revolution of a cage that
hardly turns takes for ever."""


def fastest_speed(model: CageModel) -> float:
    """The speed [rad/s] at which the land of the slowest of the cages in `model` runs at `FASTEST`."""
    return FASTEST / float(np.max(np.asarray(model.land_radius)))


def require_speeds(system: AbstractForcedSystem, speeds: Any, name: str = "speed") -> None:
    """Stop at speeds that nothing has, and at those that no cage has, which are those of somebody who gave revolutions
    per minute.

    **Raises:** `ValueError`.
    """
    if not is_concrete(*jax.tree.leaves(speeds)):
        return
    given = np.asarray(speeds, dtype=float)
    if np.any(bad := ~((given > 0) & (given <= MOST))):
        said = f"must be positive and finite, at most {MOST:g} rad/s, but {given[bad].flat[0]:g} was given."
        raise ArgumentError(name, said=said)
    if isinstance(system, BearingModel) and system.over_angle and is_concrete(*jax.tree.leaves(system)):
        _require_turning_cage(system, given, name)
    if not isinstance(system, CageModel) or not is_concrete(system.land_radius):
        return
    highest, limit = float(np.max(given, initial=0.0)), fastest_speed(system)
    if highest > limit:
        raise ArgumentError(
            name,
            said=(
                f"must be in rad/s, at most {limit:.0f} ({FASTEST:g} m/s at the land of this cage), but {highest:g} "
                f"was given, which is {highest * 30 / math.pi:.0f} rpm: `jaxcage.rpm({highest:g})` makes rad/s of rpm."
            ),
        )


def _require_turning_cage(model: BearingModel, speeds: np.ndarray, name: str) -> None:
    """**Raises:** `ValueError` for rings that turn against each other and leave the cage next to rest."""
    outer = float(model.outer_speed)
    for speed in np.unique(speeds):
        rolling, fastest = float(model.rolling_cage_speed(speed)), max(abs(speed), abs(outer))
        if abs(rolling) < SLOWEST_CAGE * fastest:
            raise ArgumentError(
                name,
                said=f"must make the cage turn at {SLOWEST_CAGE:g} of the faster ring's speed at least, "
                f"{SLOWEST_CAGE * fastest:.3g} rad/s, but with the outer ring at {outer:.6g} rad/s {speed:.6g} rad/s "
                f"of the shaft make it {rolling:.3g} rad/s: `bearing_over_time` follows it over time.",
            )


def require_known(function: str, instead: str, *arguments: object) -> None:
    """Stop where `jax.vmap`, `jax.grad` or `jax.jit` goes over a function that steers by what it finds.

    **Raises:** `ValueError` that says what to call `instead`.
    """
    if not is_concrete(*jax.tree.leaves(arguments)):
        raise ArgumentError(
            *("system", "speeds" if function == "sweep" else "speed"),
            said=(
                f"of `{function}` must be known numbers, but are traced by `jax.vmap`, `jax.grad` or `jax.jit`, which "
                f"cannot go over it: {instead}."
            ),
        )


INSTEAD = (
    "many designs are swept in one call by `jaxcage.sweep_designs(systems, speeds)`, and derivatives are those of "
    "orbits and edges, by `jaxcage.periodic_orbit` and `jaxcage.sensitivity`"
)
