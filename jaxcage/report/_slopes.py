"""How every exact edge answers to the design."""

from ..integrate import AbstractMethod
from ..models import CageModel
from ..orbits import Cascade, Explained, LossZones, Sensitivity, limit_sensitivity, sensitivities, sensitivity


def edge_slopes(
    model: CageModel, loss: LossZones, explained: Explained, method: AbstractMethod | None
) -> dict[str, Sensitivity]:
    """Sensitivities of the synchronous-loss edges, and of chaotic edges that coincide with something exact."""
    slopes = sensitivities(model, loss.edges, method)
    for name, source in explained.sources.items():
        of = limit_sensitivity if isinstance(source, Cascade) else sensitivity
        slopes[f"chaotic {name}"] = of(model, source, f"chaotic {name}", method)  # pyright: ignore[reportArgumentType]
    return slopes
