"""A search by a Gaussian process in a region about the best design, ten designs at a time.

What is known in closed form (the cost) is not guessed: the process is that of the logarithm of the rest. Each batch
holds one optimum of each of ten drawn samples (Thompson sampling), within a region that grows while designs become
better and shrinks while they do not (D. Eriksson et al., Scalable global optimization via local Bayesian optimization,
NeurIPS 2019).
"""

from collections.abc import Callable

import numpy as np
from scipy.linalg import cho_factor, cho_solve, solve_triangular
from scipy.optimize import minimize
from scipy.stats import qmc


FIRST = 20
"""Designs all over the bounds to begin with."""
CANDIDATES = 512
LARGEST, FIRST_SIZE, SMALLEST = 1.0, 0.6, 0.02
"""Sizes of the region, as parts of the bounds' distance."""
PATIENCE = 2
"""Batches in a row after which the region grows or shrinks."""
BESIDE = 100.0
"""Added to what is made small [rpm], so that its logarithm has no cliff."""


def matern(apart: np.ndarray) -> np.ndarray:
    """Correlation at so many lengths (Matern 5/2)."""
    s = np.sqrt(5.0) * apart
    return (1 + s + s * s / 3) * np.exp(-s)


class Process:
    """A Gaussian process with a length for each parameter, fitted by maximum likelihood with mild priors."""

    def __init__(self, x: np.ndarray, y: np.ndarray, guess: np.ndarray | None = None):
        self.x, self.mean, self.size = x, float(np.mean(y)), float(np.std(y)) or 1.0
        self.y = (y - self.mean) / self.size
        self.squares = (x[:, None] - x[None]) ** 2
        n = x.shape[1]
        begin = np.concatenate([np.full(n, np.log(0.7)), [np.log(0.05)]]) if guess is None else guess
        bounds = [(np.log(0.05), np.log(10.0))] * n + [(np.log(1e-4), np.log(1.0))]
        fit = minimize(self._likelihood, begin, jac=True, method="L-BFGS-B", bounds=bounds, options={"maxiter": 20})
        self.hyper = np.asarray(fit.x)
        self.factor = cho_factor(self._covariance(self.hyper)[0], lower=True)
        self.weights = cho_solve(self.factor, self.y)

    @property
    def lengths(self) -> np.ndarray:
        """Of each parameter."""
        return np.exp(self.hyper[:-1])

    def _covariance(self, hyper: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        apart = np.sqrt(self.squares @ np.exp(-2 * hyper[:-1]))
        return matern(apart) + np.exp(hyper[-1]) * np.eye(len(self.x)), apart

    def _likelihood(self, hyper: np.ndarray) -> tuple[float, np.ndarray]:
        """Minus its logarithm and that of the priors, with the slope."""
        k, apart = self._covariance(hyper)
        factor = cho_factor(k, lower=True)
        inverse = cho_solve(factor, np.eye(len(k)))
        a = inverse @ self.y
        s = np.sqrt(5.0) * apart
        pull = 5.0 / 3.0 * (1 + s) * np.exp(-s) * (inverse - np.outer(a, a))  # d matern / d log length over squares
        slope = np.array([0.5 * np.sum(pull * self.squares[..., i]) * np.exp(-2 * h) for i, h in enumerate(hyper[:-1])])
        noise = 0.5 * np.exp(hyper[-1]) * (np.trace(inverse) - a @ a)
        away = hyper - np.concatenate([np.full(len(hyper) - 1, np.log(0.7)), [np.log(0.05)]])
        value = 0.5 * self.y @ a + np.sum(np.log(np.diag(factor[0]))) + 0.5 * np.sum(away**2)
        return float(value), np.append(slope, noise) + away

    def draw(self, at: np.ndarray, count: int, rng: np.random.Generator) -> np.ndarray:
        """Samples at places, without noise."""
        between = lambda a, b: matern(np.sqrt(((a[:, None] - b[None]) ** 2) @ np.exp(-2 * self.hyper[:-1])))
        across = between(at, self.x)
        v = solve_triangular(self.factor[0], across.T, lower=True)
        spread = between(at, at) - v.T @ v + 1e-8 * np.eye(len(at))
        root = np.linalg.cholesky(spread + 1e-6 * np.eye(len(at)))
        drawn = across @ self.weights + (root @ rng.standard_normal((len(at), count))).T
        return self.mean + self.size * drawn


class ModelSearch:
    """Asked for places and told what was found there."""

    def __init__(self, n: int, begin: np.ndarray, seed: int):
        self.rng, self.n = np.random.default_rng(seed), n
        self.x, self.y, self.total = np.empty((0, n)), np.empty(0), np.empty(0)
        self.first = qmc.Sobol(n, rng=seed).random_base2(5)[:FIRST]
        self.first[0] = begin
        self.size, self.better, self.worse, self.hyper = FIRST_SIZE, 0, 0, None

    def ask(self, count: int, known: Callable[[np.ndarray], np.ndarray]) -> np.ndarray:
        """Places of the next designs; `known` is what of them is known in closed form."""
        if len(self.x) < FIRST:
            return self.first[len(self.x) : len(self.x) + count]
        process = Process(self.x, np.log(self.y + BESIDE), self.hyper)
        self.hyper = process.hyper
        middle = self.x[np.argmin(self.total)]
        shape = process.lengths / np.exp(np.mean(np.log(process.lengths)))
        half = 0.5 * self.size * np.clip(shape, 0.3, 3.0)
        low, high = np.clip(middle - half, 0, 1), np.clip(middle + half, 0, 1)
        spread = qmc.Sobol(self.n, rng=self.rng).random(CANDIDATES)
        places = low + spread * (high - low)
        moved = self.rng.random(places.shape) < max(0.5, 1 / self.n)  # the others stay as in the best design
        moved[np.arange(CANDIDATES), self.rng.integers(0, self.n, CANDIDATES)] = True
        places = np.where(moved, places, middle)
        samples = np.exp(process.draw(places, count, self.rng)) + known(places)
        chosen: list[int] = []
        for row in samples:
            row[chosen] = np.inf
            chosen.append(int(np.argmin(row)))
        return places[chosen]

    def tell(self, places: np.ndarray, values: np.ndarray, known: Callable[[np.ndarray], np.ndarray]) -> None:
        """What was found, less what is known in closed form."""
        total = values + known(places)
        if len(self.x) >= FIRST:
            won = np.min(total) < np.min(self.total) - 1e-3 * abs(np.min(self.total))
            self.better, self.worse = (self.better + 1, 0) if won else (0, self.worse + 1)
            if self.better >= PATIENCE:
                self.size, self.better = min(2 * self.size, LARGEST), 0
            if self.worse >= PATIENCE:
                self.size, self.worse = self.size / 2, 0
            if self.size < SMALLEST:
                self.size = FIRST_SIZE
        self.x, self.y = np.vstack([self.x, places]), np.append(self.y, np.maximum(values, 0.0))
        self.total = np.append(self.total, total)
