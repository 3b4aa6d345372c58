"""Data of all rivals: states on the attractors of one case, constants of the equations, and the measure of error."""

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np

import jaxcage as jc
from tests.helpers import preliminary


CASE = "1a"
FIRST_RPM, LAST_RPM = 2500.0, 27500.0
TRANSIENT = 216
"""Revolutions from a start to its attractor."""
TARGET = 1e-4
"""Reached error at which rivals are compared, over the clearance."""


@dataclasses.dataclass(frozen=True)
class Problem:
    """Lanes: a speed [rad/s], ascending, and a state in SI units each."""

    model: jc.CageModel
    speeds: np.ndarray
    states: np.ndarray

    def places(self, count: int) -> np.ndarray:
        """Numbers of `count` lanes evenly spread over the speeds."""
        return np.linspace(0, self.speeds.size - 1, count).round().astype(int)

    def lanes(self, count: int) -> "Problem":
        """These lanes alone."""
        pick = self.places(count)
        return Problem(self.model, self.speeds[pick], self.states[pick])

    @property
    def scale(self) -> np.ndarray:
        """Clearance [m] and clearance times speed [m/s] for each lane, shape (lanes, 4)."""
        c = np.full_like(self.speeds, float(self.model.clearance))
        return np.stack([c, c, c * self.speeds, c * self.speeds], axis=-1)


def _begin() -> None:
    jc.enable_x64()
    jax.config.update("jax_enable_compilation_cache", False)  # or times of compiling would be those of reading a disk


def make_problem(lanes: int) -> Problem:
    """Lanes over the case's speeds, the model's three initial states taken in turn, each run onto its attractor.

    Some attractors reach past the clearance circle, which the contact allows but `sweep` does not as a start: of a few
    more lanes than asked for those inside are kept.
    """
    _begin()
    model = preliminary(CASE)
    speeds = jc.rpm(FIRST_RPM, LAST_RPM, lanes + lanes // 64 + 8)
    table = jax.vmap(lambda s: jnp.stack([jnp.stack(y) for y in model.initial_states(s)]))
    initial_states = np.asarray(table(jnp.asarray(speeds)))
    turn = np.arange(speeds.size)
    first = Problem(model, speeds, initial_states[turn, turn % initial_states.shape[1]])
    states = our_map(first, None, TRANSIENT)
    if not np.all(np.isfinite(states)):
        raise RuntimeError(f"{np.sum(~np.isfinite(states[:, 0]))} lanes failed on the way to their attractors.")
    inside = np.hypot(states[:, 0], states[:, 1]) < float(model.clearance)
    return Problem(model, speeds[inside], states[inside]).lanes(lanes)


def save(problem: Problem, file: str) -> None:
    """Keep the lanes for another process."""
    np.savez(file, speeds=problem.speeds, states=problem.states)


def load(file: str) -> Problem:
    """The lanes that `save` kept."""
    _begin()
    with np.load(file) as kept:
        return Problem(preliminary(CASE), kept["speeds"], kept["states"])


def spread_out(problem: Problem, lanes: int) -> Problem:
    """Any number of lanes over the same speeds, each from the state of the nearest lane of `problem`."""
    if lanes <= problem.speeds.size:
        return problem.lanes(lanes)
    speeds = np.linspace(problem.speeds[0], problem.speeds[-1], lanes)
    nearest = np.searchsorted((problem.speeds[1:] + problem.speeds[:-1]) / 2, speeds)
    return Problem(problem.model, speeds, problem.states[nearest])


def our_map(problem: Problem, method: jc.solve.AbstractMethod | None, revolutions: int = 1) -> np.ndarray:
    """End states of the library's own map, shape (lanes, 4)."""
    return jc.sweep(
        problem.model,
        problem.speeds,
        initial_states=problem.states[:, None],
        discard=0,
        revolutions=revolutions,
        blocks=1,
        exponents=0,
        keep=1,
        method=method,
    )["last"].values[:, 0]


def constants(model: jc.CageModel, speeds: np.ndarray) -> np.ndarray:
    """Numbers of the equations of motion in units of clearance and cage revolution, shape (lanes, constants).

    In the order of `Constants` in `rosenbrock.c`. With lengths over c and phase tau for time, a force F becomes
    F / (M c omega^2). All come from `model.cage_at`.
    """
    cage = jax.vmap(model.cage_at)(jnp.asarray(speeds))
    film, contact, support, impact = (cage.law(name) for name in ("film", "contact", "support", "impact"))
    law, land = model.support, cage.land
    plain = model.film.model == "fixed_half" and law.cross == "circulatory" and not np.any(film.supply_scale)
    if not plain or model.extra or not isinstance(impact, jc.forces.SynchronousForce):
        raise ValueError("The rivals know no film, coupling, impact and forces but those of the published cases.")
    c, w, mass = land.clearance, cage.speed, cage.mass
    inertia = mass * w * w
    columns = (
        film.scale / (2 * mass * c * w),
        contact.stiffness * c ** (1 / 9) / inertia,
        contact.damping * c * w,
        land.onset,
        land.onset_width,
        land.centre_width**2,
        law.stiffness_x / inertia,
        law.stiffness_y / inertia,
        support.cubic * c * c / inertia,
        law.damping / (mass * w),
        law.cross_stiffness / inertia,
        cage.law("unbalance").unbalance / (mass * c),
        impact.amplitude / (c * inertia),
        model.gravity / (c * w * w),
    )
    return np.stack([np.broadcast_to(np.asarray(x, dtype=float), speeds.shape) for x in columns], axis=-1)


def reached_error(problem: Problem, truth: np.ndarray, got: np.ndarray) -> tuple[float, float]:
    """Median and 99th percentile of max(|dx|, |dy|) over the clearance; lanes that failed count as infinite."""
    apart = np.max(np.abs(got - truth)[:, :2], axis=-1) / float(problem.model.clearance)
    apart = np.where(np.isfinite(apart), apart, np.inf)
    median, most = np.quantile(apart, [0.5, 0.99], method="higher")
    return float(median), float(most)
