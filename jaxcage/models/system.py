"""The forced-system protocol: any y' = f(tau, y; speed) that is 2 pi-periodic in its phase tau = speed * t.

Everything above this layer works on `AbstractForcedSystem`. `ForcedSystem` and `ForcedOscillator` wrap a user's
function; `CageModel` is a cage in its rib.
"""

import abc
import contextlib
from collections.abc import Iterator

import equinox as eqx
import jax

from .._arguments import is_concrete
from .._errors import ArgumentError, InputError
from .._types import Scalar, State
from .field import AbstractField


ESCAPE = 2.0
"""Excursion beyond which a trajectory has left the model for good."""


class AbstractForcedSystem(eqx.Module):
    """A system y' = f(tau, y; speed) that integration and analysis work on."""

    @property
    @abc.abstractmethod
    def dimension(self) -> int:
        """Number of state components; a second-order system has its velocities behind its coordinates."""

    @property
    def harmonics(self) -> int:
        """The highest harmonic of the revolution in the forcing, a static number; 1 by default.

        Fewer than two steps in its period cannot tell it from a slower one, whatever an error estimate says. A user's
        system with cos(k tau), k > 1, in its law declares k: as an argument of `ForcedSystem` and `ForcedOscillator`,
        or as a property of this name.
        """
        return 1

    def abrupt(self, y: State, rate: State) -> tuple[Scalar, Scalar] | None:
        """Distance of a state from where the law changes abruptly, at least the width of the change, and the rate at
        which the state approaches it [1/rad] when it changes by `rate`; None for a law without abrupt changes.

        Steps are shortened in proportion to the ratio of the two.
        """
        return None

    @abc.abstractmethod
    def at_speed(self, speed: Scalar) -> AbstractField:
        """The field dy/dtau at `speed` [rad/s], with everything that depends on the speed alone evaluated once."""

    @abc.abstractmethod
    def scale(self, speed: Scalar) -> State:
        """Characteristic magnitude of each state component: tolerances and tangent vectors are measured in it."""

    @abc.abstractmethod
    def starts(self, speed: Scalar) -> tuple[State, ...]:
        """Initial states a sweep runs from unless told otherwise, the conventional one first."""

    @abc.abstractmethod
    def excursion(self, y: State) -> Scalar:
        """Distance from the centre of the states for which the model is valid, 1 at their edge; for a cage, eps.

        A trajectory must start at 1 or less, is flagged beyond 1, and fails beyond `ESCAPE`. A system without such an
        edge returns 0.
        """


@contextlib.contextmanager
def told(what: str) -> Iterator[None]:
    """**Raises:** `ValueError` for functions of NumPy or `math`, and for an `if`, on numbers that JAX traces."""
    try:
        yield
    except (jax.errors.ConcretizationTypeError, jax.errors.TracerArrayConversionError) as error:
        raise InputError(
            f"{what} must be made of functions of `jax.numpy`: JAX traces it, and NumPy's or `math`'s functions, "
            "`float(x)` and `if x > 0:` want known numbers; write `jnp.cos(x)` and `jnp.where(x > 0, a, b)`."
        ) from error


def require_known(function: str, instead: str, *arguments: object) -> None:
    """Stop where `jax.vmap`, `jax.grad` or `jax.jit` traces a function whose control flow depends on its results.

    **Raises:** `ValueError` that names the function to call `instead`.
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
