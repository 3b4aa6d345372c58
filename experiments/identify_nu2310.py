"""The constants that the paper leaves out, from its edges: `python experiments/identify_nu2310.py [--minutes M]`.

Every candidate is swept over 48 speeds in all six cases; its score is the share of speeds with the wrong kind of motion
(`jaxcage.screen`). An evolution strategy runs again and again from the best of quasi-random designs and from the best
found so far. The set `identified` in `jaxcage/models/_constants.py` comes from a search of this kind, 75 minutes
on two cores, with slightly other weights and bounds; another run ends elsewhere.
"""

import argparse
import time

import jax


jax.config.update("jax_enable_x64", True)

import jaxcage as jc
from jaxcage.bearing import PUBLISHED_CASES


UNKNOWNS = (
    jc.Unknown("cage_mass", 0.20, 0.36),  # [kg] from the cage's shape
    jc.Unknown("support_stiffness", 5e3, 4e5, sets=("stiffness_x", "stiffness_y")),  # [N/m] of the support
    jc.Unknown("cubic_stiffness", 1e10, 1e15),  # [N/m^3]
    jc.Unknown("damping", 0.3, 60.0),  # [N s/m]
    jc.Unknown("cross_stiffness", -4e3, 4e3, "linear"),  # [N/m]
    jc.Unknown("land_width", 0.5e-3, 6.5e-3),  # [m]
    jc.Unknown("amplitude", 10.0, 500.0),  # [N] at 1000 rad/s
    jc.Unknown("exponent", 1.0, 2.0, "linear"),
    jc.Unknown("contact_stiffness", 1e7, 1e11, sets=("stiffness",)),  # [N/m^(10/9)]
    jc.Unknown("restitution", 0.3, 1.0, "linear"),
)


def edges() -> list[jc.MeasuredEdge]:
    """The published ones, with the 2 % to which a diagram can be read."""
    made = []
    for name, case in PUBLISHED_CASES.items():
        read = {"zone 1 onset": case.zone_1_onset_rpm, "zone 1 exit": case.zone_1_exit_rpm}
        read |= {"zone 2 onset": case.zone_2_onset_rpm}
        made += [jc.MeasuredEdge(name, edge, rpm, 0.02 * rpm, "chaotic") for edge, rpm in read.items()]
    return made


def main() -> None:
    """Search until the time is up, and print every better candidate."""
    parser = argparse.ArgumentParser(description="Identify the constants that the paper leaves out.")
    parser.add_argument("--minutes", type=float, default=60.0)
    parser.add_argument("--quick", action="store_true", help="few designs and speeds, one generation: for trying")
    given = parser.parse_args()
    jc.keep_compiled_programs()
    chosen = {"unbalance": "as_printed"}  # the reading that lets gap and eccentricity act
    systems = {name: jc.replace(jc.case(name), **chosen) for name in PUBLISHED_CASES}
    grid = jc.rpm(4000, 27500, 12 if given.quick else 48)
    small = dict(designs=4, generations=1, discard=20, revolutions=20) if given.quick else dict(generations=60)
    began, best, seed = time.perf_counter(), None, 0
    while best is None or time.perf_counter() - began < 60 * given.minutes:
        begin = None if best is None or seed % 2 else best.values
        found = jc.screen(systems, UNKNOWNS, edges(), grid, seed=seed, begin=begin, **small)[0]
        seed += 1
        if best is None or found.score < best.score:
            best = found
            cases = ", ".join(f"{name} {wrong:.3f}" for name, wrong in found.by_case.items())
            print(f"{time.perf_counter() - began:.0f} s: {found}\n  wrong: {cases}", flush=True)
        if given.quick:
            break


if __name__ == "__main__":
    main()
