"""Two designs side by side: what differs between them, and what each does."""

import dataclasses
import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from jaxtyping import Float

from ..analysis import Sweep, Zones
from ..io import configuration
from ..models import BearingModel, CageModel
from ..sweeps import Motion
from ._sources import parameter_rows
from ._table import Table, number
from ._zone_tables import zone_document


@dataclasses.dataclass(frozen=True)
class Compared:
    """What one of the designs does."""

    name: str
    model: CageModel
    swept: Sweep
    zones: Zones
    motion: Motion
    loads: Mapping[str, Float[np.ndarray, " speeds"]]
    """`wear load` [N m/s] and `peak land force` [N] at each speed."""

    @property
    def rpm(self) -> Float[np.ndarray, " speeds"]:
        """Cage speed [rpm]."""
        return self.swept.rpm

    @property
    def size(self) -> Float[np.ndarray, " speeds"]:
        """Size of the orbit [m] at each speed, the largest of its starts; NaN where all failed."""
        return _largest(self.motion.size)

    @property
    def exponent(self) -> Float[np.ndarray, " speeds"]:
        """Largest exponent per revolution of all starts; NaN where all failed."""
        return _largest(np.where(self.swept.failed, np.nan, self.swept.exponents[..., 0]))

    def labels(self, i: int) -> str:
        """What the starts do at the i-th speed, each sort once."""
        return ", ".join(dict.fromkeys(self.swept.label[i].tolist()))


def _largest(values: np.ndarray) -> np.ndarray:
    found = np.max(np.where(np.isnan(values), -np.inf, values), axis=1)
    return np.where(np.isfinite(found), found, np.nan)


def differences_table(names: Sequence[str], models: Sequence[CageModel | BearingModel]) -> Table:
    """Every value in which two designs differ, in the units people read."""
    rows = []
    for path, (text, *cells, unit, change) in differences(models).items():
        rows.append((text or path, *(cell or "-" for cell in cells), unit, change))
    title = f"What differs between {' and '.join(names)}"
    return Table(title, ("value", *names, "unit", "change"), rows or [("nothing", "-", "-", "", "-")])


def differences(models: Sequence[CageModel | BearingModel]) -> dict[str, tuple[str, str, str, str, str]]:
    """Text, both values, unit and change of each parameter or choice in which two designs differ, by dotted name."""
    shown = [{".".join(row.path): row for row in parameter_rows(model, None)} for model in models]
    exact = [_flat(configuration(model)) for model in models]
    found = {}
    for path in dict.fromkeys([*exact[0], *exact[1]]):
        before, after = values = [each.get(path) for each in exact]
        if before == after:
            continue
        rows = [each.get(path) for each in shown]
        row = next((r for r in rows if r is not None), None)
        cells = [str(v if v is not None else "") if r is None else r.value for r, v in zip(rows, values, strict=True)]
        units = {r.unit for r in rows if r is not None}
        if len(units) > 1:  # one in mm, the other in um
            cells = [f"{r.value} {r.unit}" for r in rows if r is not None]
        unit = units.pop() if len(units) == 1 else ""
        text = path if row is None or not row.text else row.text
        found[path] = (text, *cells, unit, _change(before, after, unit))
    return found


def _change(before: Any, after: Any, unit: str) -> str:
    numbers = all(isinstance(v, float | int) and math.isfinite(v) for v in (before, after))
    if numbers and unit == "°C":  # temperatures have no per cent
        return f"{after - before:+.3g} K"
    return f"{100 * (after / before - 1):+.3g} %" if numbers and before else "-"


def _flat(table: Mapping[str, Any], path: tuple[str, ...] = ()) -> dict[str, Any]:
    found: dict[str, Any] = {}
    for key, value in table.items():
        found |= _flat(value, (*path, key)) if isinstance(value, Mapping) else {".".join((*path, key)): value}
    return found


def compared_document(one: Compared) -> dict[str, Any]:
    """A design for programs: over speed, then in all."""
    swept = one.swept
    return {
        "speeds_rpm": one.rpm,
        "shaft_speeds_rpm": one.rpm / float(one.model.bearing.cage_speed_ratio),
        "labels": swept.label,
        "largest_exponent": one.exponent,
        "chaotic_share": swept.chaotic_share,
        "orbit_size_m": one.size,
        "peak_land_force_N": one.loads["peak land force"],
        "wear_load_N_m_per_s": one.loads["wear load"],
        "zones": [zone_document(zone) for zone in one.zones.zones],
        "transient": [zone_document(zone) for zone in one.zones.transient],
        "failed": int(np.sum(swept.failed)),
        "means": means(one),
    }


def means(one: Compared) -> dict[str, float]:
    """In all, over the speeds: how much is chaotic, how far the cage moves and what its land feels."""
    share = one.swept.chaotic_share
    with_some = np.isfinite(share)
    mean = lambda values: float(np.nanmean(values)) if np.any(np.isfinite(values)) else math.nan
    return {
        "chaotic_speeds": float(np.mean(one.swept.restless)),
        "chaotic_lanes": mean(share[with_some]),
        "largest_exponent": float(np.nanmax(one.exponent)) if np.any(np.isfinite(one.exponent)) else math.nan,
        "mean_orbit_size_m": mean(one.size),
        "mean_peak_land_force_N": mean(one.loads["peak land force"]),
        "mean_wear_load_N_m_per_s": mean(one.loads["wear load"]),
    }


def overall_table(pair: Sequence[Compared]) -> Table:
    """Both designs over all speeds."""
    found = [means(one) for one in pair]
    shown = (
        ("chaotic_speeds", "speeds at which some start is chaotic", "%", 100.0, ".1f"),
        ("chaotic_lanes", "starts that are chaotic", "%", 100.0, ".1f"),
        ("largest_exponent", "largest exponent", "1/rev", 1.0, "+.3f"),
        ("mean_orbit_size_m", "size of the orbit, mean over speed", "mm", 1e3, ".4g"),
        ("mean_peak_land_force_N", "peak land force, mean over speed", "N", 1.0, ".4g"),
        ("mean_wear_load_N_m_per_s", "wear load of the land, mean over speed", "N m/s", 1.0, ".4g"),
    )
    cell = lambda value, form: format(value, form) if math.isfinite(value) else "-"
    rows = [(what, *(cell(f * one[key], form) for one in found), unit) for key, what, unit, f, form in shown]
    swept = pair[0].swept
    title = f"Over {swept.speed.size} speeds x {swept.outcome.shape[1]} starts, {swept.length}"
    return Table(title, ("measure", *(one.name for one in pair), "unit"), rows)


def compared_zones_table(pair: Sequence[Compared]) -> Table:
    """Chaotic zones of both, one after the other."""
    end = lambda edge: "past range" if edge is None else number(edge.speed_rpm)
    rows = [
        (one.name, kind, str(i), end(z.onset), end(z.exit), number(z.width_rpm, nothing="open"), f"{z.share:.0%}")
        for one in pair
        for kind, zones in (
            ("lasting" if one.zones.horizon else "any", one.zones.zones),
            ("transient", one.zones.transient),
        )
        for i, z in enumerate(zones, start=1)
    ]
    missing = [(one.name, "none", *5 * ("-",)) for one in pair if not (one.zones.zones or one.zones.transient)]
    columns = ("design", "chaos", "zone", "onset", "exit", "width", "share")
    return Table("Chaotic zones [rpm of the cage]", columns, [*rows, *missing])


def at_speeds_compared(pair: Sequence[Compared], at: Sequence[int]) -> Table:
    """Both designs at some of the speeds, a row of each under the other."""
    rows = [
        (
            number(one.rpm[i] / float(one.model.bearing.cage_speed_ratio)),
            number(one.rpm[i]),
            one.name,
            one.labels(i),
            f"{one.exponent[i]:+.3f}" if math.isfinite(one.exponent[i]) else "-",
            number(1e3 * one.size[i], 3),
            number(one.loads["peak land force"][i], 1),
            number(one.loads["wear load"][i], 2),
        )
        for i in at
        for one in pair
    ]
    columns = ("shaft [rpm]", "cage [rpm]", "design", "starts are", "exponent", "orbit [mm]", "land peak [N]")
    return Table("At chosen speeds", (*columns, "wear load [N m/s]"), rows)
