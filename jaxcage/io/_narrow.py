"""A TOML file with other ranges: everything else stays as its writer has it, comments too."""

import re
from collections.abc import Mapping

from ._ranges import Range
from ._schema import ConfigError


_TABLE = re.compile(r"\s*\[([^\[\]]+)\]\s*(?:#.*)?")


def with_ranges(text: str, ranges: Mapping[str, tuple[Range, str]]) -> str:
    """`text` with these ranges in the place of those it has.

    **Arguments:** TOML text; label of each value, such as `support.stiffness`, with its new range and SI unit.

    **Raises:** `ConfigError` for a value that is not written as `key = "..."` under its table.
    """
    lines, table, left = text.splitlines(), "", dict(ranges)
    for i, line in enumerate(lines):
        if head := _TABLE.fullmatch(line):
            table = head[1].strip()
            continue
        value = re.match(r'(\s*([A-Za-z0-9_]+)\s*=\s*)("[^"]*"|\'[^\']*\')(\s*)(.*)', line)
        label = "" if value is None else ".".join(filter(None, (table, value[2])))
        if value is not None and label in left:
            new = f'{value[1]}"{range_text(*left.pop(label))}"'
            lines[i] = f"{new} {value[5]}".rstrip()
    if left:
        raise ConfigError(
            f'`{"`, `".join(left)}` must be written as key = "range" below [table] for a new range to take its place.'
        )
    return "\n".join(lines) + "\n"


def range_text(found: Range, unit: str) -> str:
    """A range as `read_range` reads it."""
    best, low, high = (re.sub(r"e\+?(-?)0*", r"e\1", f"{x:.4g}") for x in (found.best, found.lower, found.upper))
    return f"{best} ({low} .. {high})" + ("" if unit == "1" else f" {unit}")
