"""Constants found from edges: planted ones come back with honest intervals, and what cannot be known is called so.

A double-well oscillator m x'' + d x' - k x + b x^3 = s g cos(w t) loses its small orbit by period doubling, at a speed
that depends on the forcing g, which differs from case to case. Its five constants have two symmetries: the equation
multiplied by a number, and x in another unit. Edges can therefore fix three combinations of them, not five constants.
"""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import pytest

import jaxcage as jc
from jaxcage._parameters import parameter
from jaxcage.design._fit import NORMAL_95, determined
from jaxcage.design._measured import inside_zones


METHOD = jc.method("rodas4", steps=64)
TRUTH = {"mass": 1.0, "damping": 0.3, "stiffness": 1.0, "cubic": 1.0, "gain": 1.0}
FORCING = (0.24, 0.25, 0.262, 0.275, 0.29, 0.305)
BOUNDS = [jc.Unknown(name, value / 4, value * 4) for name, value in TRUTH.items()]


class DoubleWell(eqx.Module):
    mass: float = parameter("kg", 0.0, 1e3, "m")
    damping: float = parameter("N s/m", 0.0, 1e3, "d")
    stiffness: float = parameter("N/m", 0.0, 1e3, "k")
    cubic: float = parameter("N/m^3", 0.0, 1e3, "b")
    gain: float = parameter("1", 0.0, 1e3, "s")
    forcing: float = parameter("N", 0.0, 1e3, "g")

    def __call__(self, tau, q, v, speed):
        (x,), (u,) = q, v
        push = self.gain * self.forcing * jnp.cos(tau)
        return ((push - self.damping * u + self.stiffness * x - self.cubic * x**3) / self.mass,)


def cases():
    made = {f"g={g}": jc.ForcedOscillator(DoubleWell(**TRUTH, forcing=g), coordinates=1) for g in FORCING}
    return made


@pytest.fixture(scope="module")
def located():
    """Both period doublings of every case: the small orbit is lost between them."""
    points, names = [], []
    guess = (np.array([0.41751, 0.32921]), 1.2)
    for case, system in cases().items():
        found = jc.branches(system, "speed", [(0.6, 1.9)], guess) if False else None
        del found
        for end, at in (("onset", 0.9), ("exit", 1.25)):
            point = jc.bifurcation(system, "period-doubling", (jnp.asarray(guess[0]), at), method=METHOD)
            points.append(point)
            names.append((case, f"zone 1 {end}"))
    return points, names
