"""Ways of advancing the cage by revolutions, at the same reached accuracy: `python -m benchmarks [--quick]`.

Every rival gets the same equations, states and speeds; is held against a tight reference; climbs a ladder of settings;
and is timed at the cheapest one whose error is below the target in 99 % of states. Then what the library adds to plain
revolutions: exponents, monodromy matrices, an edge with its gradient, lanes by the thousand. Writes
`benchmarks/speed.md`, unless `--quick` or `--only` is given.
"""

import argparse
import json
import pathlib
import tempfile
import time
from collections.abc import Callable
from typing import Any

from jaxcage.sweeps import cores as available_cores

from . import sections
from .plain import seconds
from .problem import make_problem, save
from .report import machine, page
from .rivals import Rival, all_rivals, few_rivals


SECTIONS = ("precision", "plain", "exponents", "labels", "monodromy", "edge", "scaling")


def arguments() -> argparse.Namespace:
    """What the command line says."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks", description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--quick", action="store_true", help="few rivals, few lanes, nothing written")
    parser.add_argument("--only", metavar="A,B", help=f"sections: {', '.join(SECTIONS)} (plain needs precision)")
    parser.add_argument("--json", metavar="FILE", type=pathlib.Path, help="write the numbers too")
    given = parser.parse_args()
    given.sections = tuple(given.only.split(",")) if given.only else SECTIONS
    unknown = set(given.sections) - set(SECTIONS)
    if unknown:
        parser.error(f"--only takes {', '.join(SECTIONS)}, but not {', '.join(sorted(unknown))}")
    if "plain" in given.sections and "precision" not in given.sections:
        given.sections = ("precision", *given.sections)
    return given


def present(rivals: list[Rival], cores: int) -> tuple[dict[str, Rival], dict[str, float], dict[str, str]]:
    """Those who can take part, the seconds to prepare each, and why the others cannot."""
    there, spent, absent = {}, {}, {}
    for rival in rivals:
        why = rival.missing()
        if why:
            absent[rival.name] = why
            continue
        spent[rival.name] = seconds(lambda: rival.prepare(cores))
        there[rival.name] = rival
    return there, spent, absent


def main() -> None:
    """Run the sections and report."""
    given = arguments()
    begin = time.perf_counter()
    cores = available_cores()
    results: dict[str, Any] = {"machine": machine(cores)}
    print("states on the attractors", flush=True)
    problem = make_problem(512 if given.quick else 2048)
    needed = (few_rivals() if given.quick else all_rivals()) if "precision" in given.sections else []
    rivals, prepared, absent = present(needed, cores)
    for name, why in absent.items():
        print(f"  {name}: {why}", flush=True)
    with tempfile.TemporaryDirectory() as folder:
        file = str(pathlib.Path(folder, "lanes.npz"))
        save(problem, file)
        setup = sections.Setup(problem, file, given.quick, cores, rivals, prepared)
        measures: dict[str, Callable[[], dict[str, Any]]] = {
            "precision": lambda: sections.precision(setup),
            "plain": lambda: sections.plain(setup, results["precision"]["rivals"]),
            "exponents": lambda: sections.exponents(setup),
            "labels": lambda: sections.labels(setup),
            "monodromy": lambda: sections.monodromy(setup),
            "edge": lambda: sections.edge(setup),
            "scaling": lambda: sections.scaling(setup),
        }
        for name in (s for s in SECTIONS if s in given.sections):
            print(f"{name}, {time.perf_counter() - begin:.0f} s", flush=True)
            results[name] = measures[name]()
        for rival in rivals.values():
            rival.close()
    if "plain" in results:
        results["plain"]["skipped"] = absent
    report = page(results)
    print(f"\n{report}\n{time.perf_counter() - begin:.0f} s in all")
    if given.json:
        given.json.write_text(json.dumps(results, indent=1))
    if not given.quick and not given.only:
        pathlib.Path(__file__).with_name("speed.md").write_text(report)


if __name__ == "__main__":
    main()
