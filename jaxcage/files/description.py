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
from .._errors import ConfigError, printable, shown
from .disk import read_bytes
from .plausibility import check_numbers
from .ranges import Range, is_range, read_range
from .template import Subject, left_as_written
from .units import NUMBER, WHOSE, Whose, read_rpm, to_si


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


@dataclasses.dataclass(frozen=True)
class Part:
    """A table that passed: what it builds."""

    module: str
    """Name of the class."""
    values: dict[str, Any]
    """Numbers in SI, best guesses, choices and counts by field; `designation` and `grade` of what is ready made."""
    parts: Mapping[str, "Part"]


@dataclasses.dataclass(frozen=True)
class Description:
    """A configuration that passed."""

    subject: Subject
    base: str | None
    speeds: Whose
    """Owner of the speeds that commands give as bare numbers; by default the cage, for a whole bearing the shaft."""
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
            found |= declarations()["catalogue"].get(bearing.values.get("designation"), {}) | bearing.values
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
    _one_of("speeds", WHOSE, speeds)
    if "base" in table:
        _one_of("base", bases, base)
    ranges: Ranges = {}
    rest = {key: value for key, value in table.items() if key not in ("speeds", "model", "base", "material")}
    material = _listed("material", table["material"], cage_material, "PEEK-GF30") if "material" in table else None
    made = {} if material is None else BY_MATERIAL[subject]
    if made and subject == "bearing":
        rest = {"pockets": {}, "wear": {}} | rest
    grade = _GRADE.fullmatch(given) if isinstance(given := rest.get("eccentricity"), str) else None
    by_grade = set() if grade is None else {"eccentricity"}
    numbers = {key: value for key, value in rest.items() if key not in by_grade}
    root = _checked(module, numbers, base is not None, (), ranges, {*made, *by_grade})
    if base is None and root.values.get("guidance") == "inner" and "inner_land_diameter" not in rest:
        raise ConfigError('`inner_land_diameter` must be given with guidance = "inner".')
    bearing = root.parts.get("bearing")
    guessed: tuple[str, ...] = ()
    if bearing is not None:
        listed = bearing.values.get("designation")
        names = bearing.values if listed is None else estimated(listed)
        guessed = tuple(f"bearing.{name}" for name in names if name not in rest["bearing"])
        drag = root.parts["drag"].values if "drag" in root.parts else {}
        if listed is not None:
            drag.setdefault("rolling_coefficient", rolling_coefficient(listed))
        elif base is None and "rolling_coefficient" not in drag and drag.get("rolling_law", "none") != "none":
            guessed += ("drag.rolling_coefficient",)
    told = {*rest, *(f"lubricant.{name}" for name in rest.get("lubricant", ()))}
    guessed += tuple(name for name in ("load", "lubricant.temperature") if base is None and name not in told)
    own = {**rest, **rest.get("pockets", {}), **rest.get("wear", {})}
    guessed += tuple(where for name, where in made.items() if name not in own)
    found = Description(subject, base, speeds, root, ranges, table, guessed, material)
    if grade is not None:
        info = ParameterInfo(**declarations()["modules"][module]["values"]["eccentricity"], text="")
        root.values["eccentricity"] = _by_grade(grade, speeds, found.numbers, info)
    check_numbers(found.numbers)
    return found


def _subject(table: Mapping[str, Any]) -> Subject:
    base = table.get("base")
    whole = isinstance(base, str) and base in declarations()["subjects"]["bearing"]["bases"]
    return _one_of("model", get_args(Subject), table.get("model", "bearing" if whole else "cage"))


def _one_of(name: str, offered: Iterable[str], given: Any) -> Any:
    if given not in [*offered]:  # of any type
        is_what = "missing" if given is None else shown(given)
        raise ConfigError(f"`{name}` must be one of {', '.join(offered)}, but is {is_what}.")
    return given


def _checked(
    module: str,
    table: Mapping[str, Any],
    started: bool,
    path: tuple[str, ...],
    ranges: Ranges,
    made: set[str],
) -> Part:
    """A table of values of a module; `started` if there is a base from which it takes what it leaves out. Names in
    `made` need not be given."""
    declared = declarations()["modules"][module]
    fields, nested = declared["values"], declared["tables"]
    ready_made = {key: read for (where, key), read in _READY_MADE.items() if (where,) == path}
    sets = {where[-1]: names for where, names in _SHORTHANDS.items() if where[:-1] == path}
    sets |= {name: (name,) for name in fields}
    _refuse_unknown(table, [*ready_made, *fields, *sets], nested, path)
    found = {key: read(table[key]) for key, read in ready_made.items() if key in table}
    started = started or bool(found)
    for key in (key for key in sets if key in table):
        value = _value(_dotted(path, key), table[key], fields[sets[key][0]])
        names = tuple(name for name in sets[key] if name == key or name not in table)
        if isinstance(value, Range) and names:
            ranges[(*path, key)] = value, names
        found |= dict.fromkeys(names, value.best if isinstance(value, Range) else value)
    parts = {}
    for name in (name for name in nested if name in table):
        below, options = table[name], nested[name]
        if not isinstance(below, Mapping):
            raise ConfigError(f"`{_dotted(path, name)}` must be a table of values, but is {shown(below)}.")
        kind = _kind(options, below, started, (*path, name))
        below = {key: value for key, value in below.items() if key != "kind" or len(options) == 1}
        parts[name] = _checked(kind, below, started and kind == options[0], (*path, name), ranges, made)
    if not started:
        found = clearances(found) | found if module == "Bearing" else found
        _require_whole(module, {*found, *parts, *made}, path)
    return Part(module, found, parts)


def _kind(options: list[str], table: Mapping[str, Any], started: bool, path: tuple[str, ...]) -> str:
    """The law that a table chooses with `kind` where there are several; every base has the first."""
    if len(options) == 1:
        return options[0]
    names = [declarations()["modules"][option]["kind"] for option in options]
    given = _one_of(_dotted(path, "kind"), names, table.get("kind", names[0] if started else None))
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


def _refuse_unknown(table: Mapping[str, Any], keys: list[str], nested: Iterable[str], path: tuple[str, ...]) -> None:
    keys = [*([] if path else ["base", "model", "speeds", "material"]), *dict.fromkeys(keys)]
    for key in table:
        if key in (*keys, *nested):
            continue
        where = f" in [{_dotted(path)}]" if path else " at the top level"
        for subject, about in declarations()["subjects"].items():
            other = declarations()["modules"][about["module"]]
            if not path and (key in other["values"] or key in other["tables"]):
                raise ConfigError(f'Key `{key}`{where} needs model = "{subject}".')
        if like := difflib.get_close_matches(key[:100], [*keys, *nested], 1):
            raise ConfigError(f"Key `{printable(key)}`{where} is unknown (did you mean `{like[0]}`?).")
        offered = ", ".join([*keys, *(f"[{name}]" for name in nested)])
        raise ConfigError(f"Key `{printable(key)}`{where} must be one of {offered}.")


def _value(name: str, value: Any, declared: Mapping[str, Any]) -> Any:
    """`value` as the configuration gives it, checked against its declaration; a `Range` for what may be one."""
    if "choice" in declared:
        return _one_of(name, declared["choice"], value)
    if "count" in declared:
        lower, upper = declared["count"]
        if isinstance(value, bool) or not isinstance(value, int) or not lower <= value <= upper:
            raise ConfigError(f"`{name}` must be a whole number from {lower} to {upper}, but is {shown(value)}.")
        return value
    return _number(name, value, ParameterInfo(**declared, text=""))


def _by_grade(given: re.Match[str], speeds: Whose, n: Mapping[str, Any], info: ParameterInfo) -> float:
    """The eccentricity [m] that a balance grade allows at a speed: G [mm/s] over that of the cage, ISO 21940-11."""
    must = '`eccentricity` must name the speed of its balance grade, such as "G6.3 at 12000 rpm shaft"'
    try:
        speed = read_rpm(given[2]) if given[2] else 0.0
    except ValueError as error:
        raise ConfigError(f"{must}, but {error}.") from error
    if not (float(given[1]) > 0 and 0 < speed < math.inf):
        raise ConfigError(f'{must}, but is "{printable(given[0])}".')
    cage = speed * math.pi / 30
    if getattr(speed, "whose", speeds) == "shaft":
        ratio = cage_speed_ratio(n["inner_raceway_diameter"], n["roller_diameter"])
        cage = abs(ratio * cage + (1 - ratio) * n.get("outer_speed", 0.0))
    value = 1e-3 * float(given[1]) / cage if cage else math.inf
    require_within("eccentricity", value, info, given[0])
    return value


def _number(name: str, value: Any, info: ParameterInfo) -> float | Range:
    must = f"`{name}` {must_be(info)}"
    if isinstance(value, bool) or not isinstance(value, int | float | str):
        raise ConfigError(f"{must}, but is {shown(value)}.")
    if isinstance(value, str) and info.unit != "1" and _WITHOUT_UNIT.fullmatch(value):
        example = f"{printable(value.strip())} {_USUAL.get(info.unit, info.unit)}"
        raise ConfigError(f'{must}, but "{printable(value)}" has no unit: write "{example}" if that is meant.')
    try:
        if isinstance(value, str) and is_range(value):
            number = read_range(value, info.unit)
        else:
            number = to_si(value, info.unit) if isinstance(value, str) else float(value)
    except ValueError as error:
        raise ConfigError(f"{must}, but {error}.") from error
    except OverflowError as error:  # of a whole number
        raise ConfigError(f"{must}, but is {shown(value)}.") from error
    for each in (number.lower, number.upper) if isinstance(number, Range) else (number,):
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
