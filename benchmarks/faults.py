"""Random faults on a finished store by the thousand: `python -m benchmarks.faults [--count 1000] [--seed 0]`.

Bits are flipped, files are swapped, deleted, cut, filled with nothing or made pipes, folders and links, chunks and what
describes them alike. Each time the store is read, checked and run again: no lane may have another value than the true
one or none, what went wrong must be said in one sentence, exactly the chunks that differ are computed again, and the
store ends as it was, byte for byte. Prints one JSON document; exit status 1 if anything else happened.
"""

import argparse
import collections
import json
import os
import random
import shutil
import stat
import tempfile
import time
import traceback
from collections.abc import Callable
from pathlib import Path
from typing import Any

import jax
import numpy as np


jax.config.update("jax_enable_x64", True)

import jax.numpy as jnp

import jaxcage as jc
from jaxcage.studies import Plan, Study, check_study, open_study, run_study
from jaxcage.studies._manifest import ABOUT, chunks_of, entry_of, keys_of, read_entry


SHOWN = 10
"""Cases shown of those that went wrong."""
Fault = Callable[[random.Random, Path, list[str]], str]


def duffing(tau: Any, q: Any, v: Any, speed: Any) -> tuple[Any]:
    """A law to fill a store with."""
    (x,), (u,) = q, v
    return (-0.1 * u - x - x**3 + 0.3 * jnp.cos(tau),)


def small_study() -> Study:
    """Two axes and two starts, in six chunks of four lanes."""
    grid = {"speed": np.linspace(1.1, 1.9, 6)}
    plan = Plan(grid, {}, 0, 0, 2, 2)
    return Study(jc.ForcedOscillator(duffing, coordinates=1), plan, jc.method("rk4", steps=32), 10, 20, 4, 2, 3)


def _flip(dice: random.Random, store: Path, files: list[str]) -> str:
    name = dice.choice(files)
    data = bytearray((store / name).read_bytes())
    if data:
        data[dice.randrange(len(data))] ^= 1 << dice.randrange(8)
    (store / name).write_bytes(data)
    return f"a bit of {name}"


def _cut(dice: random.Random, store: Path, files: list[str]) -> str:
    name = dice.choice(files)
    data = (store / name).read_bytes()
    (store / name).write_bytes(data[: dice.randrange(len(data) + 1)])
    return f"{name} cut"


def _nothing(dice: random.Random, store: Path, files: list[str]) -> str:
    name = dice.choice(files)
    (store / name).write_bytes(bytes((store / name).stat().st_size))
    return f"{name} full of zeros"


def _delete(dice: random.Random, store: Path, files: list[str]) -> str:
    name = dice.choice(files)
    (store / name).unlink()
    return f"{name} deleted"


def _delete_folder(dice: random.Random, store: Path, files: list[str]) -> str:
    folder = dice.choice(sorted({str(Path(name).parent) for name in files} - {"."}))
    shutil.rmtree(store / folder)
    return f"{folder} deleted"


def _swap(dice: random.Random, store: Path, files: list[str]) -> str:
    """Two files of one length, if there are such, are the hardest to tell."""
    one = dice.choice(files)
    size = (store / one).stat().st_size
    alike = [name for name in files if name != one and (store / name).stat().st_size == size]
    other = dice.choice(alike or files)
    first, second = (store / one).read_bytes(), (store / other).read_bytes()
    (store / one).write_bytes(second)
    (store / other).write_bytes(first)
    return f"{one} and {other} swapped"


def _swap_chunks(dice: random.Random, store: Path, files: list[str]) -> str:
    """All files of two chunks, and what the manifest says of them."""
    about = read_entry(store / ABOUT)
    if about is None:
        return _swap(dice, store, files)
    one, other = dice.sample(range(chunks_of(about)), 2)
    names = [[*keys_of(about, n), f"manifest/chunks/{n}"] for n in (one, other)]
    for first, second in zip(*names, strict=True):
        if (store / first).is_file() and (store / second).is_file():
            a, b = (store / first).read_bytes(), (store / second).read_bytes()
            (store / first).write_bytes(b)
            (store / second).write_bytes(a)
    return f"chunks {one} and {other} swapped"


def _append(dice: random.Random, store: Path, files: list[str]) -> str:
    name = dice.choice(files)
    with open(store / name, "ab") as file:
        file.write(dice.randbytes(dice.randint(1, 2000)))
    return f"{name} longer"


def _no_file(dice: random.Random, store: Path, files: list[str]) -> str:
    name, kind = dice.choice(files), dice.choice(["folder", "pipe", "device", "link to nothing"])
    (store / name).unlink()
    if kind == "folder":
        (store / name).mkdir()
    elif kind == "pipe":
        os.mkfifo(store / name)
    else:
        (store / name).symlink_to("/dev/zero" if kind == "device" else "/nowhere/at/all")
    return f"{name} a {kind}"


def _edit(dice: random.Random, store: Path, files: list[str]) -> str:
    """A digit of what describes the store: still a fine JSON document."""
    name = dice.choice([name for name in files if "/c/" not in name])
    text = (store / name).read_text(errors="replace")
    digits = [i for i, c in enumerate(text) if c.isdigit()]
    if digits:
        i = dice.choice(digits)
        text = text[:i] + str((int(text[i]) + dice.randint(1, 9)) % 10) + text[i + 1 :]
    (store / name).write_text(text)
    return f"a digit of {name}"


FAULTS: dict[str, Fault] = {
    "bit": _flip,
    "cut": _cut,
    "zeros": _nothing,
    "deleted": _delete,
    "folder deleted": _delete_folder,
    "swapped": _swap,
    "chunks swapped": _swap_chunks,
    "longer": _append,
    "no file": _no_file,
    "digit": _edit,
}


def contents(store: Path) -> dict[str, bytes]:
    """Every regular file of a store."""
    names = (p for p in store.rglob("*") if stat.S_ISREG(os.lstat(p).st_mode))
    return {p.relative_to(store).as_posix(): p.read_bytes() for p in names}


class Bench:
    """A finished store, and what becomes of copies of it."""

    def __init__(self, folder: Path):
        self.folder, self.study = folder, small_study()
        self.whole = folder / "whole.zarr"
        run_study(self.study, self.whole)
        self.truth, self.files = open_study(self.whole).load(), contents(self.whole)
        self.about = read_entry(self.whole / ABOUT)
        assert self.about is not None
        self.results = {n: self.study.chunk(n) for n in range(self.study.plan.chunks)}
        self.count: collections.Counter[str] = collections.Counter()
        self.wrong: list[dict[str, Any]] = []

    def differing(self, store: Path) -> list[int]:
        """Chunks of which a file is not what it was."""
        assert self.about is not None
        there = contents(store)

        def differs(chunk: int) -> bool:
            entry = entry_of(store, chunk).relative_to(store).as_posix()
            keys = [entry, *keys_of(self.about or {}, chunk)]
            return any(there.get(key) != self.files.get(key) for key in keys)

        return [n for n in range(chunks_of(self.about)) if differs(n)]

    def said(self, error: Exception, store: Path) -> None:
        """Count an error: a sentence of ours, or a traceback."""
        told = isinstance(error, ValueError | OSError) and type(error).__module__ != "json.decoder"
        sentence = str(error)
        if told and str(store) in sentence and "\n" not in sentence and sentence.endswith("."):
            self.count["told in a sentence"] += 1
        else:
            raise error

    def read(self, store: Path, differing: list[int]) -> None:
        """Every lane is the true one, or pending if its chunk differs."""
        try:
            found = open_study(store).load()
        except (ValueError, OSError) as error:
            return self.said(error, store)
        pending = np.zeros(self.study.plan.shape, dtype=bool)
        for chunk in differing:
            pending[self.study.plan.region(chunk)] = True
        for name, true in self.truth.items():
            lanes = pending.reshape(pending.shape + (1,) * (true.ndim - pending.ndim))
            missing = np.nan if true.dtype.kind == "f" else -1
            if not np.array_equal(found[name], np.where(lanes, missing, true), equal_nan=true.dtype.kind == "f"):
                raise AssertionError(f"false values of {name}")
        for name, true in self.truth.coords.items():
            if not np.array_equal(found[name], true):
                raise AssertionError(f"false values of {name}")

    def one(self, dice: random.Random) -> None:
        """Damage a copy, read it, check it, run it again."""
        store = self.folder / "store.zarr"
        shutil.rmtree(store, ignore_errors=True)
        shutil.copytree(self.whole, store)
        done = []
        try:
            for _ in range(dice.choice([1, 1, 1, 2, 3])):
                kind = dice.choice(list(FAULTS))
                self.count[kind] += 1
                done.append(FAULTS[kind](dice, store, sorted(contents(store))))
            differing = self.differing(store)
            self.count["damaged"] += len(differing)
            self.read(store, differing)
            state = check_study(store)
            if state.chunks and state.finished != state.chunks - len(differing):
                raise AssertionError(f"found {state.damaged}, but {differing} differ")
            self.again(store, differing)
        except Exception as error:
            kind = "false values" if isinstance(error, AssertionError) else "tracebacks"
            self.count[kind] += 1
            if len(self.wrong) < SHOWN:
                last = traceback.extract_tb(error.__traceback__)[-1]
                what = f"{type(error).__name__}: {error} ({last.filename}, line {last.lineno})"
                self.wrong.append({"kind": kind, "what": what[-500:], "faults": done})

    def again(self, store: Path, differing: list[int]) -> None:
        """Run the study again: what differs is computed, and the store is as it was."""
        computed: list[int] = []
        results = self.results

        def chunk(self: Study, number: int) -> dict[str, np.ndarray]:
            computed.append(number)
            return results[number]

        true, Study.chunk = Study.chunk, chunk
        try:
            run_study(self.study, store)
        except (ValueError, OSError) as error:
            self.count["refused"] += 1
            return self.said(error, store)
        finally:
            Study.chunk = true
        self.count["recomputed"] += len(computed)
        if computed != differing:
            raise AssertionError(f"computed {computed}, but {differing} differ")
        if contents(store) != self.files:
            there = contents(store)
            other = [name for name in {**there, **self.files} if there.get(name) != self.files.get(name)]
            raise AssertionError(f"{other} are not what they were")


def run(count: int, seed: int) -> dict[str, Any]:
    """Damage a store `count` times."""
    begin, dice = time.perf_counter(), random.Random(seed)
    with tempfile.TemporaryDirectory() as place:
        bench = Bench(Path(place))
        for _ in range(count):
            bench.one(dice)
    names = ("tracebacks", "false values", "refused", "damaged", "recomputed")
    counts = {name: bench.count.pop(name, 0) for name in names} | dict(sorted(bench.count.items()))
    return {"stores": count, **counts, "seconds": round(time.perf_counter() - begin, 1), "wrong": bench.wrong}


def main() -> None:
    """Run and report."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.faults", description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--count", type=int, default=1000, help="damaged stores")
    parser.add_argument("--seed", type=int, default=0, help="another seed makes other faults")
    chosen = parser.parse_args()
    found = run(chosen.count, chosen.seed)
    print(json.dumps(found, indent=2))
    raise SystemExit(1 if found["wrong"] or found["damaged"] != found["recomputed"] else 0)


if __name__ == "__main__":
    main()
