"""What a whole bearing does over the shaft's speed: slips, forces, losses, exponent, state of the cage's motion."""

import collections
import dataclasses
from functools import partial
from typing import Any

import numpy as np

from .._errors import InputError, NoResult
from ..analysis import BearingSweep, BearingZone, bearing_zones
from ..io import save_bearing_sweep
from ..models import BearingModel
from ..plotting import bearing_sweep_figure
from ..report import Table, chosen
from ..sweeps import sweep_bearing
from ._job import Job, blocks_of
from ._options import SweepOptions
from ._show import Report
from ._whole import loaded, shaft_speeds


SPEEDS, STARTS = 13, 3
COLUMNS = (
    "cage_slip roller_slip_max pocket_force_mean_sum_N pocket_force_max_N pocket_impulse_N_s land_force_max_N "
    "land_impulse_N_s pocket_wear_mm3_per_h land_wear_mm3_per_h friction_power_W input_power_W eccentricity_mean "
    "eccentricity_std eccentricity_max whirl_ratio synchronous_force_x_N synchronous_force_y_N "
    "synchronous_force_error_N exponent exponent_error state outcome error steps"
)


def bearing_over_speed(job: Job[SweepOptions], model: BearingModel) -> Report:
    """`jaxcage sweep` of a whole bearing, and `jaxcage zones`."""
    options, model = job.options, loaded(model, job.options.load)
    if options.exponents > 1:
        raise InputError(f"Option --exponents must be 1 for a whole bearing, but {options.exponents} was given.")
    speeds = shaft_speeds(job, model, options.count or SPEEDS)
    found = swept(job, model, speeds)
    title = f"{job.name}, {float(model.load):g} N, {options.discard} + {options.revolutions} revolutions of the cage"
    found_zones = bearing_zones(found)
    job.figure(bearing_sweep_figure(found, title, found_zones))
    job.listed("data", save_bearing_sweep(job.folder / f"sweep_{job.name}.zarr", found, model))
    outcomes = dict(sorted(collections.Counter(found.outcome.ravel().tolist()).items()))
    document = {
        "load_N": float(model.load),
        "speeds": speeds.size,
        "starts": STARTS,
        **chosen(options, "discard revolutions"),
        "shaft_speed_rpm": found.rpm,
        **chosen(found, COLUMNS),
        "standard_errors": {name: found.standard_error(name) for name in found.block_means},
        "power_parts_W": found.power_parts_W,
        "outcomes": outcomes,
        "zones": [dataclasses.asdict(zone) for zone in found_zones],
    }
    said = ", ".join(f"{n} {name}" for name, n in outcomes.items())
    tables = [zones_table(job.name, found_zones), sweep_table(title, found)]
    return Report(document, tables, [f"Lanes: {said}"])


def swept(job: Job[Any], model: BearingModel, speeds: np.ndarray) -> BearingSweep:
    """The sweep that the options describe.

    **Raises:** `NoResult` if every lane fails.
    """
    options = job.options
    with job.computing("sweep") as say:
        found = sweep_bearing(
            model,
            speeds,
            starts=STARTS,
            **job.given("discard revolutions tolerance"),
            blocks=blocks_of(options.revolutions),
            progress=partial(say, ""),
        )
    if found.failed.all():
        raise NoResult(f"All lanes failed ({', '.join(np.unique(found.outcome))}).")
    return found


def zones_table(name: str, found: tuple[BearingZone, ...]) -> Table:
    """Stretches of speed in which the cage does the same."""
    columns = {
        "shaft [rpm]": "{0.low_rpm:.0f} to {0.high_rpm:.0f}",
        "state of the cage": lambda zone: " or ".join(zone.states),
        "exponent says": lambda zone: "chaotic" if zone.chaotic else "not known to be chaotic",
        "exponent": "{0.exponent:.2f} ± {0.exponent_error:.2f}",
        "speeds": "{.speeds}",
    }
    return Table.of(f"Zones of {name}, each edge halfway between two speeds of the sweep", columns, found)


def sweep_table(title: str, found: BearingSweep) -> Table:
    """One row for each speed, means over the starts that did not fail."""
    heads = ("shaft [rpm]", "slip [%]", "pockets, mean [N]", "largest [N]", "lost [W]", "eccentricity", "whirl ratio")
    rows = []
    for i, shaft in enumerate(found.rpm):
        well = ~found.failed[i]
        if not well.any():
            rows.append((f"{shaft:.0f}", *["-"] * (len(heads) - 1), "-", "failed"))
            continue
        mean = lambda name, i=i, well=well: float(np.mean(getattr(found, name)[i, well]))
        error = lambda name, i=i, well=well: _error(found, name, i, well)
        rows.append(
            (
                f"{shaft:.0f}",
                f"{100 * mean('cage_slip'):.2f} ± {100 * error('cage_slip'):.2f}",
                f"{mean('pocket_force_mean_sum_N'):.1f} ± {error('pocket_force_mean_sum_N'):.1f}",
                f"{np.max(found.pocket_force_max_N[i, well]):.0f}",
                f"{mean('friction_power_W'):.1f}",
                f"{mean('eccentricity_mean'):.3f}",
                f"{mean('whirl_ratio'):.3f}",
                f"{mean('exponent'):.2f} ± {error('exponent'):.2f}",
                ", ".join(sorted(set(found.state[i, well].tolist()))),
            )
        )
    return Table(title, (*heads, "exponent", "state"), rows)


def _error(found: BearingSweep, name: str, i: int, well: np.ndarray) -> float:
    """Standard error of the mean over starts, from blocks of all of them."""
    blocks: Any = found.block_means[name][i][well]
    return float(np.std(blocks, ddof=1) / np.sqrt(blocks.size))
