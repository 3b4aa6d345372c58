"""One number beside another."""

import dataclasses
from typing import Any

from ._literature import Number


@dataclasses.dataclass(frozen=True)
class Comparison:
    """A number of ours beside one that we did not make."""

    what: str
    source: str
    """Where theirs is printed, or by what it is computed."""
    theirs: float
    ours: float
    tolerance: float
    """Largest difference that the source supports, in the unit of the numbers."""

    @property
    def difference(self) -> float:
        """Ours less theirs."""
        return self.ours - self.theirs

    @property
    def passed(self) -> bool:
        """False for a number that is not finite, too."""
        return bool(abs(self.difference) <= self.tolerance)


def within(what: str, source: str, theirs: float, ours: Any, tolerance: float) -> Comparison:
    """A comparison with an absolute tolerance."""
    return Comparison(what, source, float(theirs), float(ours), float(tolerance))


def beside(what: str, number: Number, ours: Any, sample: float = 0.0) -> Comparison:
    """A comparison with a number of `_literature`; `sample` is what ours is uncertain by as a finite sample."""
    return within(what, number.source, number.value, ours, number.tolerance + sample)


def within_share(what: str, source: str, theirs: float, ours: Any, share: float, least: float = 0.0) -> Comparison:
    """A comparison with a tolerance relative to theirs, and at least `least`."""
    return within(what, source, theirs, ours, max(share * abs(theirs), least))
