"""Impact of a roller on a cage bar: the two-mass oscillator (14) and its force history (fig. 5).

    M_w d_w'' + K_cw (d_w - d_c)_+^(10/9) = 0
    M_c d_c'' + K_c d_c - K_cw (d_w - d_c)_+^(10/9) = 0
started with the roller approaching at v_0. The paper prints d_w'' in the second line and gives no constants.
"""

from typing import Any

import diffrax as dfx
import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from .._arguments import require_at_least
from .._parameters import parameter
from .._types import Scalar
from ._smooth import power_10_9


class PocketImpact(eqx.Module):
    """Constants of the roller-bar oscillator; none is printed in the paper."""

    contact_stiffness: Scalar = parameter(
        "N/m^(10/9)",
        1e4,
        1e13,
        "roller-bar line-contact stiffness K_cw",
        within=(2e7, 2e9),
        source="press a roller on a bar: force over approach",
        default=2e8,
    )
    bar_stiffness: Scalar = parameter(
        "N/m",
        1e3,
        1e10,
        "bending stiffness of a cage bar K_c",
        within=(2.5e5, 2.5e7),
        source="bend a bar, or a finite-element model of the cage",
        default=2.5e6,
    )
    bar_mass: Scalar = parameter(
        "kg",
        1e-5,
        1.0,
        "effective mass of a cage bar M_c",
        within=(1e-3, 1.6e-2),
        source="a modal test of a bar, or a finite-element model of the cage",
        default=4e-3,
    )
    approach_ratio: Scalar = parameter(
        "1",
        1e-3,
        10.0,
        "kappa in v_0 = kappa omega T, T the pocket clearance",
        within=(0.1, 1.0),
        source="cage speed over roller speed in the pocket, by high-speed film",
        default=0.45,
    )


class ImpactHistory(eqx.Module):
    """Forces and motion of one impact on a uniform time grid."""

    time: Float[Array, " samples"]  # [s]
    contact_force: Float[Array, " samples"]  # Q_cw [N], never negative
    bar_force: Float[Array, " samples"]  # K_c d_c [N], negative when the bar swings back
    roller_position: Float[Array, " samples"]  # d_w [m]
    bar_position: Float[Array, " samples"]  # d_c [m]
    roller_velocity: Float[Array, " samples"]  # [m/s]
    bar_velocity: Float[Array, " samples"]  # [m/s]

    @property
    def impulse(self) -> Array:
        """Integral of the contact force over the history [N s]."""
        return jnp.trapezoid(self.contact_force, self.time)


def approach_speed(approach_ratio: Scalar, omega: Scalar, pocket_clearance: Scalar) -> Array:
    """v_0 = kappa omega T [m/s]: ties the impact to the pocket clearance, as the paper's conclusion 2 says."""
    return jnp.asarray(approach_ratio * omega * pocket_clearance)


def impact_time_scale(impact: PocketImpact, roller_mass: Scalar, v0: Scalar) -> Array:
    """Time [s] in which the contact and the bar take up the roller: their Hertzian and harmonic times in series."""
    depth = (19 / 18 * roller_mass * v0**2 / impact.contact_stiffness) ** (9 / 19)
    return jnp.sqrt((depth / v0) ** 2 + roller_mass / impact.bar_stiffness)


def _contact(y: tuple[Array, ...], impact: PocketImpact) -> Array:
    d_w, d_c, *_ = y
    return impact.contact_stiffness * power_10_9(jnp.maximum(d_w - d_c, 0.0))


def _rates(s: Any, y: Any, args: Any) -> tuple[Array, ...]:
    del s
    impact, roller_mass, scale = args
    _, d_c, u_w, u_c = y
    q = _contact(y, impact)
    return tuple(
        scale * rate for rate in (u_w, u_c, -q / roller_mass, (q - impact.bar_stiffness * d_c) / impact.bar_mass)
    )


def impact_history(
    impact: PocketImpact, roller_mass: Scalar, v0: Scalar, duration: Scalar, samples: int = 512, substeps: int = 4
) -> ImpactHistory:
    """Solve (14) from the touch of a roller that approaches at `v0`.

    **Arguments:** oscillator; roller mass [kg]; approach speed [m/s]; duration [s]; number of samples on a uniform grid
    and of Tsit5 steps between two samples.

    **Returns:** `ImpactHistory`.
    """
    require_at_least(1, samples=samples, substeps=substeps)
    y0 = (jnp.zeros_like(v0), jnp.zeros_like(v0), jnp.asarray(v0), jnp.zeros_like(v0))
    grid = jnp.linspace(0.0, 1.0, samples)
    solution = dfx.diffeqsolve(
        dfx.ODETerm(_rates),
        dfx.Tsit5(),
        t0=0.0,
        t1=1.0,
        dt0=1 / ((samples - 1) * substeps),
        y0=y0,
        args=(impact, roller_mass, duration),
        saveat=dfx.SaveAt(ts=grid),
        stepsize_controller=dfx.ConstantStepSize(),
        adjoint=dfx.DirectAdjoint(),
        max_steps=(samples - 1) * substeps + 2,
    )
    assert solution.ys is not None
    d_w, d_c, u_w, u_c = solution.ys
    q = jax.vmap(lambda *y: _contact(y, impact))(*solution.ys)
    return ImpactHistory(grid * duration, q, impact.bar_stiffness * d_c, d_w, d_c, u_w, u_c)
