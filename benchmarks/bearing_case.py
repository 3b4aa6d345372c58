"""`python -m benchmarks.bearing_case`: the open benchmark case, NU2310 whole, as `benchmarks/bearing_case.json`.

Every constant with its unit and meaning; states at the ends of arcs of the cage's angle by tight steps, to compare
equations of motion arc by arc; means over many revolutions with standard errors, and the state of the cage's motion,
over shaft speeds and loads, to compare what chaotic motions have in common.
"""

import argparse
import json
import pathlib
from typing import Any

import numpy as np
import xarray as xr

import jaxcage as jc
from benchmarks.common import commit
from jaxcage.files import configuration
from jaxcage.models import Bodies, Rollers, state_scale


FILE = pathlib.Path(__file__).with_suffix(".json")
SPEEDS, LOADS = (4000.0, 8000.0, 10000.0, 12000.0, 16000.0), (300.0, 1000.0, 4450.0)
"""Shaft speeds [rpm] and loads [N] of the statistics."""
ARC_SPEEDS, ARC_LOADS = (4000.0, 10000.0, 16000.0), (300.0, 4450.0)
"""Those of the arcs."""
SAMPLES, ARCS, TOLERANCE = 32, 4, 1e-8
"""Arcs of a revolution of the cage, those that are kept, and the tolerance of a step."""
STARTS, BLOCKS = 2, 10
DIGITS = 15
MEANS = (
    "cage_slip",
    "pocket_force_mean_sum_N",
    "friction_power_W",
    "land_power_W",
    "eccentricity_mean",
    "whirl_ratio",
    "exponents",
)


def constants(model: jc.BearingModel) -> dict[str, dict[str, Any]]:
    """Every number of the model by name: value, unit, meaning."""
    info = jc.parameter_info(model)
    return {
        name: {"value": float(value), "unit": info[name].unit, "meaning": info[name].text}
        for name, value in jc.parameters(model).items()
    }


def state_of(rollers: np.ndarray, bodies: np.ndarray, angle: float, time: float) -> dict[str, Any]:
    """A state as the file has it, SI."""
    short = lambda row: [float(f"{x:.{DIGITS}g}") for x in row]
    return {
        "cage_angle": float(angle),
        "time": float(f"{time:.{DIGITS}g}"),
        "rollers": {name: short(row) for name, row in zip(Rollers._fields, rollers, strict=True)},
        "bodies": dict(zip(Bodies._fields, short(bodies), strict=True)),
    }


def arcs(model: jc.BearingModel, rpm: float, start: tuple[float, ...]) -> dict[str, Any]:
    """States at the ends of neighbouring arcs from a settled motion, and how sure they are."""
    run = jc.simulate(
        model, jc.rpm(rpm), revolutions=1, samples=SAMPLES, start=start, method=jc.native(TOLERANCE, 1e-3)
    )
    if run.outcome != "successful":
        raise RuntimeError(f"{rpm:g} rpm, {float(model.load):g} N: {run.outcome}")
    scale = state_scale(model, jc.rpm(rpm))
    unit = {name: float(row[0]) for name, row in zip(Rollers._fields, np.asarray(scale.rollers), strict=True)}
    unit_bodies = dict(zip(Bodies._fields, map(float, np.asarray(scale.bodies)), strict=True))
    kept = [state_of(run.rollers[i], run.bodies[i], run.angle[i], run.time[i] - run.time[0]) for i in range(ARCS + 1)]
    return {
        "shaft_speed_rpm": rpm,
        "load_N": float(model.load),
        "arc_rad": 2 * np.pi / SAMPLES,
        "error_of_an_arc": float(f"{run.error:.2g}"),
        "scale": {"rollers": unit, "bodies": unit_bodies},
        "states": kept,
    }


def statistics(found: xr.Dataset, load: float) -> list[dict[str, Any]]:
    """Means with standard errors at every speed, from all initial states."""
    rows = []
    for i, rpm in enumerate(found["rpm"].values):
        row: dict[str, Any] = {"shaft_speed_rpm": round(float(rpm), 6), "load_N": load}
        for name in MEANS:
            blocks = found["block_growth" if name == "exponents" else f"{name}_blocks"].values[i]
            error = np.std(blocks, ddof=1) / np.sqrt(blocks.size)
            if not error > 0:  # a tangent vector that is no number any more grows by nothing: not known
                row[name] = None
                continue
            row[name] = {"mean": float(f"{blocks.mean():.5g}"), "standard_error": float(f"{error:.2g}")}
        row |= {
            "pocket_force_max_N": float(f"{float(found['pocket_force_max_N'][i].max()):.4g}"),
            "state": found["label"].values[i].tolist(),
            "outcome": found["outcome"].values[i].tolist(),
        }
        rows.append(row)
    return rows


def made(discard: int, revolutions: int) -> dict[str, Any]:
    """The whole file."""
    model = jc.whole_bearing("nu2310")
    models = [jc.replace(model, load=load) for load in LOADS]
    length: dict[str, Any] = dict(initial_states=STARTS, discard=discard, revolutions=revolutions, blocks=BLOCKS)
    swept = jc.sweep(models, np.array([jc.rpm(rpm) for rpm in SPEEDS]), **length)
    sweeps = [swept.isel(design=i) for i in range(len(models))]
    trajectories = []
    for load in ARC_LOADS:
        found = sweeps[LOADS.index(load)]
        for rpm in ARC_SPEEDS:
            i = SPEEDS.index(rpm)
            trajectories.append(arcs(models[LOADS.index(load)], rpm, tuple(found["last"].values[i, 0].tolist())))
    return {
        "what": "NU2310, whole bearing: open benchmark case; docs/whole-bearing.md says how to compare with it",
        "made_by": f"python -m benchmarks.bearing_case --discard {discard} --revolutions {revolutions}",
        "commit": commit(),
        "configuration": configuration(model),
        "constants": constants(model),
        "arcs": trajectories,
        "statistics": {
            "initial_states": STARTS,
            "discard": discard,
            "revolutions": revolutions,
            "at": [row for load, sweep in zip(LOADS, sweeps, strict=True) for row in statistics(sweep, load)],
        },
    }


def main() -> None:
    """Make the file."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--discard", type=int, default=100)
    parser.add_argument("--revolutions", type=int, default=200, help=f"a multiple of {BLOCKS}")
    parser.add_argument("--out", type=pathlib.Path, default=FILE)
    given = parser.parse_args()
    jc.enable_x64()
    document = made(given.discard, given.revolutions)
    given.out.write_text(json.dumps(document, indent=1) + "\n", encoding="utf-8")
    print(f"{given.out}: {len(document['arcs'])} stretches of {ARCS} arcs, {len(document['statistics']['at'])} means")


if __name__ == "__main__":
    main()
