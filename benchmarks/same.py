"""Whether the package of another checkout gives the same to the last bit: `python -m benchmarks.same PATH`.

For a change of when lanes are run, or beside which others: what the package before it printed need not be made again
(`SAME` in `benchmarks/remake/_stamps.py`). Sweeps of all cases, by several methods, with and without exponents, short
and long, confirmed and followed; prints which fields differ, with status 1. It takes some six minutes.
"""

import argparse
import dataclasses
import hashlib
import json
import os
import pathlib
import subprocess
import sys
from collections.abc import Callable
from typing import Any

import numpy as np

import jaxcage as jc


HERE = pathlib.Path(__file__).resolve()


def sweeps() -> dict[str, Callable[[], list[Any]]]:
    """By name."""
    one = lambda name, speeds, **options: lambda: [jc.sweep(jc.case(name), speeds, **options)]
    few: dict[str, Any] = {"discard": 100, "revolutions": 100, "horizon": 0}
    speeds = jc.rpm(500, 25000, 40)
    return {
        "default": one("1a", jc.rpm(50, 25150, 84)),
        "four exponents": one("2b", speeds, exponents=4, horizon=0),
        "no exponents": one("2a", speeds, exponents=0),
        "by Runge-Kutta": one("3a", speeds, method=jc.method("rk4", steps=256), horizon=1500),
        "by Rodas4": one("3b", speeds[::2], method=jc.method("rodas4", steps=64), **few),
        "short": one("1b", speeds, discard=5, revolutions=20, blocks=5, keep=8, confirm=False, horizon=0),
        "several designs": lambda: jc.sweeps.sweep_designs(
            list(map(jc.case, ("1a", "1b", "2a"))), speeds, starts=1, settled=200, confirm=False, horizon=0
        ),
    }


def digests() -> dict[str, str]:
    """Of every field of all sweeps but for how they were made."""
    jc.enable_x64()
    found = {}
    for name, run in sweeps().items():
        for i, sweep in enumerate(run()):
            for field in dataclasses.fields(sweep):
                value = getattr(sweep, field.name)
                if field.name != "settings":
                    data = value.tobytes() if isinstance(value, np.ndarray) else repr(value).encode()
                    found[f"{name}, {i}: {field.name}"] = hashlib.sha256(data).hexdigest()
    return found


def digests_at(checkout: pathlib.Path) -> dict[str, str]:
    """The same with the package of a checkout."""
    environment = {**os.environ, "PYTHONPATH": str(checkout), "JAXCAGE_CACHE": "off"}
    command = [sys.executable, "-P", str(HERE), "--digests"]
    done = subprocess.run(command, env=environment, cwd=checkout, capture_output=True, text=True)
    if done.returncode:
        raise SystemExit(f"The sweeps did not end with the package at {checkout}:\n{done.stderr}")
    return json.loads(done.stdout)


def main() -> None:
    """Compare, or print the digests."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n\n")[0])
    parser.add_argument("checkout", nargs="?", type=pathlib.Path, help="where the other package lies")
    parser.add_argument("--digests", action="store_true", help="print those of the package that is imported")
    given = parser.parse_args()
    if given.digests:
        print(json.dumps(digests()))
        return
    if given.checkout is None or not (given.checkout / "jaxcage").is_dir():
        parser.error(f"a checkout with a folder jaxcage is needed, but {given.checkout} was given.")
    here, there = digests_at(HERE.parent.parent), digests_at(given.checkout.resolve())
    different = [name for name in sorted({*here, *there}) if here.get(name) != there.get(name)]
    print("\n".join(different) or f"All {len(here)} fields are the same to the last bit.")
    sys.exit(bool(different))


if __name__ == "__main__":
    main()
