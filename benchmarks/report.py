"""The page that the benchmark writes."""

import datetime
import os
import pathlib
import platform
from collections.abc import Iterable, Mapping
from importlib.metadata import PackageNotFoundError, version
from typing import Any

from .plain import show
from .problem import CASE, FIRST_RPM, LAST_RPM, TARGET


PACKAGES = ("jaxcage", "jax", "jaxlib", "diffrax", "equinox", "numpy", "scipy", "numba")


def machine(cores: int) -> dict[str, str]:
    """What the numbers were measured on."""
    cpu = pathlib.Path("/proc/cpuinfo")
    about = cpu.read_text() if cpu.exists() else ""
    models = [line.split(":")[1].strip() for line in about.splitlines() if line.startswith("model name")]
    flags = [word for word in ("avx512f", "avx2") if word in about]
    load = "/".join(f"{x:.1f}" for x in os.getloadavg())
    return {
        "processor": ", ".join([models[0] if models else platform.processor(), *flags[:1]]),
        "cores": str(cores),
        "load before": load,
        "python": platform.python_version(),
        **{name: _version(name) for name in PACKAGES},
        "date": datetime.date.today().isoformat(),
    }


def _version(name: str) -> str:
    try:
        return version(name)
    except PackageNotFoundError:
        return "none"


def table(head: Iterable[str], rows: Iterable[Iterable[str]]) -> str:
    """Markdown table, numbers to the right."""
    head, rows = list(head), [list(row) for row in rows]
    line = lambda cells: "| " + " | ".join(cells) + " |"
    return "\n".join([line(head), line(["---", *["---:"] * (len(head) - 1)]), *map(line, rows)])


def page(results: Mapping[str, Any]) -> str:
    """The whole report in Markdown."""
    makers = {
        "plain": _plain,
        "precision": _precision,
        "exponents": _exponents,
        "labels": _labels,
        "monodromy": _monodromy,
        "edge": _edge,
        "scaling": _scaling,
    }
    about = "; ".join(f"{name} {value}" for name, value in results["machine"].items())
    head = f"# Speed\n\nMade by `python -m benchmarks`, case {CASE}. {about[0].upper()}{about[1:]}.\n"
    return "\n".join([head, *(make(results[name]) for name, make in makers.items() if name in results)])


def _plain(found: Mapping[str, Any]) -> str:
    rows = found["rivals"]
    reach = [row for row in rows if row["name"].startswith("jaxcage") and row["most"] <= TARGET]
    ours = min(reach, key=lambda row: row["us"]) if reach else rows[0]
    alone = lambda row: f"{row['one_core']:.1f}" if row["one_core"] else ""
    body = [
        [
            row["name"] + (" (below)" if row is ours else ""),
            show(row["setting"]) + ("" if row["most"] <= TARGET else " (misses)"),
            f"{row['most']:.1e}",
            f"{row['us']:.1f}",
            f"{row['us'] / ours['us']:.2f}",
            f"{1e6 / row['us']:,.0f}",
            alone(row),
            f"{row['compile']:.1f}",
            f"{row['lanes']} x {row['revolutions']}",
            f"{row['spread']:.2f}",
        ]
        for row in sorted(rows, key=lambda row: row["us"])
    ]
    head = ["rival", "setting", "99 % error / c", "us", "ratio", "revolutions / s", "us, one core", "compile, s"]
    skipped = "".join(f"\n\nLeft out: {n} ({why})." for n, why in found.get("skipped", {}).items())
    return (
        f"## Plain revolutions at a reached error of {TARGET:g}\n\n"
        "Microseconds per revolution and lane, all cores, median of three runs that take turns; ratio to the cheapest "
        "row of jaxcage that reaches the target, marked `below`. Each rival is at its cheapest setting whose "
        "one-revolution error is below the target in 99 % of states; `misses` where no setting of its ladder is.\n\n"
        f"{table([*head, 'lanes x revolutions', 'slowest / fastest'], body)}{skipped}\n"
    )


def _precision(found: Mapping[str, Any]) -> str:
    body = [
        [row["name"], show(rung["setting"]), f"{rung['median']:.1e}", f"{rung['most']:.1e}", f"{rung['us']:.1f}"]
        for row in found["rivals"]
        for rung in row["ladder"]
    ]
    agree = [[r["name"], show(r["tight"]), f"{r['apart']:.1e}"] for r in found["rivals"] if r["tight"] is not None]
    doubt = f", 99 % of it within {found['doubt']:.1e} of 16384 steps" if found["doubt"] is not None else ""
    return (
        "## Work and precision\n\n"
        f"Error of the one-revolution map, max(|dx|, |dy|) / c, over {found['states']} states on the attractors from "
        f"{FIRST_RPM:.0f} to {LAST_RPM:.0f} rpm, three starts in turn. Reference: Rodas4 with 8192 steps"
        f"{doubt}. Microseconds per revolution and lane are those of the quickest of up to five calls.\n\n"
        f"{table(['rival', 'setting', 'median', '99 %', 'us'], body)}\n\n"
        "That they solve the same equations: largest distance from the reference when tight, over the clearance.\n\n"
        f"{table(['rival', 'setting', 'largest'], agree)}\n"
    )


def _exponents(found: Mapping[str, Any]) -> str:
    unit = found["runs"]["0"]["seconds"]
    body = [
        [
            k,
            f"{run['seconds'] / found['lanes'] / found['revolutions'] * 1e6:.1f}",
            f"{run['seconds'] / unit:.2f}",
            f"{run['compile']:.1f}",
        ]
        for k, run in found["runs"].items()
    ]
    return (
        f"## Lyapunov exponents\n\njaxcage, default method, {found['lanes']} lanes, {found['revolutions']} "
        f"revolutions.\n\n{table(['exponents', 'us', 'in plain revolutions', 'compile, s'], body)}\n"
    )


def _labels(found: Mapping[str, Any]) -> str:
    head = "## Confirmed labels\n\n"
    if "missing" in found:
        return f"{head}Not measured: {found['missing']}.\n"
    lanes = found["lanes"]
    cells = lambda s: [f"{s / lanes * 1e3:.1f}", f"{s / found['seconds']:.2f}"]
    body = [["jaxcage, default, confirmed", "", *cells(found["seconds"])]]
    for row in found["rows"]:
        body.append([f"SciPy LSODA, tol {row['tolerance']:.0e}", f"{row['same']:.1%}", *cells(row["seconds"])])
    return (
        f"{head}{found['closed']} of {lanes} lanes are periodic after {found['length']} revolutions. `same` is the "
        "share of lanes in which SciPy closes after as many revolutions, or does not close; chaotic transients and "
        "basins keep it below all. Exponents and confirmation are in our time and not in SciPy's.\n\n"
        f"{table(['rival', 'same', 'ms a label', 'ratio'], body)}\n"
    )


def _monodromy(found: Mapping[str, Any]) -> str:
    plain = found["runs"]["plain"]["seconds"] / found["revolutions"]
    matrices = found["runs"]["matrices"]["seconds"]
    return (
        f"## Monodromy matrices\n\nA batch of {found['lanes']}: {matrices / found['lanes'] * 1e6:.1f} us each, "
        f"{matrices / plain:.2f} plain revolutions; compile {found['runs']['matrices']['compile']:.1f} s.\n"
    )


def _edge(found: Mapping[str, Any]) -> str:
    head = "## An edge and its gradient\n\n"
    if "missing" in found:
        return f"{head}Not measured: {found['missing']}.\n"
    cells = lambda of, what: [f"{of[f'{what}_compile']:.1f}", f"{of[what]:.3f}"]
    rows = [["`sensitivity`", *cells(found, "solve"), *cells(found, "gradient")]]
    if found["bifurcation"]:
        of = found["bifurcation"]
        rows.append(["`bifurcation`, `jax.grad`", *cells(of, "solve"), *cells(of, "gradient")])
    else:
        rows.append(["`bifurcation`, `jax.grad`", f"more than {found['patience']:.0f}", "", "", ""])
    names = ["", "solve: compile, s", "solve, s", "solve and gradient: compile, s", "solve and gradient, s"]
    return (
        f"{head}Exit of zone 1, a period doubling at {found['rpm']:.2f} rpm; gradient by every parameter. Its search "
        f"among the synchronous orbits took {found['search']:.0f} s, compiling included.\n\n{table(names, rows)}\n"
    )


def _scaling(found: Mapping[str, Any]) -> str:
    body = [
        [
            f"{row['lanes']:,}",
            f"{row['revolutions']:,}",
            str(row["cores"]),
            *([f"{row['us']:.1f}", f"{row['mb']:.0f}", f"{row['compile']:.1f}"] if "us" in row else ["", "", ""]),
        ]
        for row in found["runs"]
    ]
    return (
        "## Lanes, revolutions, cores\n\njaxcage, default method, each run in a process of its own.\n\n"
        f"{table(['lanes', 'revolutions', 'cores', 'us', 'peak memory, MB', 'compile, s'], body)}\n"
    )
