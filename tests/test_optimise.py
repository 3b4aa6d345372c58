"""Optimisation: known optima from many starts, within bounds, resumable; sensitivities against closed forms."""

import jax
import jax.numpy as jnp
import numpy as np
import optax
import pytest
from helpers import WELL, double_well

import jaxcage as jc


VARY = {"damping": (0.1, 1.0), "cubic": (0.5, 3.0)}
OPTIMISERS = optax.adam(0.2), optax.sgd(0.3, momentum=0.5), optax.rmsprop(0.1)


def bowl(damping=0.4, cubic=1.5):
    """Smallest, with the value 1, where damping and cubic are these."""

    def height(system):
        p = jc.parameters(system)
        return 1.0 + 40 * (p["damping"] - damping) ** 2 + (p["cubic"] - cubic) ** 2

    return jc.design.Smooth(height)


@pytest.mark.wide
@pytest.mark.parametrize("optimiser", [None, *OPTIMISERS])
def test_any_optimiser_finds_a_known_optimum(optimiser):
    found = jc.optimise(double_well(), VARY, bowl(), starts=4, steps=150, optimiser=optimiser).best
    assert found.objective == pytest.approx(1.0, abs=2e-2)
    assert found.values == pytest.approx({"damping": 0.4, "cubic": 1.5}, rel=0.1)
    assert found.at_bound == ()
    cubic = found.model.acceleration.cubic  # pyright: ignore[reportFunctionMemberAccess]
    assert cubic == pytest.approx(found.values["cubic"], rel=1e-12)


@pytest.mark.parametrize("vary", [VARY, {"cubic": VARY["cubic"]}])
def test_a_surrogate_finds_a_known_optimum(vary: dict[str, tuple[float, float]]):
    found = jc.design.surrogate_search(double_well(), vary, bowl(damping=WELL["damping"])).best
    assert found.objective == pytest.approx(1.0, abs=1e-3)
    assert found.values == pytest.approx({n: {"damping": WELL["damping"], "cubic": 1.5}[n] for n in vary}, rel=0.03)


def test_the_best_of_many_with_noise_is_chosen_anew():
    """Noise of 2 hides a bowl; by the bowl itself the design chosen is better than what the search took for best, and
    one that is the best from the beginning stays."""
    rng = np.random.default_rng(0)

    class Noisy(jc.design.Smooth):
        def values(self, space, places):
            return super().values(space, places) + 2.0 * rng.normal(size=len(places))

    exact = bowl(damping=0.7)
    found = jc.design.surrogate_search(double_well(), VARY, Noisy(exact.function), starts=2, batches=8)
    worth = lambda o: float(exact.function(o.model))
    chosen, itself = jc.design.confirmed(found, exact)
    assert itself == pytest.approx(float(exact.function(double_well())))
    assert chosen.best.objective == pytest.approx(worth(chosen.best)) and found.best.objective < 1.0
    assert chosen.best.objective < min(worth(found.best), itself)
    at_best = bowl(damping=WELL["damping"], cubic=WELL["cubic"])
    stays, itself = jc.design.confirmed(found, at_best)
    assert stays.best.status == "nothing better found" and stays.best.objective == itself == pytest.approx(1.0)
    assert stays.best.values == pytest.approx({n: WELL[n] for n in VARY})


@pytest.mark.wide
def test_scouts_find_the_deeper_valley():
    """One valley holds an eighth of the range and is the deeper; the slope from elsewhere leads away from it."""

    def height(system):
        d = jc.parameters(system)["damping"]
        return (d - 0.7) ** 2 - 0.5 * jnp.exp(-(((d - 0.2) / 0.05) ** 2))

    search = lambda **options: jc.optimise(double_well(), {"damping": (0.1, 1.0)}, jc.design.Smooth(height), **options)
    assert search(steps=200).best.values["damping"] == pytest.approx(0.7, abs=0.02)  # from the design itself, 0.3
    looked = search(starts=4, scouts=32, steps=200)
    assert looked.best.values["damping"] == pytest.approx(0.2, abs=0.02)
    assert looked.distinct[0][1] >= 2


def test_a_bound_that_stops_the_search_is_named():
    found = jc.optimise(double_well(), VARY, bowl(damping=2.0), steps=400, optimiser=optax.adam(0.3)).best
    assert found.at_bound == ("damping",)
    assert found.values["damping"] <= 1.0
    assert "at bound" in str(found)


def test_an_interrupted_search_goes_on_as_if_it_had_not_been(tmp_path):
    path = tmp_path / "search.npz"
    unbroken = jc.optimise(double_well(), VARY, bowl(), starts=2, steps=30)

    class Stop(Exception):
        pass

    def stop(step, measured):
        if step == 11:
            raise Stop

    with pytest.raises(Stop):
        jc.optimise(double_well(), VARY, bowl(), starts=2, steps=30, keep=path, report=stop)
    seen = []
    again = jc.optimise(
        double_well(), VARY, bowl(), starts=2, steps=30, keep=path, report=lambda step, _: seen.append(step)
    )
    assert seen[0] == 11
    assert [o.history for o in again.optima] == [o.history for o in unbroken.optima]
    for other in (bowl(damping=0.5), 2.0 * bowl(), jc.design.Smooth(jax.jit(bowl(cubic=1.0).function))):
        with pytest.raises(ValueError, match="but is of another one"):
            jc.optimise(double_well(), VARY, other, starts=2, steps=30, keep=path)
    path.write_bytes(path.read_bytes()[:100])
    with pytest.raises(ValueError, match="is none"):
        jc.optimise(double_well(), VARY, bowl(), starts=2, steps=30, keep=path)


@pytest.mark.wide
def test_sobol_indices_of_ishigami():
    """Ishigami and Homma's function, a = 7, b = 0.1: first 0.3139, 0.4424, 0, total 0.5576, 0.4424, 0.2437."""
    names = ("damping", "cubic", "stiffness")
    vary = {n: (0.5, 1.5) for n in names}

    def ishigami(system):
        x = [2 * jnp.pi * (jc.parameters(system)[n] - 1.0) for n in names]
        return jnp.sin(x[0]) + 7 * jnp.sin(x[1]) ** 2 + 0.1 * x[2] ** 4 * jnp.sin(x[0])

    got = jc.design.global_sensitivity(double_well(), vary, jc.design.Smooth(ishigami), samples=4096)
    assert list(got.first.values()) == pytest.approx([0.3139, 0.4424, 0.0], abs=0.02)
    assert list(got.total.values()) == pytest.approx([0.5576, 0.4424, 0.2437], abs=0.02)
    assert jc.design.global_sensitivity(double_well(), vary, jc.design.Smooth(ishigami), samples=4096) == got
    for name in names:
        assert got.first_interval[name][0] <= got.first[name] <= got.first_interval[name][1]


def test_tolerance_budget_is_the_root_of_squares():
    elasticity = {"gap": 0.5, "mass": -2.0}
    edge = jc.orbits.Sensitivity("zone 1 exit", "fold", 10000.0, {}, elasticity, {}, 1.0, "converged")
    got = jc.design.tolerance_budget(edge, {"gap": 0.02, "mass": 0.01})
    assert got.deviation == pytest.approx({"gap": 100.0, "mass": 200.0}) and got.unclear == ()
    assert got.total == pytest.approx(np.hypot(100, 200))


@pytest.mark.parametrize(
    "options, words",
    [
        (dict(starts=0), "at least 1"),
        (dict(starts=np.array([[0.5, 1.5]])), "between 0 and 1"),
    ],
)
def test_bad_input_gets_a_sentence(options, words):
    with pytest.raises(ValueError, match=words):
        jc.optimise(double_well(), VARY, bowl(), **options)
