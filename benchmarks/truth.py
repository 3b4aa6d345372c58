"""Statements of the package beside finer steps and beside independent integrators: `python -m benchmarks.truth`.

Looked at are the six cases and random legal models: `narrow` ones near the paper's case 1a, `wide` ones anywhere in the
declared ranges. Finer is 8 times the steps at 16^-3 of the tolerance; the reference is `tests/reference`, the cage's
equations written a second time, integrated by SciPy. Each option is a section; without one all of them are run.
Nothing is written; what is off is listed, and makes the exit status 1.

`python -m benchmarks.truth [--lanes] [--labels] [--exponents] [--measures] [--orbits] [--models 20] [--seed 0]
[--kinds cases narrow wide] [--quick]`
"""

import argparse
import sys
import time
from collections.abc import Callable, Sequence

import jaxcage as jc

from . import truth_exponents, truth_labels, truth_lanes, truth_measures, truth_orbits
from .truth_models import CASES, KINDS, Subject, subjects


Section = Callable[[Sequence[Subject], bool], list[str]]
"""Prints what it finds about models, few points of each if it is to be quick, and returns what is wrong."""
SECTIONS: dict[str, Section] = {
    "lanes": truth_lanes.report,
    "labels": truth_labels.report,
    "exponents": truth_exponents.report,
    "measures": truth_measures.report,
    "orbits": truth_orbits.report,
}


def main(arguments: Sequence[str] | None = None) -> list[str]:
    """Run the sections that were asked for; what is wrong."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.truth", description=(__doc__ or "").split("\n")[0])
    for name, section in SECTIONS.items():
        parser.add_argument(f"--{name}", action="store_true", help=(section.__doc__ or "").split("\n")[0])
    parser.add_argument("--models", type=int, default=20, help="narrow models, and as many wide ones")
    parser.add_argument("--seed", type=int, default=0, help="of the first model; another one makes other models")
    parser.add_argument("--kinds", nargs="+", choices=KINDS, default=KINDS, help="which models")
    parser.add_argument("--quick", action="store_true", help="case 1a and one random model, at few speeds")
    given = parser.parse_args(arguments)
    jc.enable_x64()
    jc.keep_compiled_programs()
    few = given.quick
    kinds = [kind for kind in given.kinds if not (few and kind == "wide")]
    seeds = range(given.seed, given.seed + (1 if few else given.models))
    found = list(subjects(kinds, seeds, CASES[:1] if few else CASES))
    wrong = []
    for name in [name for name in SECTIONS if getattr(given, name)] or SECTIONS:
        begin = time.perf_counter()
        new = SECTIONS[name](found, few)
        print(f"{name}: {'; '.join(new) or 'nothing is wrong'} ({time.perf_counter() - begin:.0f} s)", flush=True)
        wrong += [f"{name}: {text}" for text in new]
    return wrong


if __name__ == "__main__":
    sys.exit(bool(main()))
