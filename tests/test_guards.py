"""Numerical guards: single precision and bad versions of JAX are refused, the wall holds at any step size, and a label
that rests on too few revolutions says so.
"""

import inspect
from collections.abc import Callable
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from helpers import even, raw_sweep, raw_sweeps
from report_example import point

import jaxcage as jc
from jaxcage.cli import main
from jaxcage.integrate import OUTCOMES, outcome_code


def _duffing(tau: Any, q: Any, v: Any, speed: Any) -> tuple[Any]:
    (x,), (u,) = q, v
    return (-0.2 * u - x - x**3 + 0.3 * jnp.cos(tau),)


OSCILLATOR = jc.ForcedOscillator(_duffing, coordinates=1)
SPEEDS = np.array([1.0, 1.1])
FOLD, DOUBLING = point("fold", 7000.0, 1.0, 17), point("period-doubling", 12000.0, -1.0, 37)
WITHIN = {"guidance_gap": (3e-4, 6e-4)}
STATE = np.zeros(2)
ROW = np.zeros(3)
TRAJECTORY = jc.Trajectory(ROW, ROW, np.zeros((3, 4)), ROW, 2, 0.0, "finished")
WHOLE = jc.whole_bearing("nu2310")
START = jc.models.BearingState(jnp.zeros((5, 13)), jnp.zeros(9), jnp.zeros(2))
ENTRIES: dict[str, Callable[[Any], Any]] = {
    "bifurcation": lambda m: jc.bifurcation(OSCILLATOR, "fold", (1.0, STATE)),
    "branch": lambda m: jc.branch(OSCILLATOR, STATE, lower=1.0, upper=2.0),
    "cage_forces": lambda m: jc.analysis.cage_forces(m, TRAJECTORY),
    "cage_moments": lambda m: jc.analysis.cage_moments(m, TRAJECTORY),
    "cage_mass": lambda m: jc.bearing.cage_mass(m.bearing, 5e-4),
    "cascade": lambda m: jc.orbits.cascade(OSCILLATOR, DOUBLING, lower=1.0, upper=2.0),
    "case": lambda m: jc.case("1a"),
    "coexisting_orbits": lambda m: jc.orbits.coexisting_orbits(OSCILLATOR, 1.0),
    "curve": lambda m: jc.curve(m, FOLD, lower=4e-4, upper=5e-4, x_lower=600.0, x_upper=900.0),
    "doubled_branch": lambda m: jc.orbits.doubled_branch(OSCILLATOR, DOUBLING, lower=1.0, upper=2.0),
    "equilibrium": lambda m: jc.equilibrium(m, 900.0),
    "film_coefficients": lambda m: jc.analysis.film_coefficients(0.5),
    "film_whirl_speed": lambda m: jc.analysis.film_whirl_speed(m),
    "label_map": lambda m: jc.label_map(m, {"speed": SPEEDS}, {"guidance_gap": np.array([4e-4, 5e-4])}),
    "leading_multiplier": lambda m: jc.orbits.leading_multiplier(OSCILLATOR, 1.0, STATE),
    "load_distribution": lambda m: jc.bearing.load_distribution(m.bearing, 1000.0, 900.0),
    "monodromy": lambda m: jc.sweeps.monodromy(OSCILLATOR, SPEEDS, np.zeros((2, 2))),
    "optimise": lambda m: jc.optimise(m, WITHIN, jc.design.cost()),
    "orbit_measures": lambda m: jc.orbit_measures(m, TRAJECTORY),
    "periodic_orbit": lambda m: jc.periodic_orbit(OSCILLATOR, 1.0),
    "ramp": lambda m: jc.ramp(OSCILLATOR, 1.0, 1.1, revolutions=2),
    "run_up_down": lambda m: jc.run_up_down(OSCILLATOR, SPEEDS),
    "run_up_down_designs": lambda m: jc.sweeps.run_up_down_designs([OSCILLATOR], SPEEDS),
    "surrogate_search": lambda m: jc.design.surrogate_search(m, WITHIN, jc.design.cost()),
    "sensitivities": lambda m: jc.orbits.sensitivities(m, {"an edge": FOLD}, jc.method()),
    "sensitivity": lambda m: jc.sensitivity(m, FOLD),
    "simulate": lambda m: jc.simulate(OSCILLATOR, 1.0, revolutions=1),
    "stability_chart": lambda m: jc.analysis.stability_chart(),
    "static_cage_displacement": lambda m: jc.bearing.static_cage_displacement(
        "outer_rib", guidance_gap=1.0, pocket_clearance=1.0, radial_clearance=1.0, elastic_approach=1.0
    ),
    "strobe_map": lambda m: jc.strobe_map(OSCILLATOR, 1.0),
    "study": lambda m: jc.study(OSCILLATOR, {"speed": SPEEDS}, store="nowhere", name="duffing", version="1"),
    "sweep": lambda m: raw_sweep(OSCILLATOR, SPEEDS),
    "sweep_designs": lambda m: raw_sweeps([OSCILLATOR], SPEEDS),
    "synchronous_orbits": lambda m: jc.synchronous_orbits(OSCILLATOR, 1.0, 1.1, count=2),
    "whole_bearing": lambda m: jc.whole_bearing("nu2310"),
    "simulate_bearing": lambda m: jc.simulate_bearing(WHOLE, 1000.0, revolutions=1),
    "bearing_over_time": lambda m: jc.bearing_over_time(WHOLE, 1000.0, np.arange(2.0), start=START),
    "sweep_bearing": lambda m: jc.sweep_bearing(WHOLE, 1000.0),
    "sweep_bearings": lambda m: jc.sweep_bearings([WHOLE], 1000.0),
}
"""Every public function that computes in JAX, or makes a model to compute with."""

OTHERS = {
    # settings, objectives and distributions: nothing is computed yet
    *("keep_compiled_programs", "enable_x64", "rpm", "method", "controlled", "uniform", "rayleigh"),
    *("chaotic_share", "chaotic_width", "cost", "regular_motion", "survival", "zone_width"),
    # parameters by name, tables
    *("parameter_info", "parameters", "replace", "nu2310", "published_case", "vg", "open_study"),
    # of what was found before, with its numbers
    *("zones", "loss_zones", "explain", "zero_one", "order_spectrum", "dominant_orders"),
    *("tolerance_budget", "global_sensitivity", "bearing_measures"),
}


@pytest.fixture(scope="module")
def model() -> jc.CageModel:
    return jc.case("1a")


def test_every_public_function_is_known():
    functions = {n for n, o in vars(jc).items() if inspect.isfunction(inspect.unwrap(o)) and not n.startswith("_")}
    assert functions <= set(ENTRIES) | OTHERS


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
    assert "more revolutions" not in str(long)
    assert np.all(single.label == "undecided") and np.all(single.too_short)  # a single block has no error
    assert "3 lanes need more revolutions" in str(single)


@pytest.mark.wide
def test_short_studies_say_so(capsys: pytest.CaptureFixture[str], tmp_path: Path):
    counts = ["--starts", "1", "--discard", "2", "--revolutions", "10", "--solver", "rk4", "--steps", "64"]
    counts += ["--out", str(tmp_path)]
    assert main(["study", "1a", "--vary", "speed=5000rpm:6000rpm:2", *counts]) == 0
    assert "Warning: 2 labels rest on too few revolutions: choose more --revolutions." in capsys.readouterr().err


@pytest.mark.wide
def test_adaptive_steps_tell_how_far_the_cage_went():
    """Not only where it ended: it bounces off the rib within the revolution."""
    run = lambda method: raw_sweep(
        jc.case("1a"),
        float(jc.rpm(9000.0)),
        starts=[(0.0, 0.0, 3.0, 0.0)],
        discard=0,
        revolutions=1,
        blocks=1,
        exponents=0,
        keep=1,
        method=method,
    )
    adaptive, fine = run(jc.method("rk4", tolerance=1e-6)), run(jc.method("rk4", steps=1024))
    assert fine.peak[0, 0] > 1.0
    assert adaptive.peak[0, 0] == pytest.approx(fine.peak[0, 0], abs=2e-3)
