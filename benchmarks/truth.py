"""What the package says beside independent integrators: `python -m benchmarks.truth [--lanes] [--models 12]`.

The reference is `tests/reference`: the cage's equations written a second time, integrated by SciPy. Models are random
and legal, `narrow` ones near the paper's case 1a, `wide` ones anywhere in the declared ranges. Each option is a
section; without one all of them are run. Nothing is written; what is off is listed lane by lane.
"""

import argparse

import jaxcage as jc

from . import truth_lanes


SECTIONS = {"lanes": truth_lanes.report}


def main() -> None:
    """Run the sections that were asked for."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.truth", description=(__doc__ or "").split("\n")[0])
    for name, section in SECTIONS.items():
        parser.add_argument(f"--{name}", action="store_true", help=(section.__doc__ or "").split("\n")[0])
    parser.add_argument("--models", type=int, default=12, help="narrow models, and as many wide ones")
    parser.add_argument("--seed", type=int, default=0, help="of the first model; another one makes other models")
    given = parser.parse_args()
    jc.enable_x64()
    jc.keep_compiled_programs()
    seeds = range(given.seed, given.seed + given.models)
    for name in [name for name in SECTIONS if getattr(given, name)] or SECTIONS:
        SECTIONS[name](seeds)


if __name__ == "__main__":
    main()
