"""The model protocol: a system y' = f(tau, y; speed) that is 2 pi-periodic in its phase tau, and what it reports.

Everything above this layer works on `AbstractForcedSystem`. `CageModel` is a cage in its rib, `BearingModel` a whole
bearing, whose phase is the angle of its cage; `ForcedSystem` and `ForcedOscillator` wrap a user's function.
"""

import abc
import contextlib
import math
from collections.abc import Iterator, Mapping
from typing import Any, ClassVar, NamedTuple

import equinox as eqx
import jax
import numpy as np

from .._arguments import is_concrete
from .._bearing_data import FASTEST
from .._errors import ArgumentError, InputError
from .._pytrees import Scalar, State
from ..quantities import Quantity
from .field import AbstractField


ESCAPE = 2.0
"""Excursion beyond which a trajectory has left the model for good."""
HIGHEST = 1e9
"""Highest speed of any system [rad/s]."""


class StepLimits(NamedTuple):
    """Limits of the steps of machine code, for tolerances from 1e-6 on; smaller ones take more steps."""

    first: float
    """Step that is tried first [rad]."""
    longest: float
    """[rad]."""
    shortest: float
    """Step below which a lane is given up [rad]."""
    most: float
    """Largest number of steps from strobe state to strobe state, or in a sixteenth of a revolution if that is less;
    times `slowness`."""


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

    @property
    def angles(self) -> tuple[int, ...]:
        """Indices of the coordinates that are angles [rad]: a periodic orbit may turn by whole revolutions in them."""
        return ()

    def abrupt(self, y: State, rate: State) -> tuple[Scalar, Scalar] | None:
        """Distance of a state from where the law changes abruptly, at least the width of the change, and the rate at
        which the state approaches it [1/rad] when it changes by `rate`; None for a law without abrupt changes.

        Steps are shortened in proportion to the ratio of the two.
        """
        return None

    run_defaults: ClassVar[Mapping[str, Any]] = {}
    """Settings of a run (`jaxcage.lanes.Run`) that suit the model better than the general ones."""
    speed_text: ClassVar[str] = "speed"
    """Words for the model's speed."""
    steps: ClassVar[StepLimits] = StepLimits(0.05, math.pi / 2, 1e-13, 20_000.0)
    """Limits of the steps; the period of the forcing's highest harmonic has two at least."""
    quantities: ClassVar[tuple[Quantity, ...]] = ()
    """Quantities that the model reports of a run, which follow from `beside` and `watched`."""

    beside: ClassVar[tuple[str, ...]] = ()
    """Names of the quantities that are integrated beside the state; the state does not follow from them."""
    beside_start: ClassVar[tuple[float, ...]] = ()
    """Values of the quantities beside the state at the beginning of a run."""
    watched: ClassVar[tuple[str, ...]] = ("excursion",)
    """Names of the quantities whose largest values are recorded."""
    samples: ClassVar[int] = 1
    """Number of strobe states of a revolution that a sweep records."""

    @property
    def components(self) -> tuple[str, ...]:
        """Names of the state components."""
        return tuple(f"y{i}" for i in range(self.dimension))

    def comparable(self, speed: float) -> float:
        """Phase [rad] over which a run is compared with a more exact one: its error is stated for such a stretch."""
        return 2 * math.pi

    def slowness(self, speed: Scalar) -> Scalar:
        """Factor of the most steps that a lane may take: 1, or more at speeds at which a revolution takes long."""
        return 1.0

    def first_state(self, start: Any) -> tuple[np.ndarray, np.ndarray]:
        """The numbers of an initial state, and those of the quantities beside it at the beginning of a run."""
        return np.array(start, dtype=float), np.array(self.beside_start, dtype=float)

    def turning_speed(self, speed: Scalar) -> Scalar:
        """Speed at which the phase advances, in the mean [rad/s]; the model's own unless its revolutions are others."""
        return speed

    def other_speed(self, speed: Scalar) -> tuple[str, Scalar] | None:
        """Words for a speed that goes with the model's, and its value [rad/s]: a cage's shaft speed."""
        return None

    def centre(self, y: Any) -> tuple[Scalar, Scalar]:
        """Centre of the cage from that of its land, over the clearance, in models that have one."""
        raise NotImplementedError

    def reference(self, speed: Scalar) -> dict[str, Scalar]:
        """Numbers by name that the quantities refer to, such as the cage speed in pure rolling."""
        return {}

    def land_speed(self, speed: Scalar) -> Scalar:
        """Surface speed of the cage at its land [m/s], in models that have one."""
        return 0.0

    def check_speeds(self, speeds: np.ndarray, name: str) -> None:
        """**Raises:** `ValueError`, of the argument `name`, for speeds [rad/s] at which the model makes no sense."""

    @abc.abstractmethod
    def at_speed(self, speed: Scalar) -> AbstractField:
        """The field dy/dtau at `speed` [rad/s], with everything that depends on the speed alone evaluated once."""

    @abc.abstractmethod
    def scale(self, speed: Scalar) -> Any:
        """Characteristic magnitude of each state component: tolerances and tangent vectors are measured in it."""

    @abc.abstractmethod
    def initial_states(self, speed: Scalar) -> tuple[Any, ...]:
        """Initial states a sweep runs from unless told otherwise, the conventional one first."""

    def excursion(self, y: Any) -> Scalar:
        """Distance from the centre of the states for which the model is valid, 1 at their edge; for a cage, eps.

        A trajectory must start at 1 or less, is flagged beyond 1, and fails beyond `ESCAPE`. A system without such an
        edge returns 0, as by default.
        """
        return 0.0


def require_speeds(model: AbstractForcedSystem, speeds: Any, name: str = "speed") -> None:
    """Stop at impossible speeds, and at those at which the model makes no sense.

    **Raises:** `ValueError`.
    """
    if not is_concrete(*jax.tree.leaves(speeds)):
        return
    given = np.asarray(speeds, dtype=float)
    if np.any(bad := ~((given > 0) & (given <= HIGHEST))):
        said = f"must be positive and finite, at most {HIGHEST:g} rad/s, but {given[bad].flat[0]:g} was given."
        raise ArgumentError(name, said=said)
    for speed in (given.max(), given.min()) if given.size else ():
        land = model.land_speed(speed)
        if is_concrete(land) and (fastest := float(np.max(np.asarray(land)))) > FASTEST:
            raise ArgumentError(
                name,
                said=f"must be in rad/s and leave the cage at most {FASTEST:g} m/s at its land, but {speed:g} was "
                f"given, which is {speed * 30 / math.pi:.0f} rpm and makes {fastest:.0f} m/s: `jaxcage.rpm({speed:g})` "
                "makes rad/s of rpm.",
            )
    model.check_speeds(given, name)


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


def require_known(function: str, instead: str, **arguments: object) -> None:
    """Stop where `jax.vmap`, `jax.grad` or `jax.jit` traces a function whose control flow depends on its results.

    **Raises:** `ValueError` that names the function to call `instead`.
    """
    if not is_concrete(*jax.tree.leaves(arguments)):
        raise ArgumentError(
            *arguments,
            said=(
                f"of `{function}` must be known numbers, but are traced by `jax.vmap`, `jax.grad` or `jax.jit`, which "
                f"cannot go over it: {instead}."
            ),
        )


INSTEAD = (
    "many designs are swept in one call by `jaxcage.sweep([design, ...], speeds)`, and derivatives are those of "
    "orbits and edges, by `jaxcage.periodic_orbit` and `jaxcage.sensitivity`"
)
