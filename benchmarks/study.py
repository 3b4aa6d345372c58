"""Big studies shown at full size, or in part: `python -m benchmarks.study [--size 0.02] [--only store,killed]`.

store: 200 000 lanes x 300 revolutions of case 1a over speed, guidance gap and eccentricity. Rate from start to end,
by the clock and by processor time, and peak memory.
killed: the same study killed twenty times at random and resumed: every file of the store must be the same.
dask: the same study on a local cluster of two workers, one of them killed half way: every file must be the same.

At full size the first takes some 40 minutes on two cores (83 lanes a second were measured), all of them hours;
`--size 0.05` is what is published.
"""

import argparse
import contextlib
import json
import multiprocessing
import os
import pathlib
import random
import resource
import signal
import subprocess
import sys
import tempfile
import time
from typing import Any

import numpy as np

import jaxcage as jc


CASE = "1a"
LANES, REVOLUTIONS, DISCARD, KILLS = 200_000, 300, 100, 20
STEADY = 0.10
"""Largest change of the rate between the tenths of a run."""
MEMORY_GIB = 2.0


def grid(size: float) -> dict[str, np.ndarray]:
    """Speeds x gaps x eccentricities: 200 000 lanes with one start at full size."""
    speeds = max(8, round(500 * size ** (1 / 3)))
    gaps = max(2, round(20 * size ** (1 / 3)))
    eccentricities = max(2, round(LANES * size / speeds / gaps))
    return {
        "eccentricity": np.linspace(15e-6, 30e-6, eccentricities),
        "guidance_gap": np.linspace(0.40e-3, 0.50e-3, gaps),
        "speed": jc.rpm(4000, 27500, speeds),
    }


def run(store: pathlib.Path, size: float, **more: Any) -> None:
    """The study, or what its store lacks."""
    import jax

    jax.config.update("jax_enable_x64", True)
    jc.keep_compiled_programs()
    options: dict[str, Any] = {"starts": 1, "discard": DISCARD, "revolutions": REVOLUTIONS, "lanes": chunk(size)}
    jc.study(jc.case(CASE), grid(size), store=store, **options, **more)


def chunk(size: float) -> int:
    """Lanes of a chunk: 2048 at full size, and enough chunks to kill in between at a small one."""
    return int(min(2048, max(64, LANES * size / 40)))


def contents(store: pathlib.Path) -> dict[str, bytes]:
    """Every file of a store."""
    return {str(p.relative_to(store)): p.read_bytes() for p in sorted(store.rglob("*")) if p.is_file()}


def unbroken(store: pathlib.Path, size: float) -> dict[str, Any]:
    """An unbroken run in this process: rate in each tenth, peak memory."""
    seen: list[tuple[float, float, int]] = []
    run(store, size, progress=lambda done, total: seen.append((time.perf_counter(), time.process_time(), done)))
    clock, work, done = (np.array(x, dtype=float) for x in zip(*seen[1:], strict=True))  # the first chunk compiles
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20
    return {
        "lanes": int(done[-1]),
        "seconds": seen[-1][0] - seen[0][0],
        "by_the_clock": rates(clock, done),
        "by_processor_time": rates(work, done),
        "peak_memory_gib": memory,
        "memory_bounded": memory < MEMORY_GIB,
    }


def rates(time_: np.ndarray, done: np.ndarray) -> dict[str, Any]:
    """How steady the rate is over the tenths of a run."""
    at = np.interp(np.linspace(done[0], done[-1], 11), done, time_)
    tenths = (done[-1] - done[0]) / 10 / np.diff(at)
    return {
        "lanes_per_second": (done[-1] - done[0]) / (time_[-1] - time_[0]),
        "tenths": [round(float(t), 2) for t in tenths],
        "last_tenth_over_first": tenths[-1] / tenths[0],
        "largest_change_of_a_tenth": float(np.max(np.abs(tenths / np.mean(tenths) - 1))),
        "steady": bool(abs(tenths[-1] / tenths[0] - 1) <= STEADY),
    }


def killed(store: pathlib.Path, size: float, seconds: float, seed: int = 0) -> dict[str, Any]:
    """The study in processes of its own, killed after random times until it has been killed often enough."""
    dice, kills, starts = random.Random(seed), 0, 0
    command = [sys.executable, "-m", "benchmarks.study", "--run", str(store), "--size", str(size)]
    while True:
        starts += 1
        with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
            assert process.stdout is not None
            process.stdout.readline()  # it has begun
            try:
                wait = dice.uniform(0, 2 * seconds / KILLS) if kills < KILLS else None
                process.wait(wait)
            except subprocess.TimeoutExpired:
                process.send_signal(signal.SIGKILL)
                kills += 1
        if process.returncode == 0:
            return {"kills": kills, "starts": starts}
        if process.returncode != -signal.SIGKILL:
            raise SystemExit(f"A run ended with status {process.returncode}.")


def on_dask(store: pathlib.Path, size: float) -> dict[str, Any]:
    """Two worker processes, one of which is killed half way."""
    victims: list[int] = []

    def kill_half_way(done: int, total: int) -> None:
        if 2 * done >= total and not victims:
            process = multiprocessing.active_children()[0]
            victims.append(process.pid or 0)
            os.kill(victims[0], signal.SIGKILL)

    begin = time.perf_counter()
    run(store, size, executor="dask", workers=2, progress=kill_half_way)
    return {"workers": 2, "killed": len(victims), "seconds": time.perf_counter() - begin}


def main() -> None:
    """Run what is asked for and print one JSON document."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.study", description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--size", type=float, default=1.0, help="part of the full size, e.g. 0.02")
    parser.add_argument("--only", default="store,killed,dask", help="store, killed, dask")
    parser.add_argument("--folder", type=pathlib.Path, help="keep the stores here, and take the whole one from here")
    parser.add_argument("--run", type=pathlib.Path, help="only run the study into this store")
    given = parser.parse_args()
    if given.run is not None:
        print("begun", flush=True)
        run(given.run, given.size)
        return
    import jax

    jax.config.update("jax_enable_x64", True)
    jc.keep_compiled_programs()
    found: dict[str, Any] = {"size": given.size}
    with contextlib.ExitStack() as stack:
        folder = given.folder or stack.enter_context(tempfile.TemporaryDirectory())
        whole, broken, spread = (pathlib.Path(folder, f"{name}.zarr") for name in ("whole", "broken", "spread"))
        kept, only = pathlib.Path(folder, "whole.json"), set(given.only.split(","))
        if kept.exists():
            found["store"] = json.loads(kept.read_text())
        elif {"store", "killed", "dask"} & only:
            found["store"] = unbroken(whole, given.size)
            kept.write_text(json.dumps(found["store"]))
            print(json.dumps(found), flush=True)
        if "killed" in only:
            found["killed"] = killed(broken, given.size, found["store"]["seconds"])
            found["killed"]["same_files"] = contents(whole) == contents(broken)
            print(json.dumps(found), flush=True)
        if "dask" in only:
            found["dask"] = on_dask(spread, given.size)
            found["dask"]["same_files"] = contents(whole) == contents(spread)
            print(json.dumps(found), flush=True)
    print(json.dumps(found, indent=2))


if __name__ == "__main__":
    main()
