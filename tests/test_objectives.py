"""Objectives: every slope against differences of values or a closed form, loads against time histories."""

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from helpers import double_well

import jaxcage as jc


METHOD = jc.method("rk4", steps=64)
FOLD, DOUBLING = (1.0139, (-0.622, 0.103)), (1.1911, (0.407, 0.326))
"""Speed and state near the two edges."""
VARY = {"damping": (0.15, 0.6), "cubic": (0.5, 2.0)}
SPACE = jc.DesignSpace.of(double_well(), VARY)


def differences(objective, space, place, step=1e-4):
    n = len(place)
    around = np.array([place + sign * step * np.eye(n)[i] for i in range(n) for sign in (1, -1)])
    found = objective.values(space, around)
    return (found[0::2] - found[1::2]) / (2 * step)


@pytest.fixture(scope="module")
def edges():
    points = {
        "zone 1 onset": jc.orbits.Point("fold", FOLD[0], np.array(FOLD[1])),
        "zone 1 exit": jc.orbits.Point("period-doubling", DOUBLING[0], np.array(DOUBLING[1])),
    }
    return jc.design.FollowedEdges(points, METHOD)


def agrees(objective, space, place, rtol=1e-5):
    (got,) = objective.measure(space, place[None])
    assert got.status == "ok"
    assert got.value == pytest.approx(objective.values(space, place[None])[0], rel=1e-12)
    expected = differences(objective, space, place)
    np.testing.assert_allclose(got.slope, expected, rtol=rtol, atol=rtol * np.abs(expected).max())
    assert np.any(np.abs(expected) > 0)
    return got


def test_width_of_a_zone(edges):
    width = jc.design.zone_width(edges)
    agrees(width, SPACE, SPACE.place + 0.01)
    (here,) = width.measure(SPACE, SPACE.place[None])
    exact = [
        jc.sensitivity(double_well(), edges.points[n], method=METHOD).value_rpm for n in ("zone 1 exit", "zone 1 onset")
    ]
    assert here.value == pytest.approx(exact[0] - exact[1], rel=1e-9)


@pytest.mark.parametrize("operating", [(10.0,), (9.9, 11.0)])
def test_distance_from_the_nearest_edge(edges, operating):
    far = jc.design.EdgeClearance(edges, operating, softness=0.05)
    got = agrees(far, SPACE, SPACE.place)
    speeds, _ = edges.at(SPACE, SPACE.place)
    nearest = np.min(np.abs(speeds[:, None] - np.array(operating)))
    assert -nearest <= got.value <= -nearest + 0.05 * np.log(2 * len(operating))


def test_stability_margin():
    """Around the small orbit, stable and unstable: the largest multiplier at each speed and its soft maximum."""
    speeds = np.array([1.10, 1.15, 1.21])
    orbit = jc.periodic_orbit(double_well(), DOUBLING[0], guess=DOUBLING[1], method=METHOD)
    margin = jc.design.StabilityMargin(speeds, np.tile(np.asarray(orbit.state), (3, 1)), method=METHOD)
    got = agrees(margin, SPACE, SPACE.place)
    sizes = []
    for s in speeds:
        exact = jc.periodic_orbit(double_well(), s, guess=orbit, method=METHOD)
        sizes.append(float(np.abs(exact.multipliers[0])))
    assert [m.size for m in margin.multipliers(SPACE, SPACE.place)] == pytest.approx(sizes, rel=1e-9)
    assert min(sizes) < 1 < max(sizes)  # a zone is born within the range
    assert max(sizes) - 1 <= got.value <= max(sizes) - 1 + np.log(3) / 20
    lost = dataclasses.replace(margin, guesses=np.full((3, 2), 50.0))
    (nowhere,) = lost.measure(SPACE, SPACE.place[None])
    assert np.isnan(nowhere.value) and "no orbit near the guess" in nowhere.status


def test_derivatives_of_a_multiplier_against_autodiff():
    """The adjoint through one expansion against JAX's own derivative of the orbit's multipliers."""
    system = double_well()
    at = lambda s: jnp.abs(jc.periodic_orbit(s, 1.15, guess=DOUBLING[1], method=METHOD).multipliers[0])
    slope = jax.grad(at)(system)
    got = jc.orbits.leading_multiplier(system, 1.15, DOUBLING[1], method=METHOD)
    assert got.size == pytest.approx(float(at(system)), rel=1e-10)
    for name, value in got.derivative.items():
        assert value == pytest.approx(float(jc.parameters(slope)[name]), rel=1e-7, abs=1e-9), name


CHAOS = dict(starts=1, discard=60, revolutions=40)
CHAOS_SPACE = jc.DesignSpace.of(double_well(), {"damping": (0.2, 0.45), "cubic": (0.7, 1.4)})


@pytest.mark.wide
def test_a_failed_lane_counts_as_chaotic():
    """Starts beyond what the model holds for fail; a design of which nothing is known is not called calm."""
    model = jc.case("1a")
    space = jc.DesignSpace.of(model, {"guidance_gap": (0.3e-3, 0.6e-3)})
    bad = jc.design.chaotic_width(9000.0, 10000.0, 2, discard=2, revolutions=2, method=jc.method("rk4", steps=2))
    assert np.all(bad.levels(space.models(np.array([[0.5]]))) == 1.0)


def test_robust_mean_and_worst_of_a_parabola():
    """(p - 1)^2 under +-10 % has the mean (p - 1)^2 + p^2 0.1^2/3 and, at the worst, (|p - 1| + 0.1 p)^2."""
    system = double_well()
    space = jc.DesignSpace.of(system, {"cubic": (0.5, 3.0)})
    parabola = jc.design.Smooth(lambda s: (jc.parameters(s)["cubic"] - 1.0) ** 2)
    place = space.place_of({"cubic": 1.5})
    mean = jc.design.Robust(parabola, {"cubic": jc.design.uniform(0.1)}, draws=256)
    got = agrees(mean, space, place)
    assert got.value == pytest.approx(0.25 + 1.5**2 * 0.01 / 3, rel=2e-3)
    worst = agrees(
        jc.design.Robust(parabola, {"cubic": jc.design.uniform(0.1)}, draws=256, worst=1 / 256), space, place
    )
    assert worst.value == pytest.approx((0.5 + 0.15) ** 2, rel=5e-3)


@pytest.mark.parametrize(
    "make, words",
    [
        (lambda: jc.DesignSpace.of(double_well(), {"heat": (0.0, 1.0)}), "must be a parameter"),
        (lambda: jc.DesignSpace.of(double_well(), {"damping": (1.0, 0.5)}), "must ascend"),
        (lambda: jc.design.chaotic_share([(9.0, 12.0, 1.0), (11.0, 14.0, 1.0)]), "do not overlap"),
        (lambda: jc.design.Robust(jc.design.cost(), {}, draws=1), "at least 2"),
        (lambda: jc.design.uniform(3.0), "Argument `half_width` must be at least 0 and below 1, but 3 was given."),
    ],
)
def test_bad_input_gets_a_sentence(make, words):
    with pytest.raises(ValueError, match=words):
        make()


def cage_at_speeds(**options):
    """1b at two speeds, one of them within a chaotic zone, and a design space of its gap and balance."""
    space = jc.DesignSpace.of(jc.case("1b"), {"guidance_gap": (0.3e-3, 0.6e-3), "eccentricity": (5e-6, 60e-6)})
    return space, jc.design.chaotic_width(9000.0, 27500.0, 2, starts=2, **options)


@pytest.mark.wide
def test_loads_of_the_land_are_those_of_a_time_history():
    space, width = cage_at_speeds(discard=60, revolutions=20, method=jc.method("rk4", steps=1024))
    fine = jc.method("rk4", steps=2048)
    places = np.array([[1.0, 0.33], [0.0, 0.98]])
    # Where motion is chaotic two integrations part: they are compared over two revolutions.
    models = space.models(places)
    wear, peak, film = (jc.design.LandLoad(width.runs, name, over=2) for name in jc.design.LAND_LOADS)
    least = jc.design.LandLoad(width.runs, "least film", over=2)
    got = [load.at_speeds(models) for load in (wear, peak, film, least)]
    last = width.runs.run(models)["last"].values
    touched = 0
    for k, model in enumerate(models):
        for i, speed in enumerate(width.runs.speed):
            length = dict(revolutions=2, samples=1024, method=fine)
            runs = [jc.simulate(model, speed, start=tuple(y), **length) for y in last[k, i]]
            seen = [jc.analysis.measures(model, run) for run in runs]
            every = lambda name: [found[name].value for found in seen]
            load = np.mean(every("mean_contact_force")) * speed * float(model.land_radius)
            assert got[0][k, i] == pytest.approx(load, rel=0.02, abs=1e-6)
            assert got[1][k, i] == pytest.approx(np.mean(every("peak_contact_force")), rel=0.06, abs=1e-6)
            assert got[2][k, i] == pytest.approx(np.mean(every("drag_power")), rel=0.02)
            thinnest = np.min(every("minimum_film_thickness"))
            assert got[3][k, i] == pytest.approx(thinnest, abs=0.01 * float(model.clearance))
            touched += load > 1.0
    assert touched >= 2
    own, now = wear.estimate([space.system]), jc.design.relative(wear, space.system, 1000.0)
    assert own[0] > 100.0 and own[1] > 0.0 and now.values(space, space.place[None]) == pytest.approx([1000.0])
    with pytest.raises(ValueError, match="`name` must be one of wear load, .* but 'least film' was given"):
        jc.design.relative(least, space.system, 1000.0)
