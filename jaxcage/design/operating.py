"""What a design does over its operating range, with exact derivatives by the design.

The range is calm where the synchronous orbit is stable. Edges of that stable range are bifurcations, which are followed
from design to design; the orbits between are followed through the operating range, and of what they do the worst counts
wherever it is. A worst value moves with the design as it does at its own speed, which is held (the envelope theorem).
"""

import dataclasses
from collections.abc import Callable, Mapping
from functools import partial
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float
from scipy.optimize import minimize_scalar

from .._errors import InputError
from .._parameters import parameters, replace
from .._pytrees import compiled
from ..models import AbstractForcedSystem
from ..orbits import (
    Branch,
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
)
from ..solve import REVOLUTION, AbstractMethod, FixedSteps, strobe_map
from .loads import land_reading
from .surrogate import Bounds, checked_bounds


PARTS = 4096
"""Phases of a revolution at which an orbit is read. Where the land is touched its force, the least film and the drag
have derivatives to 0.1 % by so many, and to 2 % by 512."""
REACH = 0.5, 2.0
"""Limits of speed within which edges are looked for, over the lower and the upper end of the operating range."""
RIVAL = 0.02
"""Local maxima over speed that are nearer than this part of the largest value are refined too."""
FAR = 0.1  # an orbit moves by less from design to design, in units of the scale
BESIDE = 1e-3  # orbits nearer to an edge are not looked at, relative
PEAKING = 0.8  # smaller multipliers are no concern
WORST_AT = 1e-4  # accuracy of the speed of a worst value, relative


class Value(NamedTuple):
    """A number that a design is judged by, its derivatives by the place in the design space, and the cage speed [rpm]
    to which it belongs."""

    value: float
    slope: Float[np.ndarray, " n"]
    rpm: float = float("nan")


class DesignSpace(eqx.Module):
    """A design, the parameters that may change, and their bounds: a function from a place between the bounds, 0 to 1 in
    each parameter, to the design there, which JAX differentiates."""

    system: AbstractForcedSystem
    lower: Float[np.ndarray, " n"]
    """Smallest values [SI]."""
    span: Float[np.ndarray, " n"]
    """Distances of the bounds [SI]."""
    names: tuple[str, ...] = eqx.field(static=True)

    @classmethod
    def of(cls, system: AbstractForcedSystem, vary: Bounds) -> "DesignSpace":
        """The space within bounds. **Raises:** `ValueError` for bounds that make no sense."""
        checked_bounds(system, vary)
        low, high = np.array(list(vary.values()), dtype=float).T
        return cls(system, low, high - low, tuple(vary))

    @property
    def place(self) -> Float[np.ndarray, " n"]:
        """Place of the design itself."""
        known = parameters(self.system)
        return (np.array([float(known[name]) for name in self.names]) - self.lower) / self.span

    def values(self, place: Float[np.ndarray, " n"]) -> dict[str, float]:
        """Parameters [SI] at a place."""
        return dict(zip(self.names, (self.lower + place * self.span).tolist(), strict=True))

    def model(self, place: Float[np.ndarray, " n"]) -> AbstractForcedSystem:
        """The design at a place."""
        return replace(self.system, **self.values(place))

    def slope_of(self, derivative: Mapping[str, float]) -> Float[np.ndarray, " n"]:
        """Derivatives by the place, from derivatives by the parameters [SI]."""
        return np.array([derivative[name] for name in self.names]) * self.span

    def __call__(self, place: Float[Array, " n"]) -> AbstractForcedSystem:
        values = self.lower + place * self.span
        return replace(self.system, **{name: values[i] for i, name in enumerate(self.names)})


@compiled
def function_value(function: Callable[[Any], Any], designs: DesignSpace, place: Array) -> tuple[Array, Array]:
    """Return a function of the design and its derivatives by the place."""
    f = lambda x: jnp.asarray(function(designs(x)), dtype=float)
    slope, value = jax.jacfwd(lambda x: (f(x),) * 2, has_aux=True)(place)
    return value, slope


# --- readings along an orbit ---------------------------------------------------------------------------------------


def _readings(system: Any, speed: Array, state: Array, method: AbstractMethod) -> Float[Array, "3"]:
    """Return the largest land force [N], the mean power to shear the film [W] and the largest distance of the cage from
    the middle [m] over a revolution from a state; largest values are read between the samples, by a parabola."""
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
    return jnp.stack([highest[0], jnp.mean(seen[:, 1]), highest[1]])


@compiled
def _read(designs: DesignSpace, place: Array, speed: Array, state: Array, method: AbstractMethod) -> Array:
    return _readings(designs(place), speed, state, method)


@compiled
def _read_moved(
    designs: DesignSpace, place: Array, speed: Array, state: Array, moves: Array, method: AbstractMethod
) -> Array:
    """Return the derivatives of the readings by the place, the orbit moving with it."""
    at = lambda x: _readings(designs(x), speed, state + moves @ (x - place), method)
    return jax.jacfwd(at)(place)


# --- the range ------------------------------------------------------------------------------------------------------


class _Anchor(NamedTuple):
    """A design at which the edges of the stable range are known, and one of its orbits."""

    place: Float[np.ndarray, " n"]
    edges: dict[str, Point | None]
    state: Float[np.ndarray, " dim"]
    """Over the scale of the state."""
    speed: float


@dataclasses.dataclass
class OperatingRange:
    """The edges and orbits of designs around an operating range, and what they are worth.

    Edges and orbits are followed from the nearest design at which they are known. An edge that ends on the way, or past
    which the orbit was unstable already, is replaced by the one that bounds the stable range now; `handed_over` says
    so in words.
    """

    space: DesignSpace
    operating: tuple[float, float]
    """Ends of the range of cage speed [rad/s]."""
    margin: float = 0.0
    """Per cent of speed beyond both ends over which orbits are followed as well."""
    method: AbstractMethod | None = None

    def __post_init__(self):
        low, high = self.operating
        self.limits = REACH[0] * low, REACH[1] * high
        self.wider = (1 - self.margin / 100) * low, (1 + self.margin / 100) * high
        self._through: dict[bytes, Branch | None] = {}
        self.handed_over = list[str]()
        found = stable_range(self.space.system, self.operating, self.limits, method=self.method)
        if found is None:
            raise InputError(
                f"The cage must have a stable orbit somewhere in its operating range, {low * 30 / np.pi:.0f} to "
                f"{high * 30 / np.pi:.0f} rpm of the cage, but none was found."
            )
        self._anchors = [self._anchor(self.space.place, found)]

    def _anchor(self, place: np.ndarray, found: StableRange) -> _Anchor:
        """The anchor at a place with its stable range. **Raises:** `InputError` for an end that is no bifurcation."""
        for point, end, limit in zip((found.lower, found.upper), found.ends, self.limits):
            if point is None and abs(end - limit) > 1e-6 * limit:
                raise InputError(
                    f"The stable range ends near {end * 30 / np.pi:.0f} rpm of the cage and no bifurcation is found "
                    "there: it must have exact edges to be designed by them (`search` `surrogate` needs none)."
                )
        (first, last), (low, high) = found.ends, self.operating
        low, high = max(first, low), min(last, high)
        speed = (low + high) / 2 if low <= high else (first + last) / 2
        edges = {"lower": found.lower, "upper": found.upper}
        return _Anchor(place.copy(), edges, found.state_at(speed) / self._scale(place, speed), speed)

    def _scale(self, place: np.ndarray, speed: float) -> np.ndarray:
        return np.array([float(c) for c in self.space.model(place).scale(speed)])

    def _nearest(self, place: np.ndarray) -> _Anchor:
        return min(self._anchors, key=lambda a: float(np.sum((a.place - place) ** 2)))

    def forget(self, place: Float[np.ndarray, " n"]) -> None:
        """Follow nothing from this place any more."""
        self._anchors = [a for a in self._anchors if not np.array_equal(a.place, place)]

    def edges(self, place: Float[np.ndarray, " n"]) -> dict[str, Sensitivity | None] | str:
        """The edges of the stable range, `lower` and `upper`, None where it is open; or why there are none."""
        near, model = self._nearest(place), self.space.model(place)
        known = {name: point for name, point in near.edges.items() if point is not None}
        edges = follow_all(self.space.model(near.place), known, model, self.limits, self.method)
        found: dict[str, Sensitivity | None] = {name: None for name in near.edges}
        found |= {name: f.edge for name, f in edges.items()}
        if all(f.edge is not None and f.edge.bounds for f in edges.values()) and self._stable_between(place, found):
            points = {name: edge and point_of(edge, near.edges[name]) for name, edge in found.items()}
            self._anchors.append(near._replace(place=place.copy(), edges=points))
            return found
        return self._searched_again(place, near, edges)

    def _searched_again(
        self, place: np.ndarray, near: _Anchor, edges: Mapping[str, Followed]
    ) -> dict[str, Sensitivity | None] | str:
        """The edges that bound the stable range now, by a search from its orbit."""
        model = self.space.model(place)
        guess = (near.state * self._scale(place, near.speed), near.speed)
        search = partial(stable_range, model, self.operating, self.limits, method=self.method)
        found = search([guess]) or search()
        if found is None:
            return "no stable orbit in the operating range"
        try:
            anchor = self._anchor(place, found)
        except InputError as error:
            return str(error)
        known = {name: point for name, point in anchor.edges.items() if point is not None}
        solved = {name: f.edge for name, f in follow_all(model, known, model, self.limits, self.method).items()}
        if lost := [name for name, edge in solved.items() if edge is None]:
            return f"the {' and '.join(lost)} edge is not located"
        self._anchors.append(anchor)
        for name in anchor.edges:
            old, now = edges[name].edge if name in edges else None, solved.get(name)
            if old is None or now is None or abs(old.value_rpm - now.value_rpm) > 1:
                why = (edges[name].ended if name in edges else "") or "orbits between became unstable"
                there = "open" if now is None else f"{now.value_rpm:.0f} rpm, {now.kind}"
                self.handed_over.append(f"{name} edge: {why}; now {there}")
        return {name: solved.get(name) for name in anchor.edges}

    def margins(self, place: Float[np.ndarray, " n"]) -> dict[str, Value] | str:
        """Distances of both ends of the operating range from the edges [per cent of the end's speed], negative where
        the end lies outside; or why there are none. Where no edge is found, the distance of the search's limit."""
        edges = self.edges(place)
        if isinstance(edges, str):
            return edges
        found = {"peak": self.peak(place, edges)}
        for name, end, limit, sign in zip(("lower", "upper"), self.operating, self.limits, (-1.0, 1.0)):
            edge, end_rpm = edges[name], end * 30 / np.pi
            if edge is None:
                found[f"{name} margin"] = Value(100 * sign * (limit / end - 1), np.zeros(place.size))
                continue
            slope = 100 * sign / end_rpm * self.space.slope_of(edge.derivative)
            found[f"{name} margin"] = Value(100 * sign * (edge.value_rpm / end_rpm - 1), slope, edge.value_rpm)
        return found

    def _orbit(self, place: np.ndarray) -> Orbit | None:
        """An orbit of the stable range at a place, found from the nearest known one in parts of the way."""
        near = self._nearest(place)
        state, done, part = near.state, 0.0, 1.0
        while part > 0.05:
            there = near.place + min(done + part, 1.0) * (place - near.place)
            scale = self._scale(there, near.speed)
            orbit = periodic_orbit(self.space.model(there), near.speed, guess=state * scale, method=self.method)
            if bool(orbit.converged) and np.max(np.abs(np.asarray(orbit.state) / scale - state)) < FAR:
                done, state = min(done + part, 1.0), np.asarray(orbit.state) / scale
                if done == 1:
                    return orbit
            else:
                part /= 2
        return None

    def through(self, place: Float[np.ndarray, " n"]) -> Branch | None:
        """The orbits through the operating range and the margins beside it, by continuation; None if they are lost."""
        key = np.asarray(place).tobytes()
        if key not in self._through:
            orbit, (low, high) = self._orbit(place), self.wider
            if orbit is not None and not low < float(orbit.speed) < high:
                orbit = None
            given = {"lower": low, "upper": high, "method": self.method}
            found = None if orbit is None else branch(self.space.model(place), orbit, **given)
            self._through[key] = found if found is None or orbit is None else _between_folds(found, orbit)
        return self._through[key]

    def _between(self, through: Branch, edges: Mapping[str, Sensitivity | None]) -> tuple[np.ndarray, np.ndarray]:
        """Speeds of a branch between the edges, ascending, and the sizes of the largest multipliers there."""
        (low, high), lower, upper = self.wider, edges["lower"], edges["upper"]
        low = low if lower is None else max(low, lower.value_rpm * np.pi / 30)
        high = high if upper is None else min(high, upper.value_rpm * np.pi / 30)
        order = np.argsort(through.value)
        speeds, sizes = through.value[order], np.abs(through.multipliers[order]).max(axis=1)
        inside = (speeds > low * (1 + BESIDE)) & (speeds < high * (1 - BESIDE))
        return speeds[inside], sizes[inside]

    def _stable_between(self, place: np.ndarray, edges: Mapping[str, Sensitivity | None]) -> bool:
        """Whether the orbits between the edges are stable, as far as the margins reach."""
        through = self.through(place)
        if through is None:
            return True
        if np.any(self._between(through, edges)[1] >= 1):
            return False
        for name, end, sign in (("lower", self.wider[0], 1.0), ("upper", self.wider[1], -1.0)):
            edge = edges[name]
            if (
                edge is None or sign * (end - edge.value_rpm * np.pi / 30) > BESIDE * end
            ):  # the edge is beyond the margin
                orbit = self._orbit_at(through, place, end)
                if bool(orbit.converged) and float(np.abs(orbit.multipliers[0])) >= 1:
                    return False
        return True

    def peak(self, place: Float[np.ndarray, " n"], edges: Mapping[str, Sensitivity | None]) -> Value:
        """The largest multiplier at a maximum between the edges: where it passes 1, a new unstable range is born."""
        through, none = self.through(place), Value(0.0, np.zeros(place.size))
        if through is None:
            return none
        speeds, sizes = self._between(through, edges)
        inner = [k for k in range(1, sizes.size - 1) if sizes[k] > max(sizes[k - 1], sizes[k + 1], PEAKING)]
        if not inner:
            return none
        k = max(inner, key=lambda k: sizes[k])
        orbit = self._largest(through, place, "multiplier", speeds[k - 1], speeds[k + 1])
        moves = orbit_slopes(self.space, place, orbit)
        return Value(moves.multiplier, moves.multiplier_slope, float(orbit.speed) * 30 / np.pi)

    def worst(self, place: Float[np.ndarray, " n"], names: tuple[str, ...]) -> dict[str, Value] | str:
        """The worst over the operating range of some of `multiplier`, `film`, `land force`, `drag`; or why there is
        none. `film` is the least distance of cage and land [m], negative where they touch."""
        through = self.through(place)
        if through is None:
            return "the orbits of the operating range are lost"
        found = {}
        for name in names:
            orbit = self._worst_orbit(through, place, name)
            moves = orbit_slopes(self.space, place, orbit)
            value, slope = moves.multiplier, moves.multiplier_slope
            if name != "multiplier":
                at = jnp.asarray(place), orbit.speed, orbit.state
                value = float(self._read(place, float(orbit.speed), orbit.state, orbit)[READ.index(name)])
                moved = _read_moved(self.space, *at, jnp.asarray(moves.state_slope), _reader(orbit))
                slope = np.asarray(moved[READ.index(name)])
            if name == "film":
                clearance = function_value(_clearance, self.space, jnp.asarray(place))
                value, slope = float(clearance[0]) - value, np.asarray(clearance[1]) - slope
            found[name] = Value(value, slope, float(orbit.speed) * 30 / np.pi)
        return found

    def _size(self, place: np.ndarray, orbit: Orbit, name: str) -> float:
        if not bool(orbit.converged):
            return -np.inf
        if name == "multiplier":
            return float(np.abs(orbit.multipliers[0]))
        return self._read(place, float(orbit.speed), orbit.state, orbit)[READ.index(name)]

    def _orbit_at(self, through: Branch, place: np.ndarray, speed: float) -> Orbit:
        return periodic_orbit(self.space.model(place), speed, guess=_state_at(through, speed), method=self.method)

    def _largest(self, through: Branch, place: np.ndarray, name: str, low: float, high: float) -> Orbit:
        """The orbit between two speeds at which a quantity is largest, its speed to `WORST_AT`."""
        size = lambda speed: self._size(place, self._orbit_at(through, place, float(speed)), name)
        minus = lambda speed: -float(np.nan_to_num(size(speed), neginf=0.0))
        options = {"xatol": WORST_AT * high}
        found = minimize_scalar(minus, bounds=(low, high), method="bounded", options=options)
        return self._orbit_at(through, place, float(found.x))

    def _worst_orbit(self, through: Branch, place: np.ndarray, name: str) -> Orbit:
        """The orbit within the operating range at which a quantity is worst."""
        order, (low, high) = np.argsort(through.value), self.operating
        inside = (through.value[order] > low) & (through.value[order] < high)
        inner = through.value[order][inside]
        speeds, ends = np.concatenate([[low], inner, [high]]), [self._orbit_at(through, place, s) for s in (low, high)]
        if name == "multiplier":
            middle = np.abs(through.multipliers[order]).max(axis=1)[inside]
        else:
            at = lambda speed: self._read(place, speed, _state_at(through, speed), ends[0])
            middle = np.array([at(speed)[READ.index(name)] for speed in inner])
        sizes = np.concatenate([[self._size(place, ends[0], name)], middle, [self._size(place, ends[1], name)]])
        peaks = [k for k in range(1, sizes.size - 1) if sizes[k - 1] < sizes[k] >= sizes[k + 1]]
        near_top = sizes.max() - RIVAL * np.ptp(sizes)
        inner_peaks = [
            self._largest(through, place, name, speeds[k - 1], speeds[k + 1]) for k in peaks if sizes[k] >= near_top
        ]
        return max([*ends, *inner_peaks], key=lambda orbit: self._size(place, orbit, name))

    def _read(self, place: np.ndarray, speed: float, state: Any, like: Orbit) -> Float[np.ndarray, "3"]:
        """Readings of an orbit, by the method of another one."""
        at = jnp.asarray(place), jnp.asarray(speed, dtype=float), jnp.asarray(state)
        return np.asarray(_read(self.space, *at, _reader(like)))


READ = "land force", "drag", "film"


def _clearance(model: Any) -> Any:
    return model.clearance


def _between_folds(found: Branch, orbit: Orbit) -> Branch:
    """The part of a branch about one of its orbits in which the speed rises or falls throughout: past a fold there are
    other orbits at the same speeds."""
    size = float(orbit.speed), np.asarray(orbit.state)
    away = np.abs(found.speed / size[0] - 1) + np.linalg.norm(found.state - size[1], axis=1) / np.linalg.norm(size[1])
    rises = np.diff(found.speed) > 0
    here = min(int(np.argmin(away)), rises.size - 1)
    turns = np.flatnonzero(rises != rises[here])
    first = int(np.max(turns[turns < here], initial=-1)) + 1
    last = int(np.min(turns[turns > here], initial=rises.size)) + 1
    arrays = ("value", "speed", "state", "multipliers", "stable", "steps", "error")
    return dataclasses.replace(found, **{name: getattr(found, name)[first:last] for name in arrays})


def _state_at(through: Branch, speed: float) -> np.ndarray:
    order = np.argsort(through.value)
    return np.array([np.interp(speed, through.value[order], c) for c in through.state[order].T])


def _reader(orbit: Orbit) -> AbstractMethod:
    """The method by which an orbit is read: its own, with a step at least from one phase to the next."""
    method = orbit.method
    if not isinstance(method, FixedSteps):
        return method
    return FixedSteps(method.solver, jnp.asarray(PARTS * -(-int(orbit.steps) // PARTS)))


def point_of(edge: Sensitivity, before: Point | None) -> Point:
    """The bifurcation at which an edge was found, to follow it further."""
    assert before is not None
    speed = edge.value_rpm * np.pi / 30
    return Point(edge.kind, speed, np.asarray(edge.state), int(before.periods), edge.steps)
