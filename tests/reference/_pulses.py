"""The impact of a roller on a cage bar, (14), and the train of impacts of all rollers, as a Fourier series."""

import math
from typing import Any, NamedTuple

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from ._statics import half_angle


PANELS, NODES = 48, 12


class Pulse(NamedTuple):
    """The force of one impact at the nodes of a quadrature over the time of contact."""

    time: np.ndarray
    """[s], from the first touch."""
    force: np.ndarray
    """Q_cw [N]."""
    weight: np.ndarray
    """Weight of each node in an integral over time [s]."""


def pulse(
    oscillator: dict[str, Any], roller_mass: float, speed: float, window: float = math.inf, fastest: float = 0.0
) -> Pulse:
    """Solve (14) from the touch at approach speed [m/s] until the roller is out of the bar's reach, or `window` [s].

    While they are apart the roller flies and the bar swings, both in closed form. The nodes resolve the bar's swing, in
    contact too, and waves of the angular frequency `fastest` [rad/s].
    """
    k, bar, mass = oscillator["contact_stiffness"], oscillator["bar_stiffness"], oscillator["bar_mass"]
    swing = math.sqrt(bar / mass)
    depth = (roller_mass * speed**2 / k) ** (9 / 19)
    unit, length = depth / speed, depth
    held = math.sqrt((bar + k * depth ** (1 / 9)) / mass)

    def rates(s: float, y: np.ndarray) -> list[float]:
        """Rates of the penetration and the bar's position: the difference of two positions would lose digits."""
        q = k * max(y[0] * length, 0.0) ** (10 / 9) * unit / speed
        bent = (q - bar * y[1] * length * unit / speed) / mass
        return [y[2], y[3], -q / roller_mass - bent, bent]

    def apart(s: float, y: np.ndarray) -> float:
        return y[0]

    apart.terminal, apart.direction = True, -1  # pyright: ignore[reportFunctionMemberAccess]
    y, start, found = np.array([0.0, 0.0, 1.0, 0.0]), 0.0, []
    while start < window / unit:
        end = min(window / unit - start, 1e6)  # time counts from each touch, which rounds off less of it
        step = 0.05 / max(1.0, swing * unit, held * unit / 4)
        done = solve_ivp(
            rates, (0.0, end), y, "DOP853", dense_output=True, events=apart, rtol=3e-14, atol=3e-16, max_step=step
        )
        assert done.success and done.sol is not None, done.message
        panels = max(PANELS, math.ceil(done.t[-1] * unit * max(fastest, held) / 3))
        found.append(_nodes(done.t[-1], start, done.sol, k, length, panels))
        y, start = done.y[:, -1], start + done.t[-1]
        again = _next_touch(y, swing * unit)
        if again is None:
            break
        flown, y = again
        start += flown
    time, force, weight = (np.concatenate(part) for part in zip(*found, strict=True))
    return Pulse(time * unit, force, weight * unit)


def _nodes(end: float, start: float, motion: Any, stiffness: float, length: float, panels: int) -> tuple:
    """Gauss nodes in s, with time going as 3 s^2 - 2 s^3: the force leaves zero as a power of 10/9."""
    x, w = np.polynomial.legendre.leggauss(NODES)
    s = (np.arange(panels)[:, None] + (x + 1) / 2).ravel() / panels
    time = end * s * s * (3 - 2 * s)
    weight = np.tile(w, panels) / (2 * panels) * end * 6 * s * (1 - s)
    y = motion(time)
    return start + time, stiffness * (np.maximum(y[0], 0.0) * length) ** (10 / 9), weight


def _next_touch(y: np.ndarray, swing: float) -> tuple[float, np.ndarray] | None:
    """When the roller, flying on, meets the swinging bar again, and the state then; None if it never does."""
    reach, speed = math.hypot(y[1], y[3] / swing), y[2] + y[3]

    def gap(t: float) -> float:
        return y[3] / swing * math.sin(swing * t) - 2 * y[1] * math.sin(swing * t / 2) ** 2 - speed * t

    if speed < 0:
        last = (y[1] + reach) / -speed
    elif speed > 0:
        last = (reach - y[1]) / speed + 1 / swing
    else:
        last = 2 * math.pi / swing
    step = 2 * math.pi / swing / 400
    before = 1e-9 * step
    while before < last:
        after = before + step
        if gap(before) > 0 >= gap(after):
            t = float(brentq(gap, before, after, xtol=1e-18, rtol=1e-14))
            c, s = math.cos(swing * t), math.sin(swing * t)
            bar = [y[1] * c + y[3] / swing * s, y[3] * c - y[1] * swing * s]
            return t, np.array([0.0, bar[0], speed - bar[1], bar[1]])
        before = after
    return None


def train(given: dict[str, Any], omega: float, zone: float) -> np.ndarray:
    """Coefficients C of F = Re sum over k of C_k exp(i k Z tau) [N], shape (2, harmonics + 1).

    Every roller hits a bar where it enters the loaded zone, along the cage's motion, and where it leaves it, against:
    at the angles -pi/2 -+ theta, where the motion goes along (-sin, cos) of the angle. v_0 = kappa omega T.
    """
    bearing, oscillator = given["bearing"], given["impact"]["oscillator"]
    size = math.pi * bearing["roller_diameter"] ** 2 / 4 * bearing["roller_length"]
    speed = oscillator["approach_ratio"] * omega * bearing["pocket_clearance"]
    order = bearing["n_rollers"] * np.arange(given["impact"]["harmonics"] + 1)
    hit = pulse(oscillator, bearing["roller_material"]["density"] * size, speed, fastest=float(omega * order[-1]))
    spectrum = np.exp(-1j * omega * np.outer(order, hit.time)) @ (hit.force * hit.weight)
    spectrum = spectrum * bearing["n_rollers"] * omega / (2 * math.pi) * np.where(order == 0, 1, 2)
    total = np.zeros((2, order.size), dtype=complex)
    for sign, angle in ((1, -math.pi / 2 - zone), (-1, -math.pi / 2 + zone)):
        along = np.array([-math.sin(angle), math.cos(angle)])
        total += sign * along[:, None] * spectrum * np.exp(-1j * order * angle)
    return total


def from_bearing(given: dict[str, Any], omega: float) -> float:
    """Amplitude [N] of a roller and half a ring's mass that meet on a bar, once in a revolution, by integration."""
    bearing, impact = given["bearing"], given["impact"]
    length, across, soft = bearing["roller_length"], bearing["roller_diameter"], impact["cage_modulus"]
    thick = math.pi * (bearing["inner_raceway_diameter"] + across) / bearing["n_rollers"]
    thick, high = thick - across - bearing["pocket_clearance"], 0.52 * across
    second = high * thick**3 / 12
    sag = length**3 / (384 * soft * second) + length / (8 * 5 / 6 * soft / 2.6 * high * thick)
    hard = bearing["roller_material"]["youngs_modulus"]
    constant = bearing["palmgren_constant"] * 2 / (1 + hard / soft)
    bar = 1 / (sag + 1 / (constant * length ** (8 / 9) * 1e-6 ** (1 / 9)))
    roller = bearing["roller_material"]["density"] * math.pi * across**2 / 4 * length
    speed = impact["approach_ratio"] * omega * bearing["pocket_clearance"]

    def rates(t: float, y: np.ndarray) -> list[float]:
        push = bar * (y[0] - y[1])
        phase = np.exp(1j * omega * t) * push
        return [y[2], y[3], -push / roller, push / (given["cage_mass"] / 2), phase.real, phase.imag]

    def apart(t: float, y: np.ndarray) -> float:
        return y[0] - y[1]

    apart.terminal, apart.direction = True, -1  # pyright: ignore[reportFunctionMemberAccess]
    fast = math.sqrt(roller / bar)
    done = solve_ivp(rates, (0, 5 * fast), [0, 0, speed, 0, 0, 0], "DOP853", events=apart, rtol=1e-12, atol=1e-15)
    once = omega / math.pi * math.hypot(*done.y[4:, -1])
    return 2 * impact["unmatched"] * math.cos(half_angle(bearing, given["load"])) * once
