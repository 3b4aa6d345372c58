"""Exact edges whose orbit touches the land.

The force sets in over a thousandth of the clearance, which takes ten times as many steps as the film alone: such an
edge is the one whose error is to be looked at.
"""

from collections.abc import Mapping

import jax.numpy as jnp
from jaxtyping import Array, Float

from .._form import compiled
from .._types import Scalar
from ..models import CageModel
from ..orbits import Point
from ..solve import AbstractMethod, method as make_method, strobe_map


STEPS = 4096
"""Steps at which an excursion is looked for."""


@compiled
def _largest_eps(
    model: CageModel, speed: Scalar, state: Float[Array, " dim"], method: AbstractMethod
) -> Float[Array, ""]:
    return jnp.asarray(strobe_map(model, speed, method)(tuple(state[i] for i in range(state.size))).peak)


def touching(model: CageModel, edges: Mapping[str, Point], method: AbstractMethod | None) -> dict[str, float]:
    """Largest eps of the synchronous orbits at those edges at which it is beyond the onset of contact."""
    chosen = make_method(steps=STEPS) if method is None else method
    largest = {
        name: float(_largest_eps(model, jnp.asarray(p.speed, dtype=float), jnp.asarray(p.state), chosen))
        for name, p in edges.items()
    }
    return {name: eps for name, eps in largest.items() if eps > float(model.contact.onset)}


def contact_notes(model: CageModel, edges: Mapping[str, Point], method: AbstractMethod | None) -> list[str]:
    """A sentence for each edge whose orbit touches the land."""
    onset = float(model.contact.onset)
    return [
        f"{name.capitalize()}: its orbit touches the land (eps {eps:.3f}, contact from {onset:g}); by half of its "
        f"{edges[name].steps} steps it is {edges[name].error_rpm:.1g} rpm away"
        for name, eps in touching(model, edges, method).items()
    ]
