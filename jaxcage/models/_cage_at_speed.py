"""The cage's forces at one speed, with everything that does not change during a revolution worked out once."""

from typing import TYPE_CHECKING, Any

import equinox as eqx
import jax.numpy as jnp

from .._types import Scalar, State
from ..forces import (
    AbstractForce,
    AbstractForcing,
    ElasticRib,
    Force,
    Land,
    Motion,
    Rows,
    UnbalanceForce,
    WeightForce,
    effective_eccentricity,
    rib_force,
    weight,
)
from ._user_law import told


if TYPE_CHECKING:
    from ._cage import CageModel


ON_LAND = ("film", "contact", "support")
"""Forces between cage and rib: they react on an elastic one."""
FORCES = (*ON_LAND, "impact", "unbalance", "weight")
"""Forces on every cage, by name; those of one's own come after them, by the names of their classes."""


class CageAtSpeed(eqx.Module):
    """The laws of all forces on a cage at one speed, in SI units, and what they are told of its motion."""

    laws: tuple[AbstractForce, ...]
    names: tuple[str, ...] = eqx.field(static=True)
    land: Land
    mass: Scalar
    speed: Scalar
    shaft_speed: Scalar

    @classmethod
    def of(cls, model: "CageModel", speed: Scalar) -> "CageAtSpeed":
        """Work out the constants of `model` at cage speed `speed` [rad/s]."""
        mass = model.cage_mass
        arm = effective_eccentricity(model.unbalance, model.eccentricity, model.guidance_gap, model.printed_unit)
        laws = (
            model.film.at(model, speed),
            model.contact.at(model, speed),
            model.support.at(model, speed),
            model.impact.at(model, speed),
            UnbalanceForce(mass * arm),
            WeightForce(mass * model.gravity),
            *model.extra,
        )
        names = (*FORCES, *(type(law).__name__ for law in model.extra))
        c, contact = model.clearance, model.contact
        land = Land(c, 1 / c, contact.onset, contact.smoothing / c, model.film.smoothing / c)
        return cls(laws, names, land, mass, speed, model.bearing.shaft_speed(speed))

    def law(self, name: str) -> Any:
        """The law of a force, with its constants."""
        return self.laws[self.names.index(name)]

    def motion(self, tau: Scalar, x: Scalar, y: Scalar, vx: Scalar, vy: Scalar) -> Motion:
        """What the laws see of a cage centre at (x, y) [m] from the rib centre, moving at (vx, vy) [m/s]."""
        return Motion(tau, x, y, vx, vy, self.speed, 0.0, self.shaft_speed, self.land)

    def forces(self, tau: Scalar, x: Scalar, y: Scalar, vx: Scalar, vy: Scalar) -> dict[str, Force]:
        """Every force on the cage by name, as (F_x, F_y, moment) [N, N, N m]."""
        motion = self.motion(tau, x, y, vx, vy)
        return {name: _force(name, law, motion) for name, law in zip(self.names, self.laws, strict=True)}

    @property
    def on_land(self) -> tuple[str, ...]:
        """Names of the forces between land and cage."""
        own = zip(self.names[len(FORCES) :], self.laws[len(FORCES) :], strict=True)
        return (*ON_LAND, *(name for name, law in own if not isinstance(law, AbstractForcing)))

    def slopes(self, x: Scalar, y: Scalar, vx: Scalar, vy: Scalar) -> tuple[Rows, Rows] | None:
        """Derivatives of the whole force with respect to position [N/m] and velocity [N s/m], as rows.

        None where a law leaves it to whoever differentiates. Forces that the phase alone decides have none.
        """
        motion = self.motion(0.0, x, y, vx, vy)
        found = [law.slopes(motion) for law in self.laws]
        known = [each for each in found if each is not None]
        if len(known) < len(found):
            return None
        of_q, of_v = zip(*known, strict=True)
        return _sum(of_q), _sum(of_v)


def _force(name: str, law: AbstractForce, motion: Motion) -> Force:
    """**Raises:** `ValueError` for a law of one's own that returns something else than three numbers."""
    with told(f"Force `{name}`"):
        force = law.force(motion)
    if not isinstance(force, tuple) or [jnp.shape(part) for part in force] != [(), (), ()]:
        raise ValueError(f"Force `{name}` must return (F_x, F_y, moment), three numbers, but returned {force}.")
    return force


def _sum(matrices: tuple[Rows, ...]) -> Rows:
    at = lambda i, j: sum((k[i][j] for k in matrices[1:]), start=matrices[0][i][j])
    return (at(0, 0), at(0, 1)), (at(1, 0), at(1, 1))


def _times(factor: Scalar, k: Rows) -> Rows:
    (xx, xy), (yx, yy) = k
    return (factor * xx, factor * xy), (factor * yx, factor * yy)


class RigidRibLaw(eqx.Module):
    """Acceleration of a cage in a rib that does not move."""

    cage: CageAtSpeed

    def __call__(self, tau: Scalar, q: State, v: State) -> State:
        f = self.cage.forces(tau, *q, *v).values()
        per_mass = 1 / self.cage.mass
        return per_mass * sum(p[0] for p in f), per_mass * sum(p[1] for p in f)

    def slopes(self, q: State, v: State) -> tuple[Rows, Rows] | None:
        """Derivatives with respect to q and v, as rows, where every law gives its own."""
        found = self.cage.slopes(*q, *v)
        per_mass = 1 / self.cage.mass
        return None if found is None else (_times(per_mass, found[0]), _times(per_mass, found[1]))


class ElasticRibLaw(eqx.Module):
    """Acceleration of cage and rib: forces between land and cage act on their difference and react on the rib."""

    cage: CageAtSpeed
    rib: ElasticRib
    gravity: Scalar

    def __call__(self, tau: Scalar, q: State, v: State) -> State:
        (xc, yc, xo, yo), (uc, wc, uo, wo) = q, v
        f = self.cage.forces(tau, xc - xo, yc - yo, uc - uo, wc - wo)
        rib = self.rib
        held = rib_force(xo, yo, uo, wo, rib.stiffness, rib.damping, rib.cubic_stiffness)
        down = weight(rib.mass, self.gravity)
        on_cage = [sum(p[i] for p in f.values()) for i in (0, 1)]
        on_rib = [held[i] + down[i] - sum(f[name][i] for name in self.cage.on_land) for i in (0, 1)]
        return (*(c / self.cage.mass for c in on_cage), *(c / rib.mass for c in on_rib))
