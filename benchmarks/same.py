"""Whether the package of another checkout gives the same to the last bit: `python -m benchmarks.same PATH`.

For a change of when lanes are run, or beside which others, or of another part of the package: what the package before
it printed need not be made again (`SAME` in `benchmarks/remake/_stamps.py`). `cage`: sweeps of all cases, by several
methods, with and without exponents, short and long, confirmed and followed; some four minutes. `bearing`: sweeps of the
whole bearing, its histories by explicit and implicit steps, ramps and gradients; two minutes. `orbits`: synchronous
orbits of two cases, their branches and bifurcations, a sensitivity, stretches without a stable one; two minutes. Prints
which fields differ, with status 1.
"""

import argparse
import dataclasses
import hashlib
import json
import os
import pathlib
import subprocess
import sys
from collections.abc import Callable, Iterator
from typing import Any

import jax
import numpy as np

import jaxcage as jc


HERE = pathlib.Path(__file__).resolve()


Runs = dict[str, Callable[[], Any]]


def sweeps() -> Runs:
    """Of cages, by name."""
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


def bearings() -> Runs:
    """Of whole bearings, by name."""
    model = jc.whole_bearing("nu2310")
    light, cold = jc.replace(model, load=200.0), jc.replace(model, temperature=273.15)
    short: dict[str, Any] = {"discard": 2, "revolutions": 6}
    history = lambda model, rpm, **options: lambda: jc.simulate_bearing(model, jc.rpm(rpm), revolutions=2, **options)
    return {
        "bearings": lambda: jc.sweep_bearings([model, light], jc.rpm(3000, 15000, 3), starts=2, blocks=3, **short),
        "history": history(light, 10000),
        "history by implicit steps": history(cold, 1000, implicit=True),
        "up and down": lambda: jc.sweeps.bearing_up_down(
            light, jc.rpm(4000), jc.rpm(4400), jc.rpm(4000), steps=3, starts=1, settle=2
        ),
        "gradient": lambda: jc.design.bearing_gradient(model, jc.rpm(10000), designs=32, starts=1, **short),
    }


def orbits() -> Runs:
    """Of periodic orbits, by name."""
    model = jc.case("1a")
    reach = dict(zip(("lower", "upper"), jc.rpm(15000, 21000), strict=True))
    found = jc.synchronous_orbits(model, *jc.rpm(17000, 21000), count=9)
    fold = jc.bifurcation(model, "fold", jc.rpm(18686.3))
    return {
        "synchronous orbits": lambda: found.branches,
        "of another case": lambda: jc.synchronous_orbits(jc.case("3a"), *jc.rpm(12000, 15000), count=9).branches,
        "branch": lambda: jc.branch(model, jc.periodic_orbit(model, jc.rpm(15000)), **reach),
        "bifurcation": lambda: fold,
        "sensitivities": lambda: jc.orbits.sensitivities(model, {"fold": fold}),
        "loss": lambda: jc.loss_zones(found),
    }


PARTS: dict[str, Callable[[], Runs]] = {"cage": sweeps, "bearing": bearings, "orbits": orbits}


def digests(part: str) -> dict[str, str]:
    """Of every field of all results but for how they were made."""
    jc.enable_x64()
    return {
        name: hashlib.sha256(data).hexdigest() for key, run in PARTS[part]().items() for name, data in _of(key, run())
    }


def _of(name: str, value: Any) -> Iterator[tuple[str, bytes]]:
    """Names and bytes of all that is in `value`."""
    if isinstance(value, np.ndarray | jax.Array):
        yield name, np.asarray(value).tobytes()
    elif dataclasses.is_dataclass(value):
        for field in dataclasses.fields(value):
            if field.name != "settings":
                yield from _of(f"{name}, {field.name}", getattr(value, field.name))
    elif isinstance(value, dict | list | tuple):
        for key, x in value.items() if isinstance(value, dict) else enumerate(value):
            yield from _of(f"{name}, {key}", x)
    else:
        yield name, repr(value).encode()


def digests_at(checkout: pathlib.Path, part: str) -> dict[str, str]:
    """The same with the package of a checkout."""
    environment = {**os.environ, "PYTHONPATH": str(checkout), "JAXCAGE_CACHE": "off"}
    command = [sys.executable, "-P", str(HERE), "--digests", "--part", part]
    done = subprocess.run(command, env=environment, cwd=checkout, capture_output=True, text=True)
    if done.returncode:
        raise SystemExit(f"The sweeps did not end with the package at {checkout}:\n{done.stderr}")
    return json.loads(done.stdout)


def main() -> None:
    """Compare, or print the digests."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n\n")[0])
    parser.add_argument("checkout", nargs="?", type=pathlib.Path, help="where the other package lies")
    parser.add_argument("--part", choices=[*PARTS], default="cage", help="what is compared")
    parser.add_argument("--digests", action="store_true", help="print those of the package that is imported")
    given = parser.parse_args()
    if given.digests:
        print(json.dumps(digests(given.part)))
        return
    if given.checkout is None or not (given.checkout / "jaxcage").is_dir():
        parser.error(f"a checkout with a folder jaxcage is needed, but {given.checkout} was given.")
    here, there = (digests_at(path, given.part) for path in (HERE.parent.parent, given.checkout.resolve()))
    different = [name for name in sorted({*here, *there}) if here.get(name) != there.get(name)]
    print("\n".join(different) or f"All {len(here)} fields are the same to the last bit.")
    sys.exit(bool(different))


if __name__ == "__main__":
    main()
