"""Reported quantities: name, symbol, SI unit, description and display unit; results as HTML.

They label the axes of figures, the variables of data sets and the columns of tables and CSV files. A model declares its
own (`AbstractForcedSystem.quantities`), with the function that computes each from averages over a run.
"""

import dataclasses
import html
import re
from collections.abc import Callable, Mapping
from typing import Any, Literal

import numpy as np
from jaxtyping import Float


@dataclasses.dataclass(frozen=True)
class Averages:
    """Integrals and maxima over intervals of a run, by the names that the model gives them."""

    integrals: Mapping[str, np.ndarray]
    """Integrals over time [SI], including `time` itself."""
    largest: Mapping[str, np.ndarray]
    numbers: Mapping[str, np.ndarray]
    """Reference values of each lane, from the model's `reference`."""
    revolutions: float | int
    """Length of an interval in revolutions."""

    def mean(self, name: str) -> np.ndarray:
        return self.integrals[name] / self.integrals["time"]

    def per_revolution(self, name: str) -> np.ndarray:
        return self.integrals[name] / self.revolutions


@dataclasses.dataclass(frozen=True)
class Quantity:
    """Reported quantity: name, symbol, SI unit and description."""

    name: str
    symbol: str
    unit: str
    text: str
    shown_in: str = ""
    """Display unit; empty for the SI unit."""
    of: Callable[[Any], Any] | None = None
    """Function that computes it from `Averages`."""
    overall: Literal["whole", "mean"] = "whole"
    """Value of a run: from averages over the whole run, or the mean over its blocks."""

    @property
    def shown_unit(self) -> str:
        return self.shown_in or self.unit

    @property
    def label(self) -> str:
        """Axis label with the display unit."""
        unit = f" [{self.shown_unit}]" if self.shown_unit != "1" else ""
        return f"{self.text[:1].upper()}{self.text[1:]} {self.symbol}{unit}"

    @property
    def factor(self) -> float:
        """Factor from the SI unit to `shown_unit`."""
        return _FACTORS[self.shown_in]


def averaged(
    quantities: tuple[Quantity, ...],
    beside: tuple[str, ...],
    watched: tuple[str, ...],
    integrals: Float[np.ndarray, "lanes blocks beside"],
    largest: Float[np.ndarray, "lanes blocks watched"],
    numbers: Mapping[str, Float[np.ndarray, " lanes"]],
    block: float | int,
) -> list[tuple[Quantity, Float[np.ndarray, " lanes"], Float[np.ndarray, "lanes blocks"]]]:
    """Each quantity with its value over a whole run and in each of its blocks.

    **Arguments:** quantities; names of the integrals and of the maxima; both per block; lanes' reference values;
    revolutions per block.
    """
    named = lambda names, values: {name: values[..., i] for i, name in enumerate(names)}
    wide = {name: x[:, None] for name, x in numbers.items()}
    of_blocks = Averages(named(beside, integrals), named(watched, largest), wide, block)
    sums, peaks = integrals.sum(axis=1), largest.max(axis=1) if largest.shape[1] else largest.sum(axis=1)
    of_all = Averages(named(beside, sums), named(watched, peaks), numbers, block * integrals.shape[1])
    found = []
    for each in quantities:
        assert each.of is not None
        blocks = np.asarray(each.of(of_blocks))
        found.append((each, np.asarray(each.of(of_all)) if each.overall == "whole" else blocks.mean(axis=1), blocks))
    return found


_FACTORS = {"": 1.0, "mm": 1e3, "mm/s": 1e3, "ms": 1e3, "rpm": 30 / np.pi}
_MM, _MM_S, _MS, _RPM = "mm", "mm/s", "ms", "rpm"

_QUANTITIES = (
    Quantity("speed", r"$\omega$", "rad/s", "cage speed", _RPM),
    Quantity("speed_rpm", r"$n$", "rpm", "cage speed"),
    Quantity("time", r"$t$", "s", "time", _MS),
    Quantity("tau", r"$\tau$", "rad", "phase"),
    Quantity("x_C", r"$X_C$", "m", "horizontal displacement", _MM),
    Quantity("y_C", r"$Y_C$", "m", "vertical displacement", _MM),
    Quantity("x_O", r"$X_O$", "m", "horizontal rib displacement", _MM),
    Quantity("y_O", r"$Y_O$", "m", "vertical rib displacement", _MM),
    Quantity("vx_C", r"$X_C'$", "m/s", "horizontal velocity", _MM_S),
    Quantity("vy_C", r"$Y_C'$", "m/s", "vertical velocity", _MM_S),
    Quantity("vx_O", r"$X_O'$", "m/s", "horizontal rib velocity", _MM_S),
    Quantity("vy_O", r"$Y_O'$", "m/s", "vertical rib velocity", _MM_S),
    Quantity("strobe", "", "SI", "strobe states, the last ones of each lane"),
    Quantity("last", "", "SI", "state at the end of the run"),
    Quantity("scale", "", "SI", "characteristic magnitude of each state component"),
    Quantity("block_growth", "", "1", "mean logarithmic growth per revolution in each block"),
    Quantity("exponent", r"$\lambda$", "1", "Lyapunov exponent per revolution"),
    Quantity("largest_exponent", r"$\lambda_1$", "1", "largest exponent per revolution"),
    Quantity("standard_error", r"$s_\lambda$", "1", "standard error of the exponents"),
    Quantity("peak", r"$\epsilon$", "1", "largest excursion observed (cage: eccentricity ratio; own system: 0)"),
    Quantity("error", "", "1", "largest error of a revolution, in units of the scale"),
    Quantity("doubt", "", "1", "error of the exponents that the scatter of the blocks does not show"),
    Quantity("steps", "", "1", "mean number of steps of a revolution"),
    Quantity("escape", "", "1", "revolutions of the run after which a lane is calm, infinite if chaotic to the end"),
    Quantity("outcome", "", "1", "how the integration of each lane ended"),
    Quantity("label", "", "1", "kind of motion of each lane"),
    Quantity("chaotic_share", "", "1", "share of the finished lanes that are chaotic while observed"),
)

GLOSSARY: dict[str, Quantity] = {quantity.name: quantity for quantity in _QUANTITIES}


def quantity(name: str) -> Quantity:
    """Quantity by name; a name that is not listed stands for itself, without a unit."""
    return GLOSSARY.get(name, Quantity(name, "", "1", name.replace("_", " ")))


_COMPONENTS = {
    4: ("x_C", "y_C", "vx_C", "vy_C"),
    8: ("x_C", "y_C", "x_O", "y_O", "vx_C", "vy_C", "vx_O", "vy_O"),
}


def component_names(dimension: int) -> tuple[str, ...]:
    """Names of the state components of a cage; those of other systems are numbered."""
    return _COMPONENTS.get(dimension) or tuple(f"y{i}" for i in range(dimension))


def notebook_html(self: Any) -> str:
    """`str(self)` as HTML: a heading, then rows split at gaps and after colons. Classes use it as method
    `_repr_html_`."""
    head, *lines = str(self).splitlines() or [""]
    rows = [re.split(r"\s{2,}|(?<=:)\s", line.strip()) for line in lines]
    cells = [[f'<td style="text-align: left">{html.escape(cell)}</td>' for cell in row] for row in rows]
    body = "".join(f"<tr>{''.join(row)}</tr>" for row in cells)
    table = f"<table><tbody>{body}</tbody></table>" if rows else ""
    return f"<div><strong>{html.escape(head)}</strong>{table}</div>"
