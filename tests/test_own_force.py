"""A force of one's own: a class of five lines, and everything that the package does with a cage follows.

A viscous drag has the same physics as the damping of the support: every result must be that of a cage with as much more
damping there. A quadratic drag is compared with the equations of motion written down a second time and integrated by
SciPy.
"""

from pathlib import Path

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import pytest
import reference
from helpers import edge_speed, preliminary, raw_sweep
from scipy.integrate import solve_ivp

import jaxcage as jc
from jaxcage.files import ConfigError, configuration, save_model
from jaxcage.forces import AbstractForce, AbstractForcing, parameter
from jaxcage.orbits import Point


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


CASE = preliminary("1a")
SHARE = 1.5
"""Damping [N s/m] that the drag takes over from the support."""
OWN = jc.replace(CASE, damping=CASE.support.damping - SHARE, extra=(ViscousDrag(SHARE, arm=0.05),))
SPEED = jc.rpm(11200.0)
METHOD = jc.method("rk4", steps=128)


def with_extra(*laws: AbstractForce) -> jc.CageModel:
    return jc.replace(CASE, extra=laws)


# --- motion ----------------------------------------------------------------------------------


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


# --- orbits ----------------------------------------------------------------------------------


TORUS = Point("Neimark-Sacker", float(jc.rpm(11023.07)), np.array([1.33877e-5, -5.11828e-5, 0.520974, 0.0221109]))
"""An edge of case 1a, as `test_edges_of_the_cage` has it."""


@pytest.mark.wide
def test_an_edge_moves_with_a_drag_as_with_the_damping():
    """And as differences say; the arm of the torque moves nothing, at a speed that is given."""
    torus = jc.sensitivity(OWN, TORUS, method=METHOD)
    slope = torus.derivative["extra.ViscousDrag.coefficient"]
    assert torus.trusted and slope == pytest.approx(torus.derivative["damping"], rel=1e-9)
    at = lambda value: edge_speed(jc.replace(OWN, **{"extra.ViscousDrag.coefficient": value}), TORUS, METHOD)
    assert slope == pytest.approx((at(SHARE + 1e-3) - at(SHARE - 1e-3)) / 2e-3 * 30 / np.pi, rel=1e-5)
    assert torus.elasticity["extra.ViscousDrag.coefficient"] == pytest.approx(slope * SHARE / torus.value_rpm)
    assert torus.derivative["extra.ViscousDrag.arm"] == 0.0


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


# --- what acts, and what is measured ---------------------------------------------------------


@pytest.mark.wide
def test_forces_and_moments_of_a_run_name_it(tmp_path: Path):
    run = jc.simulate(OWN, SPEED, revolutions=1, samples=16, method=METHOD)
    forces = jc.analysis.cage_forces(OWN, run)
    assert list(forces) == [*jc.models.FORCES, "ViscousDrag"]
    np.testing.assert_allclose(forces["ViscousDrag"], -SHARE * run.state[:, 2:], rtol=1e-12)
    at = OWN.cage_at(jnp.asarray(SPEED)).forces(jnp.asarray(0.0), *map(jnp.asarray, run.state[0]))
    assert float(at["ViscousDrag"][2]) == pytest.approx(-SHARE * 0.05**2 * SPEED, rel=1e-12)
    assert float(at["contact"][2]) == 0


# --- what is refused -------------------------------------------------------------------------


@pytest.mark.wide
def test_no_file_holds_a_force_of_ones_own(tmp_path: Path):
    refused = r"Argument `model` must have no forces of your own to be put into a file, but has ViscousDrag\."
    for write in (lambda: configuration(OWN), lambda: save_model(tmp_path / "own.toml", OWN)):
        with pytest.raises(ConfigError, match=refused):
            write()
    assert not list(tmp_path.iterdir())
    swept = raw_sweep(OWN, SPEED, discard=1, revolutions=2, blocks=1, exponents=0, keep=1, method=METHOD)
    assert "configuration" not in swept.attrs and set(swept.outcome.values.ravel()) == {"successful"}


def test_what_is_not_honoured_is_refused():
    class OwnFilm(jc.forces.RibFilm):
        def at(self, cage, speed):
            raise NotImplementedError

    class film(ViscousDrag):  # noqa: N801
        pass

    class Two(ViscousDrag):
        def force(self, motion):  # pyright: ignore[reportIncompatibleMethodOverride]
            return motion.vx, motion.vy

    drag = ViscousDrag(1.0, arm=0.0)
    with pytest.raises(ValueError, match="`film` must be a `RibFilm`, but is a `OwnFilm`; a force of your own goes in"):
        jc.replace(CASE, film=OwnFilm(land_width=2e-3))
    with pytest.raises(ValueError, match="`ViscousDrag` is there twice.*a subclass gives it another name"):
        with_extra(drag, drag)
    with pytest.raises(ValueError, match="beside film, contact, .*but `film` is there twice"):
        with_extra(film(1.0, arm=0.0))
    with pytest.raises(ValueError, match="`film` is there twice"):
        with_extra(CASE.film)
    for wrong, holds in (([drag], "list"), (None, "NoneType")):
        with pytest.raises(ValueError, match=f"`forces` must be a tuple of laws, .* but holds: {holds}"):
            jc.replace(CASE, extra=wrong)
    with pytest.raises(ValueError, match="`Shaker` must repeat after one revolution"):
        with_extra(Shaker(1.0, times=1.5))  # pyright: ignore[reportArgumentType]
    with pytest.raises(ValueError, match="cage's centre must be a number from 0 to 1000 N s/m, but is -1 N s/m"):
        ViscousDrag(-1.0, arm=0.0)
    with pytest.raises(ValueError, match="with powers as in `N s.2/m.2`, but 'N s2/m2' was given"):
        parameter("N s2/m2", 0.0, 1.0, "quadratic drag")
    with pytest.raises(ValueError, match=r"`Two` must return \(F_x, F_y, moment\), three numbers"):
        jc.simulate(with_extra(Two(1.0, arm=0.0)), SPEED, revolutions=1, method=METHOD)
