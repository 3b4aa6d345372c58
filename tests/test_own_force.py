"""A force of one's own: a class of five lines, and everything that the package does with a cage follows.

A viscous drag has the same physics as the damping of the support: every result must be that of a cage with as much more
damping there. A quadratic drag is compared with the equations of motion written down a second time and integrated by
SciPy.
"""

import dataclasses
from pathlib import Path

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
import reference
from helpers import beyond_range, elastic, raw_sweep, roller_pass
from scipy.integrate import solve_ivp

import jaxcage as jc
from jaxcage.forces import AbstractForce, AbstractForcing, parameter
from jaxcage.io import ConfigError, configuration, save_model, to_dataset
from jaxcage.orbits import Point, edge_speed
from jaxcage.plotting import force_history


class ViscousDrag(AbstractForce):
    """Oil around the cage, against every motion of its centre and against its rotation."""

    coefficient: float = parameter("N s/m", 0.0, 1e3, "drag of the cage's centre")
    arm: float = parameter("m", 0.0, 1.0, "arm of the torque on a cage that turns")

    def force(self, motion):
        torque = -self.coefficient * self.arm**2 * motion.cage_speed
        return -self.coefficient * motion.vx, -self.coefficient * motion.vy, torque


class QuadraticDrag(AbstractForce):
    coefficient: float

    def force(self, motion):
        c = self.coefficient * jnp.sqrt(motion.vx**2 + motion.vy**2 + 1e-12)
        return -c * motion.vx, -c * motion.vy, 0.0


class Shaker(AbstractForcing):
    """A horizontal force so many times a turn."""

    amplitude: float
    times: int = eqx.field(static=True, default=1)

    @property
    def harmonics(self):
        return self.times

    def force(self, motion):
        return self.amplitude * jnp.cos(self.times * motion.phase), 0.0, 0.0


CASE = jc.case("1a", "preliminary")
SHARE = 1.5
"""Damping [N s/m] that the drag takes over from the support."""
OWN = jc.replace(CASE, damping=CASE.support.damping - SHARE, extra=(ViscousDrag(SHARE, arm=0.05),))
SPEED = jc.rpm(11200.0)
NEAR = (1.37021e-05, -5.62481e-05, 0.513971, 0.0203827)
"""A state of the stable orbit there."""
METHOD = jc.method("rk4", steps=128)


def with_extra(*laws: AbstractForce) -> jc.CageModel:
    return jc.replace(CASE, extra=laws)


# --- motion ----------------------------------------------------------------------------------


@pytest.mark.wide
@pytest.mark.parametrize("solver", ["rk4", "rodas4"])
@pytest.mark.parametrize("rib", ["rigid", "elastic"])
def test_a_drag_moves_the_cage_like_the_damping_of_its_support(solver: str, rib: str):
    """Rodas4 asks the law for its derivatives; an elastic rib feels the reaction."""
    models = [elastic(model) if rib == "elastic" else model for model in (OWN, CASE)]
    runs = [jc.simulate(m, SPEED, revolutions=3, samples=8, method=jc.method(solver, steps=512)) for m in models]
    scale = np.array([float(c) for c in CASE.scale(SPEED)]).repeat(1 if rib == "rigid" else 2)
    assert np.max(np.abs(runs[0].state - runs[1].state) / scale) < 1e-10


def test_a_drag_that_nobody_has_moves_the_cage_as_scipy_says():
    coefficient = 8.0
    field, mass = reference.field(CASE, SPEED), float(CASE.cage_mass)

    def rates(tau, y):
        dx, dy, dvx, dvy = field(tau, y)
        c = coefficient * np.hypot(y[2], y[3]) / (mass * SPEED)
        return [dx, dy, dvx - c * y[2], dvy - c * y[3]]

    start = (1e-4, -5e-5, 0.1, 0.02)
    model = with_extra(QuadraticDrag(coefficient))
    run = jc.simulate(model, SPEED, revolutions=2, samples=8, start=start, method=jc.method("rk4", steps=1024))
    exact = solve_ivp(rates, (0, run.tau[-1]), start, method="DOP853", rtol=1e-11, atol=1e-15)
    free = solve_ivp(field, (0, run.tau[-1]), start, method="DOP853", rtol=1e-11, atol=1e-15)
    scale = np.array([float(c) for c in CASE.scale(SPEED)])
    assert np.max(np.abs(run.state[-1] - exact.y[:, -1]) / scale) < 1e-7
    assert np.max(np.abs(free.y[:, -1] - exact.y[:, -1]) / scale) > 1e-3


@pytest.mark.wide
def test_a_sweep_with_a_drag_is_that_with_the_damping():
    speeds = jc.rpm(11200, 12000, 2)
    swept = [raw_sweep(m, speeds, discard=2, revolutions=4, blocks=2, method=METHOD) for m in (OWN, CASE)]
    np.testing.assert_allclose(*(s.exponents for s in swept), atol=1e-9)
    np.testing.assert_allclose(*(s.last / s.scale[:, None] for s in swept), atol=1e-9)
    assert np.min(np.abs(swept[0].exponents)) > 0


def test_a_force_of_many_harmonics_keeps_the_steps_short():
    assert with_extra(Shaker(1.0, times=40)).harmonics == 40
    assert with_extra(ViscousDrag(1.0, arm=0.0)).harmonics == 1
    rollers = roller_pass(CASE)
    assert jc.replace(rollers, extra=(Shaker(1.0, times=3),)).harmonics == rollers.harmonics > 40


# --- orbits ----------------------------------------------------------------------------------


@pytest.mark.wide
def test_an_orbit_moves_with_a_drag_as_differences_say():
    method = jc.method("rk4", steps=512)
    orbit = jc.periodic_orbit(OWN, SPEED, guess=NEAR, method=method)
    assert orbit.converged

    def state(coefficient):
        model = jc.replace(OWN, **{"extra.ViscousDrag.coefficient": coefficient})
        return jc.periodic_orbit(model, SPEED, guess=orbit, method=method).state

    slope = jax.jacfwd(state)(SHARE)  # a Python number, as a user writes it
    np.testing.assert_allclose(jax.grad(lambda c: state(c)[0])(SHARE), slope[0], rtol=1e-9)
    differences = (state(SHARE + 3e-4) - state(SHARE - 3e-4)) / 6e-4
    np.testing.assert_allclose(slope, differences, atol=1e-6 * float(jnp.max(jnp.abs(slope))))


TORUS = Point("Neimark-Sacker", float(jc.rpm(11023.07)), np.array([1.33877e-5, -5.11828e-5, 0.520974, 0.0221109]))
"""An edge of case 1a, as `test_edges_of_the_cage` has it."""


@pytest.fixture(scope="module")
def torus() -> jc.orbits.Sensitivity:
    return jc.sensitivity(OWN, TORUS, method=METHOD)


@pytest.mark.wide
def test_an_edge_moves_with_a_drag_as_with_the_damping(torus: jc.orbits.Sensitivity):
    """And as differences say; the arm of the torque moves nothing, at a speed that is given."""
    slope = torus.derivative["extra.ViscousDrag.coefficient"]
    assert torus.trusted and slope == pytest.approx(torus.derivative["damping"], rel=1e-9)
    at = lambda value: edge_speed(jc.replace(OWN, **{"extra.ViscousDrag.coefficient": value}), TORUS, METHOD)
    assert slope == pytest.approx((at(SHARE + 1e-3) - at(SHARE - 1e-3)) / 2e-3 * 30 / np.pi, rel=1e-5)
    assert torus.elasticity["extra.ViscousDrag.coefficient"] == pytest.approx(slope * SHARE / torus.value_rpm)
    assert torus.derivative["extra.ViscousDrag.arm"] == 0.0


@pytest.mark.wide
def test_units_of_a_force_of_ones_own_enter_the_identities(torus: jc.orbits.Sensitivity):
    assert max(abs(r) for r in torus.homogeneity.values()) < 1e-8
    plain = jc.replace(CASE, extra=(QuadraticDrag(0.5),))
    unknown = jc.sensitivity(plain, TORUS, method=METHOD)
    assert unknown.trusted and np.isfinite(unknown.derivative["extra.QuadraticDrag.coefficient"])
    assert all(np.isnan(r) for r in unknown.homogeneity.values())  # its unit is not known


# --- parameters ------------------------------------------------------------------------------


def test_parameters_of_a_force_of_ones_own_have_names():
    """And the others keep theirs."""
    model = with_extra(ViscousDrag(3, arm=0.05), Shaker(2.0))
    own = {"extra.ViscousDrag.coefficient": 3.0, "extra.ViscousDrag.arm": 0.05, "extra.Shaker.amplitude": 2.0}
    expected = jc.parameters(CASE) | own
    assert {n: float(v) for n, v in jc.parameters(model).items()} == {n: float(v) for n, v in expected.items()}
    declared, plain = (jc.parameter_info(model)[f"extra.{n}"] for n in ("ViscousDrag.coefficient", "Shaker.amplitude"))
    assert (declared.unit, declared.upper) == ("N s/m", 1e3)
    assert (plain.unit, plain.upper) == ("?", np.inf)
    changed = jc.replace(model, **{"extra.Shaker.amplitude": 5.0, "guidance_gap": 5e-4})
    assert float(changed.extra[1].amplitude) == 5.0 and float(changed.guidance_gap) == 5e-4
    with pytest.raises(ValueError, match=r"`extra.Shaker.times` must name a part .*extra.Shaker.amplitude"):
        jc.replace(model, **{"extra.Shaker.times": 2})


def test_a_design_space_holds_a_force_of_ones_own():
    value = jc.design.Smooth(lambda m: (m.extra[0].coefficient - 2.0) ** 2)
    found = jc.optimise(OWN, {"extra.ViscousDrag.coefficient": (0.5, 5.0)}, value, starts=1).best
    assert float(found.values["extra.ViscousDrag.coefficient"]) == pytest.approx(2.0, abs=5e-3)


def test_a_unit_that_is_none_is_refused_where_it_is_declared():
    with pytest.raises(ValueError, match="`unit` must be made of .* but 'lbf' was given"):
        parameter("lbf", 0.0, 1.0, "a force")


# --- what acts, and what is measured ---------------------------------------------------------


@pytest.mark.wide
def test_forces_and_moments_of_a_run_name_it(tmp_path: Path):
    run = jc.simulate(OWN, SPEED, revolutions=1, samples=16, method=METHOD)
    forces, moments = jc.analysis.cage_forces(OWN, run), jc.analysis.cage_moments(OWN, run)
    assert list(forces) == list(moments) == [*jc.models.FORCES, "ViscousDrag"]
    np.testing.assert_allclose(forces["ViscousDrag"], -SHARE * run.state[:, 2:], rtol=1e-12)
    np.testing.assert_allclose(moments["ViscousDrag"], -SHARE * 0.05**2 * SPEED, rtol=1e-12)
    eps = np.hypot(*run.state[:, :2].T) / float(OWN.clearance)
    power = jc.analysis.film_drag_power(OWN, run.speed, eps)
    np.testing.assert_allclose(-moments["film"] * SPEED, power, rtol=1e-6)
    assert not np.any(moments["contact"])
    # Pressed into the land the film is no thinner than at the onset of contact.
    outside = np.full(eps.size, 1.02)
    place = run.state[:, :2] * (outside / eps)[:, None]
    pressed = dataclasses.replace(run, state=np.concatenate([place, run.state[:, 2:]], axis=1))
    power = jc.analysis.film_drag_power(OWN, run.speed, outside)
    np.testing.assert_allclose(-jc.analysis.cage_moments(OWN, pressed)["film"] * SPEED, power, rtol=1e-6)


@pytest.mark.wide
def test_a_figure_draws_each_force_of_ones_own_in_a_line_of_its_own():
    model = with_extra(ViscousDrag(1.0, arm=0.0), Shaker(1.0))
    run = jc.simulate(model, SPEED, revolutions=1, samples=16, method=METHOD)
    lines = force_history(run, jc.analysis.cage_forces(model, run)).get_lines()
    assert [line.get_label() for line in lines] == [*jc.models.FORCES, "ViscousDrag", "Shaker"]
    assert len({line.get_color() for line in lines}) == len(lines)
    assert [line.get_linestyle() for line in lines] == ["-"] * len(jc.models.FORCES) + ["--"] * 2


@pytest.mark.wide
def test_equilibrium_knows_a_force_of_ones_own():
    """A force that turns with the cage is left out like the unbalance; one that hides the phase is refused."""

    class Push(AbstractForce):
        newtons: float

        def force(self, motion):
            return self.newtons, 0.0, 0.0

    class Hidden(AbstractForce):
        newtons: float

        def force(self, motion):
            return self.newtons * jnp.cos(motion.phase), 0.0, 0.0

    soft = beyond_range(jc.replace(CASE, cross_stiffness=0.0, cubic_stiffness=0.0), land_width=1e-7)
    at = jc.equilibrium(jc.replace(soft, extra=(Push(0.4), Shaker(3.0))), SPEED)
    assert float(at.coordinates[0]) == pytest.approx(0.4 / float(soft.support.stiffness_x), rel=1e-6)
    with pytest.raises(RuntimeError, match="force in its `extra` changes with the phase"):
        jc.equilibrium(jc.replace(soft, extra=(Hidden(0.4),)), SPEED)


# --- what is refused -------------------------------------------------------------------------


@pytest.mark.wide
def test_no_file_holds_a_force_of_ones_own(tmp_path: Path):
    refused = r"Argument `model` must have no forces of your own to be put into a file, but has ViscousDrag\."
    swept = raw_sweep(OWN, SPEED, discard=1, revolutions=2, blocks=1, exponents=0, keep=1, method=METHOD)
    for write in (
        lambda: configuration(OWN),
        lambda: save_model(tmp_path / "own.toml", OWN),
        lambda: to_dataset(swept, OWN),
    ):
        with pytest.raises(ConfigError, match=refused):
            write()
    assert not list(tmp_path.iterdir())
    assert "configuration" not in to_dataset(swept).attrs


@pytest.mark.wide
def test_a_study_of_a_force_of_ones_own_knows_its_law_and_numbers(tmp_path: Path):
    """Another number or version of the law is another study; nothing pretends to be a configuration."""
    brief = {"discard": 1, "revolutions": 2, "blocks": 1, "method": METHOD, "starts": 1, "name": "drag", "version": "1"}
    run = lambda model: jc.study(model, {"speed": np.array([SPEED])}, store=tmp_path / "own", **brief)
    assert "configuration" not in run(OWN).attrs
    name = "extra.ViscousDrag.coefficient"
    with pytest.raises(ValueError, match="holds another study, which differs in extra.ViscousDrag"):
        run(jc.replace(OWN, **{name: 2.0}))
    with pytest.raises(ValueError, match="which differs in version"):
        jc.study(OWN, {"speed": np.array([SPEED])}, store=tmp_path / "own", **brief | {"version": "2"})
    varied = {"speed": np.array([SPEED]), name: np.array([1.0, 2.0])}
    found = jc.study(OWN, varied, store=tmp_path / "varied", **brief)
    assert found[name].attrs["units"] == "N s/m" and np.ptp(found["peak"].values) > 0


def test_what_is_not_honoured_is_refused():
    class OwnFilm(jc.forces.RibFilm):
        def at(self, cage, speed):
            raise NotImplementedError

    class OwnSupport(jc.forces.Support):
        def force(self, motion):
            return 0.0, 0.0, 0.0

    class film(ViscousDrag):  # noqa: N801
        pass

    class Two(ViscousDrag):
        def force(self, motion):  # pyright: ignore[reportIncompatibleMethodOverride]
            return motion.vx, motion.vy

    drag = ViscousDrag(1.0, arm=0.0)
    support = OwnSupport(stiffness_x=1e4, stiffness_y=1e4, damping=1.0)
    with pytest.raises(ValueError, match="`support` must be a `Support`, but is a `OwnSupport`; a force of your own"):
        jc.replace(CASE, support=support)
    with pytest.raises(ValueError, match="`film` must be a `RibFilm`, but is a `OwnFilm`"):
        jc.replace(CASE, film=OwnFilm(land_width=2e-3))
    with pytest.raises(ValueError, match="`ViscousDrag` is there twice.*a subclass gives it another name"):
        with_extra(drag, drag)
    with pytest.raises(ValueError, match="beside film, contact, .*but `film` is there twice"):
        with_extra(film(1.0, arm=0.0))
    for wrong, holds in (([drag], "list"), (drag, "ViscousDrag"), ((CASE.film,), "RibFilm"), (None, "NoneType")):
        with pytest.raises(ValueError, match=f"must be a tuple of forces, .* but holds: {holds}"):
            jc.replace(CASE, extra=wrong)
    with pytest.raises(ValueError, match=r"`Two` must return \(F_x, F_y, moment\), three numbers"):
        jc.simulate(with_extra(Two(1.0, arm=0.0)), SPEED, revolutions=1, method=METHOD)
