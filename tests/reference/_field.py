"""The equations of motion of a dictionary of numbers: the cage in a rigid rib, or cage and rib.

M r_C'' = F_film + F_contact + F_support + F_impact + M e omega^2 (cos tau, sin tau) - M g y, physics page, section 4.
"""

import math
from typing import Any

import numpy as np

import jaxcage as jc
from jaxcage.files import configuration

from ._land import Number, land_force
from ._pulses import from_bearing, train
from ._statics import half_angle, hunt_crossley_number, viscosity


def numbers_of(model: jc.CageModel) -> dict[str, Any]:
    """Every declared parameter and choice of a model in SI units, nested as in its TOML file."""
    return configuration(model)


class Field:
    """dy/dtau of the state (coordinates, velocities) in SI units, at one speed [rad/s]."""

    def __init__(self, given: dict[str, Any], omega: float):
        film, contact, support, gap = given["film"], given["contact"], given["support"], given["guidance_gap"]
        c = gap if given["clearance_reading"] == "as_printed" else gap / 2
        radius, width = (given["bearing"]["rib_diameter"] - gap) / 2, film["land_width"]
        self.omega, self.clearance, self.mass, self.gravity = omega, c, given["cage_mass"], given["gravity"]
        self.rib = given["rib"] if given["rib"]["kind"] == "elastic" else None
        self.land = {
            "film": film["model"],
            "clearance": c,
            "scale": film["n_lands"] * viscosity(given["lubricant"]) * radius * width**3 / c**2,
            "supply": film["n_lands"] * radius * width * film["supply_pressure"],
            "centre": film["smoothing"] / c,
            "onset": contact["onset"],
            "touch": contact["smoothing"] / c,
            "stiffness": contact["stiffness"],
            "chi": hunt_crossley_number(contact["restitution"]),
            "approach": contact["approach_speed"],
        }
        k_x, k_y = support["stiffness_x"], support["stiffness_y"]
        absolute = support["cubic"] == "absolute"
        cubic = support["cubic_stiffness"] if absolute else support["cubic_ratio"] * (k_x + k_y) / 2 / c**2
        self.support = (k_x, k_y, cubic, support["damping"], support["cross_stiffness"], support["cross_cubic"])
        self.circulatory = support["cross"] == "circulatory"
        # (20) prints 2 M rho omega^2 with rho = e/C_r, a number that is read in the unit given.
        lever = given["eccentricity"] * (1 if given["unbalance"] == "physical" else 2 * given["printed_unit"] / gap)
        self.turning = self.mass * lever * omega**2
        impact = given["impact"]
        if impact["kind"] == "synchronous":
            self.push, self.train = (
                impact["amplitude"] * (omega / impact["reference_speed"]) ** impact["exponent"],
                None,
            )
        elif impact["kind"] == "from_bearing":
            self.push, self.train = from_bearing(given, omega), None
        else:
            self.train = train(given, omega, half_angle(given["bearing"], given["load"]))
            self.orders = 1j * given["bearing"]["n_rollers"] * np.arange(self.train.shape[1])

    @property
    def coordinates(self) -> int:
        """Two of the cage, and two of an elastic rib."""
        return 4 if self.rib else 2

    @property
    def scale(self) -> np.ndarray:
        """One clearance, and one clearance times the speed."""
        n = self.coordinates
        return np.repeat([self.clearance, self.clearance * self.omega], n)

    def __call__(self, tau: float, state: Any) -> list[Number]:
        """dy/dtau at phase tau; a complex state carries a tangent in its imaginary part."""
        n = self.coordinates
        q, v = state[:n], state[n:]
        if self.rib is None:
            force = self.held(q[0], q[1], v[0], v[1])
            forces, masses = self.on_cage(tau, force), (self.mass, self.mass)
        else:
            force = self.held(q[0] - q[2], q[1] - q[3], v[0] - v[2], v[1] - v[3])
            forces = (*self.on_cage(tau, force), *self.on_rib(self.rib, force, q, v))
            masses = (self.mass, self.mass, self.rib["mass"], self.rib["mass"])
        rates = [f / m for f, m in zip(forces, masses, strict=True)]
        return [x / self.omega for x in (*v, *rates)]

    def held(self, x: Number, y: Number, vx: Number, vy: Number) -> tuple[Number, Number]:
        """Forces that act between cage and rib, on the cage [N]: film, contact and the support of (16) and (20)."""
        c = self.clearance
        f_x, f_y = land_force(self.land, x / c, y / c, vx / c, vy / c, self.omega)
        k_x, k_y, cubic, damping, cross, cross_cubic = self.support
        hard = cubic * (x * x + y * y)
        f_x -= (k_x + hard) * x + damping * vx
        f_y -= (k_y + hard) * y + damping * vy
        if self.circulatory:
            return f_x - cross * y, f_y + cross * x
        return f_x - cross * y - cross_cubic * y**3, f_y - cross * x - cross_cubic * x**3

    def impact(self, tau: float) -> tuple[float, float]:
        """Rollers on the cage [N]: (15), or one by one."""
        if self.train is None:
            return self.push * math.sin(tau), 0.0
        f_x, f_y = np.real(self.train @ np.exp(self.orders * tau))
        return float(f_x), float(f_y)

    def on_cage(self, tau: float, force: tuple[Number, Number]) -> tuple[Number, Number]:
        """With impact, unbalance and weight [N]."""
        i_x, i_y = self.impact(tau)
        f_x = force[0] + i_x + self.turning * math.cos(tau)
        return f_x, force[1] + i_y + self.turning * math.sin(tau) - self.mass * self.gravity

    def on_rib(self, rib: dict[str, Any], force: tuple[Number, Number], q: Any, v: Any) -> tuple[Number, Number]:
        """Reaction, support and weight of an elastic rib [N]."""
        hard = rib["stiffness"] + rib["cubic_stiffness"] * (q[2] * q[2] + q[3] * q[3])
        f_x = -force[0] - hard * q[2] - rib["damping"] * v[2]
        return f_x, -force[1] - hard * q[3] - rib["damping"] * v[3] - rib["mass"] * self.gravity

    def excursion(self, state: Any) -> Any:
        """Eccentricity ratio of a state, or of states along the last axis."""
        rib = (state[2], state[3]) if self.rib else (0.0, 0.0)
        return np.hypot(np.hypot(state[0] - rib[0], state[1] - rib[1]) / self.clearance, self.land["centre"])


def field(model: jc.CageModel, omega: float) -> Field:
    """The reference's field of a model at a speed [rad/s]."""
    return Field(numbers_of(model), omega)
