"""Lyapunov exponents of well-known systems beside published ones, runs in NumPy, and exact sums."""

import math
from collections.abc import Callable

import jax.numpy as jnp
import numpy as np

from .._types import Scalar, State
from ..integrate import method
from ..models import AbstractForcedSystem, ForcedOscillator, ForcedSystem
from ..sweeps import sweep
from ._comparison import Comparison, beside, within
from ._literature import EXPONENTS, LORENZ, ROESSLER


TRACE = "mean divergence, exact"
EIGENVALUES = "eigenvalues at the fixed point, exact"

ORDER = "largest", "second", "third"

Law = Callable[[Scalar, State, State, Scalar], State]


def _ueda(tau: Scalar, q: State, v: State, speed: Scalar) -> State:
    return (-0.05 * v[0] - q[0] ** 3 + 7.5 * jnp.sin(tau),)


def _duffing(damping: float, force: float) -> Law:
    return lambda tau, q, v, speed: (-damping * v[0] + q[0] - q[0] ** 3 + force * jnp.cos(tau),)


def _pendulum(damping: float, torque: float) -> Law:
    return lambda tau, q, v, speed: (-damping * v[0] - jnp.sin(q[0]) + torque * jnp.cos(tau),)


# Name in the table of numbers: law, drive frequency.
DRIVEN: dict[str, tuple[Law, float]] = {
    "Ueda x'' + .05 x' + x^3 = 7.5 sin t": (_ueda, 1.0),
    "Duffing x'' + .25 x' - x + x^3 = .4 cos t": (_duffing(0.25, 0.4), 1.0),
    "pendulum x'' + .05 x' + sin x = .6 cos .7t": (_pendulum(0.05, 0.6), 0.7),
    "Duffing x'' + .3 x' - x + x^3 = .5 cos 1.2t": (_duffing(0.3, 0.5), 1.2),
    "pendulum x'' + .5 x' + sin x = 1.5 cos 2t/3": (_pendulum(0.5, 1.5), 2 / 3),
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
    """Exponents per unit of time of every start."""
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
    return np.asarray(found.exponents[0]) * speed / (2 * math.pi)


def _around(centre: tuple[float, ...], count: int) -> np.ndarray:
    return np.asarray(centre) + np.random.default_rng(0).uniform(-1, 1, (count, len(centre)))


def _driven() -> list[Comparison]:
    rows = []
    for name, (law, frequency) in DRIVEN.items():
        system, starts = ForcedOscillator(law, coordinates=1), _around((0.0, 0.0), 256)
        found = _exponents(system, frequency, starts, 1, 64, 500, 2000)[:, 0]
        sample = 3 * float(found.std(ddof=1)) / math.sqrt(found.size)
        rows.append(beside(f"{name}, largest exponent", EXPONENTS[name], found.mean(), sample))
    both = _exponents(ForcedOscillator(_ueda, coordinates=1), 1.0, _around((0.0, 0.0), 4), 2, 512, 20, 100)
    rows.append(within("Ueda, sum of the exponents", TRACE, -0.05, both.mean(axis=0).sum(), 1e-6))
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
    found = _exponents(system, 2 * math.pi, _around((5.0, 5.0, 25.0), 64), 3, 256, 50, 500).mean(axis=0)
    calm = ForcedSystem(_lorenz_rates(20.0), dimension=3)
    fixed = math.sqrt(8 / 3 * 19)
    still = _exponents(calm, 2 * math.pi, _around((fixed, fixed, 19.0), 2), 3, 256, 200, 500).mean(axis=0)
    jacobian = np.array([[-10, 10, 0], [1, -1, -fixed], [fixed, fixed, -8 / 3]])
    decay = np.sort(np.linalg.eigvals(jacobian).real)[::-1]
    name = "Lorenz 10, 28, 8/3"
    return [
        *(beside(f"{name}, {n} exponent", theirs, x) for n, theirs, x in zip(ORDER, LORENZ, found, strict=True)),
        within(f"{name}, sum", TRACE, -41 / 3, found.sum(), 1e-4),
        within("Lorenz 10, 20, 8/3, largest exponent", EIGENVALUES, decay[0], still[0], 2e-3),
        within("Lorenz 10, 20, 8/3, third exponent", EIGENVALUES, decay[2], still[2], 2e-3),
    ]


def _roessler() -> list[Comparison]:
    rates = lambda tau, y, speed: (-y[1] - y[2], y[0] + 0.2 * y[1], 0.2 + y[2] * (y[0] - 5.7))
    starts = _around((0.0, -5.0, 0.0), 64)
    found = _exponents(ForcedSystem(rates, dimension=3), 1.0, starts, 3, 512, 20, 400).mean(axis=0)
    name = "Roessler .2, .2, 5.7"
    return [beside(f"{name}, {n} exponent", theirs, x) for n, theirs, x in zip(ORDER, ROESSLER, found, strict=True)]
