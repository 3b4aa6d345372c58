"""What the solver and its step do to the results: edges, exponents and chaotic width of all six cases.

    python -m benchmarks.solvers [--cases 1a,1b] [--only edge,width] [--quick]

Every solver that is one compiled loop is used with two step sizes; with diffrax's implicit ones, Kvaerno3, Kvaerno5 and
KenCarp4, a sweep takes hours, and the tests compare them on revolutions. Tables are printed and written to
`benchmarks/solvers.md`, each for itself:

1. Speeds of the exact edges of the synchronous orbit, and how far each solver's are from the finest one's [ppm].
2. Largest exponents of a calm and a chaotic speed of each case, with standard errors over the starts.
3. Chaotic width between 4000 and 27500 rpm of case 1b and of a design with few chaotic speeds, on a coarse grid.
"""

import argparse
import concurrent.futures
import multiprocessing
import pathlib
import time
from typing import Any

import numpy as np

import jaxcage as jc
from jaxcage.orbits import edge_speed


FINEST = ("rodas4", 2048)
SOLVERS = {
    "rodas3": (512, 1024),
    "rodas4": (256, 512),
    "rk4": (512, 1024),
    "newmark": (2048, 4096),
    "tsit5": (512, 1024),
}
METHODS = [FINEST, *((solver, n) for solver, pair in SOLVERS.items() for n in pair)]
OPTIMUM = {"guidance_gap": 0.3011e-3, "eccentricity": 59.1e-6}
"""A design with few chaotic speeds."""
CALM = 5000.0
CHAOTIC = {"1a": 10000.0, "1b": 11000.0, "2a": 9500.0, "2b": 9500.0, "3a": 10000.0, "3b": 10000.0}
"""Speeds of the exponents [rpm]."""
STARTS = 8
PARTS = ("edge", "exponent", "width")


def models(cases: list[str]) -> dict[str, jc.CageModel]:
    """The designs by name."""
    found = {name: jc.case(name) for name in cases}
    if "1b" in cases:
        found["1b, optimum"] = jc.replace(found["1b"], **OPTIMUM)
    return found


def located(model: jc.CageModel) -> dict[str, jc.orbits.Point]:
    """Ends of the synchronous-loss zones, at the default steps."""
    edges = jc.loss_zones(jc.synchronous_orbits(model, float(jc.rpm(4000)), float(jc.rpm(27500)))).edges
    return {n: jc.orbits.Point(p.kind, p.speed, p.state) for n, p in edges.items() if p.kind != "branch-point"}


def starts(model: jc.CageModel, speed: float) -> list[tuple[float, ...]]:
    """States at rest and moving, within six tenths of the clearance."""
    rng, c = np.random.default_rng(1), float(model.clearance)
    size = 0.6 * c * np.array([1.0, 1.0, 0.3 * speed, 0.3 * speed])
    return [tuple(float(v) for v in size * rng.uniform(-1, 1, 4)) for _ in range(STARTS)]


def exponent(model: jc.CageModel, speed: float, method: jc.integrate.AbstractMethod) -> tuple[float, float]:
    """Mean of the largest exponent over the starts, and its standard error."""
    swept = jc.sweep(model, speed, starts=starts(model, speed), method=method, discard=100, revolutions=150, blocks=1)
    every = swept.exponents[0, :, 0]
    return float(np.nanmean(every)), float(np.nanstd(every) / np.sqrt(every.size))


def results(
    solver: str, steps: int, cases: list[str], edges: dict[str, Any], only: list[str], quick: bool
) -> dict[str, Any]:
    """What is asked for by one solver, in a process of its own: compiled programs are let go of with it."""
    jc.enable_x64()
    jc.keep_compiled_programs()
    method, began = jc.method(solver, steps=steps), time.perf_counter()
    found: dict[str, Any] = {}
    for name, model in models(cases).items():
        for edge, point in edges.get(name, {}).items():
            found[f"edge|{name}|{edge}"] = float(edge_speed(model, point, method)) * 30 / np.pi
        if name in CHAOTIC and "exponent" in only:
            for kind, rpm in (("calm", CALM), ("chaotic", CHAOTIC[name])):
                found[f"exponent|{name}|{kind}"] = exponent(model, float(jc.rpm(rpm)), method)
        if name.startswith("1b") and "width" in only:
            grid = jc.rpm(4000, 27500, 8 if quick else 48)
            swept = jc.sweep(model, grid, starts=model.starts(grid[0])[:1], method=method, discard=100, revolutions=60)
            found[f"width|{name}|"] = float(np.mean(swept.label == "chaotic") * 23500)
    return found | {"seconds": time.perf_counter() - began}


def main() -> None:
    """Run every solver and write the tables."""
    parser = argparse.ArgumentParser(description="Spread of the results over solvers and step sizes.")
    parser.add_argument("--cases", default="1a,1b,2a,2b,3a,3b")
    parser.add_argument("--only", default=",".join(PARTS), help="which tables to make, the others are left as they are")
    parser.add_argument("--quick", action="store_true", help="the first two cases' worth of everything, three solvers")
    options = parser.parse_args()
    jc.enable_x64()
    cases = options.cases.split(",")
    methods = METHODS[:3] + METHODS[5:7] if options.quick else METHODS
    only = options.only.split(",")
    if unknown := set(only) - set(PARTS):
        parser.error(f"--only takes some of {', '.join(PARTS)}, but was given {', '.join(sorted(unknown))}")
    edges = {name: located(model) for name, model in models(cases).items() if name in cases and "edge" in only}
    print({n: len(e) for n, e in edges.items()}, "edges", flush=True)
    context, found = multiprocessing.get_context("spawn"), {}
    with concurrent.futures.ProcessPoolExecutor(2, mp_context=context, max_tasks_per_child=1) as pool:
        tasks = {pool.submit(results, m[0], m[1], cases, edges, only, options.quick): m for m in methods}
        for task in concurrent.futures.as_completed(tasks):
            solver, steps = tasks[task]
            if task.exception():
                print(f"{solver} {steps}: {task.exception()}", flush=True)
                continue
            found[tasks[task]] = task.result()
            print(f"{solver} {steps}: {found[tasks[task]].pop('seconds'):.0f} s", flush=True)
            if FINEST in found and not options.quick:  # after each solver: the last ones take long
                write({m: found[m] for m in methods if m in found}, only)
    made = tables({m: found[m] for m in methods if m in found})
    print("\n".join(made[part] for part in PARTS if part in only))


PAGE = pathlib.Path(__file__).with_suffix(".md")
HEAD = """# Spread over solvers

Made by `python -m benchmarks.solvers`; steps per revolution behind each name.
"""


def write(found: dict[tuple[str, int], dict[str, Any]], only: list[str]) -> None:
    """The page with the tables in `only` made anew."""
    old = PAGE.read_text().split("\n## ")[1:] if PAGE.exists() else []
    kept = dict(zip(PARTS, (f"## {section.rstrip()}\n" for section in old), strict=False))
    made = tables(found)
    PAGE.write_text("\n".join([HEAD, *(made[p] if p in only else kept[p] for p in PARTS if p in only or p in kept)]))


def tables(found: dict[tuple[str, int], dict[str, Any]]) -> dict[str, str]:
    """The tables as Markdown, by their part."""
    best = found[FINEST]
    names = [f"{solver} {n}" for solver, n in found]
    keys = lambda kind: [k for k in best if k.startswith(kind + "|")]
    title = lambda key: ", ".join(part for part in key.split("|")[1:] if part)
    made: dict[str, list[str]] = {}
    made["edge"] = lines = [f"## Edges: off from {names[0]} [ppm]", "", f"| edge | rpm | {' | '.join(names[1:])} |"]
    lines += ["|---|" + "---:|" * len(names)]
    for key in keys("edge"):
        off = [1e6 * (row[key] / best[key] - 1) for m, row in found.items() if m != FINEST]
        lines.append(f"| {title(key)} | {best[key]:.3f} | " + " | ".join(f"{o:+.2g}" for o in off) + " |")
    made["exponent"] = lines = [f"## Largest exponent per revolution, mean and standard error of {STARTS} starts", ""]
    lines += [f"| motion | {' | '.join(names)} |", "|---|" + "---:|" * len(names)]
    for key in keys("exponent"):
        cells = (f"{row[key][0]:.4f} ± {row[key][1]:.4f}" for row in found.values())
        lines.append(f"| {title(key)} | " + " | ".join(cells) + " |")
    made["width"] = lines = ["## Chaotic speeds between 4000 and 27500 rpm [rpm]", ""]
    lines += [f"| design | {' | '.join(names)} |", "|---|" + "---:|" * len(names)]
    for key in keys("width"):
        lines.append(f"| {title(key)} | " + " | ".join(f"{row[key]:.0f}" for row in found.values()) + " |")
    return {part: "\n".join(lines) + "\n" for part, lines in made.items()}


if __name__ == "__main__":
    main()
