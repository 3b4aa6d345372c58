"""The state of a search in a file, so that it goes on where it stopped: numbers only, put in place whole."""

import json
import os
import zipfile
from pathlib import Path
from typing import Any

import numpy as np

from .._errors import InputError
from .._parameters import parameters
from ._objective import DesignSpace


class KeptSearch:
    """A file of one search; that of another is refused."""

    def __init__(self, path: str | Path, space: DesignSpace, **search: Any):
        """**Arguments:** where; the space that is searched; what else makes this search another one, as JSON has it."""
        design = {name: np.asarray(value).tolist() for name, value in parameters(space.system).items()}
        bounds = {u.name: [u.lower, u.upper] for u in space.unknowns}
        self.path = Path(path)
        self.what = json.dumps({"design": design, "bounds": bounds, **search}, sort_keys=True)

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
