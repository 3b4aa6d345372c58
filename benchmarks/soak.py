"""One process over many laws of a user's own: `python -m benchmarks.soak [--minutes 60] [--models 500] [--out out]`.

Every turn makes a law that no program has been compiled for, sweeps it, follows one orbit of it and keeps a small study
of it, as a session does that tries one model after another. Between turns the process counts its memory and its memory
maps, of which Linux gives it 65 530. Writes `soak.json` and `soak.png`; prints a summary; exit status 1 if memory or
maps of the last third lie above those of the third before by more than a tenth, or the laws that are done in a second
of processor time below them by more than a fifth.
"""

import argparse
import dataclasses
import gc
import json
import pathlib
import shutil
import tempfile
import time
from typing import Any

import jax
import numpy as np


jax.config.update("jax_enable_x64", True)

import jax.numpy as jnp

import jaxcage as jc
from jaxcage.plotting import new_figure


GROWTH, SLOWER = 1.1, 0.8
"""Largest ratio of the last third to the one before of what should stay; smallest ratio of the rate."""
SETTLED = 40
"""Laws after which all that is kept is full, and memory may be asked to stay as it is."""


@dataclasses.dataclass(frozen=True)
class Moment:
    """The process after a turn."""

    seconds: float
    processor: float
    """Seconds of processor time since the beginning."""
    maps: int
    memory: float
    """[MB]."""


def law(height: float) -> jc.ForcedOscillator:
    """A law of one's own: a function that was not there before."""

    def acceleration(tau: Any, q: Any, v: Any, speed: Any) -> tuple[Any]:
        return (-0.1 * v[0] - q[0] - q[0] ** 3 + height * jnp.cos(tau),)

    return jc.ForcedOscillator(acceleration, coordinates=1)


def turn(number: int, folder: pathlib.Path) -> None:
    """What a session does with a model."""
    system, method = law(0.25 + 1e-4 * number), jc.method("rk4", steps=32)
    options: dict[str, Any] = dict(discard=10, revolutions=20, method=method)
    sweep = jc.sweep(system, np.linspace(1.1, 1.4, 4), confirm=False, horizon=0, **options)
    orbit = jc.periodic_orbit(system, 1.2, guess=sweep.strobe[1, 0, -1], method=method)
    store = folder / "store.zarr"
    jc.study(system, {"speed": np.linspace(1.1, 1.4, 8)}, store=store, name="soak", version="1", **options).load()
    shutil.rmtree(store)
    del sweep, orbit


def now(begin: float, worked: float) -> Moment:
    """The process as it is."""
    gc.collect()
    status = dict(line.split(":", 1) for line in pathlib.Path("/proc/self/status").read_text().splitlines())
    maps = pathlib.Path("/proc/self/maps").read_bytes().count(b"\n")
    memory = int(status["VmRSS"].split()[0]) / 1000
    return Moment(time.monotonic() - begin, time.process_time() - worked, maps, memory)


def run(minutes: float, models: int) -> list[Moment]:
    """Turns until the time is over or all models are done."""
    begin, worked = time.monotonic(), time.process_time()
    found = [now(begin, worked)]
    with tempfile.TemporaryDirectory() as folder:
        while len(found) <= models and found[-1].seconds < 60 * minutes:
            turn(len(found), pathlib.Path(folder))
            found.append(now(begin, worked))
    return found


def verdict(found: list[Moment]) -> dict[str, Any]:
    """What came of it, and whether it stayed as it was after the first third."""
    thirds = np.array_split(np.arange(1, len(found)), 3)
    mean = lambda name, part: float(np.mean([getattr(found[i], name) for i in part])) if len(part) else float("nan")
    rate = lambda part: len(part) / (found[part[-1]].processor - found[part[0] - 1].processor)
    ratios = {name: mean(name, thirds[2]) / mean(name, thirds[1]) for name in ("maps", "memory")}
    ratios["rate"] = rate(thirds[2]) / rate(thirds[1])
    long = len(thirds[0]) >= SETTLED
    flat = ratios["maps"] < GROWTH and ratios["memory"] < GROWTH and ratios["rate"] > SLOWER
    return {
        "laws": len(found) - 1,
        "minutes": round(found[-1].seconds / 60, 1),
        "most_maps": max(m.maps for m in found),
        "most_memory_MB": round(max(m.memory for m in found)),
        "last_third_to_the_one_before": {name: round(ratio, 3) for name, ratio in ratios.items()},
        "flat": flat if long else f"not asked: fewer than {3 * SETTLED} laws",
    }


def draw(found: list[Moment], path: pathlib.Path) -> None:
    """Maps, memory and rate over time."""
    fig = new_figure(8.0, 6.0)
    axes = fig.subplots(3, sharex=True)
    minutes = [m.seconds / 60 for m in found]
    axes[0].plot(minutes, [m.maps for m in found])
    axes[0].set_ylabel("memory maps")
    axes[1].plot(minutes, [m.memory for m in found])
    axes[1].set_ylabel("memory [MB]")
    work = np.diff([m.processor for m in found])
    axes[2].plot(minutes[1:], 60 / work)
    axes[2].set_ylabel("laws per minute\nof processor time")
    axes[2].set_xlabel("time [min]")
    for each in axes:
        each.set_ylim(bottom=0)
    fig.savefig(path)


def main() -> None:
    """Run and report."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.soak", description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--minutes", type=float, default=60.0, help="so long at most")
    parser.add_argument("--models", type=int, default=500, help="so many laws at most")
    parser.add_argument("--out", type=pathlib.Path, default=pathlib.Path("out"), help="folder of figure and numbers")
    chosen = parser.parse_args()
    found = run(chosen.minutes, chosen.models)
    chosen.out.mkdir(parents=True, exist_ok=True)
    about = verdict(found)
    moments = [dataclasses.astuple(m) for m in found]
    names = [f.name for f in dataclasses.fields(Moment)]
    (chosen.out / "soak.json").write_text(json.dumps({**about, "columns": names, "moments": moments}))
    draw(found, chosen.out / "soak.png")
    print(json.dumps(about, indent=2))
    raise SystemExit(0 if about["flat"] is not False else 1)


if __name__ == "__main__":
    main()
