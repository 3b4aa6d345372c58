"""Everyone who takes part, each with its ladder of settings from cheap to tight."""

from collections.abc import Callable, Sequence
from typing import Any, Protocol

import numpy as np

from .problem import Problem
from .rivals_c import CRosenbrock
from .rivals_diffrax import Diffrax
from .rivals_jaxcage import Jaxcage
from .rivals_numba import Numba
from .rivals_scipy import SciPy


class Rival(Protocol):
    """A way of advancing lanes by revolutions."""

    @property
    def name(self) -> str: ...

    @property
    def settings(self) -> Sequence[Any]:
        """Steps per revolution or tolerances, from cheap to tight."""
        ...

    @property
    def tight(self) -> Any:
        """The setting at which it must agree with the reference to `agree` clearances."""
        ...

    @property
    def agree(self) -> float: ...

    @property
    def lanes(self) -> int:
        """Lanes of a timed call."""
        ...

    @property
    def revolutions(self) -> int:
        """Revolutions of a timed call."""
        ...

    def missing(self) -> str | None:
        """Why it cannot take part, in a word or two."""
        ...

    def prepare(self, cores: int) -> None:
        """Compile and start processes, for so many cores."""
        ...

    def on(self, problem: Problem) -> Callable[[int, Any], np.ndarray]:
        """The function (revolutions, setting) -> end states, shape (lanes, 4), for these lanes."""
        ...

    def close(self) -> None: ...


def all_rivals() -> list[Rival]:
    """For the full run."""
    return [
        Jaxcage("default", None, (None,), None),
        Jaxcage("controlled", "controlled", (3e-2, 1e-2, 3e-3, 1e-3), 8192),
        Jaxcage("rk4", "rk4", (256, 384, 512), 8192),
        Jaxcage("rodas4", "rodas4", (256, 320, 448), 8192),
        Jaxcage("rodas3", "rodas3", (512, 768), 16384),
        Jaxcage("rodas4 adaptive", "rodas4", (1e-4, 1e-5), 1e-9),
        Jaxcage("tsit5 adaptive", "tsit5", (1e-4, 1e-5), 1e-10),
        Diffrax("Kvaerno3", (1e-4, 3e-5, 1e-5, 1e-6), 1e-9, 512, 2),
        Diffrax("Kvaerno5", (1e-3, 3e-4, 1e-4, 1e-5), 1e-9, 512, 2),
        # Its cost explodes with the tolerance: 130 ms a revolution at 1e-7. So it is held to less.
        Diffrax("KenCarp4", (1e-4, 3e-5, 1e-5), 1e-7, 512, 2, agree=1e-5),
        Diffrax("Tsit5", (1e-4, 3e-5, 1e-5, 7e-6, 5e-6, 3e-6, 1e-6), 1e-10, 2048, 4),
        SciPy("LSODA", (1e-4, 1e-5, 3e-6, 2e-6, 1e-6, 1e-7), 1e-12, 1024, 4),
        SciPy("Radau", (1e-4, 3e-5, 1e-5), 1e-9, 64, 1),
        Numba("rodas4", (256, 320, 448)),
        Numba("rk4", (256, 384, 512)),
        CRosenbrock("rodas4", (128, 192, 256, 320, 384, 448, 512)),
        CRosenbrock("rodas3", (256, 512, 768, 1024)),
        CRosenbrock("rk4", (128, 192, 256, 320, 384, 448, 512)),
    ]


def few_rivals() -> list[Rival]:
    """For `--quick`."""
    return [
        Jaxcage("default", None, (None,), None),
        Jaxcage("rk4", "rk4", (384,), 8192),
        Diffrax("Tsit5", (1e-5, 5e-6, 3e-6), 1e-10, 512, 4),
        SciPy("LSODA", (1e-6,), 1e-12, 128, 4),
        Numba("rk4", (384,)),
        CRosenbrock("rodas4", (256, 448)),
        CRosenbrock("rk4", (256, 384)),
    ]
