"""Whole commands in units of an earlier version's sweep: `python -m benchmarks.commands PATH [--only "zones 1a"]`.

PATH is a checkout of that version (`git worktree add PATH 46948b2`). The unit is the wall time of its `sweep 1a` with
programs kept, the mean of a run before and one after all others. Each command is run in a new process and with a folder
of programs of its own, which is empty the first time (cold) and kept the second (warm).
"""

import argparse
import os
import pathlib
import subprocess
import sys
import tempfile
import time


ROOT = pathlib.Path(__file__).resolve().parent.parent
UNIT = "sweep 1a"
COMMANDS = ("sweep 1a", "zones 1a", "bifurcations 1a", "gradient 1a", "report 1a --quick", "design 1b")


def seconds(checkout: pathlib.Path, words: str, folder: pathlib.Path) -> float:
    """Wall time of a command of the package in `checkout`; programs are kept in `folder`.

    **Raises:** `CalledProcessError` for one that fails.
    """
    environment = os.environ | {"PYTHONPATH": str(checkout), "JAXCAGE_CACHE": str(folder / "programs")}
    command = [sys.executable, "-m", "jaxcage", *words.split(), "--out", str(folder / "out")]
    began = time.perf_counter()
    subprocess.run(command, cwd=folder, env=environment, check=True, capture_output=True)
    return time.perf_counter() - began


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.commands", description=(__doc__ or "").split("\n")[0])
    parser.add_argument("earlier", type=pathlib.Path, metavar="PATH", help="checkout of an earlier version")
    parser.add_argument("--only", action="append", metavar="COMMAND", help=f"one of {', '.join(COMMANDS)}, or another")
    given = parser.parse_args()
    earlier = given.earlier.resolve()
    if not (earlier / "jaxcage").is_dir():
        parser.error(f"a checkout with a folder jaxcage is needed, but {earlier} was given.")
    with tempfile.TemporaryDirectory() as name:
        unit_folder = pathlib.Path(name) / "unit"
        unit_folder.mkdir()
        seconds(earlier, UNIT, unit_folder)
        units, found = [seconds(earlier, UNIT, unit_folder)], {}
        for i, words in enumerate(given.only or COMMANDS):
            folder = pathlib.Path(name) / str(i)
            folder.mkdir()
            found[words] = [seconds(ROOT, words, folder) for _ in range(2)]
            print(f"{words}: {found[words][0]:.1f} s cold, {found[words][1]:.1f} s warm", flush=True)
        units.append(seconds(earlier, UNIT, unit_folder))
    unit = sum(units) / 2
    print(f"unit: {unit:.1f} s ({units[0]:.1f} and {units[1]:.1f})")
    for words, (cold, warm) in found.items():
        print(f"{words}: {cold / unit:.2f} units cold, {warm / unit:.2f} warm")


if __name__ == "__main__":
    main()
