"""Points that fill a box evenly, for designs and draws."""

import math

import numpy as np
from jaxtyping import Float


def sobol(unknowns: int, draws: int, seed: int | np.random.Generator) -> Float[np.ndarray, "draws unknowns"]:
    """Scrambled Sobol points between 0 and 1."""
    from scipy.stats import qmc  # takes half a second to load

    return qmc.Sobol(unknowns, rng=seed).random_base2(math.ceil(math.log2(draws)))[:draws]
