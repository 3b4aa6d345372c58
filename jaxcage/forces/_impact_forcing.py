"""How roller impacts act on the cage: as the paper's synchronous force (15), or roller by roller."""

from typing import NamedTuple

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from .._arguments import require_at_least
from .._parameters import count, parameter
from .._types import Scalar
from ..bearing import load_distribution
from ._motion import AbstractForcing, Force, GuidedCage, Motion
from ._phase import cos_sin
from ._pocket_impact import PocketImpact, approach_speed
from ._pulse import pulse_integrals


def synchronous_amplitude(omega: Scalar, amplitude: Scalar, reference_speed: Scalar, exponent: Scalar) -> Array:
    """A(omega) = A_ref (omega/omega_ref)^n [N]; only A = 2 Q cos(theta) of (15) matters."""
    return jnp.asarray(amplitude * (omega / reference_speed) ** exponent)


def synchronous_force(tau: Scalar, amplitude: Scalar) -> tuple[Scalar, Scalar]:
    """(15): f_x = Q [sin tau + sin(pi - tau)] cos(theta) = A sin tau, and f_y = 0 identically [N]."""
    f_x = amplitude * cos_sin(tau)[1]
    return f_x, jnp.zeros_like(f_x)


class SynchronousImpact(eqx.Module):
    """The paper's (15): one horizontal force at cage frequency that grows as a power of speed."""

    amplitude: Scalar = parameter(
        "N",
        0.0,
        1e5,
        "amplitude A at the reference speed",
        within=(5.0, 300.0),
        source="once-a-revolution part of the acceleration of the cage, at one speed",
    )
    exponent: Scalar = parameter(
        "1",
        0.0,
        4.0,
        "power n of speed; 20/19 for a Hertz impact on a stiff bar",
        within=(1.0, 2.0),
        source="once-a-revolution part of the acceleration of the cage, at two speeds",
    )
    reference_speed: Scalar = parameter(
        "rad/s", 1.0, 1e5, "speed to which the amplitude belongs", kind="fixed", default=1000.0
    )

    def at(self, cage: GuidedCage, speed: Scalar) -> "SynchronousForce":
        """The force at cage speed `speed` [rad/s]."""
        return SynchronousForce(synchronous_amplitude(speed, self.amplitude, self.reference_speed, self.exponent))


class SynchronousForce(AbstractForcing):
    """One horizontal force at cage frequency."""

    amplitude: Scalar

    def force(self, motion: Motion) -> Force:
        return *synchronous_force(motion.phase, self.amplitude), 0.0


class RollerPassImpact(eqx.Module):
    """A pulse Q_cw(t) each time a roller enters or leaves the loaded zone, kept as a Fourier series."""

    oscillator: PocketImpact
    harmonics: int = count(1, 128, "harmonics of the roller-pass frequency that are kept", default=48)

    def at(self, cage: GuidedCage, speed: Scalar) -> "RollerPassForce":
        """The force at cage speed `speed` [rad/s]."""
        b, zone = cage.bearing, load_distribution(cage.bearing, cage.load)
        train = pulse_train(self, speed, zone.half_angle, b.n_rollers, b.roller_mass, b.pocket_clearance)
        return RollerPassForce(train, b.n_rollers)


class PulseTrain(NamedTuple):
    """Force of all roller passes as Fourier coefficients: f = sum over k of a_k cos(k Z tau) + b_k sin(k Z tau) [N].

    Each is a scalar of its own, as the kernels want them.
    """

    a_x: tuple[Scalar, ...]
    b_x: tuple[Scalar, ...]
    a_y: tuple[Scalar, ...]
    b_y: tuple[Scalar, ...]


def pulse_spectrum(
    impact: RollerPassImpact, omega: Scalar, n_rollers: int, roller_mass: Scalar, pocket_clearance: Scalar
) -> tuple[Float[Array, " harmonics"], Float[Array, " harmonics"]]:
    """Cosine and sine coefficients [N] of the train of pulses that starts at tau = 0 and repeats every 2 pi / Z.

    Pulses that last longer than the time between two rollers add up: summing shifted pulses and sampling the spectrum
    of one pulse at the multiples of Z are the same thing (Poisson). Every bounce on the swinging bar is part of a
    pulse. Coefficients are good to 1e-10 of the largest (1e-9 where it bounces ten times). They are NaN where 20 000
    steps do not resolve a pulse: a bar that swings tens of thousands of radians, or waves as many, during one impact.
    """
    require_at_least(1, n_rollers=n_rollers)
    law = impact.oscillator
    v0 = approach_speed(law.approach_ratio, omega, pocket_clearance)
    moves = v0 > 0
    v0 = jnp.where(moves, v0, 1.0)  # a roller without play does not hit, and its force has no spectrum to work out
    share = law.bar_mass / (roller_mass + law.bar_mass)
    mass = roller_mass * share
    unit = (mass / law.contact_stiffness) ** (9 / 19) * v0 ** (-1 / 19)
    swing, rate = jnp.sqrt(law.bar_stiffness / law.bar_mass), n_rollers * omega
    integrals = pulse_integrals(share, swing * unit, rate * unit, impact.harmonics)
    size = jnp.where(moves, mass * v0 * rate / (2 * jnp.pi), 0.0)
    weight = size * jnp.where(jnp.arange(impact.harmonics + 1) == 0, 1.0, 2.0)
    return weight * integrals[0], weight * integrals[1]


def pulse_train(
    impact: RollerPassImpact,
    omega: Scalar,
    half_angle: Scalar,
    n_rollers: int,
    roller_mass: Scalar,
    pocket_clearance: Scalar,
) -> PulseTrain:
    """Force of the rollers on the cage: +Q along the motion where they enter the loaded zone, -Q where they leave it.

    The zone is centred on -y with half angle theta; rollers turn counter-clockwise, enter at -pi/2 - theta, where the
    direction of motion is (cos theta, -sin theta), and leave at -pi/2 + theta, where it is (cos theta, sin theta).
    """
    require_at_least(1, n_rollers=n_rollers)
    cosine, sine = pulse_spectrum(impact, omega, n_rollers, roller_mass, pocket_clearance)
    k = jnp.arange(impact.harmonics + 1, dtype=float) * n_rollers

    def shifted(start: Scalar) -> tuple[Array, Array]:
        c, s = jnp.cos(k * start), jnp.sin(k * start)
        return cosine * c - sine * s, cosine * s + sine * c

    (a_in, b_in), (a_out, b_out) = shifted(-jnp.pi / 2 - half_angle), shifted(-jnp.pi / 2 + half_angle)
    across, down = jnp.cos(half_angle), -jnp.sin(half_angle)
    rows = across * (a_in - a_out), across * (b_in - b_out), down * (a_in + a_out), down * (b_in + b_out)
    return PulseTrain(*(tuple(jnp.unstack(row)) for row in rows))


def pulse_train_force(tau: Scalar, train: PulseTrain, n_rollers: int) -> tuple[Array, Array]:
    """Force of the pulse train at phase tau [N]."""
    require_at_least(1, n_rollers=n_rollers)
    first, rise = cos_sin(n_rollers * tau)
    now, before = (1.0, 0.0), (first, -rise)  # cosine and sine of k Z tau, by the recurrence of Chebyshev
    x = y = jnp.zeros(())
    for a_x, b_x, a_y, b_y in zip(*train, strict=True):
        c, s = now
        x, y = x + (a_x * c + b_x * s), y + (a_y * c + b_y * s)
        now, before = (2 * first * c - before[0], 2 * first * s - before[1]), now
    return x, y


class RollerPassForce(AbstractForcing):
    """A pulse for each roller."""

    train: PulseTrain
    n_rollers: int = eqx.field(static=True)

    def force(self, motion: Motion) -> Force:
        return *pulse_train_force(motion.phase, self.train, self.n_rollers), 0.0
