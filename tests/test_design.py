"""Search, Sobol indices and budgets against closed forms; loads of the land against time histories."""

import dataclasses

import jax.numpy as jnp
import numpy as np
import pytest
from laws import double_well, hardening
from literature import DUFFING_FOLDS

import jaxcage as jc
from jaxcage.design import Design, DesignSpace, OperatingRange, Requirements, Tolerance, Value
from jaxcage.design.operating import Through
from jaxcage.design.optimiser import Problem
from jaxcage.design.requirements import listed


VARY = {"d": (0.1, 1.0), "b": (0.5, 3.0)}


def by_parameters(height):
    """Values of designs by a function of their parameters."""
    return lambda models: np.array([float(height(jc.parameters(model))) for model in models])


def bowl(d=0.4, b=1.5):
    """Smallest, with the value 1, where d and b are these."""
    return by_parameters(lambda p: 1.0 + 40 * (p["d"] - d) ** 2 + (p["b"] - b) ** 2)


@pytest.mark.parametrize("vary", [VARY, {"b": VARY["b"]}])
def test_a_search_finds_a_known_optimum(vary: dict[str, tuple[float, float]]):
    found = jc.design.surrogate_search(double_well(0.262), vary, bowl(d=0.3))
    assert found.objective == pytest.approx(1.0, abs=2e-3) and found.at_bound == () and found.changed
    assert found.values == pytest.approx({n: {"d": 0.3, "b": 1.5}[n] for n in vary}, rel=0.05)
    assert found.model.acceleration.b == pytest.approx(found.values["b"])  # pyright: ignore


@pytest.mark.parametrize("seed", range(3))
def test_a_search_among_many_valleys_beats_as_many_even_draws(seed: int):
    """Rastrigin's function of four parameters; the draws are those of the same Sobol sequence."""
    names = ("d", "b", "k", "g")
    vary = {n: (0.2, 2.2) for n in names}
    waves = lambda x: 10.0 + x**2 - 10 * jnp.cos(2 * jnp.pi * x)
    height = by_parameters(lambda p: 1.0 + sum(waves(p[n] - 1.4) for n in names))
    found = jc.design.surrogate_search(double_well(0.262), vary, height, batches=10, batch=12, seed=seed)
    drawn = jc.lanes.sobol(4, 120, seed) * 2.0 + 0.2
    even = height([jc.replace(double_well(0.262), **dict(zip(names, row, strict=True))) for row in drawn.tolist()])
    assert found.objective < even.min()


def test_designs_without_a_value_are_passed_over():
    inside = bowl()
    holes = lambda models: np.where([float(jc.parameters(m)["b"]) < 1.2 for m in models], np.nan, inside(models))
    found = jc.design.surrogate_search(double_well(0.262), VARY, holes, batches=6)
    assert found.values["b"] >= 1.2 and found.objective < 1.05


def test_the_best_of_many_with_noise_is_chosen_anew():
    """Noise of 2 hides a bowl; by the bowl itself the design chosen is better than what the search took for best, and
    one that is the best from the beginning stays."""
    exact, rng, system = bowl(d=0.7), np.random.default_rng(0), double_well(0.262)
    noisy = lambda models: exact(models) + 2.0 * rng.normal(size=len(models))
    lucky = jc.design.surrogate_search(system, VARY, noisy, batches=8)
    chosen = jc.design.surrogate_search(system, VARY, noisy, confirm=exact, batches=8)
    assert lucky.objective < 1.0 <= chosen.objective == pytest.approx(exact([chosen.model])[0])
    assert chosen.objective <= exact([system])[0]
    stays = jc.design.surrogate_search(system, VARY, noisy, confirm=bowl(d=0.3, b=1.0), batches=2)
    assert not stays.changed and stays.objective == pytest.approx(1.0) and stays.model is system


def test_a_bound_that_stops_the_search_is_named():
    found = jc.design.surrogate_search(double_well(0.262), VARY, bowl(d=2.0))
    assert found.at_bound == ("d",) and found.values["d"] <= 1.0 and "at bound" in str(found)


@pytest.mark.wide
def test_sobol_indices_of_ishigami():
    """Ishigami and Homma's function, a = 7, b = 0.1: first 0.3139, 0.4424, 0, total 0.5576, 0.4424, 0.2437."""
    names = ("d", "b", "k")
    vary = {n: (0.5, 1.5) for n in names}

    def ishigami(p):
        x, y, z = (2 * np.pi * (float(p[n]) - 1.0) for n in names)
        return np.sin(x) + 7 * np.sin(y) ** 2 + 0.1 * z**4 * np.sin(x)

    got = jc.design.global_sensitivity(double_well(0.262), vary, by_parameters(ishigami), samples=1024)
    for found, ends, exact in (
        (got.first, got.first_interval, (0.3139, 0.4424, 0.0)),
        (got.total, got.total_interval, (0.5576, 0.4424, 0.2437)),
    ):
        assert list(found.values()) == pytest.approx(exact, abs=0.05) and got.doubtful == ()
        assert all(low <= value <= high for value, (low, high) in zip(exact, ends.values(), strict=True))


def test_a_parameter_that_changes_nothing_and_scatter_of_the_motion():
    """Two blocks that differ by noise of variance 0.5: their mean has a quarter of it, beside 1/12 of the parameter."""
    rng = np.random.default_rng(0)
    cubic = by_parameters(lambda p: p["b"])
    values = lambda models: cubic(models)[:, None] + np.sqrt(0.5) * rng.normal(size=(len(models), 2))
    vary = {"b": (0.5, 1.5), "d": (0.1, 0.5)}
    got = jc.design.global_sensitivity(double_well(0.262), vary, values, samples=256)
    assert got.scatter == pytest.approx(0.75, abs=0.1) and got.first["b"] == pytest.approx(0.25, abs=0.15)
    still = jc.design.global_sensitivity(double_well(0.262), vary, cubic, samples=8)
    assert still.total["d"] == 0.0 == still.first["d"] and still.total_interval["d"] == (0.0, 0.0)


def test_sobol_indices_and_their_intervals_of_a_value_far_from_zero():
    vary = {"b": (0.5, 1.5), "d": (0.5, 1.5)}
    plain, shifted = (
        jc.design.global_sensitivity(double_well(0.262), vary, by_parameters(lambda p: a + p["b"] + p["d"] / 2))
        for a in (-1.5, 98.5)
    )
    assert shifted.first == pytest.approx(plain.first)
    for name, ends in plain.first_interval.items():
        assert shifted.first_interval[name] == pytest.approx(ends)


def bare(kind, **fields):
    """An object with only some of its fields."""
    found = object.__new__(kind)
    vars(found).update(fields)
    return found


def test_what_no_design_keeps_is_told_in_the_units_of_its_table():
    """The worst bearing within tolerances counts, which the table shows even if no design is feasible."""
    limits = listed(Requirements(film=50e-6, decay=5.0), jc.case("1a"))
    worst = {limits[3].name: Value(np.exp(-1 / 6), np.zeros(1)), "least film": Value(2e-5, np.zeros(1))}
    after = {"film": Value(6e-5, np.zeros(1))}
    found = bare(Design, requirements=limits, short=dict.fromkeys(worst, 1.0), worst=worst, before={}, after=after)
    told = "decay of a disturbance, 6 rev. (at most 5); least film, 0.02000 mm (at least 0.05000)"
    assert jc.show.broken_words(found) == told
    shown = jc.show.requirement_table("", found)
    assert shown.heads[3:6] == ["before", "after", "worst in tolerance"]
    assert shown.rows[-1][3:6] == ("-", "0.06000", "0.02000")


def test_bounds_beyond_what_a_parameter_may_be_are_refused_at_once():
    with pytest.raises(ValueError, match="`restitution` must be a number from 0.05 to 1, but is 1.5"):
        jc.design_for(jc.case("1a"), (1309.0, 1885.0), {"eccentricity": (1e-6, 3e-5), "restitution": (0.5, 1.5)})


def test_a_tolerance_beyond_what_a_parameter_may_be():
    """A gap of 0.45 mm with 0.5 mm more or less."""
    space = DesignSpace.of(jc.case("1a"), {"guidance_gap": (0.3e-3, 0.6e-3)})
    problem = Problem(bare(OperatingRange, space=space), [], None, np.array([True]), {})
    made = lambda half: problem.worst(space.place, {}, {"guidance_gap": Tolerance(-half, half)})
    assert made(0.1e-3) == {}
    assert made(0.5e-3) == "guidance_gap must be a number from 1e-05 to 0.005 m, but reaches -5e-05"


def test_a_share_of_a_temperature_is_that_of_the_absolute_one():
    assert jc.show.direction_words("temperature") == "absolute temperature"
    assert jc.show.direction_words("cage_mass+cage_inertia") == "cage mass, cage inertia"


def test_tolerance_budget_is_the_root_of_squares():
    elasticity = {"gap": 0.5, "mass": -2.0}
    edge = jc.orbits.Sensitivity("zone 1 exit", "fold", 10000.0, {}, elasticity, {}, 1.0, "converged")
    got = jc.design.tolerance_budget(edge, {"gap": 0.02, "mass": 0.01})
    assert got.deviation == pytest.approx({"gap": 100.0, "mass": 200.0})
    assert got.total == pytest.approx(np.hypot(100, 200))
    assert "standard deviation 224 rpm" in str(got)  # 1.96 of it would be more than a uniform tolerance can do


@pytest.mark.parametrize(
    "vary, options, words",
    [
        ({"d": (0.5, 1.0)}, {}, "must lie within the bounds, but d does not"),
        (VARY, {"batches": 0}, "at least 1"),
        (VARY, {"batch": 1}, "at least 2"),
    ],
)
def test_bad_input_gets_a_sentence(vary, options, words):
    with pytest.raises(ValueError, match=words):
        jc.design.surrogate_search(double_well(0.262), vary, bowl(), **options)


@pytest.mark.wide
def test_a_failed_lane_counts_as_chaotic():
    """Steps that are too long fail; a design of which nothing is known is not called calm."""
    runs = jc.design.Runs(jc.rpm(9000, 10000, 2), discard=2, revolutions=2, method=jc.method("rk4", steps=2))
    assert jc.design.chaotic_width(9000.0, 10000.0).values(runs)([jc.case("1a")]) == pytest.approx([1000.0])
    priced = jc.design.chaotic_width(9000.0, 10000.0, price=100.0).values(runs)
    assert priced([jc.case("1a")]) == pytest.approx([1000.0 + 100.0 * 2.0])


@pytest.mark.wide
def test_fresh_runs_share_nothing_with_those_of_a_search():
    """Other speeds and states, twice as many speeds within the same range, and the states within the clearance."""
    runs = jc.design.Runs(jc.rpm(9000, 10000, 3), discard=0, revolutions=1)
    first, second = (runs.fresh(number, initial_states=2) for number in (1, 2))
    for some, other in ((runs, first), (runs, second), (first, second)):
        assert not set(some.speed[:-1]) & set(other.speed[:-1])
    assert second.speed.size == 6 and np.all(np.diff(second.speed) > 0)
    assert jc.rpm(9000) <= second.speed[0] and second.speed[-1] == pytest.approx(jc.rpm(10000))
    states = [jc.design.drawn_states(jc.case("1a"), runs.speed, 2, run.seed or 0) for run in (first, second)]
    assert np.abs(states[0][..., :2]).max() < 0.6 * float(jc.case("1a").clearance)
    assert not np.allclose(*states)


@pytest.mark.wide
def test_loads_of_the_land_are_those_of_a_time_history():
    """1b at two speeds, one of them within a chaotic zone. Where motion is chaotic two integrations part: they are
    compared over few revolutions."""
    models = [jc.replace(jc.case("1b"), guidance_gap=gap, eccentricity=e) for gap, e in ((6e-4, 23e-6), (3e-4, 59e-6))]
    method, fine = (jc.method("rk4", steps=steps) for steps in (1024, 2048))
    found = jc.design.Runs(jc.rpm(9000, 27500, 2), initial_states=2, discard=60, revolutions=20, method=method).run(
        models
    )
    got, last, touched = jc.analysis.land_loads(models, found, method), found["last"].values, 0
    for lane in np.ndindex(*last.shape[:-1]):
        model, speed = models[lane[0]], float(found["speed"][lane[1]])
        run = jc.simulate(model, speed, start=tuple(last[lane]), revolutions=4, samples=1024, method=fine)
        seen = {name: each.value for name, each in jc.analysis.measures(model, run).items()}
        load = seen["mean_contact_force"] * speed * float(model.land_radius)
        assert got["wear load"][lane] == pytest.approx(load, rel=0.02, abs=1e-6)
        assert got["peak land force"][lane] == pytest.approx(seen["peak_contact_force"], rel=0.06, abs=1e-6)
        assert got["film drag power"][lane] == pytest.approx(seen["drag_power"], rel=0.02)
        thinnest = seen["minimum_film_thickness"]
        assert got["least film"][lane] == pytest.approx(thinnest, abs=0.01 * float(model.clearance))
        touched += load > 1.0
    assert touched >= 2


def test_speeds_without_an_orbit_are_not_the_worst():
    """Also for the film, whose value for comparison is negative."""

    known = jc.periodic_orbit(double_well(0.262), 1.2, method=jc.method("rk4", steps=64))

    class Known:
        def orbit(self, speed):
            return dataclasses.replace(known, speed=speed)

        def size(self, orbit, name):
            return -np.inf if orbit.speed > 0.6 else -1e-4 * (1 + (orbit.speed - 0.4) ** 2)

    assert Through.largest(Known(), "film", 0.0, 1.0).speed == pytest.approx(0.4, abs=1e-3)


@pytest.mark.wide
def test_orbits_past_a_fold_are_none_of_the_operating_range():
    system = hardening()
    space = jc.design.DesignSpace.of(system, {"d": (0.05, 0.2)})
    range_ = jc.design.OperatingRange(space, (1.1, 1.7), margin=10.0)
    edges = range_.edges(space.place)
    assert not isinstance(edges, str) and edges["upper"] is not None and not range_.handed_over
    assert edges["upper"].value_rpm == pytest.approx(DUFFING_FOLDS["up"].value * 30 / np.pi, rel=1e-6)
    assert range_.peak(space.place, edges).value < 1
