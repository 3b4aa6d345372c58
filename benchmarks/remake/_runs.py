"""Commands run once for each state of the package; what they print and leave is kept under `out/remade`."""

import datetime
import hashlib
import json
import os
import pathlib
import re
import shlex
import shutil
import subprocess
import sys
import time
from collections.abc import Sequence
from typing import Any, NamedTuple


ROOT = pathlib.Path(__file__).parents[2]
RECORD = "record.json"
"""Written last: a run without it did not end well."""


class Run(NamedTuple):
    """What came of a command."""

    text: str
    """What it printed on standard output."""
    document: dict[str, Any]
    """Its JSON document, empty for a command without one."""
    folder: pathlib.Path
    """Where it ran, or what it left in the checkout was copied to."""
    record: dict[str, Any]
    """Command, fingerprint of the package, commit, date and seconds."""


def fingerprint(root: pathlib.Path = ROOT) -> str:
    """What the package's files hold, committed or not; pages, tests and benchmarks do not count."""
    found = hashlib.sha256()
    for path in sorted((root / "jaxcage").rglob("*")):
        if path.is_file() and "__pycache__" not in path.parts:
            found.update(f"{path.relative_to(root).as_posix()}\0".encode() + path.read_bytes() + b"\0")
    return found.hexdigest()[:12]


def commit(root: pathlib.Path = ROOT) -> str:
    """The commit of the checkout, with a plus where the package differs from it."""
    git = lambda *words: subprocess.run(["git", *words], cwd=root, capture_output=True, text=True).stdout.strip()
    return (git("rev-parse", "--short", "HEAD") or "none") + ("+" if git("status", "--porcelain", "jaxcage") else "")


def folder_of(command: str, root: pathlib.Path = ROOT) -> pathlib.Path:
    """Where a command's output is kept."""
    return root / "out" / "remade" / re.sub(r"[^A-Za-z0-9.]+", "-", command)


def kept(command: str, tree: str, root: pathlib.Path = ROOT) -> Run | None:
    """An earlier run of a command with the package as it is, if there is one."""
    folder = folder_of(command, root)
    if not (folder / RECORD).exists():
        return None
    record = json.loads((folder / RECORD).read_text(encoding="utf-8"))
    if (record["command"], record["tree"]) != (command, tree):
        return None
    document = folder / "document.json"
    found = json.loads(document.read_text(encoding="utf-8")) if document.exists() else {}
    return Run((folder / "stdout.txt").read_text(encoding="utf-8"), found, folder, record)


def run(command: str, in_place: Sequence[str] = (), root: pathlib.Path = ROOT) -> Run | None:
    """Run a command; None if it fails.

    **Arguments:** the command; files that it leaves in the checkout: they are moved to where its output is kept, and
    what was there before comes back.
    """
    folder, tree = folder_of(command, root), fingerprint(root)
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    record: dict[str, Any] = {
        "command": command,
        "tree": tree,
        "commit": commit(root),
        "date": str(datetime.date.today()),
    }
    program, *words = shlex.split(command)
    ours = program == "jaxcage"
    if ours:
        words = ["-m", "benchmarks.remake._record", str(folder / "document.json"), *words]
    path = os.pathsep.join([str(root), *filter(None, [os.environ.get("PYTHONPATH")])])
    before = {name: (root / name).read_bytes() for name in in_place}
    began = time.perf_counter()
    with (folder / "stdout.txt").open("w") as out, (folder / "stderr.txt").open("w") as err:
        done = subprocess.run(
            [sys.executable, *words],
            cwd=folder if ours else root,
            env=os.environ | {"PYTHONPATH": path},
            stdin=subprocess.DEVNULL,
            stdout=out,
            stderr=err,
        )
    for name, data in before.items():
        shutil.copy(root / name, folder)
        (root / name).write_bytes(data)
    if done.returncode:
        return None
    record["seconds"] = round(time.perf_counter() - began, 1)
    (folder / RECORD).write_text(json.dumps(record, indent=1), encoding="utf-8")
    return kept(command, tree, root)
