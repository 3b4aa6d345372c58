"""The film of finite width: limits in closed form, conservation, symmetry, convergence, derivatives.

Printed tables: `jaxcage/validation/_film.py`, by `test_validation.py`.
"""

import equinox as eqx
import helpers
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from helpers import raw_sweep

import jaxcage as jc
from jaxcage.forces import (
    axial_profiles,
    film_drive,
    film_pressure_field,
    finite_film_force,
    pressure_force,
    short_film_excess,
    short_film_force,
    solve_ring,
)
from jaxcage.io import load_model


@pytest.mark.wide
@pytest.mark.parametrize("stations, k", [(8, 1), (5, 1), (12, 3), (9, 2)])
def test_ring_solver_against_a_dense_one(stations: int, k: int):
    rng = np.random.default_rng(stations)
    lower, middle, upper = (rng.normal(size=(stations, k, k)) for _ in range(3))
    middle += 5 * np.eye(k)
    right = rng.normal(size=(stations, k, 2))
    dense = np.zeros((stations, k, stations, k))
    for i in range(stations):
        dense[i, :, i - 1] += lower[i]
        dense[i, :, i] += middle[i]
        dense[i, :, (i + 1) % stations] += upper[i]
    expected = np.linalg.solve(dense.reshape(stations * k, -1), right.reshape(stations * k, 2))
    found = solve_ring(*map(jnp.asarray, (lower, middle, upper, right)))
    np.testing.assert_allclose(found.reshape(stations * k, 2), expected, rtol=1e-12, atol=1e-13)


def force(r, v, slenderness, omega=1.0, **grid):
    px, py = film_drive(r[0], r[1], v[0], v[1], omega)
    return jnp.stack(pressure_force(film_pressure_field(r[0], r[1], px, py, slenderness, **grid)))


_FORCE = jax.jit(force, static_argnames=("cavitation", "stations", "profiles"))
STILL = jnp.zeros(2)


def FORCE(r, v, slenderness, omega=1.0, **grid):
    """One program for a grid, whatever the speed."""
    return _FORCE(r, v, slenderness, omega, **grid)


@pytest.mark.parametrize("slenderness", [0.05, 0.5, 1.0, 4.0])
def test_concentric_film_of_any_length_in_closed_form(slenderness: float):
    """At the centre H = 1 and p is P.n times a function of eta: F/F_short = 3 (1 - tanh(lambda)/lambda)/lambda^2."""
    v = jnp.asarray([0.3, -0.2])
    found = FORCE(STILL, v, slenderness, cavitation="full", stations=96, profiles=5)
    ratio = 3 * (1 - np.tanh(slenderness) / slenderness) / slenderness**2
    # One wave around: central differences see it flatter by a cell squared over 12, at most.
    np.testing.assert_allclose(found, -np.pi * v * ratio, rtol=(2 * np.pi / 96) ** 2 / 12)


def sommerfeld(eps: float, half: bool) -> np.ndarray:
    """Force on the long bearing, (outward radial, tangential) in units of mu omega R L (R/c)^2: Sommerfeld 1904, and
    with the negative pressure left out, Guembel."""
    tangential = 12 * np.pi * eps / ((2 + eps**2) * np.sqrt(1 - eps**2))
    if not half:
        return np.array([0.0, tangential])
    return np.array([-12 * eps**2 / ((2 + eps**2) * (1 - eps**2)), tangential / 2])


@pytest.mark.wide
@pytest.mark.parametrize("cavitation", ["full", "guembel"])
@pytest.mark.parametrize("eps", [0.3, 0.7])
def test_long_limit_in_closed_form(cavitation: str, eps: float):
    """The ends take off a share of the order of 1/lambda."""
    r = jnp.asarray([eps, 0.0])
    at = lambda lam: 4 * lam**2 * FORCE(r, STILL, lam, cavitation=cavitation, stations=96, profiles=8)
    expected = sommerfeld(eps, cavitation == "guembel")
    size = np.linalg.norm(expected)
    errors = [np.linalg.norm(at(lam) - expected) / size for lam in (10.0, 20.0)]
    assert errors[0] / errors[1] == pytest.approx(2, rel=0.05) and errors[1] < 0.08
    np.testing.assert_allclose(2 * at(20.0) - at(10.0), expected, rtol=0, atol=0.005 * size)


@pytest.mark.wide
def test_squeeze_of_a_long_film_in_closed_form():
    """Full film, no rotation: -12 pi eps'/(1 - eps^2)^(3/2) in units of mu R L (R/c)^2."""
    r, v = jnp.asarray([0.5, 0.0]), jnp.asarray([0.1, 0.0])
    at = lambda lam: 4 * lam**2 * FORCE(r, v, lam, 0.0, cavitation="full", stations=96, profiles=8)
    np.testing.assert_allclose(2 * at(20.0) - at(10.0), [-1.2 * np.pi / 0.75**1.5, 0.0], atol=0.01)


@pytest.mark.parametrize(
    "cavitation, short", [("full", "full"), ("reynolds", "positive_pressure"), ("guembel", "positive_pressure")]
)
def test_short_limit(cavitation: str, short: str):
    r, v = jnp.asarray([0.55, -0.2]), jnp.asarray([0.12, 0.05])
    expected = np.array(short_film_force(short, *r, *v, 1.0))
    found = FORCE(r, v, 1e-5, cavitation=cavitation, stations=1024, profiles=1)
    np.testing.assert_allclose(found, expected, rtol=0, atol=3e-5 * np.linalg.norm(expected))


@pytest.mark.wide
def test_short_film_is_off_by_the_square_of_the_slenderness():
    excess = jax.jit(lambda lam: short_film_excess(0.6, lam, stations=1024, profiles=1))
    found = [float(excess(lam)) for lam in (0.01, 0.02, 0.04)]
    assert found[1] / found[0] == pytest.approx(4, rel=0.04) and found[2] / found[1] == pytest.approx(4, rel=0.04)
    full = lambda lam: FORCE(jnp.asarray([0.6, 0.0]), STILL, lam, cavitation="full", stations=64, profiles=2)[1]
    whole = [0.6 * np.pi / 2 / 0.64**1.5 / float(full(lam)) - 1 for lam in (0.01, 0.02, 0.04)]
    assert whole[1] / whole[0] == pytest.approx(4, rel=0.01) and whole[2] / whole[1] == pytest.approx(4, rel=0.01)


@pytest.mark.wide
def test_error_of_the_short_film_at_the_lands_of_the_published_bearing():
    """The table in the docstring of `short_film_excess`, at radius 46 mm."""
    excess = jax.jit(jax.vmap(lambda e, lam: 100 * short_film_excess(e, lam, stations=1024, profiles=1)))
    eps, lam = jnp.asarray([0.4, 0.8, 0.95] * 2), jnp.asarray([1.45] * 3 + [6.5] * 3) / 92.0
    np.testing.assert_allclose(excess(eps, lam), [0.0182, 0.083, 0.380, 0.362, 1.64, 7.30], rtol=0.02)


def strip_balance(profiles: int) -> float:
    """What flows out of both ends of an arc between two of its faces, over what the arc's two faces and the moving wall
    bring in: 1 where mass is conserved."""
    r, v, lam = jnp.asarray([0.5, 0.0]), jnp.asarray([0.05, 0.02]), 0.4
    px, py = film_drive(*r, *v, 1.0)
    n = 64
    field = PRESSURE(*r, px, py, lam, cavitation="full", stations=n, profiles=profiles)
    at, axial = field.stations, axial_profiles(profiles)
    first, last = 38, 55  # cells of the arc, in which the source and all fluxes are of one size
    h = 2 * np.pi / n
    gamma = (np.arange(n) + 0.5) * h
    thick = 0.75 / (1 + 0.5 * np.cos(gamma))
    stretch = thick / np.sqrt(0.75)
    mean = np.asarray(field.pressure) @ axial.integral
    flux = -(lam**2) * thick**3 / stretch * (np.roll(mean, -1) - mean) / h  # towards larger angles, through face i
    slope = np.asarray(field.pressure) @ axial.end_slope
    out = -np.sum((np.asarray(at.thickness) ** 3 * slope * np.asarray(at.stretch))[first : last + 1]) * h
    source = np.asarray(6 * at.stretch * (px * at.nx + py * at.ny))[first : last + 1].sum() * h
    return float(out / (source + flux[first - 1] - flux[last]))


@pytest.mark.wide
def test_mass_is_conserved():
    """Galerkin's equations do not say so of a piece of film by themselves: with more functions it must come out."""
    errors = [abs(strip_balance(k) - 1) for k in (1, 2)]
    assert errors[0] < 0.05 and errors[1] < 2e-4


ROUNDING = 1e-10
"""Of the largest pressure: 2048 unknowns in a row have a condition of some 1e6."""
PRESSURE = jax.jit(film_pressure_field, static_argnames=("cavitation", "stations", "profiles"))


@pytest.mark.wide
@pytest.mark.parametrize("slenderness", [0.05, 0.5])
def test_film_breaks_off_without_a_slope(slenderness: float):
    """Swift and Stieber's condition, unlike Guembel's: the pressure in the last wet cell falls with its square."""
    r, v = jnp.asarray([0.7, 0.1]), jnp.asarray([0.1, -0.05])
    drive = film_drive(*r, *v, 1.0)

    def slope_at_the_edge(cavitation: str, stations: int) -> float:
        p = np.asarray(PRESSURE(*r, *drive, slenderness, cavitation=cavitation, stations=stations).pressure)[:, 0]
        wet = p > ROUNDING * p.max()
        assert p.min() > -ROUNDING * p.max() and 0.2 < np.mean(wet) < 0.8
        ends = [i for i in range(stations) if wet[i] and not wet[(i + 1) % stations]]
        assert len(ends) == 1
        return float(p[ends[0]] / p.max() * stations)

    # Where in its cell the edge lies is chance: the larger of two grids each.
    steepest = lambda cavitation, grids: max(slope_at_the_edge(cavitation, n) for n in grids)
    coarse, fine, cut = (
        steepest(*c) for c in (("reynolds", (64, 128)), ("reynolds", (1024, 2048)), ("guembel", (1024, 2048)))
    )
    assert fine < 0.2 * coarse and fine < 0.2 * cut


@pytest.mark.wide
@pytest.mark.parametrize("slenderness", [0.05, 0.5])
def test_film_is_what_it_is_by_relaxation(slenderness: float):
    """The same problem by projected Gauss-Seidel on a plain grid in NumPy: uniform in theta and z, p >= 0."""
    eps, n, m = 0.5, 96, 8
    theta = 2 * np.pi * np.arange(n) / n
    h = lambda angle: 1 - eps * np.cos(angle)
    step, width = 2 * np.pi / n, 1 / m  # eta from 0, where the film is symmetric, to 1
    around = slenderness**2 * h(theta + step / 2) ** 3 / step**2
    across = h(theta) ** 3 / width**2
    source = -6 * eps * -np.sin(theta)  # -6 P.n with P = -omega (-y, x) = (0, -eps)
    p = np.zeros((n, m + 1))
    total = around + np.roll(around, 1) + 2 * across
    for _ in range(4000):
        before = p.copy()
        for i in range(n):
            beside = around[i] * p[(i + 1) % n] + around[i - 1] * p[i - 1]
            for j in range(m):
                inner = p[i, 1] if j == 0 else p[i, j - 1]
                p[i, j] = max((beside[j] + across[i] * (inner + p[i, j + 1]) - source[i]) / total[i], 0.0)
        if np.abs(p - before).max() < 1e-9 * p.max():
            break
    mean = (p[:, 0] / 2 + p[:, 1:].sum(axis=1)) / m / (1 - 1 / (4 * m**2))  # exact for a parabola
    by_hand = -step / 4 * np.array([np.sum(mean * np.cos(theta)), np.sum(mean * np.sin(theta))])
    found = FORCE(jnp.asarray([eps, 0.0]), STILL, slenderness, stations=192, profiles=2)
    np.testing.assert_allclose(found, by_hand, rtol=0, atol=4e-3 * np.linalg.norm(by_hand))


@pytest.mark.wide
def test_convergence_is_of_second_order_around_and_faster_across():
    r, v = jnp.asarray([0.7, 0.0]), jnp.asarray([0.1, -0.05])
    around = [FORCE(r, v, 0.5, cavitation="full", stations=n, profiles=1) for n in (32, 64, 128, 256)]
    steps = [np.linalg.norm(b - a) for a, b in zip(around, around[1:], strict=False)]
    assert np.log2(steps[0] / steps[1]) == pytest.approx(2, abs=0.1)
    assert np.log2(steps[1] / steps[2]) == pytest.approx(2, abs=0.05)
    r = jnp.asarray([0.95, 0.0])
    across = [FORCE(r, v, 0.5, cavitation="full", stations=12, profiles=k) for k in (1, 2, 3, 4)]
    errors = [np.linalg.norm(f - across[3]) / np.linalg.norm(across[3]) for f in across[:3]]
    assert errors[0] < 0.03 and errors[1] < 0.1 * errors[0] and errors[2] < 0.2 * errors[1]


@pytest.mark.wide
@pytest.mark.parametrize("slenderness, bound", [(0.0158, 1e-3), (0.0467, 3e-3), (0.2, 4e-3)])
def test_grid_of_the_force_law_is_fine_enough(slenderness: float, bound: float):
    """Its 64 stations with one function against 512 with three, in random states up to the onset of contact."""
    rng = np.random.default_rng(9)
    law = jax.jit(finite_film_force, static_argnames=("stations", "profiles"))
    for _ in range(6):
        eps, phi, v = rng.uniform(0.05, 0.95), rng.uniform(-np.pi, np.pi), rng.normal(scale=0.2, size=2)
        x, y = eps * np.cos(phi), eps * np.sin(phi)
        drive = film_drive(x, y, *v, 1.0)
        fine = np.array(law(x, y, *drive, 1.0, slenderness, stations=512, profiles=3))
        found = np.array(law(x, y, *drive, 1.0, slenderness))
        assert np.linalg.norm(found - fine) < bound * np.linalg.norm(fine)


@pytest.mark.wide
def test_the_edge_of_the_film_is_found_for_lands_of_all_widths():
    """Where it is not, the force is NaN: places, squeezes, and widths from a tenth of the diameter to all of it."""
    rng = np.random.default_rng(4)
    eps, angle, width = rng.uniform(0.05, 0.97, 48), rng.uniform(0, 2 * np.pi, 48), rng.uniform(0.1, 1.0, 48)
    r, v = eps * np.array([np.cos(angle), np.sin(angle)]), 0.3 * rng.normal(size=(2, 48))
    drive = lambda x, y, vx, vy: film_drive(x, y, vx, vy, 1.0)
    one = lambda *state: finite_film_force(*state[:2], *drive(*state[:4]), 1.0, state[4])
    found = jax.vmap(one)(*r, *v, width)
    assert np.all(np.isfinite(found)) and np.all(np.hypot(*found) > 0)


@pytest.mark.wide
def test_one_function_across_a_narrow_land_is_enough():
    drive = film_drive(0.6, 0.0, 0.1, 0.05, 1.0)
    law = jax.jit(finite_film_force, static_argnames=("stations", "profiles"))
    one, two = (np.array(law(0.6, 0.0, *drive, 1.0, 0.03, stations=32, profiles=k)) for k in (1, 2))
    np.testing.assert_allclose(one, two, rtol=1e-6)


def test_mirror_and_turn_of_the_state_turn_the_force():
    r, v = jnp.asarray([0.5, -0.3]), jnp.asarray([0.2, 0.1])
    f = FORCE(r, v, 0.1, profiles=1, stations=64)
    flip = jnp.asarray([1.0, -1.0])
    mirrored = FORCE(r * flip, v * flip, 0.1, -1.0, profiles=1, stations=64)
    np.testing.assert_allclose(mirrored, f * flip, rtol=1e-10)
    angle = 2 * np.pi * 5 / 64  # stations come to lie on stations
    turn = jnp.asarray([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    np.testing.assert_allclose(FORCE(turn @ r, turn @ v, 0.1, profiles=1, stations=64), turn @ f, rtol=1e-10)


@pytest.mark.parametrize(
    "profiles, stations", [pytest.param(1, 64, marks=pytest.mark.slow), pytest.param(2, 12, marks=pytest.mark.wide)]
)
def test_derivatives_through_the_solve_match_differences(profiles: int, stations: int):
    """By position, velocity and slenderness: forward mode, and reverse mode on the grid of the force law."""

    def law(z):
        px, py = film_drive(*z[:4], 1.0)
        return jnp.stack(finite_film_force(z[0], z[1], px, py, 1.0, z[4], stations=stations, profiles=profiles))

    z = jnp.asarray([0.52, -0.31, 0.13, 0.07, 0.3])
    forward = np.asarray(jax.jit(jax.jacfwd(law))(z))
    if profiles == 1:  # reverse mode takes long to compile with blocks
        np.testing.assert_allclose(jax.jit(jax.jacrev(law))(z), forward, rtol=1e-9, atol=1e-12)
    steps = 1e-6 * np.eye(5)
    value = jax.jit(law)
    central = np.stack([(value(z + s) - value(z - s)) / 2e-6 for s in steps], axis=1)
    np.testing.assert_allclose(forward, central, rtol=1e-7, atol=1e-8 * np.abs(central).max())


def test_film_without_drive_and_at_the_centre():
    """Half-speed whirl without squeeze: no pressure. At the centre the force is that of the closed form above."""
    r = jnp.asarray([0.3, 0.1])
    v = jnp.asarray([-r[1], r[0]]) / 2
    np.testing.assert_allclose(FORCE(r, v, 0.05, stations=64, profiles=1), 0.0, atol=1e-14)
    centred = lambda r: force(r, jnp.asarray([0.3, -0.2]), 0.05, cavitation="full")
    slope = np.asarray(jax.jit(jax.jacfwd(centred))(STILL))
    # -P.n/2 M with P = 2 v - omega J r: the isotropic film turns the displacement by a quarter.
    np.testing.assert_allclose(slope, -np.pi / 2 * np.array([[0.0, 1.0], [-1.0, 0.0]]), atol=0.01)


def finite(**values) -> jc.CageModel:
    return jc.replace(jc.case("1a"), **{"film.model": "finite_length", **values})


POINT = (1.3e-4, -2.2e-4, 0.06, 0.11)


@eqx.filter_jit
def film_force(model: jc.CageModel, speed, point):
    return jnp.stack(model.cage_at(speed).forces(0.0, *point)["film"][:2])


def test_cage_uses_the_film_of_each_land():
    """Two lands of 4.3 mm: positive pressure less 0.15 to 0.5 %; with lands of 0.2 mm, the same to 1e-5."""
    speed, point = jnp.asarray(1500.0), tuple(map(jnp.asarray, POINT))
    ratios = []
    for width in (2e-4, 4.3e-3):
        laws = [
            jc.replace(finite(land_width=width), **{"film.model": m}) for m in ("finite_length", "positive_pressure")
        ]
        films = [np.array(film_force(law, speed, point)) for law in laws]
        ratios.append(np.linalg.norm(films[1]) / np.linalg.norm(films[0]) - 1)
    assert abs(ratios[0]) < 1e-5 and 0.0015 < ratios[1] < 0.005


@pytest.mark.wide
def test_slopes_of_the_cage_are_its_derivatives():
    law = finite().at_speed(jnp.asarray(1500.0)).acceleration
    q, v = (tuple(map(jnp.asarray, part)) for part in (POINT[:2], POINT[2:]))
    along = np.array([3e-5, -2e-5, 0.04, 0.07])

    @jax.jit
    def both(q, v):
        push = tuple(map(jnp.asarray, along[:2])), tuple(map(jnp.asarray, along[2:]))
        return law.slopes(q, v), jax.jvp(lambda q, v: law(0.3, q, v), (q, v), push)[1]

    (of_q, of_v), expected = both(q, v)
    found = np.array(of_q) @ along[:2] + np.array(of_v) @ along[2:]
    np.testing.assert_allclose(found, expected, rtol=1e-10)
    h = 1e-6
    moved = lambda s: law(0.3, tuple(q + s * along[:2]), tuple(v + s * along[2:]))
    q, v = np.array(POINT[:2]), np.array(POINT[2:])
    ahead, behind = (np.array(jax.jit(moved)(s)) for s in (h, -h))
    np.testing.assert_allclose((ahead - behind) / (2 * h), expected, rtol=1e-6)


@pytest.mark.parametrize("base, power", [("mass", 1), ("length", 1), ("time", -2)])
def test_film_of_the_cage_has_the_dimension_of_a_force(base: str, power: int):
    model, factor = finite(), 1.7
    units = {"mass": (1, 1), "length": (factor, factor), "time": (1, 1 / factor)}[base]
    point = [p * u for p, u in zip(POINT, (units[0], units[0], units[1], units[1]), strict=True)]
    rate = 1 / factor if base == "time" else 1.0
    here = film_force(model, jnp.asarray(1500.0), tuple(map(jnp.asarray, POINT)))
    other = helpers.in_other_units(model, base, factor)
    there = film_force(other, jnp.asarray(1500.0 * rate), tuple(map(jnp.asarray, point)))
    np.testing.assert_allclose(np.array(there), np.array(here) * factor**power, rtol=1e-9)


@pytest.mark.wide
def test_simulation_and_sweep_of_narrow_lands_are_those_of_the_short_film(tmp_path):
    """Through TOML: with lands of 0.5 mm both films give the same motion; a sweep goes where the simulation goes."""
    text = 'base = "1a"\n[film]\nland_width = "0.5 mm"\nmodel = "{}"\n'
    method, states, model = jc.method("rk4", 256), [], None
    for name in ("positive_pressure", "finite_length"):
        path = tmp_path / f"{name}.toml"
        path.write_text(text.format(name))
        model = load_model(path)
        assert model.film.model == name
        run = jc.simulate(model, jc.rpm(9000.0), revolutions=3, samples=1, method=method)
        assert run.outcome == "successful"
        states.append(run.state)
    scale = np.array([float(c) for c in model.scale(jnp.asarray(900.0))])
    np.testing.assert_allclose(states[0] / scale, states[1] / scale, atol=1e-5)
    speeds = jc.rpm(8000, 9000, 2)
    found = raw_sweep(model, speeds, discard=0, revolutions=2, blocks=1, exponents=1, keep=1, method=method)
    assert np.all(found.outcome == 0)
    np.testing.assert_allclose(found.last[1, 0] / scale, states[1][2] / scale, atol=1e-9)
    assert np.ptp(found.exponents) > 0.01
