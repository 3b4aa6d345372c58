"""TOML -> `CageModel` or `BearingModel`: tables mirror the modules, every value is checked against its declaration.
A file on a whole bearing contains `model = "bearing"`, or starts from one, `base = "nu2310"`. A file on a cage:

base = "1a"                  # optional: start from a published case and change what is listed
guidance_gap = "0.5 mm"      # numbers are SI, texts carry their unit
eccentricity = 30e-6

[lubricant]
grade = 68                   # or density, viscosity_1, temperature_1, viscosity_2, temperature_2
temperature = "70 degC"

[impact]
kind = "roller_pass"         # or "synchronous"

[impact.oscillator]
bar_mass = "4 g"
"""

import dataclasses
import tomllib
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, get_args

import equinox as eqx

from .._arguments import require_x64
from .._parameters import fields_from, must_be_given, parameter_paths
from ..bearing import PUBLISHED_CASES, listed, vg
from ..forces import PocketImpact
from ..models import NEEDED, WHOLE_BEARINGS, BearingModel, CageModel, case, whole_bearing
from .disk import read_bytes
from .plausibility import check_together
from .ranges import Range
from .schema import ConfigError, Known, read_value, submodules, values
from .template import Subject, left_as_written
from .units import WHOSE, Whose, printable, shown


Ranges = dict[tuple[str, ...], tuple[Range, tuple[str, ...]]]
"""Path of a key with a range -> the range, and the fields of that table that it sets."""
_SHORTHANDS = {("support", "stiffness"): ("stiffness_x", "stiffness_y")}
"""Keys that set several parameters to one value."""


@dataclasses.dataclass(frozen=True)
class Unknown:
    """A quantity of which a file gives a range and no value."""

    label: str
    """Its name in the file."""
    names: tuple[str, ...]
    """Parameters that it sets, all to the same value."""
    range: Range


@dataclasses.dataclass(frozen=True)
class BearingFile:
    """Contents of a TOML file: a model, and how its speeds are meant."""

    model: Any
    """A `CageModel` or a `BearingModel`."""
    speeds: Whose
    """Owner of the speeds that commands give as bare numbers: key `speeds`; by default the cage, for a whole bearing
    the shaft."""
    unknowns: tuple[Unknown, ...]
    """Values of which the file gives a range only."""
    left: tuple[str, ...]
    """Dotted names of values that are still those of the template that `jaxcage init` writes."""
    table: Mapping[str, Any]


def load_model(path: str | Path) -> Any:
    """The `CageModel` or `BearingModel` that the TOML file at `path` describes.

    **Raises:** as `read_bearing`.
    """
    return read_bearing(path).model


def read_bearing(path: str | Path) -> BearingFile:
    """The cage or the whole bearing that the TOML file at `path` describes, with speeds and unknowns.

    **Raises:** `ConfigError`, a `ValueError` whose message is one sentence that names the file, the key, the value
    given and what is allowed; `RuntimeError` without double precision.
    """
    table, unknowns = _table_of(path), []
    try:
        model = model_from(table, unknowns)
        subject = subject_of(table)
        return BearingFile(model, _whose(table, subject), tuple(unknowns), left_as_written(table, subject), table)
    except ConfigError as error:
        raise ConfigError(f"File '{path}': {error}") from error


def _table_of(path: str | Path) -> dict[str, Any]:
    try:
        return tomllib.loads(read_bytes(path).decode())
    except OSError as error:
        raise ConfigError(f"File '{path}' must be a readable TOML file, but: {error.strerror}.") from error
    except (ValueError, RecursionError) as error:  # no TOML, no UTF-8, a number of thousands of digits; nested too deep
        reason = printable(str(error).rstrip("."))
        raise ConfigError(f"File '{path}' must be valid TOML, but is not: {reason}.") from error


def subject_of(table: Mapping[str, Any]) -> Subject:
    """Subject of a nested mapping as read from a file: a cage or a whole bearing. **Raises:** `ConfigError`."""
    base = table.get("base")
    given = table.get("model", "bearing" if isinstance(base, str) and base in WHOLE_BEARINGS else "cage")
    if given not in get_args(Subject):
        raise ConfigError(f"`model` must be one of {', '.join(get_args(Subject))}, but is {shown(given)}.")
    return given


def model_from(table: Mapping[str, Any], unknowns: list[Unknown] | None = None) -> Any:
    """The `CageModel` or `BearingModel` that a nested mapping, as read from TOML, describes; a range counts with its
    best guess.

    **Arguments:** the mapping; a list to which the values known within ranges only are added.

    **Raises:** `ConfigError`; `RuntimeError` without double precision.
    """
    require_x64()
    cage = subject_of(table) == "cage"
    kind, bases = (CageModel, PUBLISHED_CASES) if cage else (BearingModel, WHOLE_BEARINGS)
    _whose(table)
    rest = {key: value for key, value in table.items() if key not in ("speeds", "model")}
    start: Any = None
    if "base" in rest:
        name = rest.pop("base")
        if not isinstance(name, str) or name not in bases:
            raise ConfigError(f"`base` must be one of {', '.join(bases)}, but is {shown(name)}.")
        start = case(name) if cage else whole_bearing(name)
    if start is None and rest.get("guidance") == "inner" and "inner_land_diameter" not in rest:
        raise ConfigError('`inner_land_diameter` must be given with guidance = "inner".')
    ranges: Ranges = {}
    model: Any = _build(kind, rest, start, (), ranges)
    check_together(model)
    if unknowns is not None:
        unknowns += _named(model, ranges)
    return model


def _named(model: eqx.Module, ranges: Ranges) -> list[Unknown]:
    """Ranges by the names that `jaxcage.replace` knows; a key that sets several parameters is one unknown."""
    short = {path: name for name, path in parameter_paths(model).items()}
    each = lambda path, names: tuple(short[(*path[:-1], name)] for name in names)
    return [Unknown(".".join(path), each(path, names), found) for path, (found, names) in ranges.items()]


def _whose(table: Mapping[str, Any], subject: Subject = "cage") -> Whose:
    given = table.get("speeds", "shaft" if subject == "bearing" else "cage")
    if given not in WHOSE:
        raise ConfigError(f"`speeds` must be one of {', '.join(WHOSE)}, but is {shown(given)}.")
    return given


def _build(
    kind: type[eqx.Module], table: Mapping[str, Any], start: eqx.Module | None, path: tuple[str, ...], ranges: Ranges
) -> eqx.Module:
    """A module of `kind` from its table; values not in the table come from `start`, or from the defaults."""
    table, nested, fields = dict(table), submodules(kind), values(kind)
    for (where, key), make in _READY_MADE.items():
        if (where,) == path and key in table:
            start = make(table.pop(key))
    _refuse_unknown(table, [f.name for f in fields], list(nested), path)
    arguments = {f.name: read_value(_dotted(path, f.name), table[f.name], f) for f in fields if f.name in table}
    short = {where[-1]: names for where, names in _SHORTHANDS.items() if where[:-1] == path and where[-1] in table}
    for key, names in short.items():
        value = read_value(_dotted(path, key), table[key], next(f for f in fields if f.name == names[0]))
        free = tuple(name for name in names if name not in arguments)
        if isinstance(value, Known) and free:
            ranges[(*path, key)] = value.range, free
        arguments = dict.fromkeys(names, float(value)) | arguments
    ranges |= {(*path, n): (value.range, (n,)) for n, value in arguments.items() if isinstance(value, Known)}
    for name, options in nested.items():
        if name in table:
            below = getattr(start, name, None)
            arguments[name] = _build_chosen(options, table[name], below, (*path, name), ranges)
    if start is not None:
        arguments = {f.name: getattr(start, f.name) for f in dataclasses.fields(kind)} | arguments
    return _construct(kind, arguments, path)


def _build_chosen(
    options: tuple[type[eqx.Module], ...], table: Any, start: eqx.Module | None, path: tuple[str, ...], ranges: Ranges
) -> eqx.Module:
    """A sub-table, which chooses its law with `kind` where there are several."""
    if not isinstance(table, Mapping):
        raise ConfigError(f"`{_dotted(path)}` must be a table of values, but is {shown(table)}.")
    table = dict(table)
    kind = options[0]
    if len(options) > 1:
        names = [getattr(law, "kind", "") for law in options]
        given = table.pop("kind", getattr(start, "kind", None))
        if given not in names:
            given = "missing" if given is None else shown(given)
            raise ConfigError(f"`{_dotted(path, 'kind')}` must be one of {', '.join(names)}, but is {given}.")
        kind = options[names.index(given)]
    return _build(kind, table, start if isinstance(start, kind) else None, path, ranges)


def _construct(kind: type[eqx.Module], arguments: dict[str, Any], path: tuple[str, ...]) -> eqx.Module:
    if "oscillator" in submodules(kind):
        arguments.setdefault("oscillator", PocketImpact())
    without = [f.name for f in dataclasses.fields(kind) if f.default is f.default_factory is dataclasses.MISSING]
    each = [name for field in without for name in (NEEDED if field == "forces" else (field,))]
    missing = [_dotted(path, name) for name in each if name not in arguments and "forces" not in arguments]
    if missing:
        example = "nu2310" if kind is BearingModel else "1a"
        hint = "" if path else f', unless `base = "{example}"` or the like gives the rest'
        raise ConfigError(f"`{'`, `'.join(missing)}` must be given{hint}.")
    if readings := [f for f in values(kind) if "readings" in f.metadata and f.name not in arguments]:
        said = ", and ".join(f"`{_dotted(path, f.name)}` {must_be_given(f.metadata['readings'])}" for f in readings)
        raise ConfigError(f"{said}.")
    try:
        return kind(**fields_from(kind, arguments))
    except ValueError as error:
        raise ConfigError(f"Table `{_dotted(path) or 'top level'}`: {error}") from error


def _dotted(path: tuple[str, ...], name: str = "") -> str:
    return ".".join((*path, name) if name else path)


def _refuse_unknown(table: dict, keys: list[str], tables: list[str], path: tuple[str, ...]) -> None:
    keys = [*keys, *(where[-1] for where in _SHORTHANDS if where[:-1] == path)]
    extra = [key for where, key in _READY_MADE if (where,) == path] if path else ["base", "model", "speeds"]
    for key in table:
        if key not in keys and key not in tables:
            where = f" in [{_dotted(path)}]" if path else " at the top level"
            allowed = ", ".join([*extra, *keys, *(f"[{name}]" for name in tables)])
            raise ConfigError(f"Key `{printable(key)}`{where} must be one of {allowed}.")


def _designated(given: Any) -> eqx.Module:
    if not isinstance(given, str):
        raise ConfigError(f'`bearing.designation` must be a text such as "NU2310", but is {shown(given)}.')
    try:
        return listed(given).bearing
    except ValueError as error:
        raise ConfigError(str(error).replace("Argument `designation`", "`bearing.designation`")) from error


def _of_grade(given: Any) -> eqx.Module:
    if isinstance(given, bool) or not isinstance(given, int | float) or not 2 <= given <= 10000:
        raise ConfigError(
            f"`lubricant.grade` must be a number from 2 to 10000 (mm^2/s at 40 degC), but is {shown(given)}."
        )
    return vg(float(given))


_READY_MADE: dict[tuple[str, str], Callable[[Any], eqx.Module]] = {
    ("bearing", "designation"): _designated,
    ("lubricant", "grade"): _of_grade,
}
"""Keys by which a table starts from a ready-made module."""
