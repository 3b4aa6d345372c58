"""`python -m benchmarks.bearing_stiffness`: whether the whole bearing wants implicit steps.

From settled states of NU2310, arcs of 1 ms are run by explicit steps (those of the package, again in NumPy, and SciPy's
DOP853) and by implicit ones (RODAS4 with an exact Jacobian, SciPy's Radau, BDF and LSODA with the same), each at the
loosest tolerance that reaches the error wanted. Steps are counted, not timed. Beside them stands how far the explicit
steps are from their stability limit, by the eigenvalues of the Jacobian along the arcs. Then the parts of a step are
timed: rates, Jacobian, factors and solutions of the arrow, in which rollers meet cage and ring only.
"""

import argparse
import time
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from scipy.integrate import solve_ivp

import jaxcage as jc
from benchmarks.bearing_speed import flat
from benchmarks.bearing_trends import table
from benchmarks.tableaux import RODAS4
from jaxcage.integrate import Arrow, Parts, arrow, factors
from jaxcage.models.whole import BearingState, state_scale


SPAN, SETTLING, BETWEEN = 1e-3, 20e-3, 5e-3
"""Time of an arc, before the first one, and from one to the next [s]."""
ARCS = 3
WANTED = (1e-2, 1e-3)
"""Errors at the end of an arc that half of the arcs reach, in units of the state's scale: as a run allows, and less."""
LADDER = (1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7)
"""Tolerances, loosest first."""
SLOW = ((1000.0, 273.15, 4450.0), (1000.0, 273.15, 300.0), (2000.0, 273.15, 4450.0), (1000.0, 293.15, 4450.0))
"""Shafts [rpm], oils [K] and loads [N] for whole revolutions."""
HALVED = 1
"""So many times the decade in which the loosest tolerance lies is halved."""
TIGHT = 1e-10
"""Tolerance of the reference."""
SETTLED = 1e-4
"""Tolerance of the run to the arcs: the usual one of sweeps."""
MOST = 20_000
"""Steps tried in an arc."""
LANES, REPEATS = 64, 12
"""How many at once parts of a step are timed for, and how often."""


class Condition(NamedTuple):
    """A bearing at a speed."""

    name: str
    shaft_rpm: float
    changes: dict[str, float]


CONDITIONS = (
    Condition("10000 rpm", 10000.0, {}),
    Condition("3000 rpm", 3000.0, {}),
    Condition("1000 rpm", 1000.0, {}),
    Condition("10000 rpm, pocket clearance 0.2 mm", 10000.0, {"pocket_clearance": 0.2e-3}),
    Condition("10000 rpm, pocket stiffness 2e8 N/m", 10000.0, {"pocket_stiffness": 2e8}),
    Condition("10000 rpm, oil at 0 °C", 10000.0, {"temperature": 273.15}),
    Condition("1000 rpm, oil at 0 °C", 1000.0, {"temperature": 273.15}),
)


def dense(blocks: Arrow) -> np.ndarray:
    """The Jacobian as one matrix, numbers in the order of the package: all lags, all spins and so on."""
    own, by_bodies, on_bodies, few = map(np.asarray, blocks)
    n, on_bodies, few = len(own), on_bodies[:, :10], few[:10]
    found = np.zeros((5 * n + 10, 5 * n + 10))
    for j in range(n):
        found[j : 5 * n : n, j : 5 * n : n] = own[j]
        found[j : 5 * n : n, 5 * n :] = by_bodies[j]
        found[5 * n :, j : 5 * n : n] = on_bodies[j]
    found[5 * n :, 5 * n :] = few
    return found


# Arcs, in units of the state's scale.


def parts_of(y: jax.Array, n_rollers: int) -> Parts:
    """A state in one row, as an arrow takes it."""
    return Parts(y[: 5 * n_rollers].reshape(5, n_rollers).T, y[5 * n_rollers :])


def flat_of(y: Parts) -> jax.Array:
    """The same in one row again."""
    return jnp.concatenate([y.rollers.T.ravel(), y.bodies])


def rates(at: Any, y: Parts) -> Parts:
    """Over time."""
    moved = at(BearingState(y.rollers.T, y.bodies[:-1], jnp.stack([y.bodies[-1], jnp.zeros(())]))).state
    return Parts(moved.rollers.T, jnp.append(moved.bodies, moved.clock[0]))


def _flat_rates(tree: Any, numbers: jax.Array, size: jax.Array, y: jax.Array) -> jax.Array:
    """Rates over time of a state in one row, both in units of `size`, by the laws' numbers in a row: few arguments."""
    at = jax.tree.unflatten(tree, list(numbers))
    return flat_of(rates(at, parts_of(y * size, at.n_rollers))) / size


flat_rates = jax.jit(_flat_rates, static_argnums=0)
flat_slopes = jax.jit(jax.jacfwd(_flat_rates, 3), static_argnums=0)


class Arcs:
    """A condition's rates and Jacobian over time, and settled states, all as flat numbers in units of the scale."""

    def __init__(self, condition: Condition, count: int):
        self.model = jc.replace(jc.whole_bearing("nu2310"), **condition.changes)
        speed = float(jc.rpm(condition.shaft_rpm))
        self.at = jax.tree.map(lambda x: jnp.asarray(x, dtype=float), self.model.at_speed(speed))
        scale = state_scale(self.model, speed)
        self.size = np.append(flat(np.asarray(scale.rollers), np.asarray(scale.bodies)), 1.0)
        leaves, tree = jax.tree.flatten(self.at)
        law = tree, jnp.stack(leaves), jnp.asarray(self.size)
        self.rate: Callable[[np.ndarray], np.ndarray] = lambda y: np.asarray(flat_rates(*law, y))
        self.jacobian: Callable[[np.ndarray], np.ndarray] = lambda y: np.asarray(flat_slopes(*law, y))
        begin, times = jc.models.rolling_start(self.model, speed), SETTLING + BETWEEN * np.arange(count)
        run = jc.bearing_over_time(self.model, speed, np.append(0.0, times), start=begin, tolerance=SETTLED)
        states = np.concatenate([flat(run.rollers, run.bodies), run.angle[:, None]], axis=-1)[1:] / self.size
        self.begin = states
        self.exact = np.array([self.scipy("DOP853", y, TIGHT).end for y in self.begin])

    def scipy(self, method: str, y: np.ndarray, tolerance: float) -> "Reached":
        """An arc by SciPy."""
        jacobian: Any = {} if method == "DOP853" else {"jac": lambda _, y: self.jacobian(y)}
        rate = lambda _, y: self.rate(y)
        done = solve_ivp(rate, (0.0, SPAN), y, method, rtol=tolerance, atol=tolerance, **jacobian)
        return Reached(done.y[:, -1], len(done.t) - 1, done.nfev, done.njev, [])


class Reached(NamedTuple):
    """What came of an arc."""

    end: np.ndarray
    steps: int
    evaluations: int
    jacobians: int
    taken: list[tuple[np.ndarray, float]]
    """Where each step began, and its length [s]; nothing from SciPy."""


Step = Callable[[Arcs, np.ndarray, np.ndarray, float], tuple[np.ndarray, np.ndarray, np.ndarray]]
"""(arcs, state, its rate, length) -> state, its rate, estimated error."""


def explicit(arcs: Arcs, y: np.ndarray, k1: np.ndarray, h: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The package's: Runge and Kutta's classical step, its error the last slope less that at its end."""
    k2 = arcs.rate(y + h / 2 * k1)
    k3 = arcs.rate(y + h / 2 * k2)
    k4 = arcs.rate(y + h * k3)
    end = y + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
    k5 = arcs.rate(end)
    return end, k5, h / 6 * (k4 - k5)


def implicit(arcs: Arcs, y: np.ndarray, k1: np.ndarray, h: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """RODAS4, of which each step solves with one matrix."""
    solve = np.linalg.inv(np.eye(y.size) / (RODAS4.gamma * h) - arcs.jacobian(y))
    stages = np.zeros((6, y.size))
    for i in range(6):
        f = arcs.rate(y + RODAS4.a[i] @ stages) if i else k1
        stages[i] = solve @ (f + RODAS4.c[i] @ stages / h)
    end = y + RODAS4.m @ stages
    return end, arcs.rate(end), stages[-1]


def controlled(step: Step, arcs: Arcs, y: np.ndarray, tolerance: float, jacobians: int) -> Reached:
    """An arc by steps of the tolerance, as the package chooses them; both estimates are of fourth order."""
    done, h, tried, taken = 0.0, SPAN / 300, 0, []
    rate = arcs.rate(y)
    while done < SPAN and tried < MOST:
        left = SPAN - done
        length = left if left <= h else left / 2 if left < 2 * h else h
        end, after, estimate = step(arcs, y, rate, length)
        tried += 1
        error = float(np.max(np.abs(estimate)))
        good = error <= tolerance
        wish = length * (min(max(0.9 * (tolerance / max(error, 1e-30)) ** 0.25, 0.2), 3.0) if error < np.inf else 0.2)
        if good:
            taken.append((y, length))
            y, rate, done = end, after, SPAN if length == left else done + length
        h = max(h, wish) if good and length < h else wish
    each = 6 if jacobians else 4
    return Reached(y, len(taken), each * tried + 1, jacobians * tried, taken)


METHODS: dict[str, Callable[[Arcs, np.ndarray, float], Reached]] = {
    "explicit, as in the package": lambda arcs, y, tolerance: controlled(explicit, arcs, y, tolerance, 0),
    "explicit, DOP853": lambda arcs, y, tolerance: arcs.scipy("DOP853", y, tolerance),
    "implicit, RODAS4": lambda arcs, y, tolerance: controlled(implicit, arcs, y, tolerance, 1),
    "implicit, Radau": lambda arcs, y, tolerance: arcs.scipy("Radau", y, tolerance),
    "implicit, BDF": lambda arcs, y, tolerance: arcs.scipy("BDF", y, tolerance),
    "both, LSODA": lambda arcs, y, tolerance: arcs.scipy("LSODA", y, tolerance),
}
EXPLICIT = tuple(METHODS)[:2]
OURS = EXPLICIT[0]
NEAR = 0.8
"""Of the longest stable step: beyond that it is said to be near."""


class Tried:
    """A method on all arcs, each tolerance run once."""

    def __init__(self, arcs: Arcs, method: Callable[[Arcs, np.ndarray, float], Reached]):
        self.arcs, self.method = arcs, method
        self.known: dict[float, list[Reached]] = {}

    def runs(self, tolerance: float) -> list[Reached]:
        """All arcs at a tolerance."""
        if tolerance not in self.known:
            self.known[tolerance] = [self.method(self.arcs, y, tolerance) for y in self.arcs.begin]
        return self.known[tolerance]

    def error(self, tolerance: float) -> float:
        """Reached by half of the arcs; of one that did not come to its end, infinite."""
        apart = [np.max(np.abs(r.end - exact)) for r, exact in zip(self.runs(tolerance), self.arcs.exact, strict=True)]
        return float(np.median(np.nan_to_num(apart, nan=np.inf)))

    def loosest(self, wanted: float) -> float | None:
        """The loosest tolerance that reaches an error; None if none does."""
        tight = next((x for x in LADDER if self.error(x) <= wanted), None)
        if tight is None or tight == LADDER[0]:
            return tight
        loose = 10 * tight
        for _ in range(HALVED):
            middle = float(np.sqrt(loose * tight))
            loose, tight = (loose, middle) if self.error(middle) <= wanted else (middle, tight)
        return tight


def limit(direction: np.ndarray) -> np.ndarray:
    """How far Runge and Kutta's stability region reaches along directions of the left half plane."""
    far = np.linspace(0.0, 3.5, 1401)[1:]
    z = far[:, None] * direction
    grows = np.abs(1 + z * (1 + z / 2 * (1 + z / 3 * (1 + z / 4)))) > 1 + 1e-12
    return np.where(grows.any(axis=0), far[np.argmax(grows, axis=0)], far[-1])


def nearness(arcs: Arcs, runs: Sequence[Reached]) -> tuple[np.ndarray, complex]:
    """Steps over the longest stable ones, from every fourth step on, and the fastest eigenvalue of all [1/s]."""
    shares, fastest = [], 0j
    for y, h in [each for run in runs for each in run.taken[::4]]:
        values = np.linalg.eigvals(arcs.jacobian(y))
        fast = values[(np.abs(values) > 1e3) & (values.real < 0)]
        shares.append(float(np.max(np.abs(fast) * h / limit(fast / np.abs(fast)))))
        fastest = max(fastest, *fast, key=abs)
    return np.array(shares), fastest


def parts(arcs: Arcs) -> dict[str, float]:
    """Processor time of the parts of a step of one bearing [us], in a batch of `LANES`."""
    n, begin = arcs.model.bearing.n_rollers, jnp.asarray(arcs.begin[0] * arcs.size)
    y = jax.tree.map(lambda x: jnp.repeat(x[None], LANES, axis=0), parts_of(begin, n))
    each = lambda f: jax.jit(jax.vmap(f))
    shift = 1 / (RODAS4.gamma * 1e-5)
    jacobian, eliminated = each(lambda y: arrow(arcs.at, y, False)), each(lambda blocks: factors(blocks, shift))
    rated, solved = each(lambda y: rates(arcs.at, y)), each(lambda held, f: held.solve(f))
    blocks, f = jacobian(y), rated(y)
    held = eliminated(blocks)
    got, one = solved(held, f), lambda tree: jax.tree.map(lambda x: x[0], tree)
    whole = np.diag(1 / arcs.size) @ dense(one(blocks)) @ np.diag(arcs.size)
    np.testing.assert_allclose(whole, arcs.jacobian(arcs.begin[0]), rtol=1e-9, atol=1e-9 * np.abs(whole).max())
    want = np.linalg.solve(shift * np.eye(whole.shape[0]) - whole, np.asarray(flat_of(one(f))) / arcs.size)
    have = np.asarray(flat_of(one(got))) / arcs.size
    np.testing.assert_allclose(have, want, rtol=1e-6, atol=1e-8 * np.abs(want).max())
    return {
        "rates": timed(rated, y),
        "Jacobian": timed(jacobian, y),
        "factors": timed(eliminated, blocks),
        "solution": timed(solved, held, f),
    }


def timed(f: Callable[..., Any], *given: Any) -> float:
    """Processor time of a call for each lane [us]: the least of several."""
    jax.block_until_ready(f(*given))
    found = []
    for _ in range(REPEATS):
        begun = time.process_time()
        jax.block_until_ready([f(*given) for _ in range(REPEATS)])
        found.append((time.process_time() - begun) / REPEATS)
    return 1e6 * min(found) / LANES


class Count(NamedTuple):
    """Means over the arcs; NaN where no tolerance reached the error."""

    steps: float
    evaluations: float
    jacobians: float

    @classmethod
    def of(cls, runs: Sequence[Reached] | None) -> "Count":
        """Of one method at one error."""
        if runs is None:
            return cls(np.nan, np.nan, np.nan)
        return cls(*(float(np.mean([getattr(run, name) for run in runs])) for name in cls._fields))

    def time(self, cost: dict[str, float], free: bool = False) -> float:
        """Of an arc [us]; of a method that solves as often as it evaluates rates, with one factorisation a Jacobian.
        With `free` Jacobians cost nothing."""
        if np.isnan(self.jacobians) or not self.jacobians:
            return self.evaluations * cost["rates"]
        once = cost["factors"] + (0.0 if free else cost["Jacobian"])
        return self.evaluations * (cost["rates"] + cost["solution"]) + self.jacobians * once


def counted(arcs: Arcs) -> tuple[dict[str, list[Count]], list[tuple[str, ...]]]:
    """What each method takes for each of the errors wanted; how near the explicit steps are to their limit."""
    found, near = {}, []
    for name, method in METHODS.items():
        tried = Tried(arcs, method)
        tolerances = [tried.loosest(error) for error in WANTED]
        runs = [None if tolerance is None else tried.runs(tolerance) for tolerance in tolerances]
        found[name] = [Count.of(each) for each in runs]
        for error, each in zip(WANTED, runs, strict=True):
            if each is not None and name == OURS:
                shares, fastest = nearness(arcs, each)
                few = f"{np.median(shares):.2f}", f"{shares.max():.2f}", f"{100 * np.mean(shares > NEAR):.0f} %"
                near.append((f"{error:.0e}", *few, f"{fastest.real:.0f} {fastest.imag:+.0f}i"))
    return found, near


def revolutions() -> None:
    """One revolution by the package's explicit steps, and with implicit ones where it chooses them."""
    rows: list[tuple[str, ...]] = [
        ("shaft, oil, load", "steps", "steps, chosen", "time of a step", "chosen", "time", "implicit", "")
    ]
    for shaft, kelvin, load in SLOW:
        model = jc.replace(jc.whole_bearing("nu2310"), temperature=kelvin, load=load)
        took, runs = [], []
        for implicit in (False, None):
            run = lambda count: jc.simulate_bearing(model, jc.rpm(shaft), revolutions=count, implicit=implicit)
            run(1)  # compiles
            begun = time.process_time()
            runs.append(run(1))
            took.append(time.process_time() - begun)
        each = [1e6 * t / run.steps for t, run in zip(took, runs, strict=True)]
        named = f"{shaft:g} rpm, {kelvin - 273.15:.0f} °C, {load:g} N"
        few = f"{took[0] / took[1]:.2f} times", f"{100 * runs[1].implicit_share:.0f} %", runs[1].outcome
        rows.append((named, *(f"{r.steps:.0f}" for r in runs), *(f"{x:.0f} us" for x in each), *few))
    print("\nA revolution by explicit steps, and by the steps that the package chooses: processor time of both lanes")
    table(rows)


def main() -> None:
    """Run all conditions, print what they take and the cost of a step."""
    about, _ = (__doc__ or "").split("\n\n")
    parser = argparse.ArgumentParser(description=about, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--conditions", type=int, nargs="*", default=range(len(CONDITIONS)), help="by number, from 0")
    parser.add_argument("--revolutions", action="store_true", help="whole revolutions only")
    parser.add_argument("--arcs", type=int, default=ARCS, help="of each condition")
    given = parser.parse_args()
    jc.enable_x64()
    if given.revolutions:
        return revolutions()
    heads = [f"{error:.0e}" for error in WANTED]
    near = [("steps over the longest stable", "error", "half", "largest", f"above {NEAR:g}", "fastest [1/s]")]
    gains = [("", "steps", "", "time", "", "time, free Jacobians", ""), ("error", *heads, *heads, *heads)]
    cost: dict[str, float] = {}
    print(f"An arc of {1e3 * SPAN:g} ms, means of {given.arcs} arcs, at the loosest tolerance to an error")
    for condition in (CONDITIONS[i] for i in given.conditions):
        arcs = Arcs(condition, given.arcs)
        cost = cost or parts(arcs)
        found, limits = counted(arcs)
        near += [(condition.name, *row) for row in limits]
        steps = [(condition.name, *(f"steps to {h}" for h in heads), *(f"rates, Jacobians to {h}" for h in heads))]
        for name, each in found.items():
            work = [f"{x.evaluations:.0f}, {x.jacobians:.0f}" for x in each]
            steps.append((f"  {name}", *(f"{x.steps:.0f}" for x in each), *work))
        table(steps)
        row: list[str] = []
        others = [each for name, each in found.items() if name not in EXPLICIT]
        for size in (lambda x: x.steps, lambda x: x.time(cost), lambda x: x.time(cost, free=True)):
            best = np.nanmin([[size(x) for x in each] for each in others], axis=0)
            row += [f"{size(x) / b:.2f}" for x, b in zip(found[OURS], best, strict=True)]
        gains.append((condition.name, *row))
    print("\nIs the explicit step limited by stability?", flush=True)
    table(near)
    usual = 4 * cost["rates"]
    arrowed = 6 * (cost["rates"] + cost["solution"]) + cost["Jacobian"] + cost["factors"]
    named = ", ".join(f"{name} {x:.1f}" for name, x in cost.items())
    print(f"\nProcessor time of the parts of a step, one of {LANES} bearings at a time [us]: {named}")
    print(f"An explicit step {usual:.0f}, one of RODAS4 {arrowed:.0f}: {arrowed / usual:.1f} times as much")
    print("\nThe package's explicit steps over those of the best method with Jacobians, and their time, by these parts")
    table(gains)
    revolutions()


if __name__ == "__main__":
    main()
