"""Numerical guards: single precision and bad versions of JAX are refused, the wall holds at any step size, and a label
that rests on too few revolutions says so.
"""

from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from helpers import even, raw_sweep

import jaxcage as jc
from jaxcage.solve import OUTCOMES, outcome_code


def _duffing(tau: Any, q: Any, v: Any, speed: Any) -> tuple[Any]:
    (x,), (u,) = q, v
    return (-0.2 * u - x - x**3 + 0.3 * jnp.cos(tau),)


OSCILLATOR = jc.ForcedOscillator(_duffing, coordinates=1)
SPEEDS = np.array([1.0, 1.1])
WITHIN = {"guidance_gap": (3e-4, 6e-4)}
STATE = np.zeros(2)
WHOLE = jc.whole_bearing("nu2310")
ENTRIES: dict[str, Callable[[Any], Any]] = {
    "branch": lambda m: jc.branch(OSCILLATOR, STATE, lower=1.0, upper=2.0),
    "case": lambda m: jc.case("1a"),
    "equilibrium": lambda m: jc.equilibrium(m, 900.0),
    "optimise": lambda m: jc.optimise(m, WITHIN, jc.design.cost()),
    "periodic_orbit": lambda m: jc.periodic_orbit(OSCILLATOR, 1.0),
    "simulate": lambda m: jc.simulate(OSCILLATOR, 1.0, revolutions=1),
    "study": lambda m: jc.study(OSCILLATOR, {"speed": SPEEDS}, store="nowhere", name="duffing", version="1"),
    "sweep": lambda m: raw_sweep(OSCILLATOR, SPEEDS),
    "whole_bearing": lambda m: jc.whole_bearing("nu2310"),
    "sweep_bearing": lambda m: jc.sweep_bearing(WHOLE, 1000.0),
}


@pytest.fixture(scope="module")
def model() -> jc.CageModel:
    return jc.case("1a")


@pytest.mark.parametrize("name", ENTRIES)
def test_single_precision_is_refused(model: jc.CageModel, name: str):
    with jax.enable_x64(False), pytest.raises(RuntimeError, match=r"double precision: call `jaxcage.enable_x64\(\)`"):
        ENTRIES[name](model)


@pytest.mark.parametrize("bad", ["0.10.2", "0.11.0"])
@pytest.mark.parametrize("name", ["case", "sweep", "simulate", "periodic_orbit", "optimise"])
def test_bad_versions_are_refused(monkeypatch: pytest.MonkeyPatch, model: jc.CageModel, name: str, bad: str):
    monkeypatch.setattr(jax, "__version__", bad)
    with pytest.raises(RuntimeError, match=f"JAX {bad} gives wrong results .*issues/39.*install jax==0.10.1"):
        ENTRIES[name](model)


THROWS = np.array([1.0, 3.0, 10.0, 100.0])
"""Speeds [m/s] at which a cage leaves the middle: at the last one it has energy to cross the rib."""
DIRECTIONS = np.arange(6) * np.pi / 3


def _clearances_reached(model: jc.CageModel, speed: np.ndarray) -> np.ndarray:
    """The eccentricity ratio at which the contact alone has taken all of a thrown cage's energy."""
    energy = 0.5 * float(model.cage_mass) * speed**2
    depth = (19 / 9 * energy / float(model.contact.stiffness)) ** (9 / 19)
    return float(model.contact.onset) + depth / float(model.clearance)


def _thrown() -> tuple[np.ndarray, Any]:
    """Speed [m/s] and state of every throw."""
    speed, angle = (x.ravel() for x in np.meshgrid(THROWS, DIRECTIONS, indexing="ij"))
    rows = (np.zeros_like(speed), np.zeros_like(speed), speed * np.cos(angle), speed * np.sin(angle))
    return speed, tuple(jnp.asarray(row) for row in rows)


@pytest.mark.wide
@pytest.mark.parametrize(
    "solver, steps",
    [
        ("rk4", 16),
        ("rk4", 128),
        ("newmark", 64),
        ("rodas3", 32),
    ],
)
def test_a_cage_thrown_at_the_rib_is_never_outside_in_silence(model: jc.CageModel, solver: str, steps: int):
    """With steps too large by far for the contact: a lane is refused, or tells how far out the farthest of its steps
    was, which is compared with here for four of them at a time.
    """
    strobe = jc.strobe_map(even(model), jc.rpm(9000.0), jc.method(solver, steps=steps))

    def one(y: Any, i: Any) -> Any:
        y = strobe.part(y, i, steps).y
        return y, jnp.hypot(y[0], y[1]) / model.clearance

    def four(y: Any, i: Any) -> Any:
        _, eps = jax.lax.scan(one, y, 4 * i + jnp.arange(4))
        stretch = strobe.part(y, i, steps // 4)
        return stretch.y, (jnp.max(eps), stretch.peak, outcome_code(stretch.result))

    speed, y = _thrown()
    revolution = jax.jit(jax.vmap(lambda y: jax.lax.scan(four, y, jnp.arange(steps // 4))[1]))
    eps, told, code = (np.asarray(x) for x in revolution(y))
    well = np.logical_and.accumulate(code == OUTCOMES.index("successful"), axis=1)
    np.testing.assert_allclose(eps[well], told[well], rtol=1e-6)
    assert np.all(told[well] <= 2) and not np.any(well[speed == 100.0, -1])
    assert np.all(told[code == OUTCOMES.index("outside")] > 2)
    crossed = np.any(~(eps <= 1), axis=1)
    assert np.any(crossed & (speed == 10.0))  # with steps like these some do leave, and it is told
    assert np.all(~crossed | ~well[:, -1] | (np.max(told, axis=1) > 1))


@pytest.mark.wide
def test_with_fine_steps_the_rib_turns_a_thrown_cage_back(model: jc.CageModel):
    """Nothing goes deeper than where the contact has taken all its energy; what has more than that is refused."""
    speed, y = _thrown()
    strobe = jc.strobe_map(model, jc.rpm(9000.0), jc.method("rk4", steps=1024))

    def revolution(y: Any) -> Any:
        stretch = strobe(y)
        return stretch.peak, outcome_code(stretch.result)

    peak, code = (np.asarray(x) for x in jax.jit(jax.vmap(revolution))(y))
    hard, limit = speed < 100, _clearances_reached(model, speed)
    assert np.all(limit[~hard] > 2) and not np.any(code[~hard] == OUTCOMES.index("successful"))
    assert np.all(code[hard] == OUTCOMES.index("successful")) and np.all(peak[hard] < limit[hard])
    assert np.all(peak[hard] > float(model.contact.onset))  # every one of them met the wall
    fast = speed == 10.0
    assert np.all(peak[fast] > 1 + 0.6 * (limit[fast] - 1))


@pytest.mark.wide
def test_a_short_sweep_says_so_and_a_long_one_does_not():
    """The chaotic oscillator of Ueda: 0.65 a revolution."""

    def ueda(tau: Any, q: Any, v: Any, speed: Any) -> tuple[Any]:
        (x,), (u,) = q, v
        return (-0.05 * u - x**3 + 7.5 * jnp.sin(tau),)

    system = jc.ForcedOscillator(ueda, coordinates=1)
    lengths = {"discard": 20, "method": jc.method("rk4", steps=64), "keep": 8}
    single, long = (
        raw_sweep(system, np.array([1.0]), revolutions=n, blocks=blocks, **lengths)
        for n, blocks in ((100, 1), (400, 20))
    )
    assert np.all(long.label == "chaotic") and not np.any(long.too_short)
    assert "no certain label" not in str(long)
    assert np.all(single.label == "undecided") and np.all(single.too_short)  # a single block has no error
    assert "3 lanes have no certain label" in str(single)
