"""Answer of a command: a sentence, tables and notes for people, a document for programs, files."""

import dataclasses
import io
import json
import math
import os
import sys
import textwrap
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import jaxcage as jc

from .._errors import visible
from .subject import Subject


if TYPE_CHECKING:
    from ..show import Table

ENDINGS = {"report": ".html", "file": ".toml"}
"""Extensions of text files, by key."""
USUAL = ("figure", "data", "curve_data", *ENDINGS)
"""Keys of files whose names do not contain the key."""
WIDTH = 110
"""Characters of a line of the sentence that answers."""
PLAIN = str.maketrans({"±": "+-", "µ": "u", "°": "deg ", "²": "^2", "³": "^3", "–": "-"})
"""ASCII replacements for characters that standard output cannot show."""


@dataclasses.dataclass(frozen=True)
class Answer:
    """Results of a command. The wrapper adds the case, the time, the files and the readings of the paper."""

    sentence: str
    tables: Sequence["Table"] = ()
    """Tables, the one that decides first; those with a key are also in the document."""
    notes: Sequence[str] = ()
    document: Mapping[str, Any] = dataclasses.field(default_factory=dict)
    """Further content of the JSON document, in SI units unless a name ends in another one."""
    files: Mapping[str, Any] = dataclasses.field(default_factory=dict)
    """Key in the document -> a figure, columns of numbers, a data set or a text; or the path of one already written."""
    details: Sequence[str] = ()
    """Notes that are printed on request only."""
    part: str = ""
    """Suffix of the case name in file names."""
    by_ranges: bool = False
    """True if values known within ranges only were not taken at their best guesses."""
    kept: Path | None = None
    """Store of finished lanes, which is removed when the files are written."""
    failure: str = ""
    """Message printed after the answer if something failed; the exit status is then 1."""


def complete(answer: Answer, command: str, subject: Subject, out: str, seconds: float) -> Answer:
    """Write the files of an answer, and add the parts that every command prints."""
    stem = Path(out) / f"{command}_{subject.name}{answer.part}"
    written = {key: str(_written(key, content, stem, subject)) for key, content in answer.files.items()}
    document = {"case": subject.name, **{table.key: table.records for table in answer.tables if table.key}}
    about, notes = subject.about(answer.by_ranges)
    document |= {**answer.document, **about, "seconds": round(seconds, 2), **written}
    notes = [*answer.notes, *notes, f"Time: {seconds:.1f} s"]
    notes += [f"{key.replace('_', ' ').capitalize()}: {visible(path)}" for key, path in written.items()]
    return dataclasses.replace(answer, document=document, notes=notes)


def _written(key: str, content: Any, stem: Path, subject: Subject) -> Path:
    import xarray as xr

    if isinstance(content, Path):
        return content
    path = stem if key in USUAL else stem.with_name(f"{stem.name}_{key}")
    named = lambda ending: path.with_name(path.name + ending)
    if isinstance(content, xr.Dataset):
        return jc.lanes.save(named(".zarr"), content)
    if isinstance(content, Mapping):
        return jc.show.write_columns(named(".csv"), content)
    if not isinstance(content, str) and subject.shaft is not None:
        jc.show.add_shaft_axes(content, 1 / subject.shaft)
    return write(named(ENDINGS.get(key, ".png")), content)


def write(path: Path, content: Any) -> Path:
    """Write a text or a figure, whole or not at all."""
    with jc.files.replacing(path) as temporary:
        if isinstance(content, str):
            temporary.write_text(content, encoding="utf-8")
        else:
            content.savefig(temporary, dpi=content.dpi)
    return path


def print_answer(answer: Answer, as_json: bool, details: bool = False) -> None:
    """Print an answer on standard output: one JSON document, or the sentence, the tables and the notes, with `details`
    all of them.

    **Raises:** `OSError` for a standard output that takes nothing.
    """
    if isinstance(sys.stdout, io.TextIOWrapper):  # names of files need not be text
        sys.stdout.reconfigure(errors="backslashreplace")
    if as_json:
        text = json.dumps(plain(answer.document), indent=2, allow_nan=False)
    else:
        tables = [table for table in answer.tables if details or not table.detail]
        notes = [*(answer.details if details else ()), *answer.notes]
        if len(tables) < len(answer.tables) or (answer.details and not details):
            notes.append("More tables and notes: --details")
        text = "\n\n".join([textwrap.fill(answer.sentence, WIDTH), *map(str, tables), "\n".join(notes)])
    try:
        text.encode(sys.stdout.encoding or "utf-8")
    except UnicodeEncodeError:
        text = text.translate(PLAIN)
    try:
        print(text, flush=True)
    except OSError as error:
        os.dup2(os.open(os.devnull, os.O_WRONLY), 1)  # otherwise Python tries again at exit, and complains
        raise OSError(
            f"Standard output could not be written ({error.strerror or error}): the files of this run are whole, make "
            "room and run it again for what it prints."
        ) from error


def plain(value: Any) -> Any:
    """Value in the types of JSON; numbers that are not finite become null."""
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        return plain({field.name: getattr(value, field.name) for field in dataclasses.fields(value)})
    if isinstance(value, Mapping):
        return {str(key): plain(v) for key, v in value.items()}
    if isinstance(value, list | tuple):
        return [plain(v) for v in value]
    if value is None or isinstance(value, str | bool | int):
        return value
    listed = None if isinstance(value, float) else getattr(value, "tolist", None)
    if listed is not None:  # an array of NumPy or JAX
        return plain(listed())
    number: Any = float(value)  # pyright: ignore[reportArgumentType]
    return number if math.isfinite(number) else None
