"""Measurements that need a process of their own: fewer cores, peak memory, a limit of time.

`ask` starts `python -m benchmarks.worker TASK NUMBERS` and reads the JSON line with which it ends.
"""

import json
import os
import pathlib
import resource
import statistics
import subprocess
import sys
from typing import Any


SETTLED = 2.0
"""Seconds of repeats after which a time is taken as known."""


def ask(task: str, limit: float = 600.0, **numbers: Any) -> dict[str, Any] | None:
    """What the worker found; None if it took longer than `limit` seconds.

    **Raises:** `RuntimeError` if it failed.
    """
    command = [sys.executable, "-m", "benchmarks.worker", task, json.dumps(numbers)]
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=limit)
    except subprocess.TimeoutExpired:
        return None
    if done.returncode:
        raise RuntimeError(f"The worker for `{task}` failed:\n{done.stderr}")
    return json.loads(done.stdout.splitlines()[-1])


def keep_cores(count: int) -> None:
    """Leave this process only so many cores, where the system can.

    Threads that exist already keep theirs: to be called before JAX starts.
    """
    if sys.platform == "linux":
        os.sched_setaffinity(0, sorted(os.sched_getaffinity(0))[:count])


def memory_mb() -> float:
    """Peak resident memory of this process [MB].

    Linux counts in `ru_maxrss` what the parent held when it started this process: so the kernel's own high-water mark
    where there is one.
    """
    status = pathlib.Path("/proc/self/status")
    marks = [line.split()[1] for line in status.read_text().splitlines() if "VmHWM" in line] if status.exists() else []
    return float(marks[0] if marks else resource.getrusage(resource.RUSAGE_SELF).ru_maxrss) / 1024


def plain(file: str, settings: dict[str, Any], cores: int, repeats: int, share: int) -> list[dict[str, Any]]:
    """`time_all` for the rivals named in `settings`."""
    keep_cores(cores)
    from .plain import time_all
    from .problem import load
    from .rivals import all_rivals, few_rivals

    problem = load(file)
    rivals = {r.name: r for r in [*few_rivals(), *all_rivals()] if r.name in settings}
    for rival in rivals.values():
        rival.prepare(cores)
    rows = time_all(problem, [(rivals[name], setting) for name, setting in settings.items()], repeats, share)
    for rival in rivals.values():
        rival.close()
    return rows


def scale(file: str, lanes: int, revolutions: int, cores: int) -> dict[str, float]:
    """The library's default on any number of lanes: time and peak memory."""
    keep_cores(cores)
    from .plain import seconds
    from .problem import load, our_map, spread_out

    problem = spread_out(load(file), lanes)
    run = lambda: our_map(problem, None, revolutions)
    first, spent = seconds(run), [seconds(run)]
    while sum(spent) < SETTLED and len(spent) < 5:
        spent.append(seconds(run))
    middle = statistics.median(spent)
    return {"us": middle / lanes / revolutions * 1e6, "seconds": middle, "compile": first - middle, "mb": memory_mb()}


def edge(lower_rpm: float, upper_rpm: float) -> dict[str, Any]:
    """The exit of zone 1: its search, then solving for it and its gradient by the expansion of the return map."""
    from .edge import search, solve_and_differentiate

    point, spent = search(lower_rpm, upper_rpm)
    at = {"state": [float(x) for x in point.state], "speed": float(point.speed)}
    return {"search": spent, **at, **solve_and_differentiate(point)}


def bifurcation(state: list[float], speed: float) -> dict[str, float]:
    """The same edge by `jaxcage.bifurcation`, and its gradient by reverse-mode differentiation of that."""
    from .edge import differentiate_bifurcation

    return differentiate_bifurcation(state, speed)


if __name__ == "__main__":
    tasks = {"plain": plain, "scale": scale, "edge": edge, "bifurcation": bifurcation}
    answer = tasks[sys.argv[1]](**json.loads(sys.argv[2]))
    print(json.dumps(answer))
