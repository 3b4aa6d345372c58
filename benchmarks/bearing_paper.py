"""`python -m benchmarks.bearing_paper`: what the published cage model prescribes, beside what the whole bearing gives.

`force`: the first harmonic of the pocket forces on the cage over its speed, beside the force (15) with identified
constants. `support`: least squares of those forces on place and velocity of the cage, beside the identified support;
their mean, and where the cage is in the mean.
`cases`: 1a to 3b as whole bearings, by guidance gap, unbalance and oil of each, over the cage's speed.
"""

import argparse
from typing import Any

import numpy as np

import jaxcage as jc
from benchmarks.bearing_trends import table
from jaxcage.analysis import bearing_history
from jaxcage.bearing import PUBLISHED_CASES
from jaxcage.forces import synchronous_amplitude


SPEEDS = (3000.0, 5000.0, 7500.0, 10000.0, 13000.0, 17000.0, 21000.0, 26000.0)
"""Of the cage in pure rolling [rpm]: the paper's range."""
SUPPORT_SPEEDS = (5000.0, 10000.0, 17000.0, 26000.0)
SAMPLES = 128
SHORT = {"locally_periodic": "periodic", "disordered": "disordered", "circular": "circular", "failed": "failed"}


def whole_case(name: str) -> jc.BearingModel:
    """A published case as a whole bearing: its gap, unbalance and oil; the rest is that of NU2310."""
    given, cage = PUBLISHED_CASES[name], jc.case(name)
    oil = {n: float(x) for n, x in jc.parameters(cage).items() if n in ("viscosity_1", "viscosity_2")}
    changed = {"guidance_gap": given.guidance_gap_mm * 1e-3, "eccentricity": given.eccentricity_um * 1e-6}
    return jc.replace(jc.whole_bearing("nu2310"), **changed, **oil)


def shaft_speeds(model: jc.BearingModel, cage_rpm: tuple[float, ...]) -> np.ndarray:
    """Of the shaft [rad/s] at which the cage would roll at these speeds."""
    return np.asarray(jc.rpm(1.0)) * np.array(cage_rpm) / float(model.rolling_cage_speed(1.0))


def force(length: dict[str, Any]) -> None:
    """First harmonics over speed, beside (15)."""
    model, paper = whole_case("1a"), jc.case("1a").impact
    assert isinstance(paper, jc.forces.SynchronousImpact)
    found = jc.sweep_bearing(model, shaft_speeds(model, SPEEDS), exponents=0, **length)
    rows: list[tuple[str, ...]] = [("cage [rpm]", "horizontal [N]", "vertical [N]", "error", "(15) [N]", "M e omega^2")]
    x, y, omegas = [], [], []
    for i, rpm in enumerate(SPEEDS):
        omega = rpm * np.pi / 30 * (1 - found.cage_slip[i].mean())
        prescribed = float(synchronous_amplitude(omega, paper.amplitude, paper.reference_speed, paper.exponent))
        unbalance = float(model.cage_mass * model.eccentricity) * omega**2
        across, upward = found.synchronous_force_x_N[i], found.synchronous_force_y_N[i]
        error = np.sqrt(np.mean(found.synchronous_force_error_N[i] ** 2) / across.size)
        cells = across.mean(), upward.mean(), error, prescribed, unbalance
        rows.append((f"{rpm:.0f}", *(f"{value:.1f}" for value in cells)))
        x, y, omegas = [*x, across.mean()], [*y, upward.mean()], [*omegas, omega]
    print("First harmonic of the pocket forces on the cage, case 1a, mean amplitude over starts")
    table(rows)
    for name, values in (("horizontal", x), ("vertical", y)):
        power, logarithm = np.polyfit(np.log(np.array(omegas) / 1000), np.log(values), 1)
        print(f"{name}: about {np.exp(logarithm):.0f} N at 1000 rad/s, growing as its power {power:.2f}")
    print(f"identified for (15): {float(paper.amplitude):.0f} N at 1000 rad/s, power {float(paper.exponent):.2f}")


def support(revolutions: int, discard: int) -> None:
    """Stiffness and damping of the pockets by least squares, errors by leaving out one revolution after the other."""
    model, paper = whole_case("1a"), jc.case("1a").support
    rows: list[tuple[str, ...]] = [
        (
            "cage [rpm]",
            "K_x [kN/m]",
            "K_y [kN/m]",
            "K_xy [kN/m]",
            "damping [N s/m]",
            "explained",
            "mean push [N]",
            "place",
        )
    ]
    for rpm, speed in zip(SUPPORT_SPEEDS, shaft_speeds(model, SUPPORT_SPEEDS), strict=True):
        run = jc.simulate_bearing(model, speed, revolutions=revolutions, discard=discard, samples=SAMPLES)
        history = bearing_history(model, run, float(speed))
        turn = history.angle
        place, velocity = run.bodies[:, 0:2], run.bodies[:, 2:4]
        known = np.column_stack([np.ones_like(turn), np.cos(turn), np.sin(turn), place, velocity])
        part = np.minimum((np.arange(turn.size) // SAMPLES), revolutions - 1)
        every = fitted(known, history.pocket_on_cage, np.ones(turn.size, dtype=bool))
        left_out = np.array([fitted(known, history.pocket_on_cage, part != i)[:4] for i in range(revolutions)])
        error = np.sqrt((revolutions - 1) * left_out.var(axis=0))
        scale = (1e-3, 1e-3, 1e-3, 1.0)
        cells = [f"{s * v:.0f} ± {s * e:.0f}" for s, v, e in zip(scale, every[:4], error, strict=True)]
        weight = np.gradient(history.time) / np.gradient(history.time).sum()
        push, mean_place = (
            ", ".join(f"{v:.{n}f}" for v in weight @ x) for n, x in ((0, history.pocket_on_cage), (2, history.place))
        )
        rows.append((f"{rpm:.0f}", *cells, f"{100 * every[4]:.1f} %", push, mean_place))
    print(f"Pocket forces on the cage against its place and velocity, case 1a, {revolutions} revolutions")
    table(rows)
    stiffness, cross = 1e-3 * float(paper.stiffness_x), 1e-3 * float(paper.cross_stiffness)
    print("mean push and place: to the right and upward, the place over the clearance")
    print(f"weight of the cage: {float(model.cage_mass * model.gravity):.1f} N")
    print(f"identified: K {stiffness:.0f} kN/m, K_xy {cross:.1f} kN/m, damping {float(paper.damping):.1f} N s/m")


def fitted(known: np.ndarray, forces: np.ndarray, used: np.ndarray) -> np.ndarray:
    """K_x, K_y, K_xy (the turning part), damping, and the share of the scatter that all of it explains."""
    slopes, *_ = np.linalg.lstsq(known[used], forces[used], rcond=None)
    left = forces[used] - known[used] @ slopes
    about = forces[used] - forces[used].mean(axis=0)
    explained = 1 - np.sum(left**2) / np.sum(about**2)
    return np.array(
        [-slopes[3, 0], -slopes[4, 1], (slopes[3, 1] - slopes[4, 0]) / 2, -(slopes[5, 0] + slopes[6, 1]) / 2, explained]
    )


def cases(length: dict[str, Any]) -> None:
    """What the cage does in each published case over speed."""
    models = {name: whole_case(name) for name in PUBLISHED_CASES}
    first = next(iter(models.values()))
    found = jc.sweep_bearings(list(models.values()), shaft_speeds(first, SPEEDS), **length)
    for what in ("state", "exponent", "eccentricity", "slip [%]"):
        rows: list[tuple[str, ...]] = [("case", *(f"{rpm:.0f} rpm" for rpm in SPEEDS))]
        for name, each in zip(models, found, strict=True):
            rows.append((name, *(cell(what, each, i) for i in range(len(SPEEDS)))))
        print(f"{what[0].upper()}{what[1:]} by the cage's speed, from all starts")
        table(rows)
    total = sum(each.outcome.size for each in found)
    counts = {name: sum(int((each.outcome == name).sum()) for each in found) for name in ("successful", "inaccurate")}
    print(f"Lanes: {total}, " + ", ".join(f"{n} {name}" for name, n in counts.items()))


def cell(what: str, found: jc.BearingSweep, i: int) -> str:
    """One entry of a table."""
    if what == "state":
        return ", ".join(sorted({SHORT[x] for x in found.state[i].tolist()}))
    if what == "exponent":
        blocks = found.block_means["exponent"][i]
        return f"{np.nanmean(blocks):.1f} ± {np.nanstd(blocks) / np.sqrt(blocks.size):.1f}"
    if what == "eccentricity":
        return f"{np.nanmean(found.eccentricity_mean[i]):.2f} ± {np.nanmean(found.eccentricity_std[i]):.2f}"
    return f"{100 * np.nanmean(found.cage_slip[i]):.2f}"


def main() -> None:
    """Read the options and run."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", choices=("force", "support", "cases"))
    parser.add_argument("--starts", type=int, default=2, choices=(1, 2, 3))
    parser.add_argument("--discard", type=int, default=20)
    parser.add_argument("--revolutions", type=int, default=20)
    given = parser.parse_args()
    if given.discard < 0 or given.revolutions < 2:
        parser.error("--revolutions must be at least 2, and --discard at least 0.")
    jc.enable_x64()
    length: dict[str, Any] = dict(
        starts=given.starts, discard=given.discard, revolutions=given.revolutions, blocks=given.revolutions
    )
    if given.what == "support":
        support(given.revolutions, given.discard)
    else:
        {"force": force, "cases": cases}[given.what](length)


if __name__ == "__main__":
    main()
