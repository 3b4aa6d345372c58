"""What a command will take, worked out before anything is computed: lanes, memory, disk, time; refused if not there."""

import dataclasses
import math
import os
import shutil
from pathlib import Path
from typing import Any

from .._errors import InputError
from ..models import CageModel
from ..studies import Study
from ..sweeps import cores
from ._console import say
from ._options import (
    CommonOptions,
    DesignOptions,
    ImpactOptions,
    MapOptions,
    PoincareOptions,
    SearchOptions,
    SimulateOptions,
    StudyOptions,
)


RATE = 5000.0
"""Revolutions of lanes that a core makes in a second, about, with the steps that are usual."""
ALONE = 700.0
"""Revolutions a second of one lane alone."""
USUAL = 600
"""Revolutions of a lane where no option says how many."""
WORTH_SAYING = 600.0
"""Seconds from which on it is said beforehand how long a computation will take."""
LONGEST = 90 * 86400.0
"""Seconds beyond which a computation is refused."""
SHARE = 0.9
"""Of the memory and of the disk that are free, how much may be asked for."""
NUMBER = 8.0
"""Bytes."""


@dataclasses.dataclass(frozen=True)
class Demand:
    """What a computation takes, about."""

    lanes: int
    revolutions: int
    """Of each lane."""
    memory: float
    """[bytes]."""
    disk: float = 0.0
    """[bytes]."""
    rate: float = RATE
    """Revolutions a second, of each core."""

    @property
    def seconds(self) -> float:
        """On all cores."""
        return self.lanes * self.revolutions / (self.rate * (cores() if self.lanes > 1 else 1))

    @property
    def work(self) -> str:
        """Lanes and revolutions."""
        return f"{self.lanes} {'lane' if self.lanes == 1 else 'lanes'} of {self.revolutions} revolutions"

    def __str__(self) -> str:
        disk = f", {_size(self.disk)} on disk" if self.disk else ""
        return f"{self.work}, about {_size(self.memory)} of memory{disk} and {_duration(self.seconds)}"


def demand_of(options: CommonOptions, model: CageModel | None) -> Demand:
    """What a command takes by its options alone."""
    count = lambda name, usual: int(getattr(options, name, None) or usual)
    dimension, own = (4, 3) if model is None else (model.dimension, len(model.starts(1.0)))
    revolutions = count("discard", 0) + count("revolutions", 0) or USUAL
    if isinstance(options, SimulateOptions):
        return Demand(1, revolutions, 5 * NUMBER * dimension * 128 * revolutions, 400.0 * 128 * revolutions, ALONE)
    if isinstance(options, MapOptions):
        across, upward = options.points or (options.columns or 0, options.rows or 0)
        lanes = max(across * upward * options.starts, options.count * own)
        return Demand(lanes, revolutions + count("persist", 0), _kept(lanes, 16, 20, 1, dimension))
    points = count("count", 0) or count("speeds", 1)
    lanes = points * own * (1 + count("batch", 0))
    lanes *= count("samples", 1)
    keep = revolutions if isinstance(options, PoincareOptions | ImpactOptions | DesignOptions) else 64
    if isinstance(options, SearchOptions):
        keep = 16
    spectra = 64 * 256 * count("waterfall", 0)
    memory = _kept(lanes, keep, 20, count("exponents", 1), dimension) + NUMBER * spectra
    return Demand(lanes, revolutions, memory, memory / 3)


def demand_of_study(work: Study) -> Demand:
    """What a study takes: of what is stored, labels and exponents are read to be counted."""
    dimension, lanes = work.system.dimension, work.plan.size
    several = 2 * NUMBER * work.exponents if work.exponents > 1 else 0
    stored = lanes * (4 * NUMBER + 3 + several + NUMBER * work.strobe * dimension)
    chunk = _kept(min(work.plan.lanes, lanes), max(16, work.strobe), work.blocks, work.exponents, dimension)
    return Demand(lanes, work.discard + work.revolutions, chunk + 40 * lanes, stored)


def _kept(lanes: int, keep: int, blocks: int, exponents: int, dimension: int) -> float:
    """Bytes of what is observed of lanes, as it comes from the programs, and as a result."""
    return 3.0 * NUMBER * lanes * (keep * dimension + blocks * exponents + 2 * dimension + 10)


def check_demand(demand: Demand, folder: Path, given: str) -> None:
    """Say what takes long, refuse what there is no room for. `given` names the options that make it large.

    **Raises:** `InputError` with the number.
    """
    asks = f"This asks for {demand.work}, about"
    there = {
        "of memory": (demand.memory, free_memory()),
        "on disk": (demand.disk, float(shutil.disk_usage(_existing(folder)).free)),
    }
    for where, (wanted, free) in there.items():
        if wanted > SHARE * free:
            part = "" if wanted > free else f", of which {SHARE:.0%} may be taken"
            but = f"but {_size(free)} are free{part}: choose a smaller {given}"
            raise InputError(f"{asks} {_size(wanted)} {where}, {but}.")
    if demand.seconds > LONGEST:
        more = f"more than the {_duration(LONGEST)} that a command may take: choose a smaller {given}"
        raise InputError(f"{asks} {_duration(demand.seconds)}, {more}.")
    if demand.seconds > WORTH_SAYING:
        say(f"Estimate: {demand}.")


def options_of_size(options: Any) -> str:
    """Options that say how much is computed, as a sentence lists them."""
    if isinstance(options, StudyOptions):
        return "--vary, --sample, --chunk or --revolutions"
    known = ("points", "count", "speeds", "samples", "batch", "waterfall", "revolutions", "discard")
    names = [f"--{name}" for name in known if getattr(options, name, None)]
    return " or ".join(filter(None, [", ".join(names[:-1]), names[-1]])) if names else "problem"


def free_memory() -> float:
    """Bytes that can be had without others losing theirs, as far as the system tells."""
    try:
        with open("/proc/meminfo", encoding="ascii") as file:
            found = next(line for line in file if line.startswith("MemAvailable:"))
        return 1024.0 * int(found.split()[1])
    except (OSError, StopIteration, ValueError):
        pass
    try:
        return float(os.sysconf("SC_PAGE_SIZE")) * os.sysconf("SC_PHYS_PAGES")
    except (AttributeError, OSError, ValueError):
        return math.inf


def _existing(folder: Path) -> Path:
    """The folder, or the nearest one above it that is there; a name that is too long is none."""
    return next(place for place in (folder.absolute(), *folder.absolute().parents) if os.path.isdir(place))


def _size(size: float) -> str:
    for unit in ("MB", "GB"):
        size /= 1000 if unit == "GB" else 1e6
        if size < 1000:
            return f"{size:.3g} {unit}"
    return f"{size / 1000:.4g} TB"


def _duration(seconds: float) -> str:
    for unit, length in (("s", 1.0), ("min", 60.0), ("h", 3600.0)):
        if seconds / length < 100:
            return f"{seconds / length:.2g} {unit}"
    return f"{seconds / 86400:.0f} days"
