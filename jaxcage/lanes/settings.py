"""Settings of a run: its length, its accuracy, and the results that are computed."""

import dataclasses
from typing import Any

from .._arguments import check_call, require_at_least
from .._errors import ArgumentError
from ..analysis import LONGEST_PERIOD
from ..models import AbstractForcedSystem
from ..solve import AbstractMethod, native


ACCURACY = "tolerance", "error"
"""Settings of the machine-code method `native`, which a run accepts in place of a `method`."""


@dataclasses.dataclass(frozen=True)
class Run:
    """Settings of a run, common to all lanes of a plan; a model may have its own defaults (`run_defaults`)."""

    discard: int = 300
    """Revolutions discarded at the beginning."""
    revolutions: int = 300
    """Revolutions observed after that."""
    blocks: int = 20
    """Number of blocks of the observed revolutions, whose scatter yields standard errors."""
    exponents: int = 1
    """Number of Lyapunov exponents, from the largest down."""
    exponent_revolutions: int = 0
    """Revolutions at the end of those observed over which exponents are computed; 0 for all."""
    keep: int = 64
    """Number of strobe states kept, the last ones; a period k can only be detected with at least 2 k of them."""
    confirm: bool = True
    """True to run lanes that are not periodic, their neighbours in speed and a tenth of the rest again with smaller
    steps."""
    horizon: int = 3000
    """Revolutions of the whole run, rounded up to blocks of 30, to which unsettled lanes are followed; 0 for none."""
    settled: int = 0
    """Revolutions after which a lane whose strobe states repeat is stopped as periodic; 0 runs all to the end."""
    method: AbstractMethod = dataclasses.field(default_factory=native)
    """Integration method."""

    @classmethod
    def of(cls, model: AbstractForcedSystem, **given: Any) -> "Run":
        """Settings for a model: those given and not None, else the model's own defaults, else those of the class.

        `tolerance` and `error` are those of the machine-code method `native`.

        **Raises:** `ValueError` for unknown settings, and for those that do not go together, or not with the model.
        """
        known = (*(f.name for f in dataclasses.fields(cls)), *ACCURACY)
        if unknown := [name for name in given if name not in known]:
            raise ArgumentError(unknown[0], said=f"must be a setting of a run, one of: {', '.join(known)}.")
        given = {name: value for name, value in given.items() if value is not None}
        chosen = {**model.run_defaults, **given}
        accuracy = {name: chosen.pop(name) for name in ACCURACY if name in chosen}
        if "method" not in chosen:
            chosen["method"] = native(**accuracy)
        elif both := accuracy.keys() & given.keys():
            raise ArgumentError("method", *sorted(both), said="must not be given together.")
        check_call(cls, **chosen)
        run = cls(**chosen)
        run = dataclasses.replace(run, keep=min(run.keep, run.revolutions))
        run._check(model)
        return run

    def _check(self, model: AbstractForcedSystem) -> None:
        require_at_least(0, discard=self.discard, horizon=self.horizon, exponent_revolutions=self.exponent_revolutions)
        require_at_least(1, revolutions=self.revolutions, blocks=self.blocks, keep=self.keep)
        if self.revolutions % self.blocks:
            raise ArgumentError(
                "blocks", said=f"must divide the {self.revolutions} revolutions, but it is {self.blocks}."
            )
        most = model.dimension if model.samples == 1 else 1
        if not 0 <= self.exponents <= most:
            allowed = f"at most {most}" if self.exponents > 0 else "at least 0"
            raise ArgumentError("exponents", said=f"must be {allowed}, but {self.exponents} was given.")
        if self.settled and not 2 * LONGEST_PERIOD <= self.settled <= self.discard:
            allowed = f"{2 * LONGEST_PERIOD} to the {self.discard} revolutions discarded"
            raise ArgumentError("settled", said=f"must be 0, or {allowed}, but is {self.settled}.")
        if self.settled and (self.confirm or self.horizon):
            raise ArgumentError("settled", said="goes with `confirm=False` and `horizon=0`, but one of them was given.")
        repeats = [name for name in ("confirm", "horizon", "settled") if getattr(self, name)]
        if model.samples > 1 and repeats:
            raise ArgumentError(*repeats, said="must be left out for a model whose revolutions do not repeat.")
        if self.followed < self.blocks and self.horizon:
            said = f"must be 0 or above {self.revolutions - self.block} with a horizon, but is "
            raise ArgumentError("exponent_revolutions", said=f"{said}{self.exponent_revolutions}.")

    @property
    def block(self) -> int:
        """Number of revolutions per block."""
        return self.revolutions // self.blocks

    @property
    def followed(self) -> int:
        """Number of blocks at the end in which exponents are computed."""
        if not self.exponent_revolutions:
            return self.blocks
        return min(self.blocks, max(2, -(-self.exponent_revolutions // self.block)))
