"""Oscillators whose special points are planted: known in closed form.

They come in four kinds. `Curve`: about a driven orbit x' = f(x, p), so that the orbits of the system are
the zeros of f. `Turning`: two planes that turn about a driven orbit, one by half a turn a revolution, with multipliers
+-exp((g(p) +- r) T). `Kicked`: a map in disguise, its variables held while the copies relax to their image, then the
other way about, so that the strobe map is known exactly. `Comb`: many copies of one curve close together, all of them
orbits, on one of which a branch must stay.
"""

import dataclasses
import math
from collections.abc import Callable
from typing import Any

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array
from scipy.optimize import root

import jaxcage as jc


@dataclasses.dataclass(frozen=True)
class Point:
    """A special point: its place, and how well that is known."""

    kind: str
    value: float
    tolerance: float = 1e-12


@dataclasses.dataclass(frozen=True)
class Planted:
    """A branch to be followed, and what is on it."""

    name: str
    system: jc.models.AbstractForcedSystem
    state: tuple[float, ...]
    value: float
    lower: float
    upper: float
    points: tuple[Point, ...] = ()
    whole: bool = True
    """Whether there are no others."""
    parameter: str = "p"
    speed: float = 1.1
    periods: int = 1
    spin: int = 0
    """Revolutions of the simulation that leads from the state to the first orbit."""
    lane: Callable[[np.ndarray, np.ndarray], np.ndarray] | None = None
    """A number, by values and states, that is the same all along the branch and another one beside it."""


def numbers(**values: Any) -> dict[str, Array]:
    """Parameters that can be varied."""
    return {name: jnp.asarray(x, dtype=float) for name, x in values.items()}


class Curve(eqx.Module):
    """x = X + cos(tau) with X' = sum of c[i, j] X^i p^j."""

    p: Array
    c: Array

    def __call__(self, tau, y, speed):
        x = y[0] - jnp.cos(tau)
        row = self.c @ jnp.stack([jnp.ones_like(self.p), self.p, self.p**2])
        return (row[0] + x * (row[1] + x * (row[2] + x * row[3])) - speed * jnp.sin(tau),)


def solved(f: Callable[[np.ndarray], np.ndarray], guess: Any) -> np.ndarray:
    """A root, as closely as it can be had."""
    return np.asarray(root(f, guess, options={"xtol": 1e-13}).x)


def curve(
    name: str, terms: dict[tuple[int, int], float], x: float, p: float, *points: Point, ends=(-1.0, 1.0), lane=None
) -> Planted:
    """Zeros of a polynomial, from (x, p)."""
    c = np.zeros((4, 3))
    for place, value in terms.items():
        c[place] = value
    system = jc.ForcedSystem(Curve(**numbers(p=p, c=c)), dimension=1)
    about = None if lane is None else lambda value, state: lane(value, state[:, 0] - 1)
    return Planted(name, system, (1 + x,), p, ends[0], ends[1], points, lane=about)


def folds(apart: float) -> Planted:
    """p + a X - X^3 turns at +-2 (a/3)^(3/2), so far apart."""
    third = (apart / 4) ** (2 / 3)
    at = 2 * third**1.5
    points = Point("fold", -at), Point("fold", at)
    return curve(
        f"two folds {apart:.0e} apart", {(0, 1): 1, (1, 0): 3 * third, (3, 0): -1}, -1.0, third * 3 - 1, *points
    )


def imperfect(gap: float, side: int) -> Planted:
    """gap + p X - X^3: what a pitchfork becomes; one branch passes, the other turns."""
    turns = () if side > 0 else (Point("fold", 3 * (gap / 2) ** (2 / 3)),)
    x = float(solved(lambda x: gap + 0.5 * x - x**3, [side * math.sqrt(0.5)])[0])
    name = f"imperfect pitchfork {gap:.0e}, {'past' if side > 0 else 'turning'}"
    terms = {(0, 0): gap, (1, 1): 1.0, (3, 0): -1.0}
    return curve(name, terms, x, 0.5, *turns, lane=lambda p, x: np.sign(x))


def crossing(gap: float, side: int) -> Planted:
    """(X - p) (X - p/5) = +-gap^2: two lines that cross, or nearly."""
    terms = {(2, 0): -1.0, (1, 1): 1.2, (0, 2): -0.2, (0, 0): side * gap**2}
    if not gap:
        return curve("two lines crossing", terms, 0.5, 0.5, Point("branch-point", 0.0))
    x = 0.3 + math.sqrt(0.04 + side * gap**2)
    name = f"two lines {gap:.0e} apart, {'passing' if side > 0 else 'turning'}"
    points = () if side > 0 else (Point("fold", 2.5 * gap),)
    lane = (lambda p, x: np.sign(x - 0.6 * p)) if side > 0 else (lambda p, x: np.sign(p))
    return curve(name, terms, x, 0.5, *points, lane=lane)


def ring(radius: float) -> Planted:
    """p^2 + X^2 = r^2."""
    points = Point("fold", -radius), Point("fold", radius)
    terms = {(0, 0): -(radius**2), (0, 2): 1.0, (2, 0): 1.0}
    return curve(f"isola of radius {radius:g}", terms, -radius, 0.0, *points)


class Comb(eqx.Module):
    """x = X + cos(tau), X' = -sin(pi (X - h) / apart) apart / pi, h = tanh(20 p) / 2: orbits at X = h + n apart."""

    p: Array
    apart: Array

    def __call__(self, tau, y, speed):
        x = (y[0] - jnp.cos(tau) - jnp.tanh(20 * self.p) / 2) * jnp.pi / self.apart
        return (-jnp.sin(x) * self.apart / jnp.pi - speed * jnp.sin(tau),)


def comb(apart: float) -> Planted:
    """No special points, and a branch that must not jump."""
    system = jc.ForcedSystem(Comb(**numbers(p=-0.9, apart=apart)), dimension=1)
    lane = lambda value, state: np.round((state[:, 0] - 1 - np.tanh(20 * value) / 2) / apart)
    return Planted(f"branches {apart:.0e} from each other", system, (0.5,), -0.9, -1.0, 1.0, lane=lane)


class Turning(eqx.Module):
    """Two planes about driven orbits, the second turning by half a turn a revolution; in plane i the pair grows with
    g_i +- sqrt(s_i^2 - b_i^2), g_i = a_i + c_i p + e_i p^2, and with -k_i of the cube."""

    p: Array
    a: Array
    c: Array
    e: Array
    s: Array
    b: Array
    k: Array

    def __call__(self, tau, y, speed):
        half, side = jnp.cos(tau / 2), jnp.sin(tau / 2)
        rates = []
        for i, turn in enumerate((0.0, 0.5)):
            c, s = (half, side) if turn else (1.0, 0.0)
            x, v = y[2 * i] - jnp.cos(tau), y[2 * i + 1] - 0.5 * jnp.sin(tau)
            e, f = c * x + s * v, -s * x + c * v
            growth = self.a[i] + self.p * (self.c[i] + self.p * self.e[i]) - self.k[i] * (e * e + f * f)
            de = (growth + self.s[i]) * e - self.b[i] * f
            df = (growth - self.s[i]) * f + self.b[i] * e
            spin = turn * speed
            rates.append(c * de - s * df - spin * v - speed * jnp.sin(tau))
            rates.append(s * de + c * df + spin * x + 0.5 * speed * jnp.cos(tau))
        return tuple(rates)


def turning(name: str, *points: Point, ends=(-0.2, 0.2), start=-0.19, **given: tuple[float, float]) -> Planted:
    """Planes as given; the rest is quiet."""
    settings = dict(a=(-0.3, -0.3), c=(0.0, 0.0), e=(0.0, 0.0), s=(0.05, 0.05), b=(0.0, 0.0), k=(1.0, 1.0)) | given
    system = jc.ForcedSystem(Turning(**numbers(p=start, **settings)), dimension=4)
    return Planted(name, system, (1.0, 0.0, 1.0, 0.0), start, ends[0], ends[1], points)


LEFT = math.exp(-5.0)
"""What is left of the distance to its image while a variable of `Kicked` relaxes."""


class Kicked(eqx.Module):
    """x goes to p - x^2 if `delay` is 0, else (x, z) to (p x (1 - z), x): m relaxes to the image of x in the first half
    of a revolution, and x to m in the second."""

    p: Array
    delay: Array

    def __call__(self, tau, y, speed):
        x, z, m, n = y
        rate = 5.0 * speed * 8 / (3 * jnp.pi)
        up, down = (rate * jnp.maximum(side * jnp.sin(tau), 0.0) ** 4 for side in (1, -1))
        image = (1 - self.delay) * (self.p - x * x) + self.delay * self.p * x * (1 - z), self.delay * x
        return down * (m - x), down * (n - z), up * (image[0] - m), up * (image[1] - n)


def kicked_map(y: np.ndarray, p: float, delay: float, times: int = 1) -> tuple[np.ndarray, np.ndarray]:
    """The strobe map and its derivative, exactly."""
    whole = np.eye(4)
    keep, go = LEFT * np.eye(2), (1 - LEFT) * np.eye(2)
    for _ in range(times):
        x, z = y[:2]
        image = np.array([p * x * (1 - z), x] if delay else [p - x * x, 0.0])
        slope = np.array([[p * (1 - z), -p * x], [1.0, 0.0]] if delay else [[-2 * x, 0.0], [0.0, 0.0]])
        after = go @ image + keep @ y[2:]
        first = np.block([[np.eye(2), np.zeros((2, 2))], [go @ slope, keep]])
        y = np.concatenate([go @ after + keep @ y[:2], after])
        whole = np.block([[keep, go], [np.zeros((2, 2)), np.eye(2)]]) @ first @ whole
    return y, whole


def kicked_point(kind: str, guess: Any, delay: float, times: int) -> Point:
    """Where the exact map has the multiplier, from a guess at (state, p)."""

    def off(u: np.ndarray) -> np.ndarray:
        y, m = kicked_map(u[:4], u[4], delay, times)
        if kind != "Neimark-Sacker":
            return np.append(y - u[:4], np.linalg.det(m + (np.eye(4) if kind == "period-doubling" else -np.eye(4))))
        i, j = np.triu_indices(4, 1)
        products = np.linalg.det(m[np.ix_(i, i)] * m[np.ix_(j, j)] - m[np.ix_(i, j)] * m[np.ix_(j, i)] - np.eye(6))
        return np.append(y - u[:4], products)

    found = solved(off, guess)
    assert np.max(np.abs(off(found))) < 1e-11
    return Point(kind, float(found[4]), 1e-9)


def kicked(name: str, delay: float, x: tuple[float, float], p: float, ends, times: int, *wanted) -> Planted:
    """Orbits of so many revolutions, from near (x, z) at p; special points as (kind, (x, z), p)."""
    settled = lambda x, p: solved(lambda y: kicked_map(y, p, delay, times)[0] - y, (*x, *x))
    points = [kicked_point(kind, (*settled(x, q), q), delay, times) for kind, x, q in wanted]
    system = jc.ForcedSystem(Kicked(**numbers(p=p, delay=delay)), dimension=4, harmonics=4)
    return Planted(name, system, tuple(settled(x, p).tolist()), p, ends[0], ends[1], tuple(points), periods=times)


def planted() -> list[Planted]:
    """All that is known in closed form."""
    double = (0.0198, 0.0202)
    quick = 0.05
    return [
        curve("fold", {(0, 1): 1.0, (2, 0): -1.0}, 0.7, 0.49, Point("fold", 0.0)),
        *(folds(apart) for apart in (2e-2, 2e-3, 2e-4)),
        curve("cusp, met exactly", {(0, 1): 1.0, (3, 0): -1.0}, -0.9, -0.729),
        curve("pitchfork", {(1, 1): 1.0, (3, 0): -1.0}, 0.0, -0.9, Point("branch-point", 0.0)),
        curve(
            "pitchfork, from the bent side",
            {(1, 1): 1.0, (3, 0): -1.0},
            0.7,
            0.49,
            Point("branch-point", 0.0),
            Point("fold", 0.0),
        ),
        *(imperfect(gap, side) for gap in (1e-3, 1e-4) for side in (1, -1)),
        crossing(0.0, 1),
        *(crossing(gap, side) for gap in (1e-3, 1e-4) for side in (1, -1)),
        ring(0.3),
        ring(0.01),
        *(comb(apart) for apart in (1e-1, 1e-2, 1e-3, 1e-4)),
        *(
            turning(
                f"two flips {2 * half:.0e} apart",
                *(Point("period-doubling", 0.02 + x) for x in (-half, half)),
                a=(-0.3, -0.02),
                c=(0.2, 1.0),
                s=(0.1, half),
            )
            for half in (2e-3, 2e-4, 2e-5)
        ),
        *(
            turning(
                f"flip and back {2 * half:.0e} on",
                *(Point("period-doubling", x) for x in (-half, half)),
                a=(-0.3, -0.1 - 2 * half**2),
                e=(0.0, 2.0),
                s=(0.0, 0.1),
                k=(1.0, -1.0),
            )
            for half in (2e-2, 2e-3, 2e-4)
        ),
        turning(
            "two tori 4e-4 apart",
            Point("Neimark-Sacker", double[0]),
            Point("Neimark-Sacker", double[1]),
            a=(-double[0], -double[1]),
            c=(1.0, 1.0),
            s=(0.0, 0.0),
            b=(0.4, 0.3),
        ),
        turning("two at -1 at once", Point("unexplained", 0.02), a=(-0.3, -0.02), c=(0.0, 1.0), s=(0.1, 0.0)),
        turning(
            "flip and torus at once",
            Point("period-doubling", 0.05),
            Point("Neimark-Sacker", 0.05),
            a=(-0.05, -0.15),
            c=(1.0, 1.0),
            s=(0.0, 0.1),
            b=(0.4, 0.0),
            k=(1.0, -1.0),
        ),
        turning(
            "flip and branch point at once",
            Point("period-doubling", 0.05),
            Point("branch-point", 0.05),
            a=(-0.15, -0.15),
            c=(1.0, 1.0),
            s=(0.1, 0.1),
        ),
        turning(
            "torus, subcritical",
            Point("Neimark-Sacker", quick),
            a=(-quick, -0.3),
            c=(1.0, 0.0),
            s=(0.0, 0.1),
            b=(0.4, 0.0),
            k=(-1.0, 1.0),
        ),
        kicked(
            "quadratic map",
            0.0,
            (0.4, 0.0),
            0.56,
            (-0.5, 1.0),
            1,
            ("fold", (-0.5, 0.0), -0.24),
            ("period-doubling", (0.5, 0.0), 0.75),
        ),
        kicked("quadratic map, period 2", 0.0, (1.2, 0.0), 1.1, (0.9, 1.5), 2, ("period-doubling", (1.2, 0.0), 1.25)),
        kicked(
            "quadratic map, period 3",
            0.0,
            (0.005, 0.0),
            1.81,
            (1.75, 1.85),
            3,
            ("fold", (0.03, 0.0), 1.8055),
            ("period-doubling", (-0.044, 0.0), 1.8234),
        ),
        kicked("delayed logistic map", 1.0, (0.47, 0.47), 1.9, (1.5, 2.3), 1, ("Neimark-Sacker", (0.5, 0.5), 2.0)),
    ]
