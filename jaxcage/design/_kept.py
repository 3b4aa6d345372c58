"""The state of a search in a file, so that it goes on where it stopped: numbers only, put in place whole."""

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
from ._objective import AbstractObjective, DesignSpace


def made_of(x: Any) -> Any:
    """What tells an objective from another, as JSON has it: the kinds of its parts and their numbers, to six digits
    since some come from simulations; of a function its name and the values that it was made with."""
    if x is None or isinstance(x, str | int):
        return x
    if isinstance(x, float):
        return f"{x:.6g}"
    if isinstance(x, np.ndarray | np.generic | jax.Array):
        return made_of(np.asarray(x).tolist())
    if isinstance(x, Mapping):
        return {str(key): made_of(value) for key, value in x.items()}
    if isinstance(x, list | tuple):
        return [made_of(value) for value in x]
    if dataclasses.is_dataclass(x) and not isinstance(x, type):
        values = {f.name: made_of(getattr(x, f.name)) for f in dataclasses.fields(x) if f.init}
        return {type(x).__qualname__: values}
    if callable(x):
        x = inspect.unwrap(x)  # a compiled one is what it was made of
    if isinstance(x, types.FunctionType):
        cells = [cell.cell_contents for cell in x.__closure__ or () if cell.cell_contents is not x]
        return {x.__qualname__: made_of([*(x.__defaults__ or ()), *cells])}
    return type(x).__qualname__


class KeptSearch:
    """A file of one search; that of another is refused."""

    def __init__(self, path: str | Path, space: DesignSpace, objective: AbstractObjective, **search: Any):
        """**Arguments:** where; the space that is searched, and for what; what else makes this search another one, as
        JSON has it."""
        design = {name: np.asarray(value).tolist() for name, value in parameters(space.system).items()}
        bounds = {name: list(pair) for name, pair in space.bounds.items()}
        self.path = Path(path)
        what = {"design": design, "bounds": bounds, "objective": made_of(objective), **search}
        self.what = json.dumps(what, sort_keys=True)

    def save(self, **arrays: Any) -> None:
        """Put these in the file, in place of what was there."""
        beside = self.path.with_name(self.path.name + ".part")
        try:
            with beside.open("wb") as file:
                np.savez(file, what=np.asarray(self.what), **arrays)
            os.replace(beside, self.path)
        except OSError as error:
            beside.unlink(missing_ok=True)
            raise OSError(
                f"'{self.path}' could not be written ({error.strerror or error}): what was there before stays as it "
                "was, and once there is room the same call goes on from there."
            ) from error

    def load(self) -> dict[str, np.ndarray] | None:
        """What was saved, None if nothing was.

        **Raises:** `InputError` for a file of another search, or of none.
        """
        if not self.path.exists():
            return None
        try:
            with self.path.open("rb") as stream, np.load(stream, allow_pickle=False) as file:
                kept = dict(file)
        except (ValueError, EOFError, zipfile.BadZipFile) as error:
            raise InputError(f"'{self.path}' must be a file of this search, but is none: remove it.") from error
        if str(kept.get("what")) != self.what:
            raise InputError(f"'{self.path}' must be a file of this search, but is of another one: remove it.")
        return kept
