"""Synchronous-loss zones of a model, with the orbit search's own settings."""

from collections.abc import Callable

from ..models import CageModel
from ..orbits import LossZones, loss_zones, synchronous_orbits
from ._inputs import angular_speed
from ._options import SETTLED


def loss_zones_between(
    model: CageModel, first: float, last: float, progress: Callable[[str, int, int], None] | None
) -> LossZones:
    """Zones between two speeds [rpm] in which no synchronous orbit is stable."""
    found = synchronous_orbits(model, angular_speed(first), angular_speed(last), discard=SETTLED, progress=progress)
    return loss_zones(found)
