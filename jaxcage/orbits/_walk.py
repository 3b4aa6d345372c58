"""A bifurcation looked for along the branch of orbits that a guess lies on, where Newton's method finds none from it.

Near a superstable orbit the scalar that vanishes at the point is flat, and Newton's steps lead anywhere; the branch
itself leads on.
"""

import jax
import jax.numpy as jnp
import numpy as np

from ._arclength import Corrected, Steps, follow, take
from ._branch import describe, joined
from ._by_name import SPEED
from ._follower import Follower, Start, seeds, stable_steps, turned
from ._located import brackets
from ._point import Point


WALK = Steps(first=0.05, longest=0.25, most=250)


def walk(follower: Follower, start: Start, periods: int, kind: str) -> tuple[Point | None, str]:
    """The nearest bifurcation of `kind` on the branch through an orbit, by the parameter.

    **Arguments:** follower over the range that is searched; an orbit; revolutions after which it closes; kind.

    **Returns:** the point, None where there is none; and what was searched, in words.
    """
    name = follower.parameter if isinstance(follower.parameter, str) else "the parameter"
    say = lambda x: f"{x * 30 / np.pi:.6g} rpm" if name == SPEED else f"{x:.6g}"
    follower = stable_steps(follower, start, periods)
    frame = follower.frame(jnp.asarray(start[0]), start[1], periods)
    first = seeds(follower, frame, [start])
    if not first.converged[0]:
        return None, f"no orbit near the guess at {name} = {say(start[1])} to follow"
    reached: list[float] = []

    def stop(lane: int, points: list[Corrected]) -> bool:
        """Past a point of the kind, or further from the guess than the other direction found one."""
        step: Corrected = jax.tree.map(lambda *x: np.stack(x), *points[-2:])
        far = float(abs(step.u[1, -1] - first.u[0, -1]))
        before, after = follower.unstable(step)
        if before != after and any(k == kind for _, k in brackets(follower, step)):
            reached.append(far)
            return True
        return bool(reached) and far > min(reached)

    both = turned(take(first, np.zeros(2, dtype=int)), np.array([1.0, -1.0]))
    up, down = follow(follower.curves(frame, [0, 0]), both, steps=WALK, inside=follower.inside, stop=stop)
    (found,) = describe(follower, frame, [joined(follower, up, down)])
    low, high = (say(float(f(found.value))) for f in (np.min, np.max))
    looked = f"looked along the branch of its orbit, {name} from {low} to {high} (ends: {', '.join(found.ended)})"
    mine = [p for p in found.special if p.kind == kind and p.status == "converged"]
    return min(mine, key=lambda p: abs(p.value - start[1]), default=None), looked
