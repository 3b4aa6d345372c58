"""Quantities that a run reports, measures of one speed, statics, and two designs beside each other, as tables."""

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr
from jaxtyping import Float

from .._parameters import walk
from ..analysis import Measures, failed, named_lines, scatter
from ..bearing import LoadDistribution, static_cage_displacements
from ..files import configuration
from .run_figures import Rollers
from .tables import SHOWN, Column, Table, rows_table, value_table


LONGEST = 60
"""Characters of the words for a quantity in a table; longer ones give way to its name."""
LINES = {"cage_place": "cage's vertical position over the clearance", "pocket_force": "pockets on cage, vertical [N]"}
"""Words for the quantities that have a spectrum."""
SHARES = ("cage_slip", "roller_slip_max")
"""Quantities without a unit that are read in per cent."""


def mean_over_starts(found: xr.Dataset, name: str) -> tuple[Float[np.ndarray, " rows"], Float[np.ndarray, " rows"]]:
    """Mean of a variable at each speed over the lanes that did not fail, and its standard error.

    The error comes from the scatter of all blocks; it is NaN for a variable without blocks.
    """
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


def unit_of(found: xr.Dataset, name: str) -> tuple[str, str | None]:
    """SI unit of a variable, and the unit in which it is shown; None for the usual one."""
    return ("1", None) if name == "exponent" else (found[name].attrs["units"], "%" if name in SHARES else None)


def head_of(name: str, unit: str) -> str:
    """Name of a quantity as the head of a column, without its unit."""
    return name.removesuffix("_" + unit.replace(" ", "_").replace("^", "").replace("/", "_per_")).replace("_", " ")


def quantities_table(title: str, found: xr.Dataset, names: Sequence[str]) -> Table:
    """Means over the lanes that did not fail at each speed, with their standard errors."""
    columns = [Column("speed [rpm]", found["rpm"].values.tolist(), key="speed_rpm", digits=0)]
    for name in names:
        (unit, shown), (mean, error) = unit_of(found, name), mean_over_starts(found, name)
        columns.append(Column(head_of(name, unit), mean.tolist(), unit, shown, error.tolist(), key=name))
    return Table(title, columns, "means")


def run_tables(title: str, found: Measures, rollers: Rollers | None) -> list[Table]:
    """Quantities of one run with their standard errors; lines of spectra beside the bearing's frequencies."""
    words = lambda q: q.text if len(q.text) <= LONGEST else head_of(q.name, q.unit)
    rows = [(words(quantity), value, quantity.unit) for quantity, value, _ in found.values()]
    tables = [value_table(title, rows, [error for _, _, error in found.values()])]
    if rollers is None:
        return tables
    columns = [Column("order of the cage's speed", (), key="order", digits=3), Column("amplitude", ())]
    columns.append(Column("at the frequency of", (), key="name"))
    for name, spectrum in rollers.spectra.items():
        lines = map(vars, named_lines(spectrum, rollers.orders))
        tables.append(rows_table(f"Spectrum, {LINES[name]}", lines, columns, f"spectrum_{name}"))
    return tables


def displacements(model: Any, shared: LoadDistribution) -> dict[str, float]:
    """Static displacement of the cage [m] for the three types of guidance."""
    found = static_cage_displacements(model.bearing, model.guidance_gap, shared.elastic_approach)
    return {guidance: float(y) for guidance, y in found.items()}


def statics_table(title: str, model: Any, shared: LoadDistribution, shaft_speed: float | None = None) -> Table:
    """Loads and displacements at rest, and the kinematics at a shaft speed [rad/s] if one is given."""
    bearing = model.bearing
    rows: list[tuple[str, Any, str]] = [
        ("largest roller load", float(shared.max_load), "N"),
        ("shift of the shaft", float(shared.shaft_shift), "m"),
        ("elastic approach", float(shared.elastic_approach), "m"),
        ("half angle of the loaded zone", float(shared.half_angle), "rad"),
        *(
            (f"cage displacement, {g.replace('_', ' ')} guidance", y, "m")
            for g, y in displacements(model, shared).items()
        ),
        ("cage speed over shaft speed", float(bearing.cage_speed_ratio), "1"),
    ]
    if shaft_speed is not None:
        rows += [
            ("cage speed", float(bearing.cage_speed(shaft_speed)), "rad/s"),
            ("surface speed of the inner raceway", float(shaft_speed * bearing.inner_raceway_diameter / 2), "m/s"),
            ("centrifugal force of a roller", float(bearing.roller_centrifugal_force(shaft_speed)), "N"),
        ]
    return value_table(title, rows)


def differences(models: Sequence[Any]) -> list[dict[str, Any]]:
    """Dotted name, text, both values [SI], unit and relative change of each parameter or choice in which two designs
    differ."""
    flat = [_flat(configuration(model)) for model in models]
    about = {".".join(path): field.metadata for model in models for path, field in walk(model)}
    found = []
    for path in dict.fromkeys([*flat[0], *flat[1]]):
        before, after = values = [each.get(path) for each in flat]
        if before == after:
            continue
        info = about.get(path, {}).get("parameter")
        row = {"name": path, "text": (info.text if info else about.get(path, {}).get("text")) or path, "values": values}
        numbers = all(isinstance(v, float | int) and math.isfinite(v) for v in values)
        change = after / before - 1 if numbers and before and (info is None or info.unit != "K") else None
        found.append(row | {"unit": info.unit if info else "1", "change": change})
    return found


def differences_table(names: Sequence[str], models: Sequence[Any]) -> Table:
    """Every value in which two designs differ."""
    rows = differences(models)
    for row in rows:
        cells = Column(
            "", [x if x is None or isinstance(x, float) else str(x) for x in row["values"]], row["unit"]
        ).cells
        row |= dict(zip(names, cells, strict=True)) | {"shown": SHOWN.get(row["unit"], row["unit"])}
    columns = [Column("value", (), key="text"), *(Column(name, ()) for name in names), Column("unit", (), key="shown")]
    columns.append(Column("change", (), "1", "%", digits=1))
    return rows_table(f"Differences between {' and '.join(names)}", rows, columns, "differences", empty="nothing")


def _flat(table: Mapping[str, Any], path: tuple[str, ...] = ()) -> dict[str, Any]:
    found: dict[str, Any] = {}
    for key, value in table.items():
        found |= _flat(value, (*path, key)) if isinstance(value, Mapping) else {".".join((*path, key)): value}
    return found
