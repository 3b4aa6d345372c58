"""Faults of a finished store: bits are flipped, files are swapped, deleted, cut, filled with nothing or made pipes,
folders and links, chunks and what describes them alike. Used by `test_studies_damage` and `store_life`.
"""

import os
import random
import shutil
import stat
from collections.abc import Callable
from pathlib import Path
from typing import Any

import jax.numpy as jnp
import numpy as np

import jaxcage as jc
from jaxcage.studies import Plan, Study, open_study, run_study
from jaxcage.studies._manifest import ABOUT, chunks_of, entry_of, keys_of, read_entry


Fault = Callable[[random.Random, Path, list[str]], None]


def duffing(tau: Any, q: Any, v: Any, speed: Any) -> tuple[Any]:
    """A law to fill a store with."""
    (x,), (u,) = q, v
    return (-0.1 * u - x - x**3 + 0.3 * jnp.cos(tau),)


def small_study() -> Study:
    """Two axes and two starts, in six chunks of four lanes."""
    grid = {"speed": np.linspace(1.1, 1.9, 6)}
    plan = Plan(grid, {}, 0, 0, 2, 2)
    return Study(jc.ForcedOscillator(duffing, coordinates=1), plan, jc.method("rk4", steps=32), 10, 20, 4, 2, 3)


def _flip(dice: random.Random, store: Path, files: list[str]) -> None:
    name = dice.choice(files)
    data = bytearray((store / name).read_bytes())
    if data:
        data[dice.randrange(len(data))] ^= 1 << dice.randrange(8)
    (store / name).write_bytes(data)


def _cut(dice: random.Random, store: Path, files: list[str]) -> None:
    name = dice.choice(files)
    data = (store / name).read_bytes()
    (store / name).write_bytes(data[: dice.randrange(len(data) + 1)])


def _nothing(dice: random.Random, store: Path, files: list[str]) -> None:
    name = dice.choice(files)
    (store / name).write_bytes(bytes((store / name).stat().st_size))


def _delete(dice: random.Random, store: Path, files: list[str]) -> None:
    name = dice.choice(files)
    (store / name).unlink()


def _delete_folder(dice: random.Random, store: Path, files: list[str]) -> None:
    folder = dice.choice(sorted({str(Path(name).parent) for name in files} - {"."}))
    shutil.rmtree(store / folder)


def _swap(dice: random.Random, store: Path, files: list[str]) -> None:
    """Two files of one length, if there are such, are the hardest to tell."""
    one = dice.choice(files)
    size = (store / one).stat().st_size
    alike = [name for name in files if name != one and (store / name).stat().st_size == size]
    other = dice.choice(alike or files)
    first, second = (store / one).read_bytes(), (store / other).read_bytes()
    (store / one).write_bytes(second)
    (store / other).write_bytes(first)


def _swap_chunks(dice: random.Random, store: Path, files: list[str]) -> None:
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


def _append(dice: random.Random, store: Path, files: list[str]) -> None:
    name = dice.choice(files)
    with open(store / name, "ab") as file:
        file.write(dice.randbytes(dice.randint(1, 2000)))


def _no_file(dice: random.Random, store: Path, files: list[str]) -> None:
    name, kind = dice.choice(files), dice.choice(["folder", "pipe", "device", "link to nothing"])
    (store / name).unlink()
    if kind == "folder":
        (store / name).mkdir()
    elif kind == "pipe":
        os.mkfifo(store / name)
    else:
        (store / name).symlink_to("/dev/zero" if kind == "device" else "/nowhere/at/all")


def _edit(dice: random.Random, store: Path, files: list[str]) -> None:
    """A digit of what describes the store: still a fine JSON document."""
    name = dice.choice([name for name in files if "/c/" not in name])
    text = (store / name).read_text(errors="replace")
    digits = [i for i, c in enumerate(text) if c.isdigit()]
    if digits:
        i = dice.choice(digits)
        text = text[:i] + str((int(text[i]) + dice.randint(1, 9)) % 10) + text[i + 1 :]
    (store / name).write_text(text)


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
        self.study = small_study()
        self.whole = folder / "whole.zarr"
        run_study(self.study, self.whole)
        self.truth, self.files = open_study(self.whole).load(), contents(self.whole)
        self.about = read_entry(self.whole / ABOUT)
        assert self.about is not None
        self.results = {n: self.study.chunk(n) for n in range(self.study.plan.chunks)}

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
        """Raise what is not a sentence of ours about the store."""
        told = isinstance(error, ValueError | OSError) and type(error).__module__ != "json.decoder"
        sentence = str(error)
        if not told or str(store) not in sentence or "\n" in sentence or not sentence.endswith("."):
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
