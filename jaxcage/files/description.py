"""First pass over a configuration: keys, units, ranges and choices. It needs no JAX: a wrong file is refused at once.

`schema.json` has the declarations of the modules; `schema` writes it from them. `config` makes the second pass, which
builds the models.
"""

import dataclasses
import difflib
import functools
import json
import math
import re
import tomllib
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Any, TypeVar, get_args

from .._allowed import ParameterInfo, allowed as must_be, must_be_given, within
from .._bearing_data import (
    CageMaterial,
    cage_material,
    cage_speed_ratio,
    clearances,
    designated,
    estimated,
    rolling_coefficient,
)
from .._errors import ConfigError
from .disk import read_bytes
from .plausibility import check_numbers
from .ranges import Range, is_range, read_range
from .template import Subject, left_as_written
from .units import NUMBER, WHOSE, Whose, printable, read_rpm, shown, to_si


SCHEMA = Path(__file__).with_name("schema.json")
Ranges = dict[tuple[str, ...], tuple[Range, tuple[str, ...]]]
"""Path of a key with a range -> the range, and the fields of that table that it sets."""
_SHORTHANDS = {("support", "stiffness"): ("stiffness_x", "stiffness_y")}
"""Keys that set several parameters to one value."""
BY_MATERIAL = {
    "cage": {"cage_mass": "cage_mass"},
    "bearing": {
        "cage_mass": "cage_mass",
        "cage_inertia": "cage_inertia",
        "pocket_stiffness": "pockets.pocket_stiffness",
        "pocket_friction": "pockets.pocket_friction",
        "hardness": "wear.hardness",
    },
}
"""Values that the material of the cage gives where a file does not, with their dotted names."""
_USUAL = {"m": "mm", "kg": "g", "K": "degC"}
"""Units in which people think of a number that is wrong in SI."""
_WITHOUT_UNIT = re.compile(rf"\s*{NUMBER}[-+±.()\s\deE]*")
_GRADE = re.compile(rf"\s*G\s*({NUMBER})\s*(?:at\b\s*(.*?)\s*)?", re.IGNORECASE)


class Known(float):
    """Best guess of a value that is known within a range only."""

    range: Range

    def __new__(cls, found: Range) -> "Known":
        number = super().__new__(cls, found.best)
        number.range = found
        return number


@dataclasses.dataclass(frozen=True)
class Balance:
    """An eccentricity given by a balance grade and the speed to which it belongs."""

    text: str
    grade: float
    """Eccentricity times angular speed [mm/s], ISO 21940-11."""
    speed: float
    """[rad/s]."""
    whose: Whose


@dataclasses.dataclass(frozen=True)
class Part:
    """A table that passed: what it builds."""

    module: str
    """Name of the class."""
    values: dict[str, Any]
    """Numbers in SI, choices and counts by field; a `Known` for a range."""
    parts: Mapping[str, "Part"]
    ready_made: tuple[str, Any] | None
    """Key and value by which the table starts from a ready-made module, such as `designation`."""


@dataclasses.dataclass(frozen=True)
class Description:
    """A configuration that passed."""

    subject: Subject
    base: str | None
    speeds: Whose
    root: Part
    ranges: Ranges
    table: Mapping[str, Any]
    estimated: tuple[str, ...]
    """Dotted names of values that the file does not give: from dimensions, from the cage material, or usual ones."""
    material: CageMaterial | None = None
    """Material of the cage, if it is named."""
    left: tuple[str, ...] = ()
    """Dotted names of values on lines that are still as `jaxcage init` wrote them."""

    @property
    def numbers(self) -> dict[str, Any]:
        """Dimensions and masses [SI] of the bearing and its cage, and its choices."""
        bases, bearing = declarations()["subjects"][self.subject]["bases"], self.root.parts.get("bearing")
        found = {} if self.base is None else {**bases[self.base]}
        if bearing is not None:
            found |= declarations()["catalogue"][bearing.ready_made[1]] if bearing.ready_made else {}
            found |= bearing.values
        film = self.root.parts["film"].values if "film" in self.root.parts else {}
        impact = {"impact": self.root.parts["impact"].module} if "impact" in self.root.parts else {}
        return {**found, **film, **impact, **self.root.values}


@functools.cache
def declarations() -> dict[str, Any]:
    """The declarations of all modules, as `schema` wrote them."""
    return json.loads(SCHEMA.read_text(encoding="utf-8"))


def read_description(path: str | Path) -> Description:
    """The configuration in the TOML file at `path`, with everything checked that a value or key alone can have wrong.

    **Raises:** `ConfigError`, one sentence with the file, the key, the value given and what is allowed.
    """
    try:
        text = read_bytes(path).decode()
        table = tomllib.loads(text)
    except OSError as error:
        raise ConfigError(f"File '{path}' must be a readable TOML file, but: {error.strerror}.") from error
    except (ValueError, RecursionError) as error:  # no TOML, no UTF-8, a number of thousands of digits; nested too deep
        reason = printable(str(error).rstrip("."))
        raise ConfigError(f"File '{path}' must be valid TOML, but is not: {reason}.") from error
    try:
        found = describe(table)
    except ConfigError as error:
        raise ConfigError(f"File '{path}': {error}") from error
    return dataclasses.replace(found, left=left_as_written(text, found.subject))


def describe(table: Mapping[str, Any]) -> Description:
    """Check a nested mapping as read from TOML. **Raises:** `ConfigError`."""
    subject = _subject(table)
    module, bases = (declarations()["subjects"][subject][key] for key in ("module", "bases"))
    base, speeds = table.get("base"), table.get("speeds", "shaft" if subject == "bearing" else "cage")
    if speeds not in WHOSE:
        raise ConfigError(f"`speeds` must be one of {', '.join(WHOSE)}, but is {shown(speeds)}.")
    if "base" in table and base not in [*bases]:  # of any type
        raise ConfigError(f"`base` must be one of {', '.join(bases)}, but is {shown(base)}.")
    ranges: Ranges = {}
    rest = {key: value for key, value in table.items() if key not in ("speeds", "model", "base", "material")}
    material = _listed("material", table["material"], cage_material, "PEEK-GF30") if "material" in table else None
    made = {} if material is None else BY_MATERIAL[subject]
    if made and subject == "bearing":
        rest = {"pockets": {}, "wear": {}} | rest
    root = _checked(module, rest, base is not None, (), ranges, speeds, tuple(made))
    if base is None and root.values.get("guidance") == "inner" and "inner_land_diameter" not in rest:
        raise ConfigError('`inner_land_diameter` must be given with guidance = "inner".')
    bearing = root.parts.get("bearing")
    guessed: tuple[str, ...] = ()
    if bearing is not None:
        names = bearing.values if bearing.ready_made is None else estimated(bearing.ready_made[1])
        guessed = tuple(f"bearing.{name}" for name in names if name not in rest["bearing"])
        drag = root.parts["drag"].values if "drag" in root.parts else {}
        if bearing.ready_made:
            drag.setdefault("rolling_coefficient", rolling_coefficient(bearing.ready_made[1]))
        elif base is None and "rolling_coefficient" not in drag and drag.get("rolling_law", "none") != "none":
            guessed += ("drag.rolling_coefficient",)
    told = {*rest, *(f"lubricant.{name}" for name in rest.get("lubricant", ()))}
    guessed += tuple(name for name in ("load", "lubricant.temperature") if base is None and name not in told)
    own = {**rest, **rest.get("pockets", {}), **rest.get("wear", {})}
    guessed += tuple(where for name, where in made.items() if name not in own)
    found = Description(subject, base, speeds, root, ranges, table, guessed, material)
    if isinstance(given := root.values.get("eccentricity"), Balance):
        cage, n = given.speed, found.numbers
        if given.whose == "shaft":
            ratio = cage_speed_ratio(n["inner_raceway_diameter"], n["roller_diameter"])
            cage = abs(ratio * cage + (1 - ratio) * n.get("outer_speed", 0.0))
        value = 1e-3 * given.grade / cage if cage else math.inf  # ISO 21940-11
        root.values["eccentricity"] = value
        declared = declarations()["modules"][module]["values"]["eccentricity"]
        require_within("eccentricity", value, ParameterInfo(**declared, text=""), given.text)
    check_numbers(found.numbers)
    return found


def _subject(table: Mapping[str, Any]) -> Subject:
    base = table.get("base")
    whole = isinstance(base, str) and base in declarations()["subjects"]["bearing"]["bases"]
    given = table.get("model", "bearing" if whole else "cage")
    if given not in get_args(Subject):
        raise ConfigError(f"`model` must be one of {', '.join(get_args(Subject))}, but is {shown(given)}.")
    return given


def _checked(
    module: str,
    table: Mapping[str, Any],
    started: bool,
    path: tuple[str, ...],
    ranges: Ranges,
    speeds: Whose,
    made: tuple[str, ...],
) -> Part:
    """A table of values of a module; `started` if there is a base from which it takes what it leaves out. Names in
    `made` need not be given."""
    declared, table, ready_made = declarations()["modules"][module], dict(table), None
    fields, nested = declared["values"], declared["tables"]
    for (where, key), read in _READY_MADE.items():
        if (where,) == path and key in table:
            ready_made, started = (key, read(table.pop(key))), True
    _refuse_unknown(table, fields, nested, path)
    found = {name: _value(_dotted(path, name), table[name], fields[name], speeds) for name in fields if name in table}
    for where, names in _SHORTHANDS.items():
        if where[:-1] == path and where[-1] in table:
            value = _value(_dotted(path, where[-1]), table[where[-1]], fields[names[0]], speeds)
            free = tuple(name for name in names if name not in found)
            if isinstance(value, Known) and free:
                ranges[where] = value.range, free
            found = dict.fromkeys(names, float(value)) | found
    ranges |= {(*path, name): (value.range, (name,)) for name, value in found.items() if isinstance(value, Known)}
    parts = {}
    for name in (name for name in nested if name in table):
        below, options = table[name], nested[name]
        if not isinstance(below, Mapping):
            raise ConfigError(f"`{_dotted(path, name)}` must be a table of values, but is {shown(below)}.")
        kind = _kind(options, below, started, (*path, name))
        below = {key: value for key, value in below.items() if key != "kind" or len(options) == 1}
        parts[name] = _checked(kind, below, started and kind == options[0], (*path, name), ranges, speeds, made)
    if not started:
        found = clearances(found) | found if module == "Bearing" else found
        _require_whole(module, {*found, *parts, *made}, path)
    return Part(module, found, parts, ready_made)


def _kind(options: list[str], table: Mapping[str, Any], started: bool, path: tuple[str, ...]) -> str:
    """The law that a table chooses with `kind` where there are several; every base has the first."""
    if len(options) == 1:
        return options[0]
    names = [declarations()["modules"][option]["kind"] for option in options]
    given = table.get("kind", names[0] if started else None)
    if given not in names:
        given = "missing" if given is None else shown(given)
        raise ConfigError(f"`{_dotted(path, 'kind')}` must be one of {', '.join(names)}, but is {given}.")
    return options[names.index(given)]


def _require_whole(module: str, given: set[str], path: tuple[str, ...]) -> None:
    """Without a base, what has no default must be given."""
    declared = declarations()["modules"][module]
    bases = [next(iter(each["bases"])) for each in declarations()["subjects"].values() if each["module"] == module]
    if missing := [_dotted(path, name) for name in declared["needed"] if name not in given]:
        ready = [*(f'base = "{name}"' for name in bases), *(['designation = "NU1014"'] if module == "Bearing" else [])]
        hint = f", unless `{ready[0]}` or the like gives the rest" if ready else ""
        hint += ', or `material = "brass"` or the like the mass' if "cage_mass" in missing else ""
        raise ConfigError(f"`{'`, `'.join(missing)}` must be given{hint}.")
    readings = {name: each["readings"] for name, each in declared["values"].items() if "readings" in each}
    if left := [name for name in readings if name not in given]:
        said = ", and ".join(f"`{_dotted(path, name)}` {must_be_given(readings[name])}" for name in left)
        raise ConfigError(f"{said}.")


def _dotted(path: tuple[str, ...], name: str = "") -> str:
    return ".".join((*path, name) if name else path)


def _refuse_unknown(
    table: Mapping[str, Any], fields: Iterable[str], nested: Iterable[str], path: tuple[str, ...]
) -> None:
    keys = [*fields, *(where[-1] for where in _SHORTHANDS if where[:-1] == path)]
    extra = [key for where, key in _READY_MADE if (where,) == path] if path else ["base", "model", "speeds", "material"]
    for key in table:
        if key in keys or key in nested:
            continue
        where = f" in [{_dotted(path)}]" if path else " at the top level"
        for subject, about in declarations()["subjects"].items():
            other = declarations()["modules"][about["module"]]
            if not path and (key in other["values"] or key in other["tables"]):
                raise ConfigError(f'Key `{key}`{where} needs model = "{subject}".')
        if like := difflib.get_close_matches(key[:100], [*extra, *keys, *nested], 1):
            raise ConfigError(f"Key `{printable(key)}`{where} is unknown (did you mean `{like[0]}`?).")
        offered = ", ".join([*extra, *keys, *(f"[{name}]" for name in nested)])
        raise ConfigError(f"Key `{printable(key)}`{where} must be one of {offered}.")


def _value(name: str, value: Any, declared: Mapping[str, Any], speeds: Whose) -> Any:
    """`value` as the configuration gives it, checked against its declaration."""
    if "choice" in declared:
        if value not in declared["choice"]:
            raise ConfigError(f"`{name}` must be one of {', '.join(declared['choice'])}, but is {shown(value)}.")
        return value
    if "count" in declared:
        lower, upper = declared["count"]
        if isinstance(value, bool) or not isinstance(value, int) or not lower <= value <= upper:
            raise ConfigError(f"`{name}` must be a whole number from {lower} to {upper}, but is {shown(value)}.")
        return value
    info = ParameterInfo(**declared, text="")
    if name == "eccentricity" and isinstance(value, str) and (grade := _GRADE.fullmatch(value)):
        return _balance(value, float(grade[1]), grade[2], speeds)
    return _number(name, value, info)


def _balance(text: str, grade: float, at: str | None, speeds: Whose) -> Balance:
    must = '`eccentricity` must name the speed of its balance grade, such as "G6.3 at 12000 rpm shaft"'
    try:
        speed = read_rpm(at) if at else 0.0
    except ValueError as error:
        raise ConfigError(f"{must}, but {error}.") from error
    if not (grade > 0 and 0 < speed < math.inf):
        raise ConfigError(f'{must}, but is "{printable(text)}".')
    return Balance(text, grade, speed * math.pi / 30, getattr(speed, "whose", speeds))


def _number(name: str, value: Any, info: ParameterInfo) -> float:
    must = f"`{name}` {must_be(info)}"
    if isinstance(value, bool) or not isinstance(value, int | float | str):
        raise ConfigError(f"{must}, but is {shown(value)}.")
    if isinstance(value, str) and info.unit != "1" and _WITHOUT_UNIT.fullmatch(value):
        example = f"{printable(value.strip())} {_USUAL.get(info.unit, info.unit)}"
        raise ConfigError(f'{must}, but "{printable(value)}" has no unit: write "{example}" if that is meant.')
    try:
        if isinstance(value, str) and is_range(value):
            number = Known(read_range(value, info.unit))
        else:
            number = to_si(value, info.unit) if isinstance(value, str) else float(value)
    except ValueError as error:
        raise ConfigError(f"{must}, but {error}.") from error
    except OverflowError as error:  # of a whole number
        raise ConfigError(f"{must}, but is {shown(value)}.") from error
    for each in (number.range.lower, number.range.upper) if isinstance(number, Known) else (number,):
        require_within(name, each, info, value)
    return number


def require_within(name: str, number: float, info: ParameterInfo, given: Any) -> None:
    """Compare a number [SI] with its bounds. **Raises:** `ConfigError`, with what was given if that was a text."""
    if math.isfinite(number) and within(number, info.lower, info.upper):
        return
    unit, usual = "" if info.unit == "1" else f" {info.unit}", _USUAL.get(info.unit)
    said = f' (given as "{printable(given)}")' if isinstance(given, str) else ""
    if usual and math.isfinite(number) and not isinstance(given, str):
        if within(to_si(f"{number:.17g} {usual}", info.unit), info.lower, info.upper):
            said += f'; with its unit it is written "{number:g} {usual}"'
    raise ConfigError(f"`{name}` {must_be(info)}, but is {number:g}{unit}{said}.")


T = TypeVar("T")


def _listed(key: str, given: Any, find: Callable[[str], T], like: str) -> T:
    """Find an entry of a table by its name in the file."""
    if not isinstance(given, str):
        raise ConfigError(f'`{key}` must be a text such as "{like}", but is {shown(given)}.')
    try:
        return find(given)
    except ValueError as error:
        raise ConfigError(re.sub(r"^Argument `\w+`", f"`{key}`", str(error))) from error


def _designation(given: Any) -> str:
    return _listed("bearing.designation", given, designated, "NU2310")


def _grade(given: Any) -> float:
    if isinstance(given, bool) or not isinstance(given, int | float) or not 2 <= given <= 10000:
        raise ConfigError(
            f"`lubricant.grade` must be a number from 2 to 10000 (mm^2/s at 40 degC), but is {shown(given)}."
        )
    return float(given)


_READY_MADE = {("bearing", "designation"): _designation, ("lubricant", "grade"): _grade}
"""Keys by which a table starts from a ready-made module."""
