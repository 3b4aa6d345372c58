"""diffrax's own solvers as its documentation shows them: `jit(vmap(diffeqsolve))` over the lanes, adaptive steps."""

import concurrent.futures
from collections.abc import Callable
from typing import Any

import diffrax as dfx
import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from .problem import Problem


BATCH = 256
"""Lanes to a call; each core takes calls in turn. Of 1, 16, 64, 256 and 1024 the quickest for Tsit5, and a third slower
than the quickest (16) for Kvaerno3."""
SOLVERS: dict[str, Callable[[], Any]] = {
    "Kvaerno3": dfx.Kvaerno3,
    "Kvaerno5": dfx.Kvaerno5,
    "KenCarp4": dfx.KenCarp4,
    "Tsit5": dfx.Tsit5,
}


class Diffrax:
    """One of diffrax's solvers with its PID controller, rtol = atol in units of the state's scale."""

    def __init__(
        self, solver: str, settings: tuple[float, ...], tight: float, lanes: int, revolutions: int, agree: float = 1e-7
    ):
        self.name, self.solver, self.settings, self.tight = f"diffrax {solver}, vmap", solver, settings, tight
        self.lanes, self.revolutions, self.agree = lanes, revolutions, agree

    def missing(self) -> str | None:
        return None

    def prepare(self, cores: int) -> None:
        self.cores = cores

    def close(self) -> None:
        pass

    def on(self, problem: Problem) -> Callable[[int, float], np.ndarray]:
        lanes = problem.speeds.size
        count = min(BATCH, -(-lanes // self.cores))
        fill = np.minimum(np.arange(-(-lanes // count) * count), lanes - 1).reshape(-1, count)
        batches = [(jnp.asarray(problem.speeds[i]), jnp.asarray(problem.states[i])) for i in fill]

        def run(revolutions: int, tolerance: float) -> np.ndarray:
            until, bound = jnp.asarray(2 * np.pi * revolutions), jnp.asarray(tolerance)

            def one(batch: tuple) -> np.ndarray:
                return np.asarray(_advance(problem.model, self.solver, batch[0], batch[1], until, bound))

            with concurrent.futures.ThreadPoolExecutor(self.cores) as pool:
                return np.concatenate(list(pool.map(one, batches)))[:lanes]

        return run


@eqx.filter_jit
def _advance(model: Any, solver: str, speeds: Any, states: Any, until: Any, tolerance: Any) -> Any:
    """States of all lanes at phase `until`, NaN where a solve fails."""

    def lane(speed: Any, state: Any) -> Any:
        scale = jnp.stack(model.scale(speed))
        field = model.at_speed(speed)
        rates = lambda tau, z, args: jnp.stack(field(tau, tuple(z * scale))) / scale
        term = dfx.ODETerm(rates)
        if solver == "KenCarp4":  # everything in its implicit half
            term = dfx.MultiTerm(dfx.ODETerm(lambda tau, z, args: jnp.zeros_like(z)), term)
        solution = dfx.diffeqsolve(
            term,
            SOLVERS[solver](),
            t0=0.0,
            t1=until,
            dt0=None,
            y0=state / scale,
            stepsize_controller=dfx.PIDController(rtol=tolerance, atol=tolerance),
            saveat=dfx.SaveAt(t1=True),
            max_steps=None,
            throw=False,
        )
        assert solution.ys is not None
        return jnp.where(solution.result == dfx.RESULTS.successful, solution.ys[-1] * scale, jnp.nan)

    return jax.vmap(lane)(speeds, states)
