"""Orbits by collocation with jaxcont (`pip install jaxcont`), which has a fixed mesh and dense matrices.

`python -m benchmarks.collocation NUMBERS` is a process of its own.
"""

import importlib.util
import json
import sys
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from .orbit_tasks import TASKS, Task


KINDS = {"fold": "fold", "period_doubling": "period-doubling"}
"""What jaxcont calls special points of orbits."""


def missing() -> str | None:
    """Why it cannot take part."""
    return None if importlib.util.find_spec("jaxcont") else "not installed"


def follow(task: Task, orbit: np.ndarray, intervals: int, longest: float) -> dict[str, Any]:
    """The branch from `orbit`, rows of phase, state, cosine and sine: points and special points (kind, speed over the
    first). The phase is carried along as the limit cycle (cos, sin) of an oscillator.
    """
    import jaxcont  # pyright: ignore[reportMissingImports]
    from jaxcont.core.collocation import Collocation  # pyright: ignore[reportMissingImports]
    from jaxcont.problems.periodic import periodic_orbit_problem  # pyright: ignore[reportMissingImports]

    model, scale = task.make(), jnp.asarray(task.scale())
    grows = jnp.arange(scale.size) >= scale.size // 2  # velocities are over the speed

    def rates(u: Any, ratio: Any, args: Any) -> Any:
        del args
        z, (c, s) = u[:-2], u[-2:]
        unit = scale * jnp.where(grows, ratio, 1.0)
        found = model.at_speed(ratio * task.speed)(jnp.arctan2(s, c), tuple(unit * z))
        rest = 1 - c * c - s * s
        return jnp.concatenate([jnp.stack(found) / unit, jnp.stack([c * rest - s, s * rest + c])])

    mesh = Collocation(ntst=intervals, ncol=4)
    tau, states = jnp.asarray(orbit[:, 0]), jnp.asarray(orbit[:, 1:])
    problem = periodic_orbit_problem(rates, states, tau, 2 * np.pi, 1.0, mesh)
    end = task.end / task.begin
    sign = 1 if end > 1 else -1
    settings = jaxcont.ContinuationPar(
        ds=0.1 * longest * sign, ds_min=1e-6, ds_max=longest, newton_tol=1e-9, max_steps=400
    )
    events = [jaxcont.Fold(), jaxcont.PeriodDoubling(raw_f=rates, mesh=mesh)]
    found = jaxcont.continuation(problem, p_span=(1.0, end), settings=settings, events=events)
    special = [[KINDS[e.kind], float(e.p)] for e in found.events if e.kind in KINDS]
    return {"points": int(found.branch.n_valid), "special": special}


if __name__ == "__main__":
    jax.config.update("jax_enable_x64", True)
    given = json.loads(sys.argv[1])
    print(json.dumps(follow(TASKS[given["task"]], np.array(given["orbit"]), given["intervals"], given["longest"])))
