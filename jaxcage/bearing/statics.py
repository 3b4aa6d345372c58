"""Distribution of the load over the rollers, and where the cage rests: paper eqs. (1), (2), (5), (6), (10)."""

from functools import partial

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import optimistix as optx
from jaxtyping import Array, Float

from .._arguments import is_concrete, require_x64
from .._errors import ArgumentError
from .._pytrees import Scalar
from .geometry import Bearing
from .line_contact import line_contact_approach, line_contact_load, raceway_loads_of_all


LARGEST = 1e12
"""Largest load that is accepted [N]."""
DEFAULT_SHAFT_LOAD = 4450.0
"""Shaft load F [N]; the paper does not print it."""


class LoadDistribution(eqx.Module):
    """Loads of the rollers and the shift of the shaft that brings them about."""

    roller_angles: Float[Array, " rollers"]
    """Angle of each roller from +x, counter-clockwise; the load points to -pi/2 [rad]."""
    inner_loads: Float[Array, " rollers"]
    """Load Q_i on the inner raceway [N]."""
    outer_loads: Float[Array, " rollers"]
    """Load Q_o = Q_i + F_cen on the outer raceway, (10) [N]."""
    max_load: Float[Array, ""]
    """Q_max, the largest load on the inner raceway [N]."""
    shaft_shift: Float[Array, ""]
    """delta_s, how far the shaft goes down from the centre [m]."""
    elastic_approach: Float[Array, ""]
    """delta_r, approach of the raceways at the most loaded roller [m].

    With that roller at the bottom it is delta_s - G_r/2. It holds the centrifugal part, (10).
    """
    half_angle: Float[Array, ""]
    """Half angle of the loaded zone, at whose ends a roller just touches the inner raceway [rad].

    acos(G_r/(2 delta_s)), the clean form of (2): the paper prints this as the whole angle and with delta_r, the elastic
    approach, in place of the shift of the shaft delta_s = delta_r + G_r/2. To G_r is added twice the approach of the
    rollers to the outer raceway that their centrifugal force makes, as it shrinks the zone. It is pi where a preload
    keeps all rollers loaded.
    """


def static_cage_displacements(bearing: Bearing, guidance_gap: Scalar, elastic_approach: Scalar) -> dict[str, Scalar]:
    """Distance of the resting cage below the bearing centre, by the ring that guides it [m].

    (1) outer rib C_r/2, (5) inner rib delta_r + G_r/2 + C_r/2, (6) roller delta_r + G_r/2 + T.

    **Arguments:** the bearing, the gap C_r, and delta_r [m], the elastic approach at the most loaded roller: delta_r +
    G_r/2 is the shift of the shaft.
    """
    shift = elastic_approach + bearing.radial_clearance / 2
    at_rest = guidance_gap / 2
    return {"outer_rib": at_rest, "inner_rib": shift + at_rest, "roller": shift + bearing.pocket_clearance}


def _half_angle(play: Array, shift: Array) -> Array:
    """acos(play/shift), and pi where a preload keeps all rollers loaded."""
    around = play + jnp.abs(shift) <= 0
    return jnp.where(around, jnp.pi, jnp.arccos(play / jnp.where(around, jnp.inf, shift)))


@eqx.filter_jit
def _distribution(bearing: Bearing, load: Array, centrifugal: Array, first_angle: Array) -> LoadDistribution:
    """The distribution, of which shift and half angle are NaN where the loads make no sense.

    The unknown is the excess of the nearest roller: its approach beyond the `seat` into which its centrifugal force
    presses it. The forces rise steadily but have kinks: the root is found by bisection and differentiated implicitly.
    At zero excess no roller carries upwards and at the bound that one carries more than the load, so that the root is
    enclosed. Under preload that excess is larger by the distance over which the opposite rollers come free, twice over.
    """
    angles = first_angle + 2 * jnp.pi / bearing.n_rollers * jnp.arange(bearing.n_rollers, dtype=float)
    stiffness, cosines = bearing.raceway_stiffness, -jnp.sin(angles)
    nearest = jnp.max(cosines)
    approach = partial(line_contact_approach, stiffness)
    seat = approach(centrifugal)
    play = bearing.radial_clearance / 2 + seat
    bound = 1.01 * (approach(load / nearest) + approach(load / nearest + centrifugal) - seat)
    bound, squeeze = bound + 2 * jnp.maximum(-play, 0.0), bearing.n_rollers * line_contact_load(stiffness, -play)

    def loads(excess: Array) -> tuple[Array, Array]:
        ratio = cosines / nearest  # delta_s cos(psi) - G_r/2 without cancellation at the nearest roller
        return raceway_loads_of_all(seat + excess * ratio - play * (1 - ratio), stiffness, centrifugal)

    def imbalance(fraction: Array, _: None) -> Array:
        return (jnp.sum(loads(fraction * bound)[0] * cosines) - load) / (load + squeeze)

    # Without `throw`, which would put a callback to Python into every program and keep it from being cached on disk.
    solver, options = optx.Bisection(rtol=1e-12, atol=1e-11, flip=False), dict(lower=0.0, upper=1.0)
    root = optx.root_find(imbalance, solver, jnp.asarray(0.5), None, options=options, max_steps=128, throw=False)
    found = (root.result == optx.RESULTS.successful) & (load > 0) & (centrifugal >= 0)
    excess = jnp.where(found, root.value * bound, jnp.nan)
    inner, outer = loads(excess)
    shift = (excess + play) / nearest
    return LoadDistribution(
        roller_angles=angles,
        inner_loads=inner,
        outer_loads=outer,
        max_load=jnp.max(inner),
        shaft_shift=shift,
        elastic_approach=seat + excess,
        half_angle=_half_angle(play, shift),
    )


def load_distribution(
    bearing: Bearing,
    load: Scalar = DEFAULT_SHAFT_LOAD,
    centrifugal_force: Scalar = 0.0,
    roller_angle: Scalar = -jnp.pi / 2,
) -> LoadDistribution:
    """Loads of all rollers under a shaft load that points down, by (3), (4) and (10).

    The shaft shifts along the load by delta_s until the vertical forces of the discrete rollers carry it. The result is
    differentiable with respect to every parameter through the implicit function theorem. With a roller at the bottom,
    or half a pitch from it, the horizontal forces cancel; at other angles the small remainder is left to the shaft.

    **Arguments:** the bearing; the load [N]; the centrifugal force of a roller [N], see
    `Bearing.roller_centrifugal_force`; the angle of the first roller from +x [rad], by default at the bottom.

    **Raises:** `ValueError` for a load that is not positive, or a negative centrifugal force. Where these are traced,
    the shift of the shaft and the half angle are NaN instead.
    """
    require_x64()
    arrays = (jnp.asarray(x, dtype=float) for x in (load, centrifugal_force, roller_angle))
    known = is_concrete(load, centrifugal_force)
    force, outward = (float(load), float(centrifugal_force)) if known else (1.0, 0.0)
    if not 0 < force <= LARGEST:
        raise ArgumentError("load", said=f"must be positive and at most {LARGEST:g} N, but {force:g} was given.")
    if not 0 <= outward <= LARGEST:
        said = f"must be from 0 to {LARGEST:g} N, but {outward:g} was given."
        raise ArgumentError("centrifugal_force", said=said)
    found = _distribution(bearing, *arrays)
    if known and is_concrete(found.shaft_shift) and np.isnan(found.shaft_shift):
        said = f"must be of sizes that can be added, but {force:g} and {outward:g} N were given."
        raise ArgumentError("load", "centrifugal_force", said=said)
    return found
