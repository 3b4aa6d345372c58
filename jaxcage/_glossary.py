"""One glossary of outputs: name, symbol, SI unit, words, and the unit in which people read it.

It feeds the axes of plots, the attributes of data sets, the heads of tables and of CSV columns.
"""

import dataclasses

import numpy as np


@dataclasses.dataclass(frozen=True)
class Quantity:
    """An output: name, symbol, SI unit, words, and the unit and factor in which it is shown."""

    name: str
    symbol: str
    unit: str
    text: str
    shown_in: str = ""
    factor: float = 1.0

    @property
    def shown_unit(self) -> str:
        """Unit on axes and in tables."""
        return self.shown_in or self.unit

    @property
    def label(self) -> str:
        """Axis label with the unit it is shown in."""
        unit = f" [{self.shown_unit}]" if self.shown_unit != "1" else ""
        return f"{self.text[:1].upper()}{self.text[1:]} {self.symbol}{unit}"


_MM = ("mm", 1e3)
_MM_S = ("mm/s", 1e3)
_MS = ("ms", 1e3)
_RPM = ("rpm", 30 / np.pi)

_QUANTITIES = (
    Quantity("speed", r"$\omega$", "rad/s", "cage speed", *_RPM),
    Quantity("speed_rpm", r"$n$", "rpm", "cage speed"),
    Quantity("time", r"$t$", "s", "time", *_MS),
    Quantity("tau", r"$\tau$", "rad", "phase"),
    Quantity("x_C", r"$X_C$", "m", "horizontal displacement", *_MM),
    Quantity("y_C", r"$Y_C$", "m", "vertical displacement", *_MM),
    Quantity("x_O", r"$X_O$", "m", "horizontal rib displacement", *_MM),
    Quantity("y_O", r"$Y_O$", "m", "vertical rib displacement", *_MM),
    Quantity("vx_C", r"$X_C'$", "m/s", "horizontal velocity", *_MM_S),
    Quantity("vy_C", r"$Y_C'$", "m/s", "vertical velocity", *_MM_S),
    Quantity("vx_O", r"$X_O'$", "m/s", "horizontal rib velocity", *_MM_S),
    Quantity("vy_O", r"$Y_O'$", "m/s", "vertical rib velocity", *_MM_S),
    Quantity("strobe", "", "SI", "strobe states, the last ones of each lane"),
    Quantity("last", "", "SI", "state at the end of the run"),
    Quantity("scale", "", "SI", "characteristic magnitude of each state component"),
    Quantity("block_growth", "", "1", "mean logarithmic growth per revolution in each block"),
    Quantity("exponent", r"$\lambda$", "1", "Lyapunov exponent per revolution"),
    Quantity("largest_exponent", r"$\lambda_1$", "1", "largest exponent per revolution"),
    Quantity("standard_error", r"$s_\lambda$", "1", "standard error of the exponents"),
    Quantity("peak", r"$\epsilon$", "1", "largest excursion (cage: eccentricity ratio) observed"),
    Quantity("error", "", "1", "largest change of a revolution's end (of the scale) with half as many steps"),
    Quantity("doubt", "", "1", "change of the exponents with half as many steps"),
    Quantity("escape", "", "1", "revolutions of the run after which a lane is calm, infinite if chaotic to the end"),
    Quantity("period", "", "1", "revolutions after which the orbit closes, 0 if it does not"),
    Quantity("outcome", "", "1", "how the integration of each lane ended"),
    Quantity("label", "", "1", "what each lane does"),
    Quantity("chaotic_share", "", "1", "share of the finished starts that are chaotic while observed"),
    Quantity("force", r"$F$", "N", "force"),
    Quantity("contact_force", r"$Q_{cw}$", "N", "roller-bar contact force"),
    Quantity("bar_force", r"$K_c \delta_c$", "N", "bar force"),
)

GLOSSARY: dict[str, Quantity] = {quantity.name: quantity for quantity in _QUANTITIES}
"""Outputs by name."""


def quantity(name: str) -> Quantity:
    """What is known of the output `name`; a name that is not listed stands for itself, without a
    unit.
    """
    return GLOSSARY.get(name, Quantity(name, "", "1", name.replace("_", " ")))


_COMPONENTS = {
    4: ("x_C", "y_C", "vx_C", "vy_C"),
    8: ("x_C", "y_C", "x_O", "y_O", "vx_C", "vy_C", "vx_O", "vy_O"),
}


def component_names(dimension: int, cage: bool = True) -> tuple[str, ...]:
    """Names of the state components of a cage; those of another system are numbered."""
    numbered = tuple(f"y{i}" for i in range(dimension))
    return _COMPONENTS.get(dimension, numbered) if cage else numbered
