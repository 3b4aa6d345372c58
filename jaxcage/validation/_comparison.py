"""One number beside another."""

import dataclasses
from typing import Any


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


def within_share(what: str, source: str, theirs: float, ours: Any, share: float, least: float = 0.0) -> Comparison:
    """A comparison with a tolerance relative to theirs, and at least `least`."""
    return within(what, source, theirs, ours, max(share * abs(theirs), least))
