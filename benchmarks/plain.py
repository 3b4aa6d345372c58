"""Plain revolutions: which setting of a rival reaches the target, that it solves the same equations, and its time."""

import statistics
import time
from collections.abc import Callable, Sequence
from typing import Any

import jax
import numpy as np

from .problem import TARGET, Problem, reached_error
from .rivals import Rival


CHECKED = 64
"""Lanes on which a rival is held against the reference at its tightest."""


def seconds(run: Callable[[], Any]) -> float:
    """Wall time of one call."""
    begin = time.perf_counter()
    jax.block_until_ready(run())
    return time.perf_counter() - begin


def quickest(run: Callable[[], Any]) -> float:
    """Smallest wall time of up to five calls, as many as fit into a second."""
    spent = [seconds(run)]
    while len(spent) < 5 and sum(spent) < 1:
        spent.append(seconds(run))
    return min(spent)


def show(setting: Any) -> str:
    """A setting in words."""
    if setting is None:
        return "default"
    return f"{setting} steps" if isinstance(setting, int) else f"tol {setting:.0e}"


def check(rival: Rival, problem: Problem, truth: np.ndarray) -> float:
    """Largest distance from the reference at the tight setting, in clearances.

    **Raises:** `RuntimeError` if it is more than the rival may have.
    """
    few = problem.lanes(CHECKED)
    got = rival.on(few)(1, rival.tight)
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
        rows.append({"setting": setting, "median": median, "most": most, "us": us})
        print(f"  {rival.name:28s} {show(setting):>11s} {median:9.1e} {most:9.1e} {rows[-1]['us']:9.1f} us", flush=True)
    return rows


def pick(rows: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """The first setting that reaches the target, else the one that comes nearest. Ladders go from cheap to tight."""
    good = [row for row in rows if row["most"] <= TARGET]
    return good[0] if good else min(rows, key=lambda row: row["most"])


def time_all(
    problem: Problem, picks: Sequence[tuple[Rival, Any]], repeats: int, share: int = 1
) -> list[dict[str, Any]]:
    """Each rival's time for plain revolutions. They take turns, so that a busy machine is busy for all of them.

    **Arguments:** lanes; prepared rivals with their settings; number of turns; `share`, by which the lanes are divided.

    **Returns:** per rival: lanes, revolutions, `us` a revolution and lane (median), `spread` (largest over smallest),
    seconds `first` of the first call, which compiles, and `compile`, its difference from a later one.
    """
    jax.clear_caches()
    jobs = []
    for rival, setting in picks:
        lanes = max(1, min(rival.lanes, problem.speeds.size) // share)
        run = rival.on(problem.lanes(lanes))
        call = lambda run=run, rival=rival, setting=setting: run(rival.revolutions, setting)
        jobs.append((rival, setting, lanes, call, seconds(call)))
        print(f"  first call of {rival.name}: {jobs[-1][-1]:.1f} s", flush=True)
    times: list[list[float]] = [[] for _ in jobs]
    for _ in range(repeats):
        for spent, (_, _, _, call, _) in zip(times, jobs, strict=True):
            spent.append(seconds(call))
    rows = []
    for spent, (rival, setting, lanes, _, first) in zip(times, jobs, strict=True):
        middle = statistics.median(spent)
        us = middle / lanes / rival.revolutions * 1e6
        row = {"name": rival.name, "setting": setting, "lanes": lanes, "revolutions": rival.revolutions, "us": us}
        rows.append({**row, "spread": max(spent) / min(spent), "first": first, "compile": max(first - middle, 0.0)})
        print(f"  {rival.name:28s} {show(setting):>11s} {us:9.1f} us", flush=True)
    return rows
