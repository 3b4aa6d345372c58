"""The contact law beside what its restitution promises and beside the closed forms of an elastic impact."""

import math

import jax
import jax.numpy as jnp
import numpy as np
from scipy.integrate import solve_ivp
from scipy.special import gamma

from ..forces import contact_force, restitution_damping
from ._comparison import Comparison, within, within_share


HUNT_CROSSLEY = (
    "K. H. Hunt and F. R. E. Crossley, J. Appl. Mech. 42 (1975) 440, force law; the restitution asked for, as SciPy's "
    "DOP853 measures it on our force"
)
SMALL = "K. H. Hunt and F. R. E. Crossley (1975), chi = 3 (1 - e)/2 for e near 1"
IMPACT = "energy of an elastic impact with force K p^(10/9), closed form"

MASS, STIFFNESS, SPEED = 0.2, 3e8, 0.1
EXPONENT = 10 / 9


def contact_comparisons() -> list[Comparison]:
    """All comparisons of the contact."""
    rows = []
    for restitution in (0.9, 0.7, 0.5, 0.3):
        speed, _, _ = _impact(restitution)
        rows.append(within(f"restitution, {restitution} asked for", HUNT_CROSSLEY, restitution, speed, 1e-5))
    near = restitution_damping(0.9999) / 1.5e-4
    rows.append(within("damping number over 3 (1 - e)/2 at e = 0.9999", SMALL, 1.0, near, 2e-4))
    speed, depth, duration = _impact(1.0)
    deepest = ((EXPONENT + 1) * MASS * SPEED**2 / (2 * STIFFNESS)) ** (1 / (EXPONENT + 1))
    share = 1 / (EXPONENT + 1)
    lasting = 2 * deepest / SPEED * math.sqrt(math.pi) * gamma(1 + share) / gamma(0.5 + share)
    return [
        *rows,
        within("restitution of an elastic impact", IMPACT, 1.0, speed, 1e-6),
        within_share("greatest depth [um]", IMPACT, 1e6 * deepest, 1e6 * depth, 1e-6),
        within_share("duration [us]", IMPACT, 1e6 * lasting, 1e6 * duration, 1e-6),
    ]


def _impact(restitution: float) -> tuple[float, float, float]:
    """Speed after over speed before, greatest depth [m] and duration [s] of an impact on our contact force."""
    chi = float(restitution_damping(restitution))
    normal = jax.jit(lambda p, v: contact_force(p, v, STIFFNESS, chi / SPEED))
    depth = (MASS * SPEED**2 / STIFFNESS) ** (1 / (EXPONENT + 1))

    def rates(_: float, y: np.ndarray | list[float]) -> list[float]:
        return [float(y[1]), -float(normal(jnp.asarray(max(y[0], 0.0)), jnp.asarray(y[1]))) / MASS]

    def out(_: float, y: np.ndarray | list[float]) -> float:
        return float(y[0])

    def deepest(_: float, y: np.ndarray | list[float]) -> float:
        return float(y[1])

    out.terminal, out.direction = True, -1  # pyright: ignore[reportFunctionMemberAccess]
    span, floor = (0.0, 200 * depth / SPEED), [1e-11 * depth, 1e-11 * SPEED]
    done = solve_ivp(rates, span, [0.0, SPEED], method="DOP853", events=[out, deepest], rtol=1e-10, atol=floor)
    return -done.y[1, -1] / SPEED, float(done.y_events[1][0][0]), float(done.t[-1])
