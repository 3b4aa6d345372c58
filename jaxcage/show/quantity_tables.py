"""Tables of quantities over speed, of one run, and of a bearing at rest."""

import math
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
import xarray as xr
from jaxtyping import Float

from .._pytrees import Scalar
from ..analysis import Measured, Measures, failed, named_lines, scatter
from ..bearing import LoadDistribution, static_cage_displacements
from .run_figures import SPECTRA, Rollers
from .tables import OWN, UNIT, Column, Table, number, table


LONGEST = 60
"""Longest description of a quantity in a table [characters]; longer ones are replaced by its name."""
SHARES = ("cage_slip", "roller_slip_max")
"""Dimensionless quantities that are shown in per cent."""


def mean_over_starts(found: xr.Dataset, name: str) -> tuple[Float[np.ndarray, " rows"], Float[np.ndarray, " rows"]]:
    """Mean of a variable at each speed over the lanes that did not fail, and its standard error from the scatter of all
    blocks, NaN for a variable without blocks."""
    if name == "exponent":
        values, blocks = found["exponents"].values[..., 0], found["block_growth"].values[..., 0]
    else:
        values = found[name].values
        blocks = found[f"{name}_blocks"].values if f"{name}_blocks" in found else None
    if values.ndim == 1:
        return values, np.full(values.shape, np.nan)
    lost, means, errors = failed(found), [], []
    for i, row in enumerate(values):
        known = row[~lost[i]]
        means.append(float(np.mean(known)) if known.size else math.nan)
        rest = np.zeros(0) if blocks is None else blocks[i][~lost[i]].ravel()
        errors.append(float(scatter(rest[None])[0]) if rest.size > 1 else math.nan)
    return np.array(means), np.array(errors)


def head_of(name: str, unit: str) -> str:
    """Column header of a quantity: its name without its unit."""
    return name.removesuffix("_" + unit.replace(" ", "_").replace("^", "").replace("/", "_per_")).replace("_", " ")


def in_per_cent(name: str, unit: str) -> tuple[float, str]:
    """Factor and unit with which a quantity is shown: per cent for shares."""
    return (100.0, "%") if name in SHARES else (1.0, unit)


def quantity_words(found: Measured) -> str:
    """A quantity in a sentence, with its error: `friction power 1187.0 ± 1.2 W` or `cage slip 2.11 ± 0.12 %`."""
    quantity, value, error = found
    times, unit = in_per_cent(quantity.name, quantity.unit)
    head = HEADS.get(quantity.name, head_of(quantity.name, quantity.unit))
    return f"{head} {number(times * value, times * error)} {unit}".removesuffix(" 1")


HEADS = dict.fromkeys(("eccentricity", "largest_eps"), "largest eccentricity ratio") | {"size": "orbit size"}
"""Headers of variables whose names alone are ambiguous."""


def column_of(found: xr.Dataset, name: str) -> Column:
    """Column of a variable, with its unit and its error."""
    if name in ("exponent", "exponents"):
        return Column("largest exponent per revolution", name, error=f"{name}_error")
    unit = found[name].attrs["units"]
    return Column(HEADS.get(name, head_of(name, unit)), name, unit, "%" if name in SHARES else None, f"{name}_error")


def quantities_table(title: str, found: xr.Dataset, names: Sequence[str]) -> Table:
    """Table of means over the lanes that did not fail at each speed, with their standard errors."""
    columns, values = [Column("speed [rpm]", "speed_rpm", digits=0)], {"speed_rpm": found["rpm"].values}
    for name in names:
        columns.append(column_of(found, name))
        values[name], values[f"{name}_error"] = mean_over_starts(found, name)
    rows = [dict(zip(values, row, strict=True)) for row in zip(*(x.tolist() for x in values.values()), strict=True)]
    return table(title, rows, columns, "means")


def means_table(designs: Sequence[str], found: Sequence[xr.Dataset], names: Sequence[str]) -> Table:
    """Table of means over speed of quantities of several designs, side by side, with their standard errors."""
    rows = []
    for name in names:
        column = column_of(found[0], name)
        times, unit = in_per_cent(name, column.unit)
        row: dict[str, Any] = {"measure": column.head, "unit": unit}
        for design, data in zip(designs, found, strict=True):
            values, errors = mean_over_starts(data, name)
            error = np.sqrt(np.sum(errors**2)) / errors.size
            row |= {design: times * np.nanmean(values), f"{design}_error": times * error}
        rows.append(row)
    columns = (Column(name, unit=OWN, error=f"{name}_error") for name in designs)
    return table("Means over speed", rows, ["measure", UNIT, *columns], "means")


def run_tables(title: str, found: Measures, rollers: Rollers | None) -> list[Table]:
    """Tables of quantities of one run with standard errors, and of spectral lines with the bearing's frequencies."""
    words = lambda q: q.text if len(q.text) <= LONGEST else head_of(q.name, q.unit)
    rows = ((words(q), *in_per_cent(q.name, q.unit), value, error) for q, value, error in found.values())
    tables = [_values_table(title, ((what, times * x, unit, times * error) for what, times, unit, x, error in rows))]
    columns = [Column("order of the cage's speed", "order", digits=3), "amplitude"]
    if rollers is None:
        return tables
    columns += [Column("frequency [Hz]", "frequency_hz", digits=1), Column("at the frequency of", "name")]
    history = rollers.history
    turns = abs(history.angle[-1] - history.angle[0]) / (2 * np.pi) / (history.time[-1] - history.time[0])
    for name, spectrum in rollers.spectra.items():
        named = named_lines(spectrum, rollers.orders)
        lines = [line._asdict() | {"frequency_hz": turns * line.order} for line in named]
        tables.append(table(f"Spectrum, {SPECTRA[name]}", lines, columns))
    return tables


def _values_table(title: str, rows: Iterable[tuple[str, Any, str, float | None]]) -> Table:
    """Table of quantities from words, value [SI], SI unit and standard error."""
    records = [{"quantity": words, "value": x, "unit": unit, "error": error} for words, x, unit, error in rows]
    return table(title, records, ["quantity", Column("value", unit=OWN, error="error"), UNIT])


def displacements(model: Any, shared: LoadDistribution) -> dict[str, float]:
    """Static displacement of the cage [m] for the three types of guidance."""
    found = static_cage_displacements(model.bearing, model.guidance_gap, shared.elastic_approach)
    return {guidance: float(y) for guidance, y in found.items()}


def statics_table(
    title: str, model: Any, shared: LoadDistribution, ratio: Scalar, turning: tuple[Scalar, ...] | None = None
) -> Table:
    """Table of loads and displacements at rest, the ratio of cage and shaft speed, and both speeds [rad/s] and the
    centrifugal force of a roller [N] if the bearing is turning."""
    rows: list[tuple[str, Any, str]] = [
        ("largest roller load on the inner raceway", shared.max_load, "N"),
        ("shift of the shaft", shared.shaft_shift, "m"),
        ("elastic approach", shared.elastic_approach, "m"),
        ("half angle of the loaded zone", shared.half_angle, "rad"),
    ]
    at_rest = displacements(model, shared)[f"{getattr(model, 'guidance', 'outer')}_rib"]
    rows.append(("displacement of the cage at rest", at_rest, "m"))
    celsius = float(model.lubricant.temperature) - 273.15
    viscosity = 1e6 * model.lubricant.kinematic_viscosity
    rows.append((f"kinematic viscosity of the oil at {celsius:g} °C", viscosity, "mm^2/s"))
    rows.append(("cage speed over shaft speed", ratio, "1"))
    if turning is not None:
        shaft, cage, centrifugal = turning
        rows += [
            ("cage speed", cage, "rad/s"),
            ("surface speed of the inner raceway", shaft * model.bearing.inner_raceway_diameter / 2, "m/s"),
            ("centrifugal force of a roller", centrifugal, "N"),
        ]
    return _values_table(title, ((words, float(value), unit, None) for words, value, unit in rows))
