"""The 0-1 test for chaos on a scalar strobe series: G. A. Gottwald and I. Melbourne, On the
implementation of the 0-1 test for chaos, SIAM J. Appl. Dyn. Syst. 8 (2009) 129-145.

The series phi(j) drives a walk in the plane, z_c(n) = sum_{j<=n} phi(j) exp(i j c). The walk stays
bounded where the series is regular and diffuses where it is chaotic, so that its mean-square
displacement D_c(n) grows linearly or not at all; K_c is the correlation of D_c(n) with n. No model,
no tangent vectors, no embedding: a second opinion on a Lyapunov exponent.

Limits. The series must be a map's: one value per revolution. A flow sampled many times per
oscillation is so correlated that chaos, too, reads near 0 (oversampling): take every q-th value.
100 values can read 0.9 on a period of 3, a torus still 0.5 at 300; 1000 and more are advisable.
Tori with a beat that is slow on the length of the series, and weak chaos (a logistic map with
exponent 0.18 reads 0.5 at 300 values, 0.8 at 1000, 0.97 at 3000), read in between. Transients must
have died out.
"""

import numpy as np
from jaxtyping import Float

from .._arguments import require_at_least
from .._errors import ArgumentError


CUT = 10
"""Displacements are formed over lags up to this fraction of the series (one tenth, as advised)."""
SHORTEST = 50
FREQUENCIES = (np.pi / 5, 4 * np.pi / 5)
"""Range of c: frequencies near 0 and pi resonate with means and period doublings."""


def mean_square_displacement(
    series: Float[np.ndarray, "*lanes n"], frequency: float
) -> Float[np.ndarray, "*lanes cut"]:
    """Mean-square displacement D_c(n) of the walk that a centred series drives, n = 1 to N/10.

    Centring removes the bounded oscillation V_osc = mean^2 (1 - cos n c)/(1 - cos c) that the paper
    subtracts afterwards (its modified displacement), and its cross terms, without loss of digits
    where the mean is large. Each lag averages over the same N - N/10 places; one FFT does them all.

    **Arguments:** series with zero mean; frequency c [rad per value].
    """
    n = series.shape[-1]
    cut = n // CUT
    places = n - cut
    walk = np.cumsum(series * np.exp(1j * frequency * np.arange(1, n + 1)), axis=-1)
    walk = walk - np.mean(walk, axis=-1, keepdims=True)
    # No wrap-around: a place plus a lag never exceeds the n - 1 of the last value.
    product = np.fft.fft(walk) * np.conj(np.fft.fft(walk[..., :places], n))
    lagged = np.fft.ifft(product).real[..., 1 : cut + 1]
    power = np.cumsum(np.abs(walk) ** 2, axis=-1)
    moved = power[..., places:] - power[..., :cut]  # sum of |z(j + n)|^2 over the places
    return (power[..., places - 1, None] + moved - 2 * lagged) / places


def _correlation(d: Float[np.ndarray, "*lanes cut"]) -> Float[np.ndarray, "*lanes"]:
    """Correlation of D_c(n) with n; 0 where D_c is constant."""
    lag = np.arange(d.shape[-1]) - (d.shape[-1] - 1) / 2
    d = d - np.mean(d, axis=-1, keepdims=True)
    size = np.sqrt(np.sum(d * d, axis=-1) * np.sum(lag * lag))
    still = size == 0
    return np.where(still, 0.0, np.sum(d * lag, axis=-1) / np.where(still, 1.0, size))


def zero_one(
    series: Float[np.ndarray, "*lanes n"],
    *,
    frequencies: int = 100,
    seed: int = 0,
    scale: float | int | None = None,
    tolerance: float | int = 1e-9,
) -> Float[np.ndarray, "*lanes"]:
    """The 0-1 test for chaos by the correlation method: K near 0 is regular, K near 1 chaotic.

    **Arguments:**

    - `series`: one scalar per revolution, e.g. a strobe coordinate, along the last axis; the other
        axes are lanes. At least 50 values, better 1000; the module says more on this.
    - `frequencies`: number of random c in (pi/5, 4 pi/5); K is the median, because single c
        resonate with the motion.
    - `seed`: of the random c; all lanes use the same ones.
    - `scale`: magnitude of the coordinate in the unit of the series (a cage: the clearance), by
        default the largest absolute value of each lane.
    - `tolerance`: a lane that scatters by less than `tolerance * scale` is a fixed point, K = 0:
        what is left of it is rounding error, which would read as chaos.

    **Returns:** K in [-1, 1] of each lane; NaN where the series is not finite.

    **Raises:** `ValueError` for a series or a number of frequencies that is too short.
    """
    require_at_least(0, seed=seed)
    n = np.atleast_1d(series).shape[-1]
    if n < SHORTEST:
        raise ArgumentError("series", said=f"must have at least {SHORTEST} values, but it has {n}.")
    require_at_least(1, frequencies=frequencies)
    finite = np.all(np.isfinite(series), axis=-1)
    safe = np.where(finite[..., None], series, 0.0)
    size = np.max(np.abs(safe), axis=-1) if scale is None else np.full(finite.shape, float(scale))
    centred = safe - np.mean(safe, axis=-1, keepdims=True)
    spread = np.std(centred, axis=-1)
    fixed = spread <= tolerance * size
    unit = centred / np.where(fixed, 1.0, spread)[..., None]
    c = np.random.default_rng(seed).uniform(*FREQUENCIES, frequencies)
    k = np.stack([_correlation(mean_square_displacement(unit, float(f))) for f in c])
    k = np.where(fixed, 0.0, np.median(k, axis=0))
    return np.where(finite, k, np.nan)
