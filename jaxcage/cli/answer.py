"""The answer of a command: a sentence, tables and notes for people, a document for programs, files."""

import dataclasses
import io
import json
import math
import os
import sys
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .options import ShowOptions
from .progress import visible


if TYPE_CHECKING:
    from ..show import Table
    from .subject import Subject


@dataclasses.dataclass(frozen=True)
class Answer:
    """What a command found. The wrapper adds the case, the time, the files and the readings of the paper."""

    sentence: str
    """The answer itself."""
    tables: Sequence["Table"] = ()
    """The table that decides first. Those with a key stand in the document too."""
    notes: Sequence[str] = ()
    document: Mapping[str, Any] = dataclasses.field(default_factory=dict)
    """More for programs, in SI units unless a name ends in another one."""
    subject: "Subject | None" = None
    files: Mapping[str, tuple[str, Any]] = dataclasses.field(default_factory=dict)
    """Key in the document -> end of the file's name, and a figure, columns of numbers, a data set or a text."""
    stored: Mapping[str, str] = dataclasses.field(default_factory=dict)
    """Key in the document -> path of a file that is written already."""
    failure: str = ""
    """Sentence that is printed, with exit status 1, after the answer of something that failed."""


def complete(answer: Answer, command: str, show: ShowOptions | None, seconds: float) -> Answer:
    """Write the files of an answer, and add what every command prints."""
    written, subject = dict(answer.stored), answer.subject
    document = {table.key: table.records for table in answer.tables if table.key} | dict(answer.document)
    notes = list(answer.notes)
    if show is not None:
        stem = f"{command}_{subject.name}" if subject else command
        for key, (ending, content) in answer.files.items():
            written[key] = str(_write(Path(show.out) / f"{stem}{ending}", content, show, subject))
    if subject is not None:
        document = {"case": subject.name} | document | subject.document
        notes += subject.notes
    if show is not None:
        document["seconds"] = round(seconds, 2)
        notes.append(f"Time: {seconds:.1f} s")
    notes += [f"{key.replace('_', ' ').capitalize()}: {visible(path)}" for key, path in written.items()]
    return dataclasses.replace(answer, document=document | written, notes=notes)


def _write(path: Path, content: Any, show: ShowOptions, subject: "Subject | None") -> Path:
    """Write one file, whole or not at all."""
    import xarray as xr
    from matplotlib.figure import Figure

    from ..files import replacing
    from ..show import write_columns
    from ..lanes import save
    from ..show import add_shaft_axes, restyle

    if isinstance(content, xr.Dataset):
        return save(path, content)
    if isinstance(content, Mapping):
        return write_columns(path, content)
    with replacing(path) as temporary:
        if isinstance(content, Figure):
            if subject is not None and subject.shaft is not None:
                add_shaft_axes(content, 1 / subject.shaft)
            restyle(content, show.style).savefig(temporary, dpi=content.dpi)
        else:
            temporary.write_text(content, encoding="utf-8")
    return path


def drawn(title: str, draw: Callable[[Any], Any], width: float = 9.0, height: float = 5.0) -> Any:
    """A figure of one diagram, which `draw` draws on its axes."""
    from ..show import new_figure

    figure = new_figure(width, height)
    draw(figure.subplots())
    figure.suptitle(title, fontsize=11)
    return figure


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
            print(f"{answer.sentence}\n")
            for table in answer.tables:
                _print_on_terminal(table) if sys.stdout.isatty() else print(f"{table}\n")
            print("\n".join(answer.notes))
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
        value = {field.name: getattr(value, field.name) for field in dataclasses.fields(value)}
    if isinstance(value, Mapping):
        return {str(key): plain(v) for key, v in value.items()}
    if isinstance(value, list | tuple):
        return [plain(v) for v in value]
    if value is None or isinstance(value, str | bool | int):
        return value
    if hasattr(value, "tolist") and not isinstance(value, float):  # an array of NumPy or JAX
        return plain(value.tolist())
    number = float(value)
    return number if math.isfinite(number) else None


def _print_on_terminal(table: "Table") -> None:
    import rich.box
    import rich.console
    import rich.table
    from rich.text import Text

    # Text and not str: units in square brackets are not markup.
    drawn = rich.table.Table(title=Text(table.title), title_justify="left", box=rich.box.SIMPLE_HEAD, pad_edge=False)
    for i, head in enumerate(table.heads):
        drawn.add_column(Text(head), justify="left" if i == 0 else "right")
    for row in table.rows:
        drawn.add_row(*map(Text, row))
    rich.console.Console().print(drawn)
