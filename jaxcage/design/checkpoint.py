"""The state of a search in a file of numbers, from which an interrupted search goes on."""

import dataclasses
import inspect
import json
import os
import types
import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import jax
import numpy as np

from .._errors import InputError
from .._parameters import parameters
from .objective import AbstractObjective, DesignSpace


def _described(x: Any) -> Any:
    """Description of an objective as JSON has it: the kinds of its parts and their numbers, to six digits since some
    come from simulations; of a function its name and the values that it was made with."""
    if x is None or isinstance(x, str | int):
        return x
    if isinstance(x, float):
        return f"{x:.6g}"
    if isinstance(x, np.ndarray | np.generic | jax.Array):
        return _described(np.asarray(x).tolist())
    if isinstance(x, Mapping):
        return {str(key): _described(value) for key, value in x.items()}
    if isinstance(x, list | tuple):
        return [_described(value) for value in x]
    if dataclasses.is_dataclass(x) and not isinstance(x, type):
        values = {f.name: _described(getattr(x, f.name)) for f in dataclasses.fields(x) if f.init}
        return {type(x).__qualname__: values}
    if callable(x):
        x = inspect.unwrap(x)
    if isinstance(x, types.FunctionType):
        cells = [cell.cell_contents for cell in x.__closure__ or () if cell.cell_contents is not x]
        return {x.__qualname__: _described([*(x.__defaults__ or ()), *cells])}
    return type(x).__qualname__


class Checkpoint:
    """A file of one search; a file of another search is refused."""

    def __init__(self, path: str | Path, space: DesignSpace, objective: AbstractObjective, **search: Any):
        """**Arguments:** path; space that is searched, and the objective; all else that the search depends on, as JSON
        has it."""
        design = {name: np.asarray(value).tolist() for name, value in parameters(space.system).items()}
        bounds = {name: list(pair) for name, pair in space.bounds.items()}
        self.path = Path(path)
        search |= {"design": design, "bounds": bounds, "objective": _described(objective)}
        self.search = json.dumps(search, sort_keys=True)

    def save(self, **arrays: Any) -> None:
        """Write arrays to the file, in place of those that were there."""
        beside = self.path.with_name(self.path.name + ".part")
        try:
            with beside.open("wb") as file:
                np.savez(file, search=np.asarray(self.search), **arrays)
            os.replace(beside, self.path)
        except OSError as error:
            beside.unlink(missing_ok=True)
            raise OSError(
                f"'{self.path}' could not be written ({error.strerror or error}): what was there before stays as it "
                "was, and once there is room the same call goes on from there."
            ) from error

    def load(self) -> dict[str, np.ndarray] | None:
        """The arrays that were saved; None if there is no file.

        **Raises:** `InputError` for a file of another search, or of none.
        """
        if not self.path.exists():
            return None
        try:
            with self.path.open("rb") as stream, np.load(stream, allow_pickle=False) as file:
                kept = dict(file)
        except (ValueError, EOFError, zipfile.BadZipFile) as error:
            raise InputError(f"'{self.path}' must be a file of this search, but is none: remove it.") from error
        if str(kept.get("search")) != self.search:
            raise InputError(f"'{self.path}' must be a file of this search, but is of another one: remove it.")
        return kept
