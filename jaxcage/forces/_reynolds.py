"""Oil film of one land of finite width: the Reynolds equation (25) with its axial term and a cavitation condition.

In the units of the short film (`_film`: clearance c, direction n, thickness H = 1 - r.n, drive P) and with
eta = 2 z/L across the land, the pressure p in units of mu (L/2c)^2 satisfies
    lambda^2 d/dtheta (H^3 dp/dtheta) + H^3 d^2p/deta^2 = -6 P.n,   p = 0 at eta = -1 and 1,
with the slenderness lambda = L/(2R), width over diameter. Without the first term it is the short film.

Across the land the pressure is a sum of a few even polynomials (`_axial`). Around it there are finite volumes on
stations that follow the cage: theta is the Moebius transform of a uniform angle gamma that takes 0 to the centre,
exp(i theta) = (w + a)/(1 + a* w), w = exp(i gamma), a = r/(1 + sqrt(1 - r^2)), complex in the plane. Along the line of
centres this is Sommerfeld's substitution: stations crowd where the gap is small, in proportion to it, and the pressure
stays a smooth function of gamma up to contact. Being smooth in r at the centre too, it needs no direction there.

Cavitation:
- `reynolds`: p >= 0, and where p > 0 the equation holds: film breaks off with p = dp/dn = 0 (Swift-Stieber). It is a
  linear complementarity problem, solved by an active set (`_wet`): exact at the nodes, where a penalty would leave a
  length to choose, and finished in a few linear solves, where projected relaxation takes hundreds of sweeps.
- `guembel`: the linear solution, cut off where it is negative (half Sommerfeld): no equation holds at the edge.
- `full`: the linear solution, of both signs.
None of them keeps account of the oil in the empty arc. With `reynolds` the film also sets in with p = dp/dn = 0, a
little ahead of the widest gap; held at zero pressure there (`grooves`), it is the bearing of Raimondi and Boyd.

Derivatives hold the set of pressurised nodes fixed: at its edge p = 0, so that moving the edge changes the force in
second order only. The force is continuous; its derivatives jump, by a share of the order of a cell, where a node
changes sides. Errors are of second order in the cell around the rib, and fall by ten and more with every function
across; with `reynolds` and `guembel` they scatter within that order, as the edge lies between nodes.
"""

from typing import Literal, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float

from .._arguments import require_above_zero, require_at_least
from .._errors import ArgumentError
from .._types import Scalar
from ._axial import axial_profiles
from ._ring import solve_ring


Cavitation = Literal["reynolds", "guembel", "full"]
Nodes = Float[Array, "stations k"]

STATIONS = 64
"""Stations around the rib."""
PROFILES = 1
"""Functions across the land."""


class Stations(NamedTuple):
    """Places around the rib, each the middle of a cell."""

    nx: Float[Array, " stations"]
    ny: Float[Array, " stations"]
    stretch: Float[Array, " stations"]
    """d theta/d gamma"""
    thickness: Float[Array, " stations"]
    """H"""


def _stations(x: Scalar, y: Scalar, gamma: np.ndarray, follow: bool) -> Stations:
    wx, wy = jnp.asarray(np.cos(gamma)), jnp.asarray(np.sin(gamma))
    if not follow:
        return Stations(wx, wy, jnp.ones_like(wx), 1 - x * wx - y * wy)
    inside = 1 - (x * x + y * y)
    share = 1 / (1 + jnp.sqrt(inside))
    ax, ay = x * share, y * share
    real, imaginary = 1 + ax * wx + ay * wy, ax * wy - ay * wx  # of 1 + a* w
    per_square = 1 / (real**2 + imaginary**2)
    nx = ((wx + ax) * real + (wy + ay) * imaginary) * per_square
    ny = ((wy + ay) * real - (wx + ax) * imaginary) * per_square
    return Stations(nx, ny, (1 - ax * ax - ay * ay) * per_square, inside / (1 + x * wx + y * wy))


class _System(NamedTuple):
    """The discretised equation: blocks of the matrix, right-hand side."""

    lower: Float[Array, "stations k k"]
    middle: Float[Array, "stations k k"]
    upper: Float[Array, "stations k k"]
    source: Nodes

    def solve(self, wet: Bool[Array, "stations k"]) -> Nodes:
        """The pressure where `wet`, zero elsewhere."""
        rows = wet[..., None]
        middle = jnp.where(rows, self.middle, jnp.eye(self.middle.shape[-1])[None])
        lower, upper = (jnp.where(rows, b, 0.0) for b in (self.lower, self.upper))
        return solve_ring(lower, middle, upper, jnp.where(wet, self.source, 0.0)[..., None])[..., 0]

    def excess(self, p: Nodes) -> Nodes:
        """Matrix times pressure less the source: zero where the equation holds."""
        times = lambda a, b: jnp.sum(a * b[:, None, :], axis=-1)
        around = times(self.lower, jnp.roll(p, 1, axis=0)) + times(self.upper, jnp.roll(p, -1, axis=0))
        return around + times(self.middle, p) - self.source


def _wet(system: _System, held: Bool[Array, " stations"]) -> tuple[Bool[Array, "stations k"], Bool[Array, ""]]:
    """The nodes that carry pressure, by a primal-dual active set, and whether it was found.

    It starts from the short film's, where the source is positive, which for narrow lands is all but the answer: one to
    four solves, against one for each station that the edge moves by in wide ones.
    """
    most = 2 * system.source.shape[0]
    free = ~held[:, None] & jnp.ones_like(system.source, bool)
    little = 1e-13 * jnp.max(jnp.abs(system.source))

    def change(state: tuple) -> tuple:
        wet, _, count = state
        p = system.solve(wet)
        weight = jnp.diagonal(system.middle, axis1=1, axis2=2)
        after = jnp.where(wet, p * weight >= -little, system.excess(p) < -little) & free
        return after, jnp.all(after == wet), count + 1

    start = (system.source > 0) & free, jnp.asarray(False), jnp.asarray(0)
    wet, found, _ = jax.lax.while_loop(lambda s: ~s[1] & (s[2] < most), change, start)
    return wet, found


class FilmPressure(NamedTuple):
    """The pressure of a film at stations around the rib and points across half its land."""

    stations: Stations
    cell: float
    """Width of a cell in gamma [rad]."""
    eta: Float[np.ndarray, " k"]
    pressure: Nodes
    """In units of mu (L/2c)^2 [Pa s], times 1/s; NaN where no active set was found."""


def film_pressure_field(
    x: Scalar,
    y: Scalar,
    px: Scalar,
    py: Scalar,
    slenderness: Scalar,
    *,
    cavitation: Cavitation = "reynolds",
    stations: int = STATIONS,
    profiles: int = PROFILES,
    grooves: Bool[np.ndarray, " stations"] | None = None,
) -> FilmPressure:
    """The pressure of a land of finite width.

    **Arguments:** position over clearance and drive P [1/s] as in `film_drive`; width over diameter; cavitation
    condition; number of stations around (2^j times a small odd number) and of functions across; stations held at zero
    pressure by axial grooves: if given, stations do not follow the cage but lie at the angles 2 pi i/stations from x.

    **Raises:** `ValueError` for fewer than 8 stations.
    """
    require_above_zero(slenderness=slenderness)
    require_at_least(1, stations=stations, profiles=profiles)
    if stations < 8:
        raise ArgumentError("stations", said=f"must be at least 8, but {stations} was given.")
    cell, axial, follow = 2 * np.pi / stations, axial_profiles(profiles), grooves is None
    at = _stations(x, y, cell * np.arange(stations), follow)
    face = _stations(x, y, cell * (np.arange(stations) + 0.5), follow)
    around = slenderness**2 * face.thickness**3 / face.stretch / cell**2
    mass, stiffness = jnp.diag(jnp.asarray(axial.mass)), jnp.asarray(axial.stiffness)
    blocks = lambda station, matrix: station[:, None, None] * matrix[None]
    after, before = around, jnp.roll(around, 1)
    source = 6 * at.stretch * (px * at.nx + py * at.ny)
    system = _System(
        blocks(-before, mass),
        blocks(after + before, mass) + blocks(at.stretch * at.thickness**3, stiffness),
        blocks(-after, mass),
        jnp.outer(source, jnp.asarray(axial.integral)),
    )
    held = jnp.zeros(stations, bool) if grooves is None else jnp.asarray(grooves)
    if cavitation == "reynolds":
        wet, found = _wet(jax.tree.map(jax.lax.stop_gradient, system), held)
        pressure = jnp.where(found, system.solve(wet), jnp.nan)
    else:
        pressure = system.solve(~held[:, None] & jnp.ones_like(system.source, bool))
        pressure = jnp.maximum(pressure, 0.0) if cavitation == "guembel" else pressure
    return FilmPressure(at, cell, axial.eta, pressure)


def pressure_force(field: FilmPressure) -> tuple[Array, Array]:
    """The force of a pressure field on the cage, in units of S = mu R L^3/c^2, times 1/s."""
    at = field.stations
    mean = field.pressure @ jnp.asarray(axial_profiles(field.eta.size).integral)
    push = -0.25 * field.cell * at.stretch * mean
    return jnp.sum(push * at.nx), jnp.sum(push * at.ny)
