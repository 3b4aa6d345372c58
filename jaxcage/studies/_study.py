"""What a study of a cage computes: a plan of lanes, how long to run them, and the numbers kept of each."""

import dataclasses
from collections.abc import Mapping
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, Int

from .._arguments import require_at_least
from .._errors import ArgumentError
from .._form import compiled
from .._glossary import component_names, quantity
from .._parameters import replace
from ..analysis import Observation, closing_period, label_lanes, too_few_revolutions
from ..bearing import vg
from ..models import AbstractForcedSystem, CageModel
from ..orbits import pick
from ..solve import OUTCOMES, AbstractMethod, Lanes
from ..sweeps import Progress, make_plan, run_lanes, settings_of
from ._plan import Plan, Values
from ._stored import SPEED, AbstractStudy, Results, Variable


OIL = "oil"
"""Name of the ISO VG grade of a mineral oil beside those of the system's parameters."""
CLOSING = 16
"""Strobe states by which a lane's period is labelled: twice the longest period that is looked for."""
FEW, SOME = 256, 1024
"""Lanes to which fewer ones are filled up: each number of lanes may take a program of its own."""

LABELS = ("failed", *(f"periodic-{k}" for k in range(1, 9)), "chaotic", "quasi-periodic", "undecided", "inaccurate")
"""What a lane does, in the order of the integer codes that a study stores."""


@dataclasses.dataclass(frozen=True, eq=False)
class Study(AbstractStudy):
    """Lanes over any parameters, and what to compute in each of them."""

    system: AbstractForcedSystem
    plan: Plan
    method: AbstractMethod
    discard: int
    revolutions: int
    blocks: int
    exponents: int
    strobe: int
    """Strobe states stored of each lane, the last ones; 0 for none."""
    name: str = ""
    version: str = ""

    def __post_init__(self):
        if SPEED not in self.plan.names:
            raise ArgumentError("vary", said="must hold the speed: a single value is enough.")
        for name in self.plan.names:
            if name == OIL and isinstance(self.system, CageModel):
                continue
            if name != SPEED:
                pick(self.system, name)
        own = len(self.system.starts(1.0))
        if self.plan.starts > own:
            raise ArgumentError("starts", said=f"must be at most {own}, but {self.plan.starts} was given.")
        require_at_least(1, exponents=self.exponents)
        if not 0 <= self.strobe <= self.revolutions:
            raise ArgumentError(
                "strobe", said=f"must lie between 0 and the {self.revolutions} revolutions, but is {self.strobe}."
            )
        self._watch  # refuses impossible counts

    @property
    def _watch(self) -> Any:
        keep = max(CLOSING, self.strobe)
        return make_plan(self.discard, self.revolutions, self.blocks, keep, self.exponents, self.system.dimension)

    def settings(self) -> dict[str, Any]:
        """System, lanes, their length, and method."""
        return {
            "system": _described(self.system),
            "plan": self.plan.describe(),
            "discard": self.discard,
            "revolutions": self.revolutions,
            "blocks": self.blocks,
            "exponents": self.exponents,
            "strobe": self.strobe,
            "method_numbers": _numbers(self.method),
            **settings_of(self.method),
        }

    @property
    def variables(self) -> dict[str, Variable]:
        """Exponents, peaks, errors, labels; strobe states if asked for."""

        def known(name: str, called: str = "", **more: Any) -> Variable:
            about = quantity(called or name)
            return Variable(about.text, about.unit, **more)

        found = {name: known(name) for name in ("largest_exponent", "standard_error", "peak", "error")}
        names = {"period": (), "label": LABELS, "outcome": OUTCOMES}
        found |= {name: known(name, kind="int8", names=codes) for name, codes in names.items()}
        if self.exponents > 1:
            several = {"exponents": "exponent", "standard_errors": "standard_error"}
            found |= {name: known(name, one, within=("exponent",)) for name, one in several.items()}
        if self.strobe:
            found["strobe"] = known("strobe", within=("revolution", "component"))
        return found

    @property
    def extents(self) -> dict[str, int]:
        """Exponents, revolutions stored, components of a state."""
        return {"exponent": self.exponents, "revolution": self.strobe, "component": self.system.dimension}

    @property
    def labels_within(self) -> dict[str, np.ndarray]:
        """Numbers of the revolutions stored, names of the components."""
        if not self.strobe:
            return {}
        last = self.discard + self.revolutions
        names = component_names(self.system.dimension, isinstance(self.system, CageModel))
        return {
            "revolution": np.arange(last - self.strobe + 1, last + 1),
            "component": np.array(names, dtype=object),
        }

    @property
    def configuration(self) -> Any:
        """That of a cage, unless it has forces of one's own, which no file can hold."""
        plain = isinstance(self.system, CageModel) and not self.system.extra
        return _described(self.system) if plain else None

    def chunk(self, number: int) -> Results:
        """The results of a chunk, laid out as its block of the grid."""
        region = self.plan.region(number)
        found = self.at(*self.plan.at(self.plan.lanes_of(number)))
        shape = tuple(part.stop - part.start for part in region)
        return {name: x.reshape(*shape, *x.shape[1:]) for name, x in found.items()}

    def at(self, values: Values, start: Int[np.ndarray, " lanes"], progress: Progress | None = None) -> Results:
        """The results of any lanes, given by the values of all that is varied and the numbers of their starts.

        A lane has the same bits as in its chunk: the programs are those of a chunk, whatever its company.
        """
        most = self.plan.lanes
        parts = [slice(i, min(i + most, start.size)) for i in range(0, start.size, most)]
        found = []
        for part in parts:
            found.append(self._part({name: x[part] for name, x in values.items()}, start[part]))
            if progress is not None:
                progress(part.stop, start.size)
        return {name: np.concatenate([one[name] for one in found]) for name in found[0]}

    def _part(self, values: Values, start: Int[np.ndarray, " lanes"]) -> Results:
        count = start.size
        full = {name: jnp.asarray(_filled(x, self.plan.lanes)) for name, x in values.items()}
        speed = full.pop(SPEED)
        designs = eqx.filter_vmap(lambda own: with_values(self.system, own), axis_size=self.plan.lanes)(full)
        begin, scale = _start_and_scale(designs, speed, jnp.asarray(_filled(start, self.plan.lanes)))
        chosen = Lanes(designs, max(self.plan.lanes, 2), np.arange(count), np.asarray(speed)[:count])
        seen = run_lanes(chosen, self.method, self._watch, np.asarray(begin)[:count])
        return self._labelled(
            Observation(*(np.moveaxis(np.asarray(x), -1, 0)[:count] for x in seen)), np.asarray(scale)[:count]
        )

    def _labelled(self, seen: Observation, scale: Float[np.ndarray, "lanes dim"]) -> Results:
        """What is stored of lanes; here they are the first axis of an observation."""
        strobe, growth, _, peak, outcome, largest, doubt = (np.asarray(x) for x in seen)
        failed = outcome != 0
        period = np.where(failed, 0, closing_period(strobe[:, -CLOSING:], scale))
        exponents = np.mean(growth, axis=1)
        error = np.full(exponents.shape, np.inf)
        if self.blocks > 1:
            error = np.hypot(np.std(growth, axis=1, ddof=1) / np.sqrt(self.blocks), doubt)
        label = label_lanes(outcome, strobe[:, -CLOSING:], scale, exponents[:, 0], error[:, 0])
        several = {"exponents": exponents, "standard_errors": error} if self.exponents > 1 else {}
        kept = {"strobe": strobe[:, -self.strobe :]} if self.strobe else {}
        return {
            "largest_exponent": exponents[:, 0],
            "standard_error": error[:, 0],
            **several,
            **kept,
            "peak": peak,
            "error": largest,
            "period": period.astype(np.int8),
            "label": np.array([LABELS.index(name) for name in label], dtype=np.int8),
            "outcome": outcome.astype(np.int8),
        }


def too_short(found: Mapping[str, np.ndarray], revolutions: int) -> Bool[np.ndarray, "*lanes"]:
    """Lanes whose label rests on too few revolutions for the error bar of its exponent; not those still to be run."""
    label = np.array([*LABELS, "pending"])[found["label"].astype(int)]
    return too_few_revolutions(label, revolutions)


def with_values(system: AbstractForcedSystem, values: dict[str, Any]) -> AbstractForcedSystem:
    """The system with parameters set by name; `oil` makes the lubricant a mineral oil of that grade."""
    for name, value in values.items():
        if name == OIL and isinstance(system, CageModel):
            oil = vg(value, system.lubricant.temperature)
            system = eqx.tree_at(lambda s: s.lubricant, system, oil)
        else:
            system = eqx.tree_at(pick(system, name), system, value)
    return system


def _filled(x: np.ndarray, size: int) -> np.ndarray:
    """Repeat the last element up to `size` of them."""
    return np.concatenate([x, np.repeat(x[-1:], size - x.shape[0], axis=0)])


@compiled
def _start_and_scale(
    designs: AbstractForcedSystem, speed: Float[Array, " lanes"], start: Int[Array, " lanes"]
) -> tuple[Float[Array, "lanes dim"], Float[Array, "lanes dim"]]:
    row = lambda y: jnp.stack([jnp.asarray(c, dtype=float) for c in y])
    of_lane = lambda s, w, n: (jnp.stack([row(y) for y in s.starts(w)])[n], row(s.scale(w)))
    return eqx.filter_vmap(of_lane)(designs, speed, start)


def _described(system: AbstractForcedSystem) -> Any:
    """The configuration of a cage, with the numbers of its user's forces; of another system its numbers."""
    if isinstance(system, CageModel):
        from ..io import configuration  # the core does not load the tables of `io`

        own = {type(law).__name__: _numbers(law) for law in system.extra}
        return configuration(replace(system, extra=())) | ({"extra": own} if own else {})
    return _numbers(system)


def _numbers(module: eqx.Module) -> dict[str, Any]:
    leaves, _ = jax.tree_util.tree_flatten_with_path(module)
    named = lambda path: jax.tree_util.keystr(path).lstrip(".")
    return {named(path): np.asarray(x).tolist() for path, x in leaves if eqx.is_array_like(x)}
