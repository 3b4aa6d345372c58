"""Stability edges and worst values of a design over a range of speed, with exact derivatives by the design.

The motion is calm where the synchronous orbit is stable. Edges of that stable range are bifurcations, which are
followed from the nearest design at which they are known. The orbits between are followed through the operating range,
and their worst value over speed counts. Its gradient is that at fixed speed (the envelope theorem).
"""

import contextlib
import dataclasses
from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float
from scipy.optimize import minimize_scalar

from .._errors import ArgumentError, InputError
from .._pytrees import compiled
from ..analysis import land_reading
from ..orbits import (
    Followed,
    Orbit,
    Point,
    Sensitivity,
    StableRange,
    branch,
    follow_all,
    orbit_slopes,
    periodic_orbit,
    stable_range,
    synchronous_orbits,
    unstable_ranges,
)
from ..solve import REVOLUTION, AbstractMethod, FixedSteps, strobe_map
from .design_space import DesignSpace, Value
from .requirements import Requirement, balance_grade


PARTS = 4096
"""Samples of an orbit per revolution. In contact with the land, the derivatives of its force, of the least film and of
the drag are accurate to 0.1 %, and to 2 % with 512 samples."""
REACH = 0.5, 2.0
"""Limits of the speeds searched for edges, over the lower and the upper end of the operating range."""
RIVAL = 0.02
"""Local maxima over speed are refined within this fraction of the spread of values from the largest one."""
FAR = 0.1  # largest change of an orbit from design to design, in units of the scale
BESIDE = 1e-3  # relative distance from an edge within which orbits are ignored
PEAKING = 0.8  # smaller maxima of the multiplier are ignored
WORST_AT = 1e-4  # relative accuracy of the speed of a worst value
NO_ORBIT = 1e30  # a quantity of a speed without an orbit is minus this
KEPT = 1e-3  # violation up to which a requirement still counts as kept
RPM = 30 / np.pi
READ = "land force", "drag", "film", "contact"


# --- orbits through a range -----------------------------------------------------------------------------------------


def _readings(system: Any, speed: Array, state: Array, method: AbstractMethod) -> Float[Array, "4"]:
    """Return the largest land force [N], the mean power lost by shear of the film [W] and minus the least distances of
    the cage from the land and from the onset of contact [m] over a revolution; maxima are interpolated by a
    parabola."""
    strobe = strobe_map(system, speed, method)

    def part(i: Array, carry: tuple) -> tuple:
        y, seen = carry
        tau = i.astype(float) * (REVOLUTION / PARTS)
        seen = seen.at[i].set(land_reading(system, speed, tau, jnp.stack(y)))
        return strobe.part(y, i, PARTS).y, seen

    start = tuple(state[i] for i in range(state.size)), jnp.zeros((PARTS, 3))
    _, seen = jax.lax.fori_loop(0, PARTS, part, start)
    peaking = seen[:, ::2]
    top = jnp.argmax(jax.lax.stop_gradient(peaking), axis=0)
    before, here, after = (peaking[(top + k) % PARTS, jnp.arange(2)] for k in (-1, 0, 1))
    bend = before - 2 * here + after
    highest = here - jnp.where(bend < 0, (after - before) ** 2 / (8 * jnp.where(bend < 0, bend, 1.0)), 0.0)
    distances = highest[1] - jnp.stack([1.0, system.contact.onset]) * system.clearance
    return jnp.stack([highest[0], jnp.mean(seen[:, 1]), *distances])


@compiled
def _read(designs: DesignSpace, place: Array, speed: Array, state: Array, method: AbstractMethod) -> Array:
    return _readings(designs(place), speed, state, method)


@compiled
def _read_moved(
    designs: DesignSpace, place: Array, speed: Array, state: Array, moves: Array, method: AbstractMethod
) -> Array:
    """Return the gradient of the readings, including the change of the orbit with the design."""
    at = lambda x: _readings(designs(x), speed, state + moves @ (x - place), method)
    return jax.jacfwd(at)(place)


class Through(NamedTuple):
    """Orbits of one design over a range: ascending speeds [rad/s], states [SI], moduli of the largest multipliers."""

    space: DesignSpace
    place: Float[np.ndarray, " n"]
    speeds: Float[np.ndarray, " orbits"]
    states: Float[np.ndarray, "orbits dim"]
    sizes: Float[np.ndarray, " orbits"]

    @classmethod
    def of(cls, space: DesignSpace, place: Float[np.ndarray, " n"], orbit: Orbit, low: float, high: float) -> "Through":
        """Continue an orbit between two speeds, up to the nearest folds, where the branch turns back in speed."""
        found = branch(space.model(place), orbit, lower=low, upper=high)
        speed, state = float(orbit.speed), np.asarray(orbit.state)
        away = np.abs(found.speed / speed - 1) + np.linalg.norm(found.state - state, axis=1) / np.linalg.norm(state)
        rises = np.diff(found.speed) > 0
        here = min(int(np.argmin(away)), rises.size - 1)
        turns = np.flatnonzero(rises != rises[here])
        first = int(np.max(turns[turns < here], initial=-1)) + 1
        last = int(np.min(turns[turns > here], initial=rises.size)) + 1
        some = first + np.argsort(found.value[first:last])
        sizes = np.abs(found.multipliers[some]).max(axis=1)
        return cls(space, place, found.value[some], found.state[some], sizes)

    def state(self, speed: float) -> Float[np.ndarray, " dim"]:
        """State of the orbit at a speed, interpolated."""
        return np.array([np.interp(speed, self.speeds, c) for c in self.states.T])

    def orbit(self, speed: float) -> Orbit:
        return periodic_orbit(self.space.model(self.place), speed, guess=self.state(speed))

    def size(self, orbit: Orbit, name: str, speed: float | None = None) -> float:
        """Value of a quantity for an orbit, larger being worse, -inf if it did not converge; or for the interpolated
        state at another speed, with the method of this orbit and at least one step per sample."""
        if speed is None and not bool(orbit.converged):
            return -np.inf
        if name == "multiplier":
            return float(np.abs(orbit.multipliers[0]))
        at = (orbit.speed, orbit.state) if speed is None else (speed, self.state(speed))
        place, *at = jnp.asarray(self.place), *(jnp.asarray(x, dtype=float) for x in at)
        return float(_read(self.space, place, *at, _reader(orbit))[READ.index(name)])

    def value(self, orbit: Orbit, name: str) -> Value:
        """Value of a quantity for an orbit, with its gradient."""
        moves, rpm = orbit_slopes(self.space, self.place, orbit), float(orbit.speed) * RPM
        if name == "multiplier":
            return Value(moves.multiplier, moves.multiplier_slope, rpm)
        at = jnp.asarray(self.place), orbit.speed, orbit.state, jnp.asarray(moves.state_slope)
        slope = np.asarray(_read_moved(self.space, *at, _reader(orbit))[READ.index(name)])
        sign = -1.0 if name in ("film", "contact") else 1.0
        return Value(sign * self.size(orbit, name), sign * slope, rpm)

    def largest(self, name: str, low: float, high: float) -> Orbit:
        """Orbit between two speeds at which a quantity is largest; its speed is accurate to `WORST_AT`."""
        minus = lambda speed: -max(-NO_ORBIT, self.size(self.orbit(float(speed)), name))  # also for NaN
        found = minimize_scalar(minus, bounds=(low, high), method="bounded", options={"xatol": WORST_AT * high})
        return self.orbit(float(found.x))

    def worst(self, name: str, low: float, high: float) -> Value:
        """Worst value of a quantity between two speeds."""
        inner = (self.speeds > low) & (self.speeds < high)
        ends = [self.orbit(low), self.orbit(high)]
        by_branch = self.sizes[inner]
        if name != "multiplier":
            by_branch = [self.size(ends[0], name, speed) for speed in self.speeds[inner].tolist()]
        first, last = (self.size(orbit, name) for orbit in ends)
        speeds, sizes = np.array([low, *self.speeds[inner], high]), np.array([first, *by_branch, last])
        near_top = [k for k in _maxima(sizes) if sizes[k] >= sizes.max() - RIVAL * np.ptp(sizes)]
        orbits = [*ends, *(self.largest(name, speeds[k - 1], speeds[k + 1]) for k in near_top)]
        return self.value(max(orbits, key=lambda orbit: self.size(orbit, name)), name)


def _maxima(sizes: np.ndarray) -> list[int]:
    """Indices of the interior local maxima."""
    return [k for k in range(1, sizes.size - 1) if sizes[k - 1] < sizes[k] >= sizes[k + 1]]


def _reader(orbit: Orbit) -> AbstractMethod:
    method: Any = orbit.method
    return FixedSteps(method.solver, jnp.asarray(PARTS * -(-int(orbit.steps) // PARTS)))


# --- edges ----------------------------------------------------------------------------------------------------------


class _Anchor(NamedTuple):
    """Design at which edges are known; for a stable range also one of its orbits, over the scale, and its speed."""

    place: Float[np.ndarray, " n"]
    edges: Mapping[str, Point | None]
    state: Any = None
    speed: float = float("nan")


@dataclasses.dataclass
class _AroundEdges:
    """Edges around a range of cage speed [rad/s], followed from the nearest design at which they are known."""

    space: DesignSpace
    operating: tuple[float, float]

    def __post_init__(self):
        low, high = self.operating
        self.limits = REACH[0] * low, REACH[1] * high
        self.handed_over = list[str]()
        self._anchors = [self._first()]

    def _first(self) -> _Anchor:
        """Edges of the given design. **Raises:** `InputError` if there are none."""
        raise NotImplementedError

    def _nearest(self, place: np.ndarray) -> _Anchor:
        return min(reversed(self._anchors), key=lambda a: float(np.sum((a.place - place) ** 2)))  # of equals the last

    def _followed(self, near: _Anchor, place: np.ndarray) -> dict[str, Followed]:
        """Follow the edges of an anchor to a place."""
        known = {name: point for name, point in near.edges.items() if point is not None}
        return follow_all(self.space.model(near.place), known, self.space.model(place), self.limits)

    def _keep(self, near: _Anchor, place: np.ndarray, edges: Mapping[str, Sensitivity | None]) -> None:
        """Make a place an anchor, from which edges are followed too."""
        at = lambda edge: Point(edge.kind, edge.value_rpm / RPM, np.asarray(edge.state), steps=edge.steps)
        points = {name: None if edge is None else at(edge) for name, edge in edges.items()}
        self._anchors.append(near._replace(place=place.copy(), edges=points))


@dataclasses.dataclass
class UnstableWidth(_AroundEdges):
    """Total width of the unstable ranges [rpm] within a range of speed, with its exact gradient.

    A search at the first design finds the edges. An unstable range vanishes where its two edges meet.
    """

    def _first(self) -> _Anchor:
        found = unstable_ranges(synchronous_orbits(self.space.system, *self.operating))
        if not found.edges:
            raise InputError("The range of speed must have an edge of an unstable range within it, but has none.")
        return _Anchor(self.space.place, found.edges)

    def values(self, place: Float[np.ndarray, " n"], wanted: Sequence[Requirement]) -> dict[str, Value] | str:
        """`width` and, if wanted, `balance` at a place of the design space; or why they are not known."""
        near = self._nearest(place)
        found = self._followed(near, place)
        low, high = (end * RPM for end in self.operating)
        total, slope = 0.0, np.zeros(len(self.space.names))
        for zone in sorted({name.rsplit(" ", 1)[0] for name in near.edges}):
            both = {end: found.get(f"{zone} {end}") for end in ("onset", "exit")}
            if all(f is not None and f.ended == "turned back" for f in both.values()):
                continue
            for (end, f), sign, at in zip(both.items(), (-1.0, 1.0), (low, high), strict=True):
                if f is not None and f.edge is None:
                    return f"{zone} {end}: {f.ended}"
                if f is not None and f.edge is not None and low < (at := f.edge.value_rpm) < high:
                    slope = slope + sign * self.space.slope_of(f.edge.derivative)
                total += sign * float(np.clip(at, low, high))
        if all(f.edge is not None for f in found.values()):
            self._keep(near, place, {name: f.edge for name, f in found.items()})
        width = {"width": Value(total, slope)}
        graded = any(r.of == "balance" for r in wanted)
        return width | ({"balance": balance_grade(self.space, self.operating, place)} if graded else {})


@dataclasses.dataclass
class OperatingRange(_AroundEdges):
    """Edges and orbits of designs around an operating range, and the values that requirements concern.

    An edge that ends on the way from design to design, or no longer bounds the stable range, is replaced by one that
    does, which `handed_over` records. Orbits are followed over a `margin` beyond both ends too, per cent of their
    speeds.
    """

    margin: float = 0.0

    def _first(self) -> _Anchor:
        (low, high), part = self.operating, self.margin / 100
        self.wider = (1 - part) * low, (1 + part) * high
        self._through: dict[bytes, Through | None] = {}
        found = stable_range(self.space.system, self.operating, self.limits)
        if found is None:
            raise InputError(
                f"The cage must have a stable orbit somewhere in its operating range, {low * RPM:.0f} to "
                f"{high * RPM:.0f} rpm of the cage, but none was found."
            )
        return self._anchor(self.space.place, found)

    def _anchor(self, place: np.ndarray, found: StableRange) -> _Anchor:
        """Anchor at a place with its stable range. **Raises:** `InputError` for an end that is no bifurcation."""
        for point, end, limit in zip((found.lower, found.upper), found.ends, self.limits):
            if point is None and abs(end - limit) > 1e-6 * limit:
                raise InputError(
                    f"The stable range ends near {end * RPM:.0f} rpm of the cage and no bifurcation is found "
                    "there: it must have exact edges to be designed by them (`search` `surrogate` needs none)."
                )
        (first, last), (low, high) = found.ends, self.operating
        low, high = max(first, low), min(last, high)
        speed = (low + high) / 2 if low <= high else (first + last) / 2
        edges = {"lower": found.lower, "upper": found.upper}
        return _Anchor(place.copy(), edges, found.state_at(speed) / self._scale(place, speed), speed)

    def _scale(self, place: np.ndarray, speed: float) -> np.ndarray:
        return np.array([float(c) for c in self.space.model(place).scale(speed)])

    def edges(self, place: Float[np.ndarray, " n"]) -> dict[str, Sensitivity | None] | str:
        """Edges of the stable range, `lower` and `upper`, None where it is open; or why there are none.

        They are kept if an unstable range appears between them: `peak` then exceeds 1, and its gradient leads back.
        """
        near = self._nearest(place)
        moved = self._followed(near, place)
        found = dict.fromkeys(near.edges) | {name: f.edge for name, f in moved.items()}
        if all(f.edge is not None and f.edge.bounds for f in moved.values()):
            sizes = self._between(place, found)[1]
            if any(sizes[k] >= 1 for k in _maxima(sizes)):
                return found
            if np.all(sizes <= 1) and self._stable_ends(place, found):
                through = self.through(place)
                state = near.state if through is None else through.state(near.speed) / self._scale(place, near.speed)
                self._keep(near._replace(state=state), place, found)
                return found
        return self._searched_again(place, near, moved)

    def _searched_again(
        self, place: np.ndarray, near: _Anchor, moved: Mapping[str, Followed]
    ) -> dict[str, Sensitivity | None] | str:
        """Search for the edges that now bound the stable range, from its orbit."""
        guess = (near.state * self._scale(place, near.speed), near.speed)
        search = partial(stable_range, self.space.model(place), self.operating, self.limits)
        found = search([guess]) or search()
        if found is None:
            return "no stable orbit in the operating range"
        try:
            anchor = self._anchor(place, found)
        except InputError as error:
            return str(error)
        solved = {name: f.edge for name, f in self._followed(anchor, place).items()}
        if lost := [name for name, edge in solved.items() if edge is None]:
            return f"the {' and '.join(lost)} edge is not located"
        self._anchors.append(anchor)
        for name in anchor.edges:
            old, now = moved[name].edge if name in moved else None, solved.get(name)
            if old is None or now is None or abs(old.value_rpm - now.value_rpm) > 1:
                why = (moved[name].ended if name in moved else "") or "orbits between became unstable"
                there = "open" if now is None else f"{now.value_rpm:.0f} rpm, {now.kind}"
                self.handed_over.append(f"{name} edge: {why}; now {there}")
        return {name: solved.get(name) for name in anchor.edges}

    def begin(self, place: Float[np.ndarray, " n"]) -> None:
        """Accept the edges that a search finds at a place, even if they jumped on the way to it."""
        told = len(self.handed_over)
        self._searched_again(place, self._nearest(place), {})
        del self.handed_over[told:]

    def values(self, place: Float[np.ndarray, " n"], wanted: Sequence[Requirement]) -> dict[str, Value] | str:
        """Values of all requirements at a place of the design space; or why there are none."""
        before, names = len(self.handed_over), {r.of for r in wanted}
        found = self.margins(place)
        if isinstance(found, str):
            return found
        jumped = self.handed_over[before:]
        broken = [r.of.split()[0] for r in wanted[:2] if r.slack(found[r.of])[0] < -KEPT]
        if any(words.split()[0] in broken for words in jumped):
            self._anchors.pop()  # beyond a jump of an edge, where no gradient leads back
            del self.handed_over[before:]
            return "; ".join(jumped)
        if "balance" in names:
            found["balance"] = balance_grade(self.space, self.operating, place)
        worst = self.worst(place, tuple(name for name in ("multiplier", *READ) if name in names))
        return worst if isinstance(worst, str) else found | worst

    def margins(self, place: Float[np.ndarray, " n"]) -> dict[str, Value] | str:
        """Margins of both ends of the operating range to the edges [per cent of the end's speed], negative outside the
        stable range, and the `peak`; or why there are none. Without an edge, the margin to the limit of the search."""
        edges = self.edges(place)
        if isinstance(edges, str):
            return edges
        found = {"peak": self.peak(place, edges)}
        for name, end, limit, sign in zip(("lower", "upper"), self.operating, self.limits, (-1.0, 1.0)):
            edge = edges[name]
            if edge is None:
                found[f"{name} margin"] = Value(100 * sign * (limit / end - 1), np.zeros(place.size))
            else:
                slope = 100 * sign / (end * RPM) * self.space.slope_of(edge.derivative)
                found[f"{name} margin"] = Value(100 * sign * (edge.value_rpm / (end * RPM) - 1), slope, edge.value_rpm)
        return found

    # --- orbits between the edges -----------------------------------------------------------------------------------

    def _orbit(self, place: np.ndarray) -> Orbit | None:
        """Orbit of the stable range at a place, continued from the nearest known one in parts of the way."""
        near = self._nearest(place)
        state, done, part = near.state, 0.0, 1.0
        while part > 0.05:
            there = near.place + min(done + part, 1.0) * (place - near.place)
            scale = self._scale(there, near.speed)
            orbit = periodic_orbit(self.space.model(there), near.speed, guess=state * scale)
            if bool(orbit.converged) and np.max(np.abs(np.asarray(orbit.state) / scale - state)) < FAR:
                done, state = min(done + part, 1.0), np.asarray(orbit.state) / scale
                if done == 1:
                    return orbit
            else:
                part /= 2
        return None

    def through(self, place: Float[np.ndarray, " n"]) -> Through | None:
        """Orbits through the operating range and its margins; None if they are lost."""
        key = np.asarray(place).tobytes()
        if key not in self._through:
            orbit, (low, high) = self._orbit(place), self.wider
            self._through[key] = None
            if orbit is not None and low < float(orbit.speed) < high:
                with contextlib.suppress(ArgumentError):  # the branch through the orbit cannot be followed
                    self._through[key] = Through.of(self.space, place, orbit, low, high)
        return self._through[key]

    def _between(self, place: np.ndarray, edges: Mapping[str, Sensitivity | None]) -> tuple[np.ndarray, np.ndarray]:
        """Ascending speeds of the orbits between the edges, and moduli of their largest multipliers, 1 at an edge."""
        if (through := self.through(place)) is None:
            return np.zeros(0), np.zeros(0)
        (low, high), lower, upper = self.wider, edges["lower"], edges["upper"]
        low = low if lower is None else max(low, lower.value_rpm / RPM)
        high = high if upper is None else min(high, upper.value_rpm / RPM)
        inside = (through.speeds > low * (1 + BESIDE)) & (through.speeds < high * (1 - BESIDE))
        first, last = ([1.0] * (end not in self.wider) for end in (low, high))
        speeds = [low] * len(first), through.speeds[inside], [high] * len(last)
        return np.concatenate(speeds), np.concatenate([first, through.sizes[inside], last])

    def _stable_ends(self, place: np.ndarray, edges: Mapping[str, Sensitivity | None]) -> bool:
        """True if the orbits reach the ends of the margins and are stable there, where the edges lie beyond them."""
        through = self.through(place)
        for name, end, sign in (("lower", self.wider[0], 1.0), ("upper", self.wider[1], -1.0)):
            edge = edges[name]
            if through is not None and (edge is None or sign * (end - edge.value_rpm / RPM) > BESIDE * end):
                reached = through.speeds[0] <= end * (1 + BESIDE) and end * (1 - BESIDE) <= through.speeds[-1]
                if not reached or through.size(through.orbit(end), "multiplier") >= 1:
                    return False
        return True

    def peak(self, place: Float[np.ndarray, " n"], edges: Mapping[str, Sensitivity | None]) -> Value:
        """Largest local maximum of the multiplier between the edges; beyond 1 there is a new unstable range."""
        through, (speeds, sizes) = self.through(place), self._between(place, edges)
        inner = [k for k in _maxima(sizes) if sizes[k] > PEAKING]
        if through is None or not inner:
            return Value(0.0, np.zeros(place.size))
        k = max(inner, key=lambda k: sizes[k])
        return through.value(through.largest("multiplier", speeds[k - 1], speeds[k + 1]), "multiplier")

    def worst(self, place: Float[np.ndarray, " n"], names: tuple[str, ...]) -> dict[str, Value] | str:
        """Worst values over the operating range of some of `multiplier`, `film`, `contact`, `land force`, `drag`; or
        why there are none. `film` is the least distance of cage and land [m], and `contact` that from the onset of
        their contact, negative in contact."""
        if names and (through := self.through(place)) is not None:
            return {name: through.worst(name, *self.operating) for name in names}
        return "the orbits of the operating range are lost" if names else {}
