"""Lyapunov exponents of well-known systems beside published ones, and beside exact sums."""

import math
from collections.abc import Callable

import jax.numpy as jnp
import numpy as np

from .._types import Scalar, State
from ..integrate import method
from ..models import AbstractForcedSystem, ForcedOscillator, ForcedSystem
from ..sweeps import sweep
from ._comparison import Comparison, within


SPROTT = "J. C. Sprott, Chaos and Time-Series Analysis (2003), appendix A"
RUNS = "four runs of 20000 periods in numba, RK4 on the variational equations"
TRACE = "mean divergence, exact"
EIGENVALUES = "eigenvalues at the fixed point, exact"

Law = Callable[[Scalar, State, State, Scalar], State]


def _ueda(tau: Scalar, q: State, v: State, speed: Scalar) -> State:
    return (-0.05 * v[0] - q[0] ** 3 + 7.5 * jnp.sin(tau),)


def _duffing(damping: float, force: float) -> Law:
    return lambda tau, q, v, speed: (-damping * v[0] + q[0] - q[0] ** 3 + force * jnp.cos(tau),)


def _pendulum(damping: float, torque: float) -> Law:
    return lambda tau, q, v, speed: (-damping * v[0] - jnp.sin(q[0]) + torque * jnp.cos(tau),)


# Name: law, drive frequency, source, largest exponent per unit of time, tolerance: that of the print or of the runs,
# and three of our own standard errors.
DRIVEN: dict[str, tuple[Law, float, str, float, float]] = {
    "Ueda x'' + .05 x' + x^3 = 7.5 sin t": (_ueda, 1.0, SPROTT, 0.1034, 0.004),
    "Duffing x'' + .25 x' - x + x^3 = .4 cos t": (_duffing(0.25, 0.4), 1.0, SPROTT, 0.157, 0.002),
    "pendulum x'' + .05 x' + sin x = .6 cos .7t": (_pendulum(0.05, 0.6), 0.7, SPROTT, 0.140, 0.002),
    "Duffing x'' + .3 x' - x + x^3 = .5 cos 1.2t": (_duffing(0.3, 0.5), 1.2, RUNS, 0.1056, 0.0015),
    "pendulum x'' + .5 x' + sin x = 1.5 cos 2t/3": (_pendulum(0.5, 1.5), 2 / 3, RUNS, 0.1123, 0.001),
}


def exponent_comparisons() -> list[Comparison]:
    """All comparisons of exponents."""
    return [*_driven(), *_lorenz(), *_roessler()]


def _exponents(
    system: AbstractForcedSystem,
    speed: float,
    starts: np.ndarray,
    count: int,
    steps: int,
    discard: int,
    revolutions: int,
) -> np.ndarray:
    """Mean exponents per unit of time over all starts."""
    found = sweep(
        system,
        np.array([speed]),
        starts=[tuple(map(float, s)) for s in starts],
        discard=discard,
        revolutions=revolutions,
        exponents=count,
        blocks=10,
        keep=1,
        method=method("rodas4", steps=steps),
    )
    return np.asarray(found.exponents[0].mean(axis=0)) * speed / (2 * math.pi)


def _around(centre: tuple[float, ...], count: int) -> np.ndarray:
    return np.asarray(centre) + np.random.default_rng(0).uniform(-1, 1, (count, len(centre)))


def _driven() -> list[Comparison]:
    rows = []
    for name, (law, frequency, source, theirs, tolerance) in DRIVEN.items():
        system, starts = ForcedOscillator(law, coordinates=1), _around((0.0, 0.0), 256)
        found = _exponents(system, frequency, starts, 1, 64, 500, 2000)
        rows.append(within(f"{name}, largest exponent", source, theirs, found[0], tolerance))
    law, damping = _ueda, 0.05
    both = _exponents(ForcedOscillator(law, coordinates=1), 1.0, _around((0.0, 0.0), 4), 2, 512, 20, 100)
    rows.append(within("Ueda, sum of the exponents", TRACE, -damping, both.sum(), 1e-6))
    return rows


def _lorenz_rates(rho: float) -> Callable[[Scalar, State, Scalar], State]:
    return lambda tau, y, speed: (
        10 * (y[1] - y[0]),
        y[0] * (rho - y[2]) - y[1],
        y[0] * y[1] - 8 / 3 * y[2],
    )


def _lorenz() -> list[Comparison]:
    """An autonomous system has no period: a unit of time takes its place."""
    system = ForcedSystem(_lorenz_rates(28.0), dimension=3)
    found = _exponents(system, 2 * math.pi, _around((5.0, 5.0, 25.0), 64), 3, 256, 50, 500)
    calm = ForcedSystem(_lorenz_rates(20.0), dimension=3)
    fixed = math.sqrt(8 / 3 * 19)
    still = _exponents(calm, 2 * math.pi, _around((fixed, fixed, 19.0), 2), 3, 256, 200, 500)
    jacobian = np.array([[-10, 10, 0], [1, -1, -fixed], [fixed, fixed, -8 / 3]])
    decay = np.sort(np.linalg.eigvals(jacobian).real)[::-1]
    name = "Lorenz 10, 28, 8/3"
    return [
        within(f"{name}, largest exponent", SPROTT, 0.9056, found[0], 0.005),
        within(f"{name}, second exponent", SPROTT, 0.0, found[1], 0.002),
        within(f"{name}, third exponent", SPROTT, -14.5723, found[2], 0.007),
        within(f"{name}, sum", TRACE, -41 / 3, found.sum(), 1e-4),
        within("Lorenz 10, 20, 8/3, largest exponent", EIGENVALUES, decay[0], still[0], 2e-3),
        within("Lorenz 10, 20, 8/3, third exponent", EIGENVALUES, decay[2], still[2], 2e-3),
    ]


def _roessler() -> list[Comparison]:
    rates = lambda tau, y, speed: (-y[1] - y[2], y[0] + 0.2 * y[1], 0.2 + y[2] * (y[0] - 5.7))
    found = _exponents(ForcedSystem(rates, dimension=3), 1.0, _around((0.0, -5.0, 0.0), 64), 3, 512, 20, 400)
    name = "Roessler .2, .2, 5.7"
    return [
        within(f"{name}, largest exponent", SPROTT, 0.0714, found[0], 0.002),
        within(f"{name}, second exponent", SPROTT, 0.0, found[1], 0.001),
        within(f"{name}, third exponent", SPROTT, -5.3943, found[2], 0.02),
    ]
