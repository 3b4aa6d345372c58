"""Impacts of rollers on the cage's bars: the two-mass oscillator (14) and its force history (fig. 5), and the force on
the cage, as the paper's synchronous one (15), of a given amplitude or one that follows from the bearing, or roller by
roller.

    M_w d_w'' + K_cw (d_w - d_c)_+^(10/9) = 0
    M_c d_c'' + K_c d_c - K_cw (d_w - d_c)_+^(10/9) = 0
started with the roller approaching at v_0. The paper prints d_w'' in the second line and gives no constants.
"""

from typing import Any, NamedTuple

import diffrax as dfx
import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from .._parameters import count, parameter
from .._pytrees import Scalar
from ..bearing import load_distribution, pocket_stiffness
from .elementary import cos_sin, power_10_9
from .law import AbstractForcing, AbstractLaw, Force, GuidedCage, Motion
from .pulse import pulse_integrals


class PocketImpact(eqx.Module):
    """Constants of the roller-bar oscillator; none is printed in the paper."""

    contact_stiffness: Scalar = parameter(
        "N/m^(10/9)",
        1e4,
        1e13,
        "roller-bar line-contact stiffness K_cw",
        source="press a roller on a bar: force over approach",
        default=2e8,
    )
    bar_stiffness: Scalar = parameter(
        "N/m",
        1e3,
        1e10,
        "bending stiffness of a cage bar K_c",
        source="bend a bar, or a finite-element model of the cage",
        default=2.5e6,
    )
    bar_mass: Scalar = parameter(
        "kg",
        1e-5,
        1.0,
        "effective mass of a cage bar M_c",
        source="a modal test of a bar, or a finite-element model of the cage",
        default=4e-3,
    )
    approach_ratio: Scalar = parameter(
        "1",
        1e-3,
        10.0,
        "kappa in v_0 = kappa omega T, T the pocket clearance",
        source="cage speed over roller speed in the pocket, by high-speed film",
        default=0.45,
    )


class ImpactHistory(eqx.Module):
    """Forces and motion of one impact on a uniform time grid."""

    time: Float[Array, " samples"]  # [s]
    contact_force: Float[Array, " samples"]  # Q_cw [N], never negative
    bar_force: Float[Array, " samples"]  # K_c d_c [N], negative when the bar swings back
    roller_position: Float[Array, " samples"]  # d_w [m]
    bar_position: Float[Array, " samples"]  # d_c [m]
    roller_velocity: Float[Array, " samples"]  # [m/s]
    bar_velocity: Float[Array, " samples"]  # [m/s]


def approach_speed(approach_ratio: Scalar, omega: Scalar, pocket_clearance: Scalar) -> Array:
    """Approach speed v_0 = kappa omega T [m/s], set by the pocket clearance T as in the paper's conclusion 2."""
    return jnp.asarray(approach_ratio * omega * pocket_clearance)


def impact_history(
    impact: PocketImpact, roller_mass: Scalar, v0: Scalar, duration: Scalar, samples: int = 512, substeps: int = 4
) -> ImpactHistory:
    """Solve (14) from the first contact of a roller that approaches at `v0`.

    **Arguments:** oscillator; roller mass [kg]; approach speed [m/s]; duration [s]; number of samples on a uniform grid
    and of Tsit5 steps between two samples.
    """

    def contact(d_w: Array, d_c: Array) -> Array:
        return impact.contact_stiffness * power_10_9(jnp.maximum(d_w - d_c, 0.0))

    def rates(_: Any, y: tuple[Array, ...], __: Any) -> tuple[Array, ...]:
        d_w, d_c, u_w, u_c = y
        q = contact(d_w, d_c)
        each = u_w, u_c, -q / roller_mass, (q - impact.bar_stiffness * d_c) / impact.bar_mass
        return tuple(duration * rate for rate in each)

    grid = jnp.linspace(0.0, 1.0, samples)
    solution = dfx.diffeqsolve(
        dfx.ODETerm(rates),
        dfx.Tsit5(),
        t0=0.0,
        t1=1.0,
        dt0=1 / ((samples - 1) * substeps),
        y0=(jnp.zeros_like(v0), jnp.zeros_like(v0), jnp.asarray(v0), jnp.zeros_like(v0)),
        saveat=dfx.SaveAt(ts=grid),
        stepsize_controller=dfx.ConstantStepSize(),
        adjoint=dfx.DirectAdjoint(),
        max_steps=(samples - 1) * substeps + 2,
    )
    assert solution.ys is not None
    d_w, d_c, u_w, u_c = solution.ys
    return ImpactHistory(grid * duration, jax.vmap(contact)(d_w, d_c), impact.bar_stiffness * d_c, d_w, d_c, u_w, u_c)


class SynchronousImpact(AbstractLaw):
    """Synchronous impact (15) of the paper: a horizontal force at cage frequency that grows as a power of speed.

    f_x = Q [sin tau + sin(pi - tau)] cos(theta) = A sin tau, and f_y = 0 identically: only A = 2 Q cos(theta) matters,
    A(omega) = A_ref (omega/omega_ref)^n.
    """

    law_name = "impact"
    kind = "synchronous"

    amplitude: Scalar = parameter(
        "N",
        0.0,
        1e5,
        "amplitude A at the reference speed",
        source="once-a-revolution part of the acceleration of the cage, at one speed",
    )
    exponent: Scalar = parameter(
        "1",
        0.0,
        4.0,
        "power n of speed; 20/19 for a Hertz impact on a stiff bar",
        source="once-a-revolution part of the acceleration of the cage, at two speeds",
    )
    reference_speed: Scalar = parameter("rad/s", 1.0, 1e5, "speed to which the amplitude belongs", default=1000.0)

    def at(self, cage: GuidedCage, speed: Scalar) -> "SynchronousForce":
        return SynchronousForce(self.amplitude * (speed / self.reference_speed) ** self.exponent)


class SynchronousForce(AbstractForcing):
    """Horizontal force at cage frequency."""

    amplitude: Scalar

    def force(self, motion: Motion) -> Force:
        return self.amplitude * cos_sin(motion.phase)[1], 0.0, 0.0


class BarPulse(NamedTuple):
    """Force of one impact of a roller on a bar: half a sine."""

    peak: Array
    """Largest force [N]."""
    duration: Array
    """[s]."""

    def first_harmonic(self, omega: Scalar) -> Array:
        """Amplitude [N], at the frequency `omega` [rad/s], of a pulse that comes once in a period 2 pi/omega.

        It is (omega/pi) times the impulse 2 Q D/pi, for a pulse that is short compared with the period.
        """
        turned = omega * self.duration
        return 2 * self.peak * turned * jnp.cos(turned / 2) / (jnp.pi**2 - turned**2)


def bar_pulse(roller_mass: Scalar, cage_mass: Scalar, stiffness: Scalar, v0: Scalar) -> BarPulse:
    """Force of a roller that hits a bar at the speed `v0`: (14) for a light bar, with a cage that gives way.

    A bar vibrates faster than the impact lasts: its mass is left out, and it is a spring. The cage moves and turns: hit
    at its own radius, half the mass of a ring opposes. Two masses on a spring part after half a period.

    **Arguments:** masses of roller and cage [kg]; stiffness of the bar and its contact in series [N/m]; speed [m/s].
    """
    mass = 1 / (1 / roller_mass + 2 / cage_mass)
    return BarPulse(jnp.asarray(v0 * jnp.sqrt(stiffness * mass)), jnp.pi * jnp.sqrt(mass / stiffness))


class ImpactFromBearing(AbstractLaw):
    """Synchronous impact (15) whose amplitude follows from the bearing: masses, bars, pocket clearance and load.

    f_x = A sin tau with A = 2 n Q_1 cos(theta), theta the half angle of the loaded zone at rest. (15) takes for Q the
    largest force of an impact. That cannot be: an impact lasts a hundredth of a revolution, and a sine of that size
    would pass on fifty times and more the momentum that a roller loses, more than all rollers have. Q_1 is the first
    harmonic of the pulse instead, which passes on what one roller loses. It depends on masses, clearance and speed (A
    grows as its square) and hardly on the stiffness, which determines the largest force of an impact.

    Rollers that hit alike cancel but for the multiples of Z: n counts the impacts per revolution that do not. Both
    constants are unknown. In whole bearings (NU2310, NU1014, NU215, cages of brass and PEEK, with and without drag, 0.6
    to 2 times the reference speed) the largest pocket forces correspond to kappa = 1.8 to 4.4, the more the slower,
    since rollers also push steadily, and the first harmonics to n = 0.03 to 2.5. Their rollers and pockets are
    identical, and only the unbalance tells one place of the cage from another.
    """

    law_name = "impact"
    kind = "from_bearing"

    approach_ratio: Scalar = parameter(
        "1",
        1e-3,
        10.0,
        "kappa in v_0 = kappa omega T, T the pocket clearance",
        kind="unknown",
        source="largest pocket force of the whole bearing, or of a strain gauge on a bar",
        default=2.0,
    )
    unmatched: Scalar = parameter(
        "1",
        0.0,
        1e3,
        "impacts per revolution n that others do not cancel",
        kind="unknown",
        source="once-a-revolution part of the acceleration of the cage, or of the pocket forces of the whole bearing",
        default=0.5,
    )
    cage_modulus: Scalar = parameter("Pa", 1e8, 1e12, "Young's modulus of the cage", kind="catalogue", default=102e9)

    def pulse(self, cage: GuidedCage, speed: Scalar) -> BarPulse:
        """Force of one roller on its bar at a cage speed [rad/s]."""
        b, bar = cage.bearing, pocket_stiffness(cage.bearing, cage.guidance_gap, self.cage_modulus)
        v0 = approach_speed(self.approach_ratio, speed, b.pocket_clearance)
        return bar_pulse(b.roller_mass, cage.cage_mass, bar, v0)

    def at(self, cage: GuidedCage, speed: Scalar) -> "SynchronousForce":
        hits = 2 * self.unmatched * jnp.cos(load_distribution(cage.bearing, cage.load).half_angle)
        return SynchronousForce(hits * self.pulse(cage, speed).first_harmonic(speed))


class RollerPassImpact(AbstractLaw):
    """Pulse Q_cw(t) each time a roller enters or leaves the loaded zone at rest, as a Fourier series."""

    law_name = "impact"
    kind = "roller_pass"

    oscillator: PocketImpact = eqx.field(default_factory=PocketImpact)
    harmonics: int = count(1, 128, "harmonics of the roller-pass frequency that are kept", default=48)

    def highest_harmonic(self, cage: GuidedCage) -> int:
        return cage.bearing.n_rollers * self.harmonics

    def at(self, cage: GuidedCage, speed: Scalar) -> "RollerPassForce":
        b, zone = cage.bearing, load_distribution(cage.bearing, cage.load)
        return pulse_train(self, speed, zone.half_angle, b.n_rollers, b.roller_mass, b.pocket_clearance)


def pulse_spectrum(
    impact: RollerPassImpact, omega: Scalar, n_rollers: int, roller_mass: Scalar, pocket_clearance: Scalar
) -> tuple[Float[Array, " harmonics"], Float[Array, " harmonics"]]:
    """Cosine and sine coefficients [N] of the train of pulses that starts at tau = 0 and repeats every 2 pi / Z.

    Overlapping pulses add up: the sum of shifted pulses equals the spectrum of one pulse sampled at the multiples of Z
    (Poisson). A pulse includes every bounce on the swinging bar. Coefficients are accurate to 1e-10 of the largest
    (1e-9 with ten bounces), and NaN where 20 000 steps do not resolve a pulse, i.e. if the bar or the highest harmonic
    turns through tens of thousands of radians during one impact.
    """
    law = impact.oscillator
    v0 = approach_speed(law.approach_ratio, omega, pocket_clearance)
    moves = v0 > 0
    v0 = jnp.where(moves, v0, 1.0)  # a roller without play does not hit: avoid NaN
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
) -> "RollerPassForce":
    """Force of the rollers on the cage: +Q along the motion where they enter the loaded zone, -Q where they leave it.

    The zone is centred on -y with half angle theta; rollers turn counter-clockwise, enter at -pi/2 - theta, where the
    direction of motion is (cos theta, -sin theta), and leave at -pi/2 + theta, where it is (cos theta, sin theta).
    """
    cosine, sine = pulse_spectrum(impact, omega, n_rollers, roller_mass, pocket_clearance)
    k = jnp.arange(impact.harmonics + 1, dtype=float) * n_rollers

    def shifted(start: Scalar) -> tuple[Array, Array]:
        c, s = jnp.cos(k * start), jnp.sin(k * start)
        return cosine * c - sine * s, cosine * s + sine * c

    (a_in, b_in), (a_out, b_out) = shifted(-jnp.pi / 2 - half_angle), shifted(-jnp.pi / 2 + half_angle)
    across, down = jnp.cos(half_angle), -jnp.sin(half_angle)
    rows = across * (a_in - a_out), across * (b_in - b_out), down * (a_in + a_out), down * (b_in + b_out)
    a_x, b_x, a_y, b_y = (tuple(jnp.unstack(row)) for row in rows)
    return RollerPassForce(a_x, b_x, a_y, b_y, n_rollers)


class RollerPassForce(AbstractForcing):
    """Force of all roller passes by Fourier coefficients: the sum over k of a_k cos(k Z tau) + b_k sin(k Z tau) [N].
    Each coefficient is a separate scalar, as the compiled kernels require."""

    a_x: tuple[Scalar, ...]
    b_x: tuple[Scalar, ...]
    a_y: tuple[Scalar, ...]
    b_y: tuple[Scalar, ...]
    n_rollers: int = eqx.field(static=True)

    def force(self, motion: Motion) -> Force:
        first, rise = cos_sin(self.n_rollers * motion.phase)
        now, before = (1.0, 0.0), (first, -rise)  # cosine and sine of k Z tau, by Chebyshev's recurrence
        x = y = jnp.zeros(())
        for a_x, b_x, a_y, b_y in zip(self.a_x, self.b_x, self.a_y, self.b_y, strict=True):
            c, s = now
            x, y = x + (a_x * c + b_x * s), y + (a_y * c + b_y * s)
            now, before = (2 * first * c - before[0], 2 * first * s - before[1]), now
        return x, y, 0.0
