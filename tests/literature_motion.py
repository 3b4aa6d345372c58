"""Exponents, bifurcations and the cage's motion beside the numbers of `literature` and second computations."""

import math
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import literature as table
import numpy as np
import reference
import xarray as xr
from laws import double_well, hardening
from literature import Row, beside, row, share
from scipy.integrate import solve_ivp
from scipy.optimize import brentq
from scipy.special import mathieu_a, mathieu_b

import jaxcage as jc
from jaxcage import bearing


# Exponents.


class Oscillator(NamedTuple):
    """x'' = f(t, x, x') with period 2 pi over `frequency`, in NumPy, and f's derivatives, written by hand."""

    f: Callable[[Any, Any, Any], Any]
    by_position: Callable[[Any], Any]
    damping: float
    """Minus the derivative with respect to x', a constant."""
    frequency: float


def duffing(damping: float, force: float, frequency: float) -> Oscillator:
    """x'' + d x' - x + x^3 = g cos wt."""
    push = lambda t, x, v: -damping * v + x - x * x * x + force * math.cos(frequency * t)
    return Oscillator(push, lambda x: 1 - 3 * x * x, damping, frequency)


def pendulum(damping: float, torque: float, frequency: float, stiffness: float = 1.0) -> Oscillator:
    """x'' + d x' + k sin x = g cos wt."""
    push = lambda t, x, v: -damping * v - stiffness * np.sin(x) + torque * math.cos(frequency * t)
    return Oscillator(push, lambda x: -stiffness * np.cos(x), damping, frequency)


UEDA = Oscillator(lambda t, x, v: -0.05 * v - x * x * x + 7.5 * math.sin(t), lambda x: -3 * x * x, 0.05, 1.0)


_ueda = lambda tau, q, v, speed: (-0.05 * v[0] - q[0] ** 3 + 7.5 * jnp.sin(tau),)
_duffing = lambda d, g: lambda tau, q, v, speed: (-d * v[0] + q[0] - q[0] ** 3 + g * jnp.cos(tau),)
_pendulum = lambda d, g: lambda tau, q, v, speed: (-d * v[0] - jnp.sin(q[0]) + g * jnp.cos(tau),)
LAWS = (
    (_ueda, UEDA),
    (_duffing(0.25, 0.4), duffing(0.25, 0.4, 1.0)),
    (_pendulum(0.05, 0.6), pendulum(0.05, 0.6, 0.7)),
    (_duffing(0.3, 0.5), duffing(0.3, 0.5, 1.2)),
    (_duffing(0.15, 0.3), duffing(0.15, 0.3, 1.0)),
    (_pendulum(0.5, 1.5), pendulum(0.5, 1.5, 2 / 3)),
)
"""In the order of the table: for the package, and in NumPy."""


def largest_exponent(
    of: Oscillator, initial_states: int, discard: int, periods: int, steps: int
) -> tuple[float, float]:
    """Largest exponent per unit of time of the chaotic motion, by Runge-Kutta steps, and its standard error.

    From initial states in the square of side 2; those that end on a periodic orbit, with a negative exponent, are left
    out.
    """
    f, slope, damping, frequency = of
    span = 2 * math.pi / frequency
    h, growth, y = span / steps, np.zeros(initial_states), np.zeros((4, initial_states))
    y[:2], y[2] = np.random.default_rng(7).uniform(-1, 1, (2, initial_states)), 1.0
    rates = lambda t, y: np.stack([y[1], f(t, y[0], y[1]), y[3], slope(y[0]) * y[2] - damping * y[3]])
    for period in range(discard + periods):
        for t in h * np.arange(steps):
            k1 = rates(t, y)
            k2 = rates(t + h / 2, y + h / 2 * k1)
            k3 = rates(t + h / 2, y + h / 2 * k2)
            y = y + h / 6 * (k1 + 2 * k2 + 2 * k3 + rates(t + h, y + h * k3))
        length = np.hypot(y[2], y[3])
        y[2:] /= length
        growth += np.log(length) if period >= discard else 0.0
    each = growth[growth > 0] / (periods * span)
    return float(each.mean()), float(each.std(ddof=1) / math.sqrt(each.size))


def _exponents(
    system: Any, speed: float, centre: Any, initial_states: int, count: int, steps: int, discard: int, length: int
) -> xr.Dataset:
    around = np.asarray(centre) + np.random.default_rng(0).uniform(-1, 1, (initial_states, len(centre)))
    how: Any = dict(exponents=count, blocks=10, keep=1, method=jc.method("rodas4", steps=steps))
    begin = [tuple(map(float, s)) for s in around]
    return jc.sweep(system, np.array([speed]), initial_states=begin, discard=discard, revolutions=length, **how)


def _means(*asked: Any) -> np.ndarray:
    """Exponents per period, as means over the initial states."""
    return _exponents(*asked).exponents.values[0].mean(axis=0)


def driven_exponents() -> Iterator[Row]:
    for (name, theirs), (law, of) in zip(table.EXPONENTS.items(), LAWS, strict=True):
        system = jc.ForcedOscillator(law, coordinates=1)
        found = _exponents(system, of.frequency, (0.0, 0.0), 256, 1, 64, 500, 2000)
        each = found.exponents.values[found.label.values == "chaotic", 0] * of.frequency / (2 * math.pi)
        sample = 3 * float(each.std(ddof=1)) / math.sqrt(each.size)
        yield beside(f"{name}, largest exponent", theirs, each.mean(), sample)
    ours = _means(jc.ForcedOscillator(_ueda, coordinates=1), 1.0, (0.0, 0.0), 4, 2, 512, 20, 100).sum() / (2 * math.pi)
    yield row("Ueda, sum of the exponents", -0.05, ours, 1e-6, table.TRACE)


ORDER = "largest", "second", "third"


def flows() -> Iterator[Row]:
    """An autonomous system has no period: a unit of time takes its place."""

    def system(rho: float) -> jc.ForcedSystem:
        law = lambda tau, y, speed: (10 * (y[1] - y[0]), y[0] * (rho - y[2]) - y[1], y[0] * y[1] - 8 / 3 * y[2])
        return jc.ForcedSystem(law, dimension=3)

    found = _means(system(28.0), 2 * math.pi, (5.0, 5.0, 25.0), 64, 3, 256, 50, 500)
    name = "Lorenz 10, 28, 8/3"
    yield from (
        beside(f"{name}, {n} exponent", theirs, x) for n, theirs, x in zip(ORDER, table.LORENZ, found, strict=True)
    )
    yield row(f"{name}, sum", -41 / 3, found.sum(), 1e-4, table.TRACE)
    yield beside(f"{name}, dimension of Kaplan and Yorke", table.LORENZ_DIMENSION, 2 + found[0] / abs(found[2]))
    fixed = math.sqrt(8 / 3 * 19)
    still = _means(system(20.0), 2 * math.pi, (fixed, fixed, 19.0), 2, 3, 256, 200, 500)
    decay = np.linalg.eigvals(np.array([[-10, 10, 0], [1, -1, -fixed], [fixed, fixed, -8 / 3]])).real
    yield row("Lorenz 10, 20, 8/3, largest exponent", decay.max(), still[0], 2e-3, table.EIGENVALUES)
    yield row("Lorenz 10, 20, 8/3, third exponent", decay.min(), still[2], 2e-3, table.EIGENVALUES)
    rates = lambda tau, y, speed: (-y[1] - y[2], y[0] + 0.2 * y[1], 0.2 + y[2] * (y[0] - 5.7))
    each = _means(jc.ForcedSystem(rates, dimension=3), 1.0, (0.0, -5.0, 0.0), 64, 3, 512, 20, 400) / (2 * math.pi)
    for n, theirs, x in zip(ORDER, table.ROESSLER, each, strict=True):
        yield beside(f"Roessler .2, .2, 5.7, {n} exponent", theirs, x)


# Bifurcations.

FINE = jc.method("rodas4", steps=1024)


def doubling(family: Callable[[float], Oscillator], periods: int, bracket: Any, start: Any) -> float:
    """Parameter at which an orbit of `periods` periods of the drive has the multiplier -1, a second time.

    DOP853 on the variational equations; Newton's method on the orbit, Brent's on 1 + tr M + det M. The orbit is stable
    at the first end of the bracket, and reached from `start` by simulation.
    """

    def map_of(oscillator: Oscillator, at: np.ndarray, turns: int, tolerance: float) -> tuple[np.ndarray, np.ndarray]:
        f, slope, damping, frequency = oscillator

        def rates(t: float, y: np.ndarray) -> list[float]:
            k = slope(y[0])
            return [y[1], f(t, y[0], y[1]), y[3], k * y[2] - damping * y[3], y[5], k * y[4] - damping * y[5]]

        how: Any = dict(method="DOP853", rtol=tolerance, atol=tolerance)
        end = solve_ivp(rates, (0.0, turns * periods * 2 * math.pi / frequency), [*at, 1, 0, 0, 1], **how).y[:, -1]
        return end[:2], np.array([[end[2], end[4]], [end[3], end[5]]])

    at = np.array(start, dtype=float)
    for _ in range(8):
        at = map_of(family(bracket[0]), at, 40, 1e-9)[0]

    def characteristic(parameter: float) -> float:
        nonlocal at
        for _ in range(20):
            end, matrix = map_of(family(parameter), at, 1, 1e-12)
            step = np.linalg.solve(matrix - np.eye(2), at - end)
            at = at + step
            if np.abs(step).max() < 1e-10:
                return float(1 + np.trace(matrix) + np.linalg.det(matrix))
        raise RuntimeError("Newton's method did not find the orbit.")

    found: Any = brentq(characteristic, *bracket, xtol=1e-13)
    return found


class Law(eqx.Module):
    """Rates or accelerations of a system with constants by name."""

    c: dict[str, jax.Array]
    f: Callable[..., Any] = eqx.field(static=True)

    def __call__(self, tau: Any, *state: Any) -> Any:
        return self.f(self.c, tau, *state)


def _system(f: Callable[..., Any], dimension: int = 0, **c: float) -> Any:
    """A system of first order, or without a dimension an oscillator."""
    law = Law({name: jnp.asarray(x, float) for name, x in c.items()}, f)
    return jc.ForcedSystem(law, dimension=dimension) if dimension else jc.ForcedOscillator(law, coordinates=1)


def _point(system: Any, kind: Any, near: Any, name: str, **options: Any) -> Any:
    """The value of a constant at a bifurcation."""
    pick = lambda s: getattr(s, "acceleration" if isinstance(s, jc.ForcedOscillator) else "rates").c[name]
    return jc.bifurcation(system, kind, near, pick, method=FINE, **options).value


def doublings() -> Iterator[Row]:
    name, found = "Duffing x'' + .3 x' - x + x^3 = g cos 1.2t", []
    for periods, (inside, theirs) in table.DUFFING_DOUBLINGS.items():
        system = double_well(inside)
        orbit = jc.periodic_orbit(system, 1.2, periods, guess=(1.0, 0.0), revolutions=400, method=FINE)
        how: Any = dict(speed=1.2, periods=periods, method=FINE)
        found.append(float(jc.bifurcation(system, "period-doubling", orbit, "g", **how).value))
        yield beside(f"{name}: g where period {periods} doubles", theirs, found[-1])
    ratio = (found[2] - found[1]) / (found[3] - found[2])  # the error of the first one, 0.13, falls to about a fifth
    yield row(f"{name}: second ratio of distances", table.FEIGENBAUM, ratio, 0.03, table.FEIGENBAUM_1978)
    system = double_well(0.262)
    orbit = jc.periodic_orbit(system, 1.2, 1, guess=(1.0, 0.0), revolutions=400, method=FINE)
    force = lambda system: jc.bifurcation(system, "period-doubling", orbit, "g", speed=1.2, method=FINE).value
    value, slope = eqx.filter_value_and_grad(force)(system)
    of, name = vars(slope.acceleration), "Duffing x'' + .3 x' - x + x^3 = g cos 1.2t: slope of the first by"
    for (what, theirs), ours in zip(table.DUFFING_SLOPES.items(), (of["m"], of["d"], of["k"] + of["b"]), strict=True):
        yield beside(f"{name} {what}", theirs, ours)
    yield row(f"{name} b", -value / 2, of["b"], 1e-9, table.SCALING)


PENDULUM = {1: (1.06, 1.07), 2: (1.075, 1.08), 4: (1.081, 1.0823), 8: (1.0825, 1.0828)}
"""Periods: a drive strength at which the orbit is stable, and one at which it is not."""


def pendulum_doublings() -> Iterator[Row]:
    """The driven pendulum of J. R. Taylor, Classical Mechanics (2005), chapter 12."""
    speed, found = 2 * math.pi, []
    square = (1.5 * speed) ** 2

    def law(c: Any, tau: Any, q: Any, v: Any, speed: Any) -> Any:
        natural = 1.5 * speed
        return (-natural / 2 * v[0] + natural**2 * (c["g"] * jnp.cos(tau) - jnp.sin(q[0])),)

    for n, bracket in PENDULUM.items():
        start = (-math.pi / 2, 0.0)
        theirs = doubling(lambda g: pendulum(0.75 * speed, g * square, speed, square), n, bracket, start)
        system = _system(law, g=bracket[0])
        orbit = jc.periodic_orbit(system, speed, n, guess=start, revolutions=320, method=FINE)
        found.append(float(_point(system, "period-doubling", orbit, "g", speed=speed, periods=n)))
        yield row(f"pendulum: drive strength where period {n} doubles", theirs, found[-1], 2e-9, table.SHOOTING)
    ratio = (found[2] - found[1]) / (found[3] - found[2])
    yield share("pendulum: second ratio of distances", table.FEIGENBAUM, ratio, 0.02, table.FEIGENBAUM_1978)


def folds() -> Iterator[Row]:
    system = hardening()
    for speed, start, theirs in ((1.7, (0.6, 2.4), "up"), (1.4, (-0.3, 0.05), "down")):
        orbit = jc.periodic_orbit(system, speed, 1, guess=start, revolutions=400, method=FINE)
        ours = jc.bifurcation(system, "fold", orbit, method=FINE).value
        yield beside("Duffing x'' + .1 x' + x + x^3 = .3 cos wt: w at a fold", table.DUFFING_FOLDS[theirs], ours)


def van_der_pol() -> Iterator[Row]:
    def law(c: Any, tau: Any, y: Any, speed: Any) -> Any:
        return (y[1], c["mu"] * (1 - y[0] ** 2) * y[1] - y[0] + c["g"] * jnp.cos(tau))

    driven = _system(law, 2, mu=0.3, g=1.2)
    held = jc.periodic_orbit(driven, 1.3, guess=(-1.3, -0.4), method=FINE)
    what = "van der Pol, mu 0.3, g cos 1.3t: g where entrainment is lost (Neimark-Sacker)"
    yield beside(what, table.VAN_DER_POL_LET_GO, _point(driven, "Neimark-Sacker", held, "g"))


def mathieu() -> Iterator[Row]:
    """x'' + (a - 2 q cos 2t) x = 0 with tau = 2 t: period doublings, and values at which the multipliers are 1."""
    of = lambda a: _system(lambda c, tau, q, v, speed: (-(c["a"] - 2 * jnp.cos(tau)) * q[0],), a=a)
    still = lambda a: jc.periodic_orbit(of(a), 2.0, guess=(0.0, 0.0), method=FINE).multipliers.sum().real - 2
    for name in ("b1", "a1", "a0", "b2", "a2"):
        order = int(name[1])
        theirs = float((mathieu_b if name[0] == "b" else mathieu_a)(order, 1))
        if order == 1:
            ours = _point(of(1.0), "period-doubling", ((0.0, 0.0), theirs + 0.03), "a", speed=2.0)
        else:
            ours = brentq(still, theirs - 0.02, theirs + 0.03, xtol=1e-12)
        yield row(f"Mathieu's equation: {name}", theirs, ours, 1e-8, table.MATHIEU)


# The cage.

RPM = math.pi / 30
BEYOND_SPRINGS = "cubic_stiffness", "cubic_ratio", "cross_stiffness"


def _cage(without: tuple[str, ...], **changes: Any) -> jc.CageModel:
    return jc.replace(jc.case("1a"), **(dict.fromkeys((*without, *BEYOND_SPRINGS), 0.0) | changes))


def _without_film(model: jc.CageModel) -> jc.CageModel:
    return eqx.tree_at(lambda m: m.film.land_width, model, jnp.asarray(1e-7))


def unbalance() -> Iterator[Row]:
    """Steady position at phase 0 below and above resonance: r = e w^2/(K/M - w^2 + i w B/M)."""
    mass, k, damping, arm = 0.25, 4e4, 20.0, 30e-6
    support = dict(cage_mass=mass, stiffness_x=k, stiffness_y=k, damping=damping, eccentricity=arm)
    model = _without_film(_cage(("gravity", "amplitude"), unbalance="physical", **support))
    for part in (0.8, 1.5):
        speed = part * math.sqrt(k / mass)
        run = jc.simulate(model, speed, revolutions=1, discard=120, samples=1, start=(0.0, 0.0, 0.0, 0.0))
        exact = arm * speed**2 / (k / mass - speed**2 + 1j * speed * damping / mass)
        for axis, theirs, ours in (("x", exact.real, run.state[0, 0]), ("y", exact.imag, run.state[0, 1])):
            what = f"unbalance response at {part} of resonance, {axis} at phase 0 [um]"
            yield share(what, 1e6 * theirs, 1e6 * ours, 1e-5, table.JEFFCOTT)


def divergence() -> Iterator[Row]:
    model, speed = _without_film(jc.replace(jc.case("1a"), restitution=1.0)), 15000 * RPM
    how: Any = dict(exponents=4, blocks=10, keep=1, method=jc.method(steps=2048), confirm=False, horizon=0)
    found = jc.sweep(model, np.array([speed]), discard=20, revolutions=50, **how)
    theirs = -2 * float(model.support.damping / model.cage_mass) * 2 * math.pi / speed
    what = "case 1a without film at 15000 rpm: sum of the four exponents"
    yield share(what, theirs, found.exponents.sum(axis=-1).mean(), 1e-3, table.DAMPING)


def whirl() -> Iterator[Row]:
    alone = "stiffness_x", "stiffness_y", "damping", "eccentricity", "amplitude"
    model = eqx.tree_at(lambda m: m.cage_mass, _cage(alone, guidance_gap=0.45e-3, gravity=9.81), jnp.asarray(1e-5))
    speed = math.sqrt(24 / math.pi * 9.81 / 0.45e-3) * 1.01  # a light cage is all but in the middle of its film
    start = (0.0, 0.0, 1e-3 * float(model.clearance) * speed, 0.0)
    fine = jc.method(steps=256)
    run = jc.simulate(model, speed, revolutions=40, discard=10, samples=16, start=start, method=fine)
    away = run.state[:, :2] - run.state[:, :2].mean(axis=0)
    turned = np.unwrap(np.arctan2(away[:, 1], away[:, 0]))
    ratio = (turned[-1] - turned[0]) / (run.tau[-1] - run.tau[0])
    yield row("whirl of a light cage over its speed, simulated", 0.5, ratio, 0.005, table.NEWKIRK)


@eqx.filter_jit
def _half_a_revolution(model: jc.CageModel, speed: Any, start: Any) -> Any:
    return jc.strobe_map(model, speed, jc.method(steps=1024)).part(start, 0, 2).y


def half_a_revolution() -> Iterator[Row]:
    """Off the rib; contact is compared in the contact's own topic."""
    for name in bearing.PUBLISHED_CASES:
        model, speed = jc.case(name), 9000 * RPM
        c = float(model.clearance)
        field, start = reference.field(model, speed), np.array([0.2, 0.1, 0.0, 0.0])
        rates = lambda tau, z: np.array(field(tau, (z * field.scale).tolist())) / field.scale
        how: Any = dict(method="DOP853", rtol=1e-10, atol=1e-11)
        done = solve_ivp(rates, (0.0, math.pi), start, **how)
        ours = _half_a_revolution(model, jnp.asarray(speed), tuple(jnp.asarray(s) for s in start * field.scale))
        for i, axis in enumerate("xy"):
            what = f"case {name}, 9000 rpm, {axis} over clearance after half a revolution"
            yield row(what, done.y[i, -1], float(ours[i]) / c, 1e-6, table.POLAR)
