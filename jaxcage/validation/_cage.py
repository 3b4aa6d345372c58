"""The cage as a whole: where the answer is a closed form, and beside the same equations integrated by SciPy."""

import math

import jax.numpy as jnp
import numpy as np
from scipy.integrate import solve_ivp

from .._parameters import replace, with_values
from .._recent import jitted
from .._types import Scalar, State
from ..analysis import equilibrium, film_whirl_speed
from ..bearing import PUBLISHED_CASES
from ..forces import cubic_stiffness
from ..integrate import method, simulate, strobe_map
from ..models import CageModel, case
from ..sweeps import sweep
from ._comparison import Comparison, within, within_share


JEFFCOTT = "H. H. Jeffcott, Phil. Mag. 37 (1919) 304: unbalance response of a mass on springs"
NEWKIRK = "B. L. Newkirk and H. D. Taylor, General Electric Review 28 (1925) 559: oil whirl at half speed"
ROUTH = "short film of vanishing load: omega = sqrt(24/pi) sqrt(g/c)"
DAMPING = "mean divergence, -2 B/M times the period, exact"
SCIPY = "(16)-(27) in polar form in NumPy, film by quadrature of the pressure (26), integrated by SciPy's DOP853"

RPM = math.pi / 30
BEYOND_SPRINGS = "cubic_stiffness", "cubic_ratio", "cross_stiffness"
"""What a support has beyond two springs and a damper."""


def cage_comparisons() -> list[Comparison]:
    """All comparisons of the cage."""
    return [*_unbalance(), *_divergence(), *_whirl(), *_another_integration()]


def _bare(**changes: float) -> CageModel:
    """A cage on linear springs without film, weight and impacts."""
    none = dict.fromkeys(("gravity", "amplitude", *BEYOND_SPRINGS), 0.0)
    return with_values(replace(case("1a"), unbalance="physical", **(none | changes)), {"land_width": 1e-7})


def _unbalance() -> list[Comparison]:
    """Steady position at phase 0 below and above resonance: r = e w^2/(K/M - w^2 + i w B/M)."""
    mass, stiffness, damping, arm = 0.25, 4e4, 20.0, 30e-6
    model = _bare(cage_mass=mass, stiffness_x=stiffness, stiffness_y=stiffness, damping=damping, eccentricity=arm)
    rows = []
    for share in (0.8, 1.5):
        speed = share * math.sqrt(stiffness / mass)
        run = simulate(model, speed, revolutions=1, discard=120, samples=1, start=(0.0, 0.0, 0.0, 0.0))
        exact = arm * speed**2 / (stiffness / mass - speed**2 + 1j * speed * damping / mass)
        for axis, theirs, ours in (("x", exact.real, run.state[0, 0]), ("y", exact.imag, run.state[0, 1])):
            what = f"unbalance response at {share} of resonance, {axis} at phase 0 [um]"
            rows.append(within_share(what, JEFFCOTT, 1e6 * theirs, 1e6 * ours, 1e-5))
    return rows


def _divergence() -> list[Comparison]:
    model, speed = with_values(replace(case("1a"), restitution=1.0), {"land_width": 1e-7}), 15000 * RPM
    options = dict(exponents=4, blocks=10, keep=1, method=method(steps=2048), confirm=False, horizon=0)
    found = sweep(model, np.array([speed]), discard=20, revolutions=50, **options)  # pyright: ignore
    theirs = -2 * float(model.support.damping / model.cage_mass) * 2 * math.pi / speed
    ours = found.exponents.sum(axis=-1).mean()
    return [within_share("case 1a without film at 15000 rpm: sum of the four exponents", DAMPING, theirs, ours, 1e-3)]


def _in_film(**changes: float) -> CageModel:
    """A cage in its film under its weight alone."""
    none = dict.fromkeys(("stiffness_x", "stiffness_y", "damping", "eccentricity", "amplitude", *BEYOND_SPRINGS), 0.0)
    return replace(case("1a"), gravity=9.81, **(none | changes))


def _whirl() -> list[Comparison]:
    rows = []
    for gap in (0.45e-3, 0.60e-3):
        light = with_values(_in_film(guidance_gap=gap), {"cage_mass": 1e-6})
        theirs = math.sqrt(24 / math.pi * 9.81 / gap) / RPM
        ours = float(film_whirl_speed(light)) / RPM
        rows.append(
            within_share(f"whirl threshold of a light cage, gap {1e3 * gap:g} mm [rpm]", ROUTH, theirs, ours, 1e-4)
        )
    model = with_values(_in_film(), {"cage_mass": 1e-5})
    speed = float(film_whirl_speed(model)) * 1.01
    at = equilibrium(model, speed)
    start = (*(float(c) for c in at.coordinates), 1e-3 * float(model.clearance) * speed, 0.0)
    run = simulate(model, speed, revolutions=40, discard=10, samples=16, start=start, method=method(steps=256))
    away = run.state[:, :2] - np.asarray(at.coordinates)
    turned = np.unwrap(np.arctan2(away[:, 1], away[:, 0]))
    ratio = (turned[-1] - turned[0]) / (run.tau[-1] - run.tau[0])
    return [*rows, within("whirl of a light cage over its speed, simulated", NEWKIRK, 0.5, ratio, 0.005)]


ALPHA = np.linspace(0, np.pi, 401)


class _Polar:
    """The published case 1a in NumPy; constants are read off the model, formulas are not."""

    def __init__(self, model: CageModel, speed: float):
        s, film, self.w = model.support, model.film, speed
        self.c, self.m, self.g = float(model.clearance), float(model.cage_mass), float(model.gravity)
        self.radius, self.width = (0.0921 - float(model.guidance_gap)) / 2, float(film.land_width)
        self.oil, self.lands = float(model.lubricant.dynamic_viscosity), film.n_lands
        self.k = np.array([float(s.stiffness_x), float(s.stiffness_y)])
        mean = float(self.k.mean())
        self.cubic = float(cubic_stiffness(s.cubic, s.cubic_stiffness, s.cubic_ratio, mean, self.c))
        self.cross, self.b = float(s.cross_stiffness), float(s.damping)
        law = model.impact
        self.push = float(law.amplitude * (speed / law.reference_speed) ** law.exponent)  # pyright: ignore
        self.arm = float(model.cage_at(speed).law("unbalance").unbalance) / self.m

    def film(self, r: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Minus the integral of p n over the half arc behind the line of centres, Simpson's rule."""
        distance = float(np.hypot(*r))
        n = r / distance
        t = np.array([-n[1], n[0]])
        eps, rate, turn = distance / self.c, float(v @ n) / self.c, float(v @ t) / distance
        thick = 1 + eps * np.cos(ALPHA)  # from the widest gap, opposite to the displacement
        drive = (self.w - 2 * turn) * eps * np.sin(ALPHA) - 2 * rate * np.cos(ALPHA)
        mean = 3 * self.oil * (self.width / self.c) ** 2 * drive / thick**3 / 6
        weight = np.full(ALPHA.size, 2.0)
        weight[1::2], weight[[0, -1]] = 4.0, 1.0
        weight *= (ALPHA[1] - ALPHA[0]) / 3 * self.radius * self.width * self.lands
        return np.sum(weight * mean * np.cos(ALPHA)) * n + np.sum(weight * mean * np.sin(ALPHA)) * t

    def rates(self, tau: float, y: np.ndarray) -> np.ndarray:
        r, v = y[:2], y[2:]
        spring = -(self.k + self.cubic * (r @ r)) * r + self.cross * np.array([-r[1], r[0]]) - self.b * v
        turning = self.m * self.arm * self.w**2 * np.array([math.cos(tau), math.sin(tau)])
        outside = np.array([self.push * math.sin(tau), -self.m * self.g])
        return np.concatenate([v, (self.film(r, v) + spring + turning + outside) / self.m]) / self.w


@jitted
def _half_a_revolution(model: CageModel, speed: Scalar, start: State) -> State:
    return strobe_map(model, speed, method(steps=1024)).part(start, 0, 2).y


def _another_integration() -> list[Comparison]:
    """Half a revolution off the rib; contact is compared in the contact's own topic."""
    rows = []
    for name in PUBLISHED_CASES:
        model, speed = case(name), 9000 * RPM
        c = float(model.clearance)
        start = np.array([0.2 * c, 0.1 * c, 0.0, 0.0])
        other = _Polar(model, speed)
        unit = np.array([c, c, c * speed, c * speed])
        done = solve_ivp(
            lambda tau, z: other.rates(tau, z * unit) / unit,
            (0.0, math.pi),
            start / unit,
            method="DOP853",
            rtol=1e-10,
            atol=1e-11,
        )
        ours = _half_a_revolution(model, jnp.asarray(speed), tuple(jnp.asarray(s) for s in start))
        for i, axis in enumerate("xy"):
            what = f"case {name}, 9000 rpm, {axis} over clearance after half a revolution"
            rows.append(within(what, SCIPY, done.y[i, -1], float(ours[i]) / c, 1e-6))
    return rows
