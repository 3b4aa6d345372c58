"""The constants that the paper leaves out, from its edges: `python experiments/identify_nu2310.py [--minutes M]`.

Every candidate is swept over speeds in equal ratios in all six cases; its score is about the mean relative error of
the edges, with a price for every band too many (`jaxcage.design.screen`). An evolution strategy starts again and again,
in turns from the best set known and from quasi-random designs. `--cases 1a` fits cases of their own. Every better
candidate is printed with its values; another run ends elsewhere. `--begin experiments/case_fits/1a.json --cases 1a
--check` shows what values do.
"""

import argparse
import json
import time
from pathlib import Path

import numpy as np

import jaxcage as jc
from jaxcage.bearing import PUBLISHED_CASES
from jaxcage.reproduction import LASTING, compare_edges, zones_in_range


jc.enable_x64()

UNKNOWNS = (
    jc.design.Unknown("cage_mass", 0.20, 0.36),  # [kg] from the cage's shape
    jc.design.Unknown("stiffness_x", 5e3, 4e5),  # [N/m] of the support
    jc.design.Unknown("stiffness_y", 5e3, 4e5),
    jc.design.Unknown("cubic_stiffness", 1e10, 1e15),  # [N/m^3]
    jc.design.Unknown("damping", 0.3, 60.0),  # [N s/m]
    jc.design.Unknown("cross_stiffness", -1e4, 1e4, "linear"),  # [N/m]
    jc.design.Unknown("land_width", 0.5e-3, 6.5e-3),  # [m]
    jc.design.Unknown("amplitude", 10.0, 500.0),  # [N] at 1000 rad/s
    jc.design.Unknown("exponent", 1.0, 2.0, "linear"),
    jc.design.Unknown("contact_stiffness", 1e7, 1e11, sets=("stiffness",)),  # [N/m^(10/9)]
    jc.design.Unknown("restitution", 0.3, 1.0, "linear"),
)


def edges(cases: list[str]) -> list[jc.design.MeasuredEdge]:
    """The published ones, with the 2 % to which a diagram can be read."""
    made = []
    for name in cases:
        case = PUBLISHED_CASES[name]
        read = {"zone 1 onset": case.zone_1_onset_rpm, "zone 1 exit": case.zone_1_exit_rpm}
        read |= {"zone 2 onset": case.zone_2_onset_rpm}
        made += [jc.design.MeasuredEdge(name, edge, rpm, 0.02 * rpm, "chaotic") for edge, rpm in read.items()]
    return made


def known(name: str) -> dict[str, float]:
    """Values of a set of the package."""
    model = jc.case("1a", name)
    return {u.name: float(jc.parameters(model)[u.targets[0]]) for u in UNKNOWNS}


def check(cases: list[str], values: dict[str, float]) -> None:
    """Edges and number of zones with these values, at 100 rpm, from three starts."""
    chosen = {target: values[u.name] for u in UNKNOWNS for target in u.targets}
    models = [jc.replace(jc.case(name), **chosen) for name in cases]
    for name, swept in zip(cases, jc.sweep_designs(models, jc.rpm(2500, 27500, 251)), strict=True):
        found = jc.zones(swept).zones
        rows = compare_edges(PUBLISHED_CASES[name], found, LASTING)
        errors = [f"{r.edge} " + ("none" if r.ours_rpm is None else f"{r.error_percent:+.1f} %") for r in rows]
        print(f"{name}: {', '.join(errors)}; {len(zones_in_range(found))} zones", flush=True)


def main() -> None:
    """Search until the time is up, and print every better candidate."""
    parser = argparse.ArgumentParser(description="Identify the constants that the paper leaves out.")
    parser.add_argument("--minutes", type=float, default=60.0)
    parser.add_argument("--cases", nargs="+", default=list(PUBLISHED_CASES), choices=list(PUBLISHED_CASES))
    parser.add_argument("--starts", type=int, default=2, choices=(1, 2, 3), help="starts of a sweep")
    parser.add_argument("--by", default="motion", choices=("motion", "edges"), help="far from the answer, or near it")
    parser.add_argument("--generations", type=int, default=150, help="of each start of the evolution strategy")
    parser.add_argument("--speeds", type=int, default=56)
    parser.add_argument("--spread", type=float, default=0.1, help="first step, as a part of the bounds")
    parser.add_argument("--begin", type=Path, help="file of values to begin with, as --out writes it")
    parser.add_argument("--check", action="store_true", help="no search: the edges with the values of --begin")
    parser.add_argument("--out", type=Path, help="file for the best values")
    parser.add_argument("--quick", action="store_true", help="few designs, speeds and generations: for trying")
    given = parser.parse_args()
    jc.keep_compiled_programs()
    systems = {name: jc.case(name, "identified") for name in given.cases}
    grid = np.geomspace(4000, 27500, 12 if given.quick else given.speeds) * np.pi / 30
    small = (
        dict(designs=4, generations=4, discard=20, revolutions=20)
        if given.quick
        else dict(generations=given.generations)
    )
    small |= dict(discard=20, revolutions=20) if given.quick else dict(discard=120, revolutions=80)
    starts = jc.case("1a", "identified").starts(1000.0)[: given.starts]
    starts = [tuple(float(c) for c in start) for start in starts]
    begin = json.loads(given.begin.read_text()) if given.begin else known("identified")
    if given.check:
        return check(given.cases, begin)
    began, best, seed = time.perf_counter(), None, 0

    def better(tried: int, candidate: jc.design.Candidate) -> None:
        nonlocal best
        if best is None or candidate.score < best.score:
            best = candidate
            cases = ", ".join(f"{name} {wrong:.3f}" for name, wrong in candidate.by_case.items())
            print(f"{time.perf_counter() - began:.0f} s, {tried} tried: {candidate}\n  {cases}", flush=True)
            if given.out:
                given.out.write_text(json.dumps(candidate.values))

    while best is None or time.perf_counter() - began < 60 * given.minutes:
        near = best.values if best is not None else begin
        own = dict(begin=near, designs=2) if seed % 2 == 0 else dict(designs=256)
        options = dict(spread=given.spread, report=better, starts=starts, seed=seed, by=given.by) | own | small
        jc.design.screen(systems, UNKNOWNS, edges(given.cases), grid, **options)
        seed += 1
        if given.quick:
            break


if __name__ == "__main__":
    main()
