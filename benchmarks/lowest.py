"""A sample of the tests with the lowest versions that are allowed: `python -m benchmarks.lowest [--python 3.11]`.

Makes two virtual environments in a temporary folder: one with `uv`, which works out the lowest version of every
dependency that `pyproject.toml` allows, and one with those and a wheel of the package. Runs tests that use each of
them, and a command in a folder without the sources. Needs a network and some minutes; prints one JSON document; exit
status 1 if something failed, 2 if the environment could not be made.
"""

import argparse
import json
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import time
from typing import Any


ROOT = pathlib.Path(__file__).parents[1]
SAMPLE = (
    "test_start",  # tyro, rich
    "test_units_at_the_door",  # pint
    "test_bearing_errors",  # jax, equinox, optimistix
    "test_io_dataset",  # xarray, zarr, numpy
    "test_cache",  # platformdirs
    "test_traced",  # flatbuffers, jaxtyping
    "test_studies_damage",  # hypothesis
    "test_optimise",  # scikit-learn, optax
    "test_plotting",  # matplotlib
    "test_report_page",  # jinja2
    "test_spectra",  # scipy
)
"""Test files, and the dependencies for which they are on the list."""


class NotMade(Exception):
    """The environment could not be made."""


def call(*line: str | pathlib.Path, **more: Any) -> str:
    """What a command prints. **Raises:** `NotMade`."""
    found = subprocess.run(list(map(str, line)), capture_output=True, text=True, **more)
    if found.returncode:
        raise NotMade(f"{' '.join(map(str, line))}: {found.stderr.strip()[-1500:]}")
    return found.stdout


def environment(place: pathlib.Path, version: str) -> tuple[pathlib.Path, dict[str, str]]:
    """A Python with the lowest versions and a wheel of the package, and the versions of what is asked for by name."""
    call(sys.executable, "-m", "venv", place / "uv")
    call(place / "uv" / "bin" / "pip", "-q", "install", "uv")
    uv = place / "uv" / "bin" / "uv"
    options = ("--extra", "test", "--resolution", "lowest-direct", "--python-version", version)
    pins = place / "lowest.txt"
    call(uv, "pip", "compile", "-q", ROOT / "pyproject.toml", *options, "-o", pins)
    call(uv, "venv", "-q", "--python", version, place / "lowest")
    own = dict(os.environ, VIRTUAL_ENV=str(place / "lowest"))
    call(uv, "pip", "install", "-q", "-r", pins, env=own)
    call(uv, "pip", "install", "-q", "--no-deps", ROOT, env=own)
    text = (ROOT / "pyproject.toml").read_text()
    asked = set(re.findall(r'^    "([A-Za-z0-9_.-]+)[>\[]', text, re.MULTILINE))
    pinned = dict(line.split("==") for line in pins.read_text().splitlines() if re.match(r"[A-Za-z0-9_.-]+==", line))
    return place / "lowest" / "bin" / "python", {name: pinned[name] for name in sorted(asked & set(pinned))}


def run(version: str) -> dict[str, Any]:
    """Make the environment and run the sample."""
    begin = time.monotonic()
    with tempfile.TemporaryDirectory() as folder:
        place = pathlib.Path(folder)
        python, versions = environment(place, version)
        own = {k: v for k, v in os.environ.items() if k != "PYTHONPATH"} | {"JAXCAGE_CACHE": str(place / "programs")}
        alone = [python, "-m", "jaxcage", "statics", "1a", "--out", place / "out"]
        statics = subprocess.run(alone, cwd=place, env=own, capture_output=True, text=True)
        files = [f"tests/{name}.py" for name in SAMPLE]
        # What one old dependency no longer should do with another one is no fault of this package.
        others = ("-W", "default::DeprecationWarning")
        line = [python, "-m", "pytest", "-q", "-n", "0", "-p", "no:cacheprovider", *others, *files]
        tests = subprocess.run(line, cwd=ROOT, env=own, capture_output=True, text=True)
    failed = [line[:300] for line in tests.stdout.splitlines() if line.startswith(("FAILED", "ERROR"))]
    return {
        "python": version,
        "versions": versions,
        "command": "ok" if statics.returncode == 0 else statics.stderr.strip()[-1000:],
        "tests": tests.stdout.strip().splitlines()[-1:],
        "failed": failed or ([] if tests.returncode == 0 else [tests.stdout[-1000:] + tests.stderr[-1000:]]),
        "minutes": round((time.monotonic() - begin) / 60, 1),
    }


def main() -> None:
    """Run and report."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.lowest", description=(__doc__ or "").split("\n")[0])
    usual = ".".join(map(str, sys.version_info[:2]))
    parser.add_argument("--python", default=usual, help="version of Python")
    chosen = parser.parse_args()
    try:
        found = run(chosen.python)
    except NotMade as error:
        print(error, file=sys.stderr)
        raise SystemExit(2) from error
    print(json.dumps(found, indent=2))
    raise SystemExit(1 if found["failed"] or found["command"] != "ok" else 0)


if __name__ == "__main__":
    main()
