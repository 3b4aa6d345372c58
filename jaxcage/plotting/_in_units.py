"""A figure in other units than those it was drawn in: its axes, and the numbers in its texts."""

from typing import Any, Protocol, runtime_checkable

import numpy as np
from matplotlib.axis import Axis, XAxis
from matplotlib.figure import Figure
from matplotlib.text import Text
from matplotlib.ticker import AutoLocator, Formatter


@runtime_checkable
class Units(Protocol):
    """What is asked for."""

    def in_head(self, head: str) -> tuple[str, float]:
        """Label of an axis -> the new one, and the factor of its numbers."""
        ...

    def in_text(self, text: str) -> str:
        """A text with its numbers in the new units."""
        ...


def in_units(figure: Figure, units: Units) -> Figure:
    """Show the axes of `figure` in other units; what is drawn stays where it is.

    **Arguments:** figure; units, a `jaxcage.io.ShownUnits`.

    **Returns:** the same figure.
    """
    for ax in figure.axes:
        for axis in (ax.xaxis, ax.yaxis):
            label, factor = units.in_head(axis.get_label_text())
            if factor != 1.0:
                axis.set_label_text(label)
                _show_times(axis, factor)
    for text in figure.findobj(Text):
        assert isinstance(text, Text)
        text.set_text(units.in_text(text.get_text()))
    return figure


def _show_times(axis: Axis, factor: float) -> None:
    """Ticks at round numbers of the new unit."""
    if axis.get_scale() == "linear":
        axis.set_major_locator(locator := _Locator(factor))
        if isinstance(axis, XAxis):
            locator.set_params(nbins=6)  # numbers such as 0.0125 inch are wider than matplotlib takes them to be
    axis.set_major_formatter(_Formatter(factor))


class _Locator(AutoLocator):
    def __init__(self, factor: float):
        super().__init__()
        self.factor = factor

    def tick_values(self, vmin: float, vmax: float) -> Any:
        return np.asarray(super().tick_values(vmin * self.factor, vmax * self.factor)) / self.factor


class _Formatter(Formatter):
    def __init__(self, factor: float):
        self.factor = factor

    def __call__(self, x: float, pos: int | None = None) -> str:
        return f"{self.factor * x:g}".replace("-", "−")

    def format_ticks(self, values: Any) -> list[str]:
        """All with as many decimals as tell them apart."""
        told = self.factor * np.asarray(values, dtype=float)
        step = np.min(np.diff(np.unique(told))) if len(told) > 1 else 0.0
        if not step > 0:
            return [self(x) for x in values]
        decimals = max(0, int(np.ceil(-np.log10(step) - 1e-9)) + _odd(step))
        return [f"{x:.{decimals}f}".replace("-", "−") for x in np.where(np.abs(told) < 1e-6 * step, 0.0, told)]


def _odd(step: float) -> bool:
    """Whether one digit does not tell the ticks apart, as with steps of 0.25."""
    leading = step / 10 ** np.floor(np.log10(step) + 1e-9)
    return bool(abs(leading - round(leading)) > 1e-6)
