"""Random legal models by seed, near the paper's case 1a or over all that may be given."""

import math
from collections.abc import Iterator

import numpy as np

import jaxcage as jc
from jaxcage.models import CageModel

from ._field import Field


CHOICES = {
    "film.model": ("fixed_half", "positive_pressure", "full"),
    "clearance_reading": ("as_printed", "radial"),
    "unbalance": ("physical", "as_printed"),
    "support.cross": ("circulatory", "as_printed"),
    "support.cubic": ("absolute", "dimensionless"),
    "film.n_lands": (1, 2, 3, 4),
}
KEPT = ("temperature_1", "temperature_2", "reference_viscosity", "reference_speed", "printed_unit", "palmgren_constant")
BEARING = (
    *("bore", "outside_diameter", "width", "roller_diameter", "roller_length", "rib_diameter"),
    *("inner_raceway_diameter", "radial_clearance", "pocket_clearance"),
)
"""Lengths of the bearing: they must go together, and are scaled as one."""
USUAL = {"cubic_ratio": 16.0, "cross_cubic": 1e12}
NARROW = {"onset": (0.9, 0.98), "restitution": (0.5, 1.0), "exponent": (1.0, 2.0), "supply_pressure": (1e2, 1e5)}
SPANS = {"temperature": (300.0, 390.0)}
"""Beyond its two points the line of viscosity runs off to nothing and to solids."""
FACTOR = 5.0
DECADES = 9
"""Decades below the end of a range that begins at zero, or runs through it, in which numbers are drawn."""
SPEEDS = {False: (2500.0, 27500.0), True: (300.0, 60000.0)}
"""Ranges of speed of narrow and wide models [rpm]."""


def random_model(seed: int, wide: bool = False) -> CageModel:
    """A legal model: narrow ones have most parameters within a factor of five of those of case 1a, wide ones anything
    in the declared ranges, logarithmically where these span decades. Both take all choices but the finite film.
    """
    rng = np.random.default_rng([seed, wide])
    model = jc.case("1a")
    if rng.random() < 0.25:
        rib = jc.forces.ElasticRib(mass=1.0, stiffness=5e7, damping=500.0, cubic_stiffness=1e13)
        model = jc.replace(model, rib=rib)
    if rng.random() < 0.25:
        model = jc.replace(model, impact=jc.forces.RollerPassImpact(jc.forces.PocketImpact()))
    model = jc.replace(model, **{name: options[rng.integers(len(options))] for name, options in CHOICES.items()})
    drawn = (_wide if wide else _narrow)(rng, model)
    size = math.exp(rng.uniform(-1, 1) * math.log(FACTOR if wide else 1.5))
    lengths = {name: size * float(jc.parameters(model)[name]) for name in BEARING}
    clearance = drawn["guidance_gap"] / (1 if model.clearance_reading == "as_printed" else 2)
    for name in ("contact.smoothing", "film.smoothing"):
        drawn[name] = min(drawn[name], 0.09 * clearance)
    drawn["viscosity_2"], drawn["viscosity_1"] = sorted((drawn["viscosity_1"], drawn["viscosity_2"]))  # of a warm oil
    model = jc.replace(model, **(drawn | lengths))
    return jc.replace(model, **{"bearing.n_rollers": int(rng.integers(8, 14))})


def _drawn(model: CageModel) -> Iterator[tuple[str, float, float, float]]:
    """Name, value and range of every parameter that is drawn."""
    values = jc.parameters(model)
    for name, info in jc.parameter_info(model).items():
        if name not in (*BEARING, *KEPT):
            lower, upper = SPANS.get(name, (info.lower, info.upper))
            yield name, float(values[name]), lower, upper


def _narrow(rng: np.random.Generator, model: CageModel) -> dict[str, float]:
    """Within a factor of `FACTOR` of what `model` has; what has no size of its own from `NARROW`."""
    found = {}
    for name, value, lower, upper in _drawn(model):
        if name in NARROW:
            found[name] = rng.uniform(*NARROW[name])
        else:
            value = USUAL.get(name, value) * FACTOR ** rng.uniform(-1, 1)
            found[name] = min(max(value, lower), upper)
    if rng.random() < 0.5:
        found["supply_pressure"] = 0.0
    return found


def _wide(rng: np.random.Generator, model: CageModel) -> dict[str, float]:
    """Anywhere in the declared ranges."""
    found = {}
    for name, _, lower, upper in _drawn(model):
        if lower > 0 and upper <= 100 * lower or upper in (4.0, 100.0):
            found[name] = rng.uniform(lower, upper)
        else:
            low = lower if lower > 0 else upper * 10.0**-DECADES
            sign = rng.choice([-1, 1]) if lower < 0 else 1
            absent = lower <= 0 and name != "load" and rng.random() < 0.1
            found[name] = 0.0 if absent else sign * math.exp(rng.uniform(math.log(low), math.log(upper)))
    return found


def random_speeds(seed: int, count: int, wide: bool = False, fastest: float = math.inf) -> np.ndarray:
    """Ascending cage speeds [rad/s], logarithmically spread up to the `fastest` that this cage may run."""
    low, high = SPEEDS[wide]
    low, high = math.log(low), math.log(min(high, fastest * 30 / math.pi))
    return np.sort(np.exp(np.random.default_rng([seed, wide, 1]).uniform(low, high, count))) * math.pi / 30


def random_state(seed: int, field: Field, reach: float) -> np.ndarray:
    """A state with an eccentricity ratio up to `reach`, an elastic rib close to its centre, and velocities of the order
    of a clearance in a radian.
    """
    rng = np.random.default_rng([seed, 2])
    n = field.coordinates
    state = rng.normal(scale=0.3, size=2 * n)
    state[2:n] *= 0.1
    eps, phi = reach * rng.random() ** 0.5, rng.uniform(-math.pi, math.pi)
    state[:2] = eps * np.array([math.cos(phi), math.sin(phi)])
    if n == 4:
        state[:2] += state[2:4]
    return state * field.scale
