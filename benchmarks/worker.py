"""Timing of rivals, and measurements that need a process of their own: one core, peak memory.

`ask` starts `python -m benchmarks.worker TASK NUMBERS` and reads the JSON line with which it ends.
"""

import json
import os
import pathlib
import resource
import statistics
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from typing import Any


def seconds(run: Callable[[], Any]) -> float:
    """Wall time of one call."""
    import jax  # not above: `plain` leaves this process one core before JAX starts

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


def time_all(problem: Any, picks: Sequence[tuple[Any, Any]], repeats: int, share: int = 1) -> list[dict[str, Any]]:
    """Each rival's time for plain revolutions. They take turns, so that a busy machine is busy for all of them.

    **Arguments:** lanes; prepared rivals with their settings; number of turns; `share`, by which the lanes are divided.

    **Returns:** per rival: lanes, revolutions, `us` a revolution and lane (median), `spread` (largest over smallest),
    and `compile`, by how much the first call takes longer [s].
    """
    import jax

    jax.clear_caches()
    jobs = []
    for rival, setting in picks:
        lanes = max(1, min(rival.lanes, problem.speeds.size) // share)
        run = rival.on(problem.lanes(lanes))
        call = lambda run=run, rival=rival, setting=setting: run(rival.revolutions, setting)
        jobs.append((rival, setting, lanes, call, seconds(call)))
    spent = [[seconds(call) for _, _, _, call, _ in jobs] for _ in range(repeats)]
    rows = []
    for times, (rival, setting, lanes, _, first) in zip(zip(*spent, strict=True), jobs, strict=True):
        middle = statistics.median(times)
        row = {"name": rival.name, "setting": setting, "lanes": lanes, "revolutions": rival.revolutions}
        row |= {"us": middle / lanes / rival.revolutions * 1e6, "spread": max(times) / min(times)}
        rows.append(row | {"compile": max(first - middle, 0.0)})
        print(f"  {rival.name:28s} {show(setting):>11s} {row['us']:9.1f} us", flush=True)
    return rows


def ask(task: str, **numbers: Any) -> Any:
    """The worker's answer.

    **Raises:** `RuntimeError` if it failed.
    """
    command = [sys.executable, "-m", "benchmarks.worker", task, json.dumps(numbers)]
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode:
        raise RuntimeError(f"The worker for `{task}` failed:\n{done.stderr}")
    return json.loads(done.stdout.splitlines()[-1])


def memory_mb() -> float:
    """Peak resident memory of this process [MB].

    Linux counts in `ru_maxrss` what the parent held when it started this process: so the kernel's own high-water mark
    where there is one.
    """
    status = pathlib.Path("/proc/self/status")
    marks = [line.split()[1] for line in status.read_text().splitlines() if "VmHWM" in line] if status.exists() else []
    return float(marks[0] if marks else resource.getrusage(resource.RUSAGE_SELF).ru_maxrss) / 1024


def plain(file: str, settings: dict[str, Any], repeats: int) -> list[dict[str, Any]]:
    """`time_all` on one core, where the system can keep others away, for the rivals named in `settings`."""
    if sys.platform == "linux":  # threads that exist already keep their cores: before JAX starts
        os.sched_setaffinity(0, sorted(os.sched_getaffinity(0))[:1])
    from .problem import load
    from .rivals import all_rivals

    problem = load(file)
    rivals = {r.name: r for r in all_rivals() if r.name in settings}
    for rival in rivals.values():
        rival.prepare(1)
    rows = time_all(problem, [(rivals[name], setting) for name, setting in settings.items()], repeats, 2)
    for rival in rivals.values():
        rival.close()
    return rows


def scale(file: str, lanes: int, revolutions: int) -> dict[str, float]:
    """The library's default on any number of lanes: time and peak memory."""
    from .problem import load, our_map, spread_out

    problem = spread_out(load(file), lanes)
    run = lambda: our_map(problem, None, revolutions)
    first, spent = seconds(run), [seconds(run)]
    while sum(spent) < 2 and len(spent) < 5:
        spent.append(seconds(run))
    middle = statistics.median(spent)
    return {"us": middle / lanes / revolutions * 1e6, "compile": first - middle, "mb": memory_mb()}


if __name__ == "__main__":
    print(json.dumps({"plain": plain, "scale": scale}[sys.argv[1]](**json.loads(sys.argv[2]))))
