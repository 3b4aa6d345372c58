"""The whole bearing written a second time, in NumPy: places and forces as complex numbers, bodies by mass centres.

Rollers, cage and inner ring are free bodies in the inertial frame with coordinates z = x + i y of their mass centres
and angles of rotation. A contact is a point and a force there; each body gets that force and its moment about its own
mass centre. Nothing is solved for and nothing is in polar coordinates but the film.
"""

import math
from typing import Any

import numpy as np
from scipy.integrate import quad, solve_ivp
from scipy.optimize import brentq

import jaxcage as jc

from ._land import film_in_polar, ramp
from ._statics import hunt_crossley_number, viscosity


def _ramp(u: np.ndarray, width: float) -> np.ndarray:
    return np.array([ramp(float(v), width) for v in u])


def _moment(arm: Any, force: Any) -> Any:
    return np.imag(np.conj(arm) * force)


def gupta(rest: float, peak: float, limit: float, speed: float) -> tuple[float, float, float, float]:
    """A, B, C, D of (A + B u) exp(-C u) + D with its maximum `peak` at `speed`: B by bracketing, C = B/(A + B u_m)."""
    a = rest - limit
    top = lambda b: (a + b * speed) * math.exp(-b * speed / (a + b * speed)) + limit - peak
    lowest = max(0.0, -a / speed)
    highest = lowest + 10 * (peak - limit) * math.e / speed
    b: Any = brentq(top, lowest * (1 + 1e-9) + 1e-12, highest, xtol=1e-16, rtol=1e-15)
    return a, b, b / (a + b * speed), limit


class WholeBearing:
    """Rates of a `jc.BearingModel` at one shaft speed [rad/s], from its declared numbers alone."""

    def __init__(self, model: jc.BearingModel, speed: float):
        g = {name: float(value) for name, value in jc.parameters(model).items()}
        self.g, self.speed, self.n = g, speed, model.bearing.n_rollers
        self.inner_guided, self.held = model.guidance == "inner", model.cage_rotation == "held"
        self.half = g["roller_diameter"] / 2
        self.r_i = g["inner_raceway_diameter"] / 2
        self.r_o = self.r_i + 2 * self.half + g["radial_clearance"] / 2
        self.k = g["palmgren_constant"] * g["roller_length"] ** (8 / 9)
        self.m = g["bearing.roller_material.density"] * math.pi * self.half**2 * g["roller_length"]
        self.c = g["guidance_gap"] / (2 if model.clearance_reading == "radial" else 1)
        gap = g["guidance_gap"]
        self.land = (g["inner_land_diameter"] + gap) / 2 if self.inner_guided else (g["rib_diameter"] - gap) / 2
        oil = {name.removeprefix("lubricant."): v for name, v in g.items()} | {"density": g["lubricant.density"]}
        mu, width, lands = viscosity(oil), g["land_width"], model.film.n_lands
        steeper = (mu / oil["density"] / oil["viscosity_1"]) ** g["viscosity_exponent"]
        self.curve = gupta(g["rest"], g["peak"], g["limit"], g["peak_speed"] / steeper)
        self.film, self.film_scale = model.film.model, lands * mu * self.land * width**3 / self.c**2
        self.petroff = lands * 2 * math.pi * mu * self.land**3 * width / self.c
        self.chi = hunt_crossley_number(g["restitution"]) / g["approach_speed"]
        self.power_law = model.pockets.pocket_law == "power"
        self.c_d, self.couple = self._oil(model.drag, viscosity(oil) / oil["density"])

    def _oil(self, drag: Any, nu: float) -> tuple[float, float]:
        """Drag coefficient, and the couple of rolling resistance under 1 N [N m]."""
        g = self.g
        passing = abs(self.r_i * self.speed + self.r_o * g["outer_speed"]) / 2
        re, c_d = passing * 2 * self.half / nu, g["drag_coefficient"]
        if drag.drag_law == "cylinder":
            c_d *= 1.18 + 6.8 / re**0.89 + 1.96 / math.sqrt(re) - 0.0004 * re / (1 + 3.64e-7 * re**2)
        if drag.rolling_law == "none":
            return c_d, 0.0
        d, big, n = 1e3 * g["bore"], 1e3 * g["outside_diameter"], abs(self.speed - g["outer_speed"]) * 30 / math.pi
        middle, cst = (d + big) / 2, 1e6 * nu
        factor = 1 / (1 + 1.84e-9 * (n * middle) ** 1.28 * cst**0.64)
        starvation = {"flooded": 0.0, "bath": 3e-8, "spot": 6e-8}[drag.rolling_law]
        factor *= math.exp(-starvation * cst * n * (d + big) * math.sqrt(5.1 / (2 * (big - d))))
        # Under the load at which the lowest roller bears 1 N, and any roller cos^(10/9).
        over_rollers = lambda power: self.n / np.pi * quad(lambda a: np.cos(a) ** power, 0.0, np.pi / 2)[0]
        shaft, sum_ = over_rollers(19 / 9), over_rollers(3.1 / 9)
        whole = 1e-3 * factor * g["rolling_coefficient"] * middle**2.41 * shaft**0.31 * (cst * n) ** 0.6
        return c_d, whole / sum_ * 2 * self.half / (g["inner_raceway_diameter"] + 2 * self.half)

    def traction(self, u: np.ndarray) -> np.ndarray:
        a, b, c, d = self.curve
        size = np.hypot(u, self.g["traction_smoothing"])
        return u / size * ((a + b * size) * np.exp(-c * size) + d)

    def friction(self, u: Any) -> Any:
        return u / np.hypot(u, self.g["saturation_speed"])

    def _raceway(self, overlap: np.ndarray, closing: np.ndarray) -> np.ndarray:
        pressed = _ramp(overlap, self.g["raceway_smoothing"])
        return self.k * pressed ** (10 / 9) * _ramp(1 + 1.5 * self.g["raceway_damping"] * closing, 1e-4)

    def _land_force(self, gap: complex, rate: complex, omega: float, land: float) -> tuple[complex, float, float]:
        """Force on the cage, and the moments on cage and land about their centres."""
        g, c = self.g, self.c
        r = abs(gap) / c
        n = gap / abs(gap)
        eps = math.hypot(r, g["film.smoothing"] / c)
        sure, excess = r / eps, ramp(eps - g["onset"], g["contact.smoothing"] / c)
        v_r, v_t = (np.conj(n) * rate).real / c, (np.conj(n) * rate).imag / c
        total = omega + land
        share, sense = 1 - excess / eps, math.copysign(1.0, total)
        f_r, f_t = film_in_polar(self.film, share * r, v_r, total * r - 2 * v_t, sense * sure)
        film = self.film_scale * (f_r + 1j * f_t) * n
        shear = self.petroff / math.sqrt(1 - (eps - excess) ** 2) * (omega - land)
        on_cage, on_land = -shear - _moment(gap, film) / 2, shear - _moment(gap, film) / 2
        normal = g["stiffness"] * (c * excess) ** (10 / 9) * ramp(1 + self.chi * c * sure * v_r, 1e-4)
        # The point of contact: on the cage's rim ahead of it, or behind it on the rim of a land inside.
        side = -1.0 if self.inner_guided else 1.0
        at = side * self.land * n * sure
        from_land = at + c * eps * n * sure
        slip = (np.conj(n * sure) * rate).imag + omega * side * self.land - land * (side * self.land + c * eps)
        rub = -g["land_friction"] * normal * self.friction(slip)
        push = -normal * n * sure + 1j * n * sure * rub
        return film + push, on_cage + _moment(at, 1j * n * rub), on_land - _moment(from_land, 1j * n * rub)

    def rates(self, angle: float, rollers: np.ndarray, bodies: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Rates over time of the package's state: rollers (lag, spin, radius, radius', psi') and bodies."""
        g, m = self.g, self.m
        lag, spin, radius, radial, orbit = rollers
        z_c, v_c, omega = complex(*bodies[0:2]), complex(*bodies[2:4]), bodies[4]
        z_i, v_i = complex(*bodies[5:7]), complex(*bodies[7:9])
        pocket = np.exp(1j * (angle + 2 * np.pi * np.arange(self.n) / self.n))
        out = pocket * np.exp(1j * lag)
        z, v = radius * out, (radial + 1j * radius * orbit) * out
        force, moment = -1j * m * g["gravity"] * np.ones(self.n), np.zeros(self.n)
        ring_force, cage_force, cage_moment = 0j, 0j, 0.0

        for centre, v_ring, turning, sign in ((0j, 0j, g["outer_speed"], 1.0), (z_i, v_i, self.speed, -1.0)):
            far = np.abs(z - centre)
            n = (z - centre) / far
            race = self.r_o if sign > 0 else self.r_i
            overlap = sign * (far + sign * self.half - race)
            load = self._raceway(overlap, sign * (np.conj(n) * (v - v_ring)).real)
            point = z + sign * (self.half - overlap / 2) * n
            sliding = v_ring + 1j * turning * (point - centre) - v - 1j * spin * (point - z)
            push = (-sign * load + 1j * load * self.traction((np.conj(n) * sliding).imag)) * n
            force, moment = force + push, moment + _moment(point - z, push)
            turn = spin - turning
            moment = moment - self.couple * load / (load + 1.0) ** 0.69 * turn / np.hypot(turn, 1.0)
            if sign < 0:
                ring_force = ring_force - push.sum()

        from_c = z - z_c
        u = (np.conj(pocket) * from_c).imag
        side = np.where(u >= 0, 1.0, -1.0)
        t = 1j * pocket
        point = z + side * self.half * t
        slip = v + 1j * spin * (point - z) - v_c - 1j * omega * (point - z_c)
        pressed = _ramp(side * u - g["pocket_clearance"] / 2, g["pocket_smoothing"])
        if self.power_law:
            pressed = g["pocket_reference"] * (pressed / g["pocket_reference"]) ** g["pocket_exponent"]
        closing = side * (np.conj(t) * slip).real
        normal = g["pocket_stiffness"] * pressed * _ramp(1 + 1.5 * g["pocket_damping"] * closing, 1e-4)
        rub = -g["pocket_friction"] * normal * self.friction((np.conj(pocket) * slip).real)
        push = -side * normal * t + rub * pocket
        force, moment = force + push, moment + _moment(point - z, push)
        cage_force, cage_moment = -push.sum(), -_moment(point - z_c, push).sum()

        dense = g["oil_share"] * g["lubricant.density"] * g["roller_length"] / 2
        force = force - self.c_d * dense * 2 * self.half * np.abs(v) * v
        moment = moment - g["churning_coefficient"] * dense * self.half**4 * np.abs(spin) * spin

        centre, v_land, turning = (z_i, v_i, self.speed) if self.inner_guided else (0j, 0j, g["outer_speed"])
        on_cage, couple, _ = self._land_force(z_c - centre, v_c - v_land, omega, turning)
        cage_force, cage_moment = cage_force + on_cage, cage_moment + couple
        if self.inner_guided:
            ring_force = ring_force - on_cage
        ring_force = ring_force - g["mounting_damping"] * v_i - 1j * (g["load"] + g["ring_mass"] * g["gravity"])

        # The cage about its mass centre, and from there the acceleration of its geometric centre.
        e = g["eccentricity"] * np.exp(1j * angle)
        mass_centre = cage_force / g["cage_mass"] - 1j * g["gravity"]
        turn = 0.0 if self.held else (cage_moment - _moment(e, cage_force)) / g["cage_inertia"]
        a_c = mass_centre - (1j * turn - omega**2) * e
        a_i = ring_force / g["ring_mass"]
        a = np.conj(out) * force / m
        rolling = np.stack(
            [
                orbit - omega,
                moment / (m * self.half**2 / 2),
                radial,
                a.real + radius * orbit**2,
                (a.imag - 2 * radial * orbit) / radius,
            ]
        )
        pair = lambda w: [w.real, w.imag]
        return rolling, np.array([*pair(v_c), *pair(a_c), turn, *pair(v_i), *pair(a_i)])

    def arc(self, angle: float, rollers: np.ndarray, bodies: np.ndarray, span: float) -> tuple[np.ndarray, np.ndarray]:
        """The state after the cage has turned by `span` [rad], integrated over time by SciPy."""
        shape, n = rollers.shape, rollers.size

        def rate(_: float, y: np.ndarray) -> np.ndarray:
            a, b = self.rates(y[-1], y[:n].reshape(shape), y[n:-1])
            return np.concatenate([a.ravel(), b, y[-1:] * 0 + y[n + 4]])

        def turned(_: float, y: np.ndarray) -> float:
            return y[-1] - angle - span

        turned.terminal = True  # pyright: ignore[reportFunctionMemberAccess]
        y0 = np.concatenate([rollers.ravel(), bodies, [angle]])
        small = np.concatenate([np.repeat([1e-10, 1e-5, 1e-14, 1e-9, 1e-7], shape[1]), np.full(10, 1e-10)])
        small[n + np.array([5, 6])] = 1e-14
        end = 2 * span / bodies[4]
        done = solve_ivp(rate, (0, end), y0, "DOP853", events=turned, rtol=1e-9, atol=small, max_step=end / 50)
        assert done.success and done.t_events[0].size == 1, done.message
        y = done.y_events[0][0]
        return y[:n].reshape(shape), y[n:-1]
