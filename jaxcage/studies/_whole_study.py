"""What a study of a whole bearing computes, and the numbers kept of each lane."""

import dataclasses
from typing import Any

import numpy as np
from jaxtyping import Float

from .._errors import ArgumentError
from .._parameters import parameter_info, replace
from ..analysis import CAGE_STATES, STATISTIC_UNITS, BearingSweep, OfLanes
from ..models import CAGE_STARTS, BearingModel
from ..solve import OUTCOMES
from ..sweeps import require_bearings, sweep_bearings, versions
from ._plan import Plan
from ._stored import SPEED, AbstractStudy, Results, Variable


WHOLE_LANES = 48
"""Lanes of a chunk, at most: some minutes of work."""
WHOLE_TOLERANCE = 1e-4
"""Of a step, if nothing else is asked for, as for `sweep_bearing`."""
ERROR = "_standard_error"
"""Ends the name of the standard error of a mean."""
_KEPT = {field.name: field.metadata for field in dataclasses.fields(BearingSweep) if field.type is OfLanes}
_MEANS = tuple(name for name in STATISTIC_UNITS if name in _KEPT and name != "exponent")
_CODES = {"state": CAGE_STATES, "outcome": OUTCOMES}


@dataclasses.dataclass(frozen=True, eq=False)
class BearingStudy(AbstractStudy):
    """Lanes over shaft speed and any parameters of a whole bearing."""

    system: BearingModel
    plan: Plan
    discard: int
    revolutions: int
    blocks: int
    exponents: int
    """1 for the largest, 0 for none."""
    tolerance: float
    """Largest estimated error of a step, as for `sweep_bearing`."""
    name: str = ""
    version: str = ""

    speed_text = "shaft speed"

    def __post_init__(self):
        if SPEED not in self.plan.grid:
            raise ArgumentError("vary", said="must hold values of the shaft's speed: a single one is enough.")
        known = parameter_info(self.system)
        for name in self.plan.names:
            if name not in (SPEED, *known):
                raise ArgumentError("vary", said=f"must name {SPEED} or parameters of the bearing, but names {name}.")
        require_bearings([self.system], self.plan.starts, self.discard, self.revolutions, self.blocks, self.exponents)

    @property
    def configuration(self) -> Any:
        """What a TOML file would say of the bearing."""
        from ..io import configuration  # the core does not load the tables of `io`

        return configuration(self.system)

    def settings(self) -> dict[str, Any]:
        """Bearing, lanes, their length, tolerance."""
        return {
            "system": self.configuration,
            "plan": self.plan.describe(),
            "discard": self.discard,
            "revolutions": self.revolutions,
            "blocks": self.blocks,
            "exponents": self.exponents,
            "tolerance": self.tolerance,
            **versions(),
        }

    @property
    def variables(self) -> dict[str, Variable]:
        """All that `BearingSweep` has one number of for each lane, standard errors of its means, state and outcome."""
        found = {name: Variable(about["text"], about["unit"]) for name, about in _KEPT.items()}
        error = lambda about: Variable(f"standard error, {about['text']}", about["unit"])
        found |= {name + ERROR: error(_KEPT[name]) for name in _MEANS}
        texts = {field.name: field.metadata.get("text", "") for field in dataclasses.fields(BearingSweep)}
        return found | {name: Variable(texts[name], "1", "int8", names) for name, names in _CODES.items()}

    def chunk(self, number: int) -> Results:
        """The results of a chunk, laid out as its block of the grid: designs that each run at all its speeds."""
        values, start = self.plan.at(self.plan.lanes_of(number))
        shape = [part.stop - part.start for part in self.plan.region(number)]
        speed_axis = list(self.plan.axes).index(SPEED)
        speeds_inside = lambda x: np.moveaxis(x.reshape(shape), speed_axis, -2)  # next to the starts, which are last
        laid_out = {name: speeds_inside(x) for name, x in values.items()}
        speeds, starts = laid_out.pop(SPEED), speeds_inside(start)
        designs = list(np.ndindex(starts.shape[:-2]))
        models = [replace(self.system, **{name: float(x[*i, 0, 0]) for name, x in laid_out.items()}) for i in designs]
        found = self._swept(models, speeds[*designs[0], :, 0], [CAGE_STARTS[i] for i in starts[*designs[0], 0]])
        return {name: np.moveaxis(x.reshape(starts.shape), -2, speed_axis) for name, x in found.items()}

    def _swept(self, models: list[BearingModel], speeds: Float[np.ndarray, " speeds"], places: Any) -> Results:
        """Designs, speeds, starts."""
        ascending = np.argsort(speeds)
        sweeps = sweep_bearings(
            models,
            speeds[ascending],
            starts=places,
            discard=self.discard,
            revolutions=self.revolutions,
            blocks=self.blocks,
            exponents=self.exponents,
            tolerance=self.tolerance,
        )
        as_given = np.argsort(ascending)
        stacked = lambda read: np.stack([np.asarray(read(sweep))[as_given] for sweep in sweeps])
        found = {name: stacked(lambda sweep, name=name: getattr(sweep, name)) for name in _KEPT}
        found |= {name + ERROR: stacked(lambda sweep, name=name: sweep.standard_error(name)) for name in _MEANS}
        for name, names in _CODES.items():
            coded = lambda sweep, name=name, names=names: [
                [names.index(x) for x in row] for row in getattr(sweep, name)
            ]
            found[name] = stacked(coded).astype(np.int8)
        return found
