"""Exact edges whose orbit touches the land.

The force has a kink at the onset of contact, which costs every solver its order: such an edge leans on the integration
steps by much more than others do (for case 3a, 256 steps of Rodas4 put one at 18945 rpm and 2048 at 19133).
"""

from collections.abc import Mapping

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from .._types import Scalar
from ..integrate import AbstractMethod, strobe_map
from ..models import CageModel
from ..orbits import SpecialPoint


@eqx.filter_jit
def _largest_eps(
    model: CageModel, speed: Scalar, state: Float[Array, " dim"], method: AbstractMethod
) -> Float[Array, ""]:
    return jnp.asarray(strobe_map(model, speed, method)(tuple(state[i] for i in range(state.size))).peak)


def touching(model: CageModel, edges: Mapping[str, SpecialPoint], method: AbstractMethod) -> dict[str, float]:
    """Largest eps of the synchronous orbits at those edges at which it is beyond the onset of contact."""
    largest = {
        name: float(_largest_eps(model, jnp.asarray(p.speed, dtype=float), jnp.asarray(p.state), method))
        for name, p in edges.items()
    }
    return {name: eps for name, eps in largest.items() if eps > float(model.contact.onset)}


def contact_notes(model: CageModel, edges: Mapping[str, SpecialPoint], method: AbstractMethod) -> list[str]:
    """A sentence for each edge that should not be relied on as it is."""
    onset = float(model.contact.onset)
    return [
        f"{name.capitalize()}: its orbit touches the land (eps {eps:.3f}, contact from {onset:g}), so that its "
        "speed depends on the integration steps: try more --steps"
        for name, eps in touching(model, edges, method).items()
    ]
