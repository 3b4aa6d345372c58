"""Spectra of Lorenz's and Roessler's systems as J. C. Sprott prints them (Common Chaotic Systems).

They have no period: a unit of time, or a phase of 2 pi, takes its place; exponents are those per unit of time.
"""

import math

import numpy as np
import pytest
from helpers import raw_sweep

import jaxcage as jc
from jaxcage.validation import LORENZ, LORENZ_DIMENSION, ROESSLER, Number


def lorenz(rho):
    def rates(tau, y, speed):
        return (10 * (y[1] - y[0]), y[0] * (rho - y[2]) - y[1], y[0] * y[1] - 8 / 3 * y[2])

    return rates


def roessler(tau, y, speed):
    return (-y[1] - y[2], y[0] + 0.2 * y[1], 0.2 + y[2] * (y[0] - 5.7))


def spectrum(rates, speed, centre, steps, revolutions, discard=50, starts=64):
    cloud = np.asarray(centre) + np.random.default_rng(1).uniform(-1, 1, (starts, 3))
    found = raw_sweep(
        jc.ForcedSystem(rates, dimension=3),
        np.array([speed]),
        starts=[tuple(map(float, s)) for s in cloud],
        discard=discard,
        revolutions=revolutions,
        exponents=3,
        blocks=10,
        keep=1,
        method=jc.method("rodas4", steps=steps),
    )
    assert not np.any(found.failed)
    return found.exponents[0].mean(axis=0) * speed / (2 * math.pi)


def agrees(found, known: tuple[Number, ...]):
    for ours, theirs in zip(found, known, strict=True):
        assert ours == pytest.approx(theirs.value, abs=theirs.tolerance)


@pytest.mark.wide
def test_lorenz():
    """The sum is the divergence -41/3, exactly."""
    found = spectrum(lorenz(28.0), 2 * math.pi, (5.0, 5.0, 25.0), 256, 400)
    agrees(found, LORENZ)
    assert found.sum() == pytest.approx(-41 / 3, abs=1e-5)
    dimension = 2 + found[0] / abs(found[2])
    assert dimension == pytest.approx(LORENZ_DIMENSION.value, abs=LORENZ_DIMENSION.tolerance)  # Kaplan and Yorke's


@pytest.mark.wide
def test_roessler():
    found = spectrum(roessler, 1.0, (0.0, -5.0, 0.0), 512, 300, discard=20)
    agrees(found, ROESSLER)
