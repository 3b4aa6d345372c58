"""Machine code of the whole bearing: one loop over its rollers within the rates of the integration loop.

The forces on a roller are traced once, as a function of that roller, cage and ring; the code runs it for each roller in
turn and adds up what the rollers pass on. Numbers are those of a lane: rollers one after the other (five numbers each),
cage and ring, all in units of the scale; the same of tangent vectors; and behind these what is integrated beside.
"""

import dataclasses
import functools
from collections.abc import Callable
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from .._form import Form, split
from ..forces import cos_sin
from ..models.whole import LEDGER, MEANS, MOVING, BearingAtSpeed, BearingState, Bodies, Passed, Rollers
from .ir import Value, number
from .loop import Code, Field, Layout, fixed_numbers
from .machine import March, Runner
from .program import Program, Sizes, program_of


INTEGRATED = (*LEDGER, *MEANS, "eccentricity_squared")
"""What is integrated over time beside the state."""
CLOCK = ("angle", "time")
"""Of the cage [rad], and since the beginning [s]: the first of what is integrated beside the state."""
WATCHED = ("lost", "pocket_force", "land_force", "roller_slip", "eccentricity")
"""Of what the largest values are kept. The first is more than 2 where a cage has left its land, or hardly turns."""
OF_ROLLER, OF_BODIES, PASSED = (len(x._fields) for x in (Rollers, Bodies, Passed))
LOST = 3.0
NORMAL = Passed._fields.index("normal")


@dataclasses.dataclass(frozen=True)
class _Roller:
    """A roller's rates and what it passes on, by itself and the bodies: moved are its place in the cage (cosine and
    sine), those of the cage's angle, numbers of the roller and the bodies, and tangents of both.

    Results are rates, what moves the bodies, their tangents, the rest of what is passed on, slip.
    """

    form: Form
    over_angle: bool
    tangents: int

    def __call__(self, i: Any, moved: Any, watched: Any, fixed: Any) -> Any:
        (cos_j, sin_j, cos, sin), numbers = moved[:4], moved[4:]
        _, at, scale, _ = self.form.filled(fixed)
        units = (*scale.rollers, *scale.bodies)
        pocket = cos * cos_j - sin * sin_j, sin * cos_j + cos * sin_j
        size = OF_ROLLER + OF_BODIES

        def go(y: Any) -> tuple[Any, Any]:
            y = [a * u for a, u in zip(y, units, strict=True)]
            rollers, cage = Rollers(*y[:OF_ROLLER]), Bodies(*y[OF_ROLLER:])
            rates, passed = at.roller_rates(rollers, cage, at.on_roller(rollers, cage, *pocket))
            pace = 1 / jnp.abs(cage.cage_speed) if self.over_angle else 1.0
            rates = [pace * x / u for x, u in zip(rates, units, strict=False)]
            return _floats((*rates, *passed[:MOVING])), _floats((*passed[MOVING:], at.slip(rollers.spin)))

        return _with_tangents(go, numbers, size, self.tangents), ()


@dataclasses.dataclass(frozen=True)
class _Bodies:
    """Rates of cage and ring: moved are those of the cage's angle (cosine and sine), numbers of the bodies, sums of
    what moves them, tangents of both, the rest of what the rollers pass on, largest pocket force and slip.

    Results are rates, their tangents, rates of what is integrated beside, and what is watched.
    """

    form: Form
    over_angle: bool
    tangents: int

    def __call__(self, i: Any, moved: Any, watched: Any, fixed: Any) -> Any:
        (cos, sin), numbers = moved[:2], moved[2:]
        _, at, scale, slowest = self.form.filled(fixed)
        size = OF_BODIES + MOVING
        numbers, rest, (normal, slip) = (
            numbers[: size * (1 + self.tangents)],
            numbers[size * (1 + self.tangents) : -2],
            numbers[-2:],
        )

        def go(y: Any) -> tuple[Any, Any]:
            cage = Bodies(*(a * u for a, u in zip(y, scale.bodies, strict=False)))
            land = at.on_land(cage)
            rates, integrals, _ = at.body_rates(cage, (cos, sin), Passed(*y[OF_BODIES:], *rest), land)
            pace = 1 / jnp.abs(cage.cage_speed) if self.over_angle else 1.0
            rates = [pace * x / u for x, u in zip(rates, scale.bodies, strict=True)]
            beside = [pace * x for x in (cage.cage_speed, 1.0, *integrals, land.eps * land.eps)]
            lost = jnp.where(jnp.abs(cage.cage_speed) < slowest, LOST, land.eps)
            return _floats(rates), _floats((*beside, lost, normal, land.size, slip, land.eps))

        return _with_tangents(go, numbers, size, self.tangents), ()


def _floats(numbers: Any) -> tuple[Any, ...]:
    return tuple(jnp.asarray(x, dtype=float) for x in numbers)


def _with_tangents(go: Callable[[Any], Any], numbers: Any, size: int, tangents: int) -> tuple[Any, ...]:
    """Values of `go`, their tangents along the vectors behind the first `size` numbers, and what is seen."""
    y, out = tuple(numbers[:size]), []
    values, seen = go(y)
    for k in range(1, 1 + tangents):
        along = tuple(numbers[k * size : (k + 1) * size])
        out += jax.jvp(lambda y: go(y)[0], (y,), (along,))[1]
    return (*values, *out, *seen)


class RollersCode(NamedTuple):
    """What writes the rates of a bearing."""

    rollers: int
    roller: Program
    bodies: Program
    angle: Program
    """Cosine and sine of the cage's angle."""

    def code(self, field: Field, rows: Layout, width: int) -> tuple[str, set[str]]:
        """The function `rates`: of state, tangents and what is integrated beside at `place`, stored at `out`."""
        w = Code(width)
        z, size, tangents = self.rollers, field.dimension, field.tangents
        load = lambda first, count: [w.get(first + k, base="%place") for k in range(count)]
        own = [load(z * OF_ROLLER + size * t, OF_BODIES) for t in range(1 + tangents)]
        phase = w.get(size * (1 + tangents), base="%place")
        (cos, sin), w.block = w.program(self.angle, [number(0.0), phase], w.block)
        places = 2 * np.pi / z * np.arange(z)
        table = ", ".join(f"double {number(x).text}" for pair in zip(np.cos(places), np.sin(places)) for x in pair)
        # Of values and of tangents MOVING sums each, then the other sums, then the largest force and slip.
        moving, others = MOVING * (1 + tangents), PASSED - MOVING
        begin = w.block
        w.line("br label %roller")
        w.line("roller:")
        names = [f"%sum{k}" for k in range(moving + others + 2)]
        sums = [Value(name, "double", True) for name in names]
        j = Value("%j", "i64", False)
        at = w.simple("mul", j, Value("2", "i64", False))
        cos_at = w.let(f"getelementptr double, ptr @places, i64 {at.text}", "ptr", False)
        sin_at = w.let(f"getelementptr double, ptr {cos_at.text}, i64 1", "ptr", False)
        place = [w.let(f"load double, ptr {x.text}", "double", False) for x in (cos_at, sin_at)]
        first = w.simple("mul", j, Value(str(OF_ROLLER), "i64", False))
        row = lambda k: w.simple("add", first, Value(str(k), "i64", False))
        numbers: list[Value] = []
        for t in range(1 + tangents):
            numbers += [w.get(row(size * t + k), base="%place") for k in range(OF_ROLLER)] + own[t]
        arguments = [number(0.0), *place, cos, sin, *numbers]
        fixed = fixed_numbers(w, field, rows, self.roller, len(arguments))
        results, w.block = w.program(self.roller, [*arguments, *fixed], w.block)
        rates, passed = [], []
        for t in range(1 + tangents):
            part = results[t * (OF_ROLLER + MOVING) : (t + 1) * (OF_ROLLER + MOVING)]
            rates.append(part[:OF_ROLLER])
            passed += part[OF_ROLLER:]
        *rest, slip = results[(1 + tangents) * (OF_ROLLER + MOVING) :]
        for t, part in enumerate(rates):
            for k, x in enumerate(part):
                w.put(row(size * t + k), x, base="%out")
        new = [w.add(s, w.widened(x)) for s, x in zip(sums, [*passed, *rest], strict=False)]
        largest = zip(sums[-2:], (rest[NORMAL - MOVING], slip), strict=True)
        new += [w.larger(w.widened(x), s) for s, x in largest]
        latch = w.block
        w.line("%j_next = add i64 %j, 1")
        w.line(f"%more = icmp slt i64 %j_next, {z}")
        w.line("br i1 %more, label %roller, label %bodies")
        w.line("bodies:")
        lines, w.lines = w.lines, []
        vector = w.type("double", True)
        start = lambda k: f"splat (double {number(-np.inf if k >= moving + others else 0.0).text})"
        phis = [f"  %j = phi i64 [ 0, %{begin} ], [ %j_next, %{latch} ]"]
        phis += [
            f"  {name} = phi {vector} [ {start(k)}, %{begin} ], [ {x.text}, %{latch} ]"
            for k, (name, x) in enumerate(zip(names, new, strict=True))
        ]
        where = lines.index("roller:") + 1
        w.lines = [*lines[:where], *phis, *lines[where:]]
        numbers = []
        for t in range(1 + tangents):
            numbers += own[t] + new[t * MOVING : (t + 1) * MOVING]
        arguments = [number(0.0), cos, sin, *numbers, *new[moving:]]
        fixed = fixed_numbers(w, field, rows, self.bodies, len(arguments))
        results, w.block = w.program(self.bodies, [*arguments, *fixed], w.block)
        for t in range(1 + tangents):
            for k in range(OF_BODIES):
                w.put(size * t + z * OF_ROLLER + k, results[t * OF_BODIES + k], base="%out")
        for k, x in enumerate(results[(1 + tangents) * OF_BODIES :]):
            w.put(size * (1 + tangents) + k, x, base="%out")
        head = (
            f"@places = internal constant [{2 * z} x double] [{table}]\n"
            f"define internal void @rates({vector} %phase, ptr noalias %place, ptr noalias %memory, "
            "ptr noalias %shared, ptr noalias %out) noinline {\nentry:\n"
        )
        return head + w.taken() + "\n  ret void\n}\n", w.declarations


class BearingLimits(NamedTuple):
    """Of steps, in units of angle or time."""

    first: float
    longest: float
    shortest: float
    most: float
    """Steps tried from strobe to strobe, at most."""


class BearingEngine:
    """The compiled motion of a bearing over stretches of the cage's angle, or of time.

    **Raises:** `UnknownOperation`.
    """

    def __init__(self, form: Form, wide: tuple[bool, ...], tangents: int, over_angle: bool, width: int):
        _, at, *_ = form.filled([1.0] * len(wide))
        z, fixed = at.n_rollers, len(wide)
        trace = lambda step, moved: program_of(step, Sizes(moved, 0, fixed))
        size = (OF_ROLLER + OF_BODIES) * (1 + tangents)
        cosine = lambda i, moved, watched, fixed: (cos_sin(moved[0]), ())
        rollers = RollersCode(
            z,
            trace(_Roller(form, over_angle, tangents), 4 + size),
            trace(_Bodies(form, over_angle, tangents), 2 + (OF_BODIES + MOVING) * (1 + tangents) + PASSED - MOVING + 2),
            program_of(cosine, Sizes(1, 0, 0)),
        )
        field = Field(
            None, rollers, None, None, z * OF_ROLLER + OF_BODIES, tangents, wide,
            beside=len(CLOCK) + len(INTEGRATED), watched=len(WATCHED), own_turn=True, relative=False, careful=False,
        )  # fmt: skip
        self.field, self._run = field, Runner(field, "tsit5", width)

    def __call__(
        self, numbers: Any, state: Any, strobes: int, keep: int, tolerance: float, limits: BearingLimits, **more: Any
    ) -> March:
        """Run lanes of so many strobes; the first of the numbers of each lane is how far it is to the next."""
        settings = np.array([tolerance, limits.longest, limits.shortest, limits.most])
        return self._run(numbers, state, strobes, keep, settings, **more)


@functools.lru_cache(maxsize=16)
def bearing_engine(form: Form, wide: tuple[bool, ...], tangents: int, over_angle: bool, width: int) -> BearingEngine:
    """The engine of a form of (turn, laws, scale, slowest speed); where `wide`, lanes have numbers of their own."""
    return BearingEngine(form, wide, tangents, over_angle, width)


class Bearings:
    """Lanes of bearings in machine code."""

    def __init__(
        self,
        at: BearingAtSpeed,
        scale: BearingState,
        slowest: Float[np.ndarray, " lanes"],
        over_angle: bool,
        threads: int = 1,
    ):
        """**Arguments:** laws, each number a scalar or of lanes; magnitudes of the state, of one roller and of lanes;
        speed of the cage below which its angle is no measure of progress; what is integrated over; threads."""
        number = lambda x: np.asarray(x, dtype=float)
        at, scale = jax.tree.map(number, (at, scale))
        self.over_angle, self.threads = over_angle, threads
        self.rollers = at.n_rollers
        self.units = np.concatenate([np.tile(scale.rollers.T, (1, self.rollers)), scale.bodies.T], axis=1)
        tree = (
            np.zeros(slowest.size),
            at,
            scale._replace(rollers=tuple(scale.rollers), bodies=tuple(scale.bodies)),
            slowest,
        )
        self._form, self._leaves = split(tree, lambda x: isinstance(x, np.ndarray))

    def engine(self, tangents: int, width: int) -> BearingEngine:
        """The compiled code."""
        wide = tuple(x.ndim == 1 for x in self._leaves)
        return bearing_engine(self._form, wide, tangents, self.over_angle, width)

    def run(
        self,
        lanes: Any,
        state: Float[np.ndarray, "some numbers"],
        stretch: Any,
        strobes: int,
        keep: int,
        tolerance: float,
        limits: BearingLimits,
        step: Any = None,
        tangents: Float[np.ndarray, "some dim"] | None = None,
        width: int = 8,
        report: Callable[[int], None] = lambda done: None,
    ) -> March:
        """Run some lanes, by their numbers, over `strobes` stretches of the same length each.

        `state` is in units of the scale, and what is integrated beside it behind that.
        """
        some = np.asarray(lanes)
        rows = [
            np.broadcast_to(np.asarray(stretch, dtype=float), some.shape),
            *(x[some] for x in self._leaves[1:] if x.ndim == 1),
        ]
        shared = np.array([float(x) for x in self._leaves if x.ndim == 0])
        engine = self.engine(0 if tangents is None else 1, width)
        return engine(
            (np.array(rows), shared), state, strobes, keep, tolerance, limits,
            step=limits.first if step is None else step, threads=self.threads, report=report,
            tangents=None if tangents is None else tangents[:, None, :],
        )  # fmt: skip

    def packed(self, lanes: Any, state: BearingState) -> Float[np.ndarray, "some numbers"]:
        """States, lanes first, in units of the scale, with angle, time and nothing yet integrated behind them."""
        rollers, bodies, clock = (np.asarray(x, dtype=float) for x in state)
        rollers = np.swapaxes(rollers, -1, -2).reshape(len(rollers), -1)
        y = np.concatenate([rollers, bodies], axis=1) / self.units[np.asarray(lanes)]
        return np.concatenate([y, clock, np.zeros((len(y), len(INTEGRATED)))], axis=1)

    def unpacked(self, lanes: Any, y: Float[np.ndarray, "some *more numbers"]) -> tuple[Any, Any, Any, Any]:
        """Rollers (five rows), bodies, clock and integrals of states."""
        n = self.rollers * OF_ROLLER
        units = self.units[np.asarray(lanes)].reshape(len(y), *(1,) * (y.ndim - 2), -1)
        state = y[..., : n + OF_BODIES] * units
        rollers = np.swapaxes(state[..., :n].reshape(*y.shape[:-1], self.rollers, OF_ROLLER), -1, -2)
        beside = y[..., n + OF_BODIES :]
        return rollers, state[..., n:], beside[..., : len(CLOCK)], beside[..., len(CLOCK) :]
