"""The answer of a command: a sentence, tables and notes for people, a document for programs, files."""

import dataclasses
import io
import json
import math
import os
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import jaxcage as jc

from .options import ShowOptions
from .progress import visible
from .subject import Subject


if TYPE_CHECKING:
    from ..show import Table


@dataclasses.dataclass(frozen=True)
class Answer:
    """Results of a command. The wrapper adds the case, the time, the files and the readings of the paper."""

    sentence: str
    """The answer itself."""
    tables: Sequence["Table"] = ()
    """The table that decides first. Those with a key stand in the document too."""
    notes: Sequence[str] = ()
    document: Mapping[str, Any] = dataclasses.field(default_factory=dict)
    """More for programs, in SI units unless a name ends in another one."""
    subject: Subject | None = None
    files: Mapping[str, tuple[str, Any]] = dataclasses.field(default_factory=dict)
    """Key in the document -> end of the file's name, and a figure, columns of numbers, a data set or a text."""
    stored: Mapping[str, str] = dataclasses.field(default_factory=dict)
    """Key in the document -> path of a file that is written already."""
    failure: str = ""
    """Sentence that is printed, with exit status 1, after the answer of something that failed."""


def complete(answer: Answer, command: str, show: ShowOptions | None, seconds: float) -> Answer:
    """Write the files of an answer, and add what every command prints."""
    written, subject, notes = dict(answer.stored), answer.subject, list(answer.notes)
    document = {table.key: table.records for table in answer.tables if table.key} | dict(answer.document)
    if show is not None:
        stem = f"{command}_{subject.name}" if subject else command
        for key, (ending, content) in answer.files.items():
            written[key] = str(_write(Path(show.out) / f"{stem}{ending}", content, show, subject))
    if subject is not None:
        document, notes = {"case": subject.name} | document | subject.document, notes + subject.notes
    if show is not None:
        document["seconds"] = round(seconds, 2)
        notes.append(f"Time: {seconds:.1f} s")
    notes += [f"{key.replace('_', ' ').capitalize()}: {visible(path)}" for key, path in written.items()]
    return dataclasses.replace(answer, document=document | written, notes=notes)


def _write(path: Path, content: Any, show: ShowOptions, subject: Subject | None) -> Path:
    """Write one file, whole or not at all."""
    import xarray as xr

    if isinstance(content, xr.Dataset):
        return jc.lanes.save(path, content)
    if isinstance(content, Mapping):
        return jc.show.write_columns(path, content)
    with jc.files.replacing(path) as temporary:
        if isinstance(content, str):
            temporary.write_text(content, encoding="utf-8")
        else:
            if subject is not None and subject.shaft is not None:
                jc.show.add_shaft_axes(content, 1 / subject.shaft)
            content.savefig(temporary, dpi=content.dpi)
    return path


def print_answer(answer: Answer, as_json: bool) -> None:
    """Print an answer on standard output: one JSON document, or the sentence, the tables and the notes.

    **Raises:** `OSError` for a standard output that takes nothing.
    """
    if isinstance(sys.stdout, io.TextIOWrapper):  # names of files need not be text
        sys.stdout.reconfigure(errors="backslashreplace")
    try:
        if as_json:
            print(json.dumps(plain(answer.document), indent=2, allow_nan=False))
        else:
            print("\n\n".join([answer.sentence, *map(str, answer.tables), "\n".join(answer.notes)]))
        sys.stdout.flush()
    except OSError as error:
        os.dup2(os.open(os.devnull, os.O_WRONLY), 1)  # or Python tries again at its end, and complains
        raise OSError(
            f"Standard output could not be written ({error.strerror or error}): the files of this run are whole, make "
            "room and run it again for what it prints."
        ) from error


def plain(value: Any) -> Any:
    """A value as JSON has it; numbers that are not finite become null."""
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
