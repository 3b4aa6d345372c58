"""What searches for a better design share: a file to go on from, and balance that may only get better."""

import dataclasses
import hashlib
from pathlib import Path

from .._errors import InputError
from ..models import BearingModel, CageModel
from ._job import Job
from ._options import DesignOptions


def kept_search(job: Job[DesignOptions]) -> Path:
    """File of the search until the command is through; another search has another file."""
    asked = dataclasses.replace(job.options, json=False, out="", style="light", no_cache=False, quick=False)
    return job.folder / f".design_{job.name}_{hashlib.sha256(repr(asked).encode()).hexdigest()[:12]}.npz"


def no_worse_balance(model: CageModel | BearingModel, vary: dict[str, tuple[float, float]]) -> str | None:
    """Lower the upper bound of the eccentricity to what it is now; what there is to say of that.

    **Raises:** `InputError` for bounds that do not let it become smaller.
    """
    if "eccentricity" not in vary:
        return None
    (lower, upper), own = vary["eccentricity"], float(model.eccentricity)
    if upper <= own:
        return None
    if lower >= own:
        raise InputError(
            f"Option --vary must let the eccentricity become smaller than the {own:g} m that it is, but it is "
            f"{lower:g} to {upper:g} m; with --worse-balance it may become larger."
        )
    vary["eccentricity"] = lower, own
    return f"Balance may only get better: eccentricity of at most {own * 1e6:g} um (--worse-balance lifts that)."
