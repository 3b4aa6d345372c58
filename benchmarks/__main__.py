"""Ways of advancing the cage by revolutions, at the same reached accuracy: `python -m benchmarks [--quick]`.

Every rival gets the same equations, states and speeds; is held against a tight reference; climbs a ladder of settings;
and is timed at the cheapest one whose error is below the target in 99 % of states. Then what exponents and monodromy
matrices cost, and lanes by the thousand. Writes `benchmarks/speed.md`, unless `--quick` is given.
"""

import argparse
import pathlib
import statistics
import tempfile
from collections.abc import Sequence
from typing import Any

import numpy as np

import jaxcage as jc
from jaxcage.solve import cores as available_cores

from .common import machine, made_with, markdown
from .problem import CASE, FIRST_RPM, LAST_RPM, TARGET, Problem, make_problem, our_map, reached_error, save
from .rivals import Rival, all_rivals, few_rivals
from .worker import ask, quickest, seconds, show, time_all


PAGE = pathlib.Path(__file__).with_name("speed.md")
REFERENCE = 8192
"""Steps of Rodas4 that are taken for the truth."""
REPEATS = 3
CHECKED = 64
"""Lanes on which a rival is held against the reference at its tightest."""
SLOW = 1000.0
"""Microseconds a revolution and lane above which a rival is not timed on one core."""


def check(rival: Rival, problem: Problem, truth: np.ndarray) -> float:
    """Largest distance from the reference at the tight setting, in clearances.

    **Raises:** `RuntimeError` if it is more than the rival may have.
    """
    got = rival.on(problem.lanes(CHECKED))(1, rival.tight)
    apart = np.abs(got - truth[problem.places(CHECKED)])[:, :2] / float(problem.model.clearance)
    worst = float(np.max(np.where(np.isfinite(apart), apart, np.inf)))
    if rival.tight is not None and worst > rival.agree:
        raise RuntimeError(f"{rival.name} is {worst:.1e} clearances from the reference: not the same equations?")
    return worst


def ladder(rival: Rival, problem: Problem, truth: np.ndarray) -> list[dict[str, Any]]:
    """Work against precision: for each setting median and 99 % error over c, and microseconds a revolution and lane."""
    few = problem.lanes(min(rival.lanes, problem.speeds.size))
    image, timed, rows = rival.on(problem), rival.on(few), []
    for setting in rival.settings:
        median, most = reached_error(problem, truth, image(1, setting))
        timed(rival.revolutions, setting)
        us = quickest(lambda: timed(rival.revolutions, setting)) / few.speeds.size / rival.revolutions * 1e6
        rows.append({"name": rival.name, "setting": setting, "median": median, "most": most, "us": us})
        print(f"  {rival.name:28s} {show(setting):>11s} {median:9.1e} {most:9.1e} {us:9.1f} us", flush=True)
    return rows


def pick(rows: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """The first setting that reaches the target, else the one that comes nearest. Ladders go from cheap to tight."""
    good = [row for row in rows if row["most"] <= TARGET]
    return good[0] if good else min(rows, key=lambda row: row["most"])


def precision(sample: Problem, rivals: Sequence[Rival]) -> tuple[dict[str, dict[str, Any]], str]:
    """The setting of each rival that reaches the target, and the tables of all settings."""
    truth = our_map(sample, jc.method("rodas4", steps=REFERENCE))
    agree = [[rival.name, show(rival.tight), f"{check(rival, sample, truth):.1e}"] for rival in rivals]
    ladders = {rival.name: ladder(rival, sample, truth) for rival in rivals}
    body = [
        [row["name"], show(row["setting"]), f"{row['median']:.1e}", f"{row['most']:.1e}", f"{row['us']:.1f}"]
        for rows in ladders.values()
        for row in rows
    ]
    text = (
        "## Work and precision\n\n"
        f"Error of the one-revolution map, max(|dx|, |dy|) / c, over {sample.speeds.size} states on the attractors "
        f"from {FIRST_RPM:.0f} to {LAST_RPM:.0f} rpm, three initial states in turn. "
        f"Reference: Rodas4 with {REFERENCE} steps. "
        "Microseconds per revolution and lane are those of the quickest of up to five calls.\n\n"
        f"{markdown(['program', 'setting', 'median', '99 %', 'us'], body)}\n\n"
        "That they solve the same equations: largest distance from the reference when tight, over the clearance.\n\n"
        f"{markdown(['program', 'setting', 'largest'], agree)}\n"
    )
    return {name: pick(rows) for name, rows in ladders.items()}, text


def plain(
    problem: Problem, rivals: Sequence[Rival], picks: dict[str, dict[str, Any]], cores: int, file: str, quick: bool
) -> str:
    """Times at the settings picked: on all cores here, on one in a process of its own with half the lanes."""
    chosen = lambda name: picks[name]["setting"]
    rows = time_all(problem, [(rival, chosen(rival.name)) for rival in rivals], REPEATS)
    prepared = {rival.name: rival.prepared for rival in rivals}
    alone: dict[str, float] = {}
    if cores > 1 and not quick:
        few = {row["name"]: chosen(row["name"]) for row in rows if row["us"] < SLOW}
        found: Any = ask("plain", file=file, settings=few, repeats=REPEATS)
        alone = {row["name"]: row["us"] for row in found}
    reach = [row for row in rows if row["name"].startswith("jaxcage") and picks[row["name"]]["most"] <= TARGET]
    ours = min(reach or rows, key=lambda row: row["us"])
    body = [
        [
            row["name"] + (" (below)" if row is ours else ""),
            show(row["setting"]) + ("" if picks[row["name"]]["most"] <= TARGET else " (misses)"),
            f"{picks[row['name']]['most']:.1e}",
            f"{row['us']:.1f}",
            f"{row['us'] / ours['us']:.2f}",
            f"{1e6 / row['us']:,.0f}",
            f"{alone[row['name']]:.1f}" if row["name"] in alone else "",
            f"{row['compile'] + prepared[row['name']]:.1f}",
            f"{row['lanes']} x {row['revolutions']}",
            f"{row['spread']:.2f}",
        ]
        for row in sorted(rows, key=lambda row: row["us"])
    ]
    head = ["program", "setting", "99 % error / c", "us", "ratio", "revolutions / s", "us, one core", "compile, s"]
    return (
        f"## Plain revolutions at a reached error of {TARGET:g}\n\n"
        "Microseconds per revolution and lane, all cores, median of three runs that take turns; ratio to the cheapest "
        "row of jaxcage that reaches the target, marked `below`. Each program has the cheapest of its settings "
        "whose one-revolution error is below the target in 99 % of states, or `misses` the target with all of them.\n\n"
        f"{markdown([*head, 'lanes x revolutions', 'slowest / fastest'], body)}\n"
    )


def extras(problem: Problem) -> str:
    """Exponents along with 100 revolutions beside plain revolutions of the same lanes."""
    turns, initial_states = 100, problem.states[:, None]
    settings: dict[str, Any] = dict(initial_states=initial_states, discard=0, revolutions=turns, blocks=1, keep=1)
    swept = lambda k: jc.sweep(problem.model, problem.speeds, exponents=k, **settings)["last"]
    runs = {
        "plain revolution": (turns, lambda: swept(0)),
        "with one exponent": (turns, lambda: swept(1)),
        "with four exponents": (turns, lambda: swept(4)),
    }
    first = {name: seconds(run) for name, (_, run) in runs.items()}
    spent = [{name: seconds(run) for name, (_, run) in runs.items()} for _ in range(REPEATS)]
    middle = {name: statistics.median(s[name] for s in spent) for name in runs}
    us = {name: middle[name] / n / problem.speeds.size * 1e6 for name, (n, _) in runs.items()}
    rows = [
        [
            name,
            f"{us[name]:.1f}",
            f"{us[name] / us['plain revolution']:.2f}",
            f"{max(first[name] - middle[name], 0):.1f}",
        ]
        for name in runs
    ]
    head = ["", "us", "in plain revolutions", "compile, s"]
    text = f"jaxcage, default method, {problem.speeds.size} lanes."
    return f"## Exponents\n\n{text}\n\n{markdown(head, rows)}\n"


def scaling(file: str, cores: int, quick: bool) -> str:
    """Time and memory over lanes and over revolutions, each run in a process of its own."""
    plans = [(1, 200), (16, 200), *((n, 50) for n in (256, 1024, 4096, 16384, 100_000)), (256, 1000), (256, 4000)]
    body = []
    for lanes, turns in plans[1:3] if quick else plans:
        row: Any = ask("scale", file=file, lanes=lanes, revolutions=turns)
        body.append([f"{lanes:,}", f"{turns:,}", f"{row['us']:.1f}", f"{row['mb']:.0f}", f"{row['compile']:.1f}"])
        print(f"  {lanes} lanes, {turns} revolutions: {row['us']:.2f} us, {row['mb']:.0f} MB", flush=True)
    head = ["lanes", "revolutions", "us", "peak memory, MB", "compile, s"]
    text = f"jaxcage, default method, {cores} cores, each run in a process of its own."
    return f"## Lanes and revolutions\n\n{text}\n\n{markdown(head, body)}\n"


def main() -> None:
    """Measure and report."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks", description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--quick", action="store_true", help="few rivals, few lanes, nothing written")
    quick = parser.parse_args().quick
    cores = available_cores()
    head = f"# Speed\n\nMade by `python -m benchmarks`, case {CASE}: {machine(cores)}.\n"
    problem = make_problem(512 if quick else 2048)
    rivals = []
    for rival in few_rivals() if quick else all_rivals():
        if why := rival.missing():
            print(f"  {rival.name} is left out: {why}", flush=True)
        else:
            rival.prepared = seconds(lambda rival=rival: rival.prepare(cores))
            rivals.append(rival)
    with tempfile.TemporaryDirectory() as folder:
        file = str(pathlib.Path(folder, "lanes.npz"))
        save(problem, file)
        picks, work = precision(problem.lanes(512 if quick else 1024), rivals)
        parts = [plain(problem, rivals, picks, cores, file, quick), work, extras(problem), scaling(file, cores, quick)]
    for rival in rivals:
        rival.close()
    page = "\n".join([head, *parts, made_with()]) + "\n"
    print(f"\n{page}")
    if not quick:
        PAGE.write_text(page, encoding="utf-8")


if __name__ == "__main__":
    main()
