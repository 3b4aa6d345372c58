"""What a whole bearing does at one shaft speed: slips, forces, losses, wear, the cage's motion."""

import dataclasses
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from matplotlib.figure import Figure

from .._errors import InputError, NoResult
from .._parameters import replace
from ..analysis import (
    Around,
    BearingHistory,
    BearingMeasures,
    OrderSpectrum,
    around,
    bearing_history,
    bearing_measures,
    bearing_orders,
    bearing_spectra,
    named_lines,
    pocket_force_distribution,
)
from ..io import SpeedOf, Whose
from ..models import FASTEST, BearingModel
from ..plotting import bearing_figure
from ..report import Table, chosen, number
from ..solve import Trajectory, native, simulate
from ..sweeps import rpm
from ._job import Job
from ._one_speed import measures_table
from ._options import DesignOptions, GradientOptions, SensitivityOptions, SimulateOptions
from ._readers import flag
from ._show import Report


SAMPLES = 128
"""Of a revolution of the cage: some twenty in the contact of a roller with its pocket."""
TOLERANCE = 1e-5
"""Of a step, in units of the state's scale."""
ERROR = 1e-2
"""Largest error of a sixteenth of a revolution, in the same units."""


class AtShaftSpeed(NamedTuple):
    """A whole bearing at one speed of its shaft."""

    model: BearingModel
    shaft_rpm: float

    @property
    def speed(self) -> float:
        """[rad/s]."""
        return float(rpm(self.shaft_rpm))

    @property
    def ending(self) -> str:
        """What the names of files about it end in."""
        return f"_{self.shaft_rpm:g}rpm_shaft"

    @property
    def document(self) -> dict[str, float]:
        """Speed and load."""
        return {"shaft_speed_rpm": self.shaft_rpm, "load_N": float(self.model.load)}

    def title(self, name: str) -> str:
        """The bearing called `name`, its speed and load."""
        return f"{name}, {self.shaft_rpm:g} rpm of the shaft, {float(self.model.load):g} N"


def bearing_at(job: Job[SimulateOptions], model: BearingModel) -> Report:
    """`jaxcage simulate` of a whole bearing."""
    options = job.options
    if options.solver is not None or options.steps is not None:
        raise InputError("Options --solver and --steps do not go with a whole bearing: its steps are controlled.")
    at = at_shaft_speed(job, model)
    with job.computing():
        found = examined(job.name, at, options.revolutions, options.discard, options.tolerance)
    run, history = found.run, found.history
    job.figure(found.figure, detail=at.ending)
    job.columns(_columns(history), detail=at.ending)
    places = dict(vars(found.circumference))
    document = {
        **at.document,
        **chosen(options, "revolutions discard"),
        **chosen(run, "outcome error steps"),
        **dataclasses.asdict(found.measures),
        "pocket_force_distribution_N": pocket_force_distribution(history),
        "around": {"angle_deg": np.degrees(places.pop("angle")), **places},
        "orders": found.orders,
        "spectra": {n: [vars(line) for line in named_lines(s, found.orders)] for n, s in found.spectra.items()},
    }
    said = f"Error of a sixteenth of a revolution: at most {run.error:.0e} of the state's scale ({run.outcome})"
    return Report(document, found.tables, [said])


@dataclasses.dataclass(frozen=True)
class Examined:
    """A whole bearing at one shaft speed."""

    title: str
    model: BearingModel
    revolutions: int
    run: Trajectory
    history: BearingHistory
    measures: BearingMeasures
    orders: Mapping[str, float]
    spectra: Mapping[str, OrderSpectrum]
    circumference: Around

    @property
    def figure(self) -> Figure:
        """Drawing, orbit, slips and forces around the bearing, forces over time, spectra."""
        return bearing_figure(
            self.model, self.run, self.history, self.circumference, self.spectra, self.orders, self.title
        )

    @property
    def tables(self) -> list[Table]:
        """Measures, rollers around the bearing, lines of the spectra."""
        title = f"{self.title}, {self.revolutions} revolutions of the cage"
        return [
            measures_table(title, self.measures),
            _circumference_table(self.circumference),
            *_line_tables(self.spectra, self.orders),
        ]


def examined(name: str, at: AtShaftSpeed, revolutions: int, discard: int, tolerance: float | None) -> Examined:
    """Run a whole bearing at one speed, and all that is read off that run.

    **Raises:** `NoResult` if the run fails.
    """
    model, speed = at.model, at.speed
    method = native(TOLERANCE if tolerance is None else tolerance, ERROR)
    run = simulate(model, speed, revolutions=revolutions, discard=discard, samples=SAMPLES, method=method)
    if run.outcome != "successful":
        raise NoResult(f"The simulation at {at.shaft_rpm:g} rpm of the shaft failed ({run.outcome}).")
    history = bearing_history(model, run, speed)
    return Examined(
        at.title(name),
        model,
        revolutions,
        run,
        history,
        bearing_measures(model, run, speed),
        bearing_orders(model, run, speed),
        bearing_spectra(history) if revolutions > 1 else {},
        around(history),
    )


def at_shaft_speed(
    job: Job[SimulateOptions | GradientOptions | DesignOptions | SensitivityOptions], model: BearingModel
) -> AtShaftSpeed:
    """The bearing under the load, and at the speed, of a command's options.

    **Raises:** `InputError` for no speed, or one at which no cage runs.
    """
    options = job.options
    if options.speed is None:
        raise InputError('Option --speed must be given for a whole bearing, e.g. --speed "10000 rpm shaft".')
    model = loaded(model, options.load)
    return AtShaftSpeed(model, shaft_rpm_of(model, options.speed, job.speeds))


def loaded(model: BearingModel, load: float | None) -> BearingModel:
    """The bearing under the load of an option [N]."""
    return model if load is None else replace(model, load=load)


def shaft_rpm_of(model: BearingModel, given: float, unsaid: Whose, option: str = "--speed") -> float:
    """The shaft's speed [rpm] that a speed means.

    **Raises:** `InputError` for one at which no cage runs.
    """
    whose = given.whose if isinstance(given, SpeedOf) else unsaid
    at_rest = float(model.rolling_cage_speed(0.0)) * 30 / np.pi  # where the outer ring turns
    ratio = float(model.rolling_cage_speed(1.0) - model.rolling_cage_speed(0.0))
    shaft = float(given) if whose == "shaft" else (float(given) - at_rest) / ratio
    if shaft <= 0:
        raise InputError(
            f"Option {option} must be above {at_rest:g} rpm of the cage, which the outer ring makes by itself, but "
            f"{float(given):g} rpm was given."
        )
    require_land_speed(model, shaft, option)
    return shaft


def require_land_speed(model: BearingModel, shaft_rpm: float, option: str) -> None:
    """**Raises:** `InputError` for a shaft speed at which the cage's land is faster than any cage runs."""
    land = abs(float(model.rolling_cage_speed(rpm(shaft_rpm)) * model.land_radius))
    if land > FASTEST:
        raise InputError(
            f"Option {option} must leave the cage at most {FASTEST:g} m/s at its land, but {shaft_rpm:g} rpm of the "
            f"shaft make {land:.0f} m/s."
        )


def shaft_speeds(job: Job[Any], model: BearingModel, count: int) -> np.ndarray:
    """Shaft speeds [rad/s] from --first to --last.

    **Raises:** `InputError` for a range that is none, or in which no cage runs.
    """
    first, last = (shaft_rpm_of(model, getattr(job.options, n), job.speeds, flag(n)) for n in ("first", "last"))
    if count == 1:
        return np.array([rpm(first)])
    if last <= first:
        raise InputError(f"Option --last must be above --first, but the range is {first:g} to {last:g} rpm.")
    return np.asarray(rpm(first, last, count))


def _columns(history: BearingHistory) -> dict[str, np.ndarray]:
    """Time history for a file: cage, land, and each roller."""
    found = {
        "time [s]": history.time,
        "cage angle [rad]": history.angle,
        "cage place x over clearance": history.place[:, 0],
        "cage place y over clearance": history.place[:, 1],
    }
    for name in ("pocket_on_cage", "land_on_cage"):
        found |= {f"{name}_{axis} [N]": getattr(history, name)[:, i] for i, axis in enumerate("xy")}
    of_rollers = {"pocket_force": "N", "inner_load": "N", "roller_slip": "1"}
    for name, unit in of_rollers.items():
        values = getattr(history, name)
        found |= {f"{name}_{j + 1} [{unit}]": values[:, j] for j in range(values.shape[1])}
    return found


def _line_tables(spectra: Mapping[str, OrderSpectrum], orders: Mapping[str, float]) -> list[Table]:
    titles = {
        "cage_place": "Cage's vertical position over the clearance",
        "pocket_force": "Pockets on cage, vertical [N]",
    }
    return [
        Table(
            f"Spectrum, {titles[name]}",
            ("order of the cage's speed", "amplitude", "at the frequency of"),
            [(f"{x.order:.3f}", f"{x.amplitude:.3g}", x.name or "-") for x in named_lines(found, orders)],
        )
        for name, found in spectra.items()
    ]


def _circumference_table(found: Around) -> Table:
    """An eighth of the circumference to a row."""
    eighths = [np.flatnonzero(np.floor(found.angle / (2 * np.pi) * 8).astype(int) == i) for i in range(8)]
    mean = lambda x, i: float(np.nanmean(x[i])) if np.isfinite(x[i]).any() else float("nan")
    rows = [
        (
            f"{45 * i} to {45 * (i + 1)}°",
            number(100 * mean(found.roller_slip, part), 2),
            number(mean(found.inner_load, part), 0),
            number(mean(found.driving_force, part), 2),
            number(mean(found.braking_force, part), 2),
            number(float(np.nanmax(found.largest_force[part])), 0),
        )
        for i, part in enumerate(eighths)
    ]
    heads = ("position, load at 270°", "slip [%]", "inner load [N]", "driving [N]", "braking [N]", "largest [N]")
    return Table("Rollers around the bearing: slip, load, pocket force", heads, rows)
