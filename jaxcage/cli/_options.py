"""Commands and their options: what each may be, and which go together. Nothing heavy is imported here, so that `--help`
and typing errors answer at once.
"""

import dataclasses
from collections.abc import Mapping
from typing import Annotated, Any, ClassVar, Literal, Union

import tyro

from .._errors import InputError
from ._readers import is_within, number, text, two, whole


SIDE = range(2, 10_001)
"""Points along one side of a map."""
_SIDES = f"ACROSSxUPWARDS, each from {SIDE[0]} to {SIDE[-1]}, e.g. 300x300"
_PART = "I/N with I from 1 to N, e.g. 1/4"

Speed = Annotated[float, number("be a speed above 0 rpm", lambda x: x > 0, "rpm")]
"""[rpm]."""
Share = Annotated[float, number("be above 0 and at most 1", lambda x: 0 < x <= 1)]
FromZero = Annotated[int, whole(0)]
FromOne = Annotated[int, whole(1)]
FromTwo = Annotated[int, whole(2)]
Tens = Annotated[int, whole(10, of=10)]
"""Revolutions that can be cut into equal blocks, for error bars."""
OptionalSpeed = Annotated[float | None, number("be a speed above 0 rpm", lambda x: x > 0, "rpm")]
Load = Annotated[float | None, number("be from 0 to 1e7 N", lambda x: x >= 0, "N", "own")]
"""[N]."""
Price = Annotated[float | None, number("be at least 0", lambda x: x >= 0)]
OptionalText = Annotated[str | None, text()]
Texts = Annotated[tuple[str, ...], tyro.conf.UseAppendAction]


@dataclasses.dataclass(frozen=True, kw_only=True)
class AnyOptions:
    """What every command has."""

    timed: ClassVar[bool] = True
    """Whether the time that the command took is of interest."""
    called: ClassVar[Mapping[str, str]] = {}
    """Argument of the library -> option that it comes from, where their names differ."""

    usual: ClassVar[Mapping[str, tuple[Any, Any]]] = {}
    """Option that may be left out -> what it then is for a cage, and for a whole bearing."""
    of_cage: ClassVar[str] = ""
    """Names of options that say nothing of a whole bearing."""
    of_whole: ClassVar[str] = ""
    """Names of options that say nothing of a cage."""

    json: bool = False
    """Print one JSON document on standard output instead of tables."""

    def check(self) -> None:
        """Refuse options that do not go together.

        **Raises:** `InputError`.
        """

    def _given(self, name: str) -> bool:
        """Whether an option is neither left out nor what it usually is."""
        return getattr(self, name) not in (getattr(type(self), name), *self.usual.get(name, ()))


@dataclasses.dataclass(frozen=True, kw_only=True)
class CommonOptions(AnyOptions):
    """What every command takes that computes something."""

    out: Annotated[str, text("name a folder")] = "out"
    """Folder for figures and data; it is made if need be."""
    style: Literal["light", "dark", "print"] = "light"
    """Style of the figures: for white pages, dark screens, or black-and-white paper."""
    no_cache: bool = False
    """Compile everything anew instead of using programs kept from earlier runs."""


@dataclasses.dataclass(frozen=True)
class _Case:
    case: Annotated[tyro.conf.Positional[str], tyro.conf.arg(metavar="CASE")]
    """A published case (1a, 1b, 2a, 2b, 3a, 3b), the path of a TOML file, or for commands that take one a whole bearing
    (nu2310)."""


@dataclasses.dataclass(frozen=True)
class Options(CommonOptions, _Case):
    """What every command about a case takes."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class IntegrationOptions(Options):
    """How to integrate."""

    solver: OptionalText = None
    """Integration method: rodas3, rodas4, rk4, newmark, tsit5, kvaerno3, kvaerno5, kencarp4."""
    steps: Annotated[int | None, whole(1)] = None
    """Equal steps per revolution."""
    tolerance: Annotated[float | None, number()] = None
    """Adaptive steps with this tolerance instead of equal ones."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class _Range(Options):
    first: Speed = 2500.0
    """First cage speed [rpm], or with a unit or of the shaft, e.g. "300 rad/s", "6000 rpm shaft"."""
    last: Speed = 27500.0
    """Last cage speed [rpm]."""

    def check(self) -> None:
        # Speeds of cage and shaft are not compared before the bearing is read.
        mixed = getattr(self.first, "whose", None) != getattr(self.last, "whose", None)
        if self.last <= self.first and not mixed:
            between = f"{self.first:g} to {self.last:g} rpm"
            raise InputError(f"Option --last must be above --first, but the range is {between}.")


@dataclasses.dataclass(frozen=True, kw_only=True)
class _Length(Options):
    discard: FromZero = 300
    """Revolutions left out at the beginning."""
    revolutions: Tens = 300
    """Revolutions observed, a multiple of 10 (the error bars come from blocks of them)."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class SweepOptions(_Length, _Range, IntegrationOptions):
    """Sweep over speed from three starts: orbit diagram, exponents, chaotic zones; slips, forces, losses of a whole
    bearing, whose speeds are the shaft's."""

    of_cage: ClassVar[str] = "solver steps horizon confirm draws seed nominal"
    of_whole: ClassVar[str] = "load"

    count: Annotated[int | None, whole(1)] = None
    """Number of speeds; if left out 251, of a whole bearing 13, and 40 where ranges are drawn from. With one, only the
    first speed is run."""
    draws: FromTwo = 64
    """Draws from what the file knows within ranges only, each run once at every speed, 100 revolutions after 100."""
    seed: FromZero = 0
    """Seed of the draws."""
    nominal: bool = False
    """Take the best guesses of what is known within ranges only, as if they were known."""
    confirm: bool = True
    """Confirm labels: what is not periodic, its neighbours and a tenth of the rest are run again with steps half as
    long. --no-confirm turns this off."""
    horizon: FromZero = 3000
    """Revolutions to which chaos is followed, to tell how long it lasts; 0 turns this off."""
    exponents: FromOne = 1
    """Number of Lyapunov exponents."""
    load: Load = None
    """Of a whole bearing: shaft load [N], or with a unit; its own if left out."""

    def check(self) -> None:
        if self.count != 1:
            super().check()


@dataclasses.dataclass(frozen=True, kw_only=True)
class ZonesOptions(SweepOptions):
    """Zones without a stable synchronous orbit, with exact edges, and chaotic zones, beside the published ones; of a
    whole bearing, stretches of speed in which its cage does the same, by the sweep."""

    of_cage: ClassVar[str] = f"quick {SweepOptions.of_cage}"

    quick: bool = False
    """Leave out the gradients of the edges, which take about a minute to compile."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class SearchOptions(_Range, IntegrationOptions):
    """Synchronous orbits over speed: where they are stable, how they lose it, and the zones without one."""

    usual: ClassVar[Mapping[str, tuple[Any, Any]]] = {"discard": (250, 20)}

    count: FromTwo = 251
    """Speeds that are simulated, from three starts each."""
    discard: Annotated[int | None, whole(0)] = None
    """Revolutions left out at the beginning; if left out 250, 1000 for a map of a cage, 20 of a whole bearing."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class GradientOptions(SearchOptions):
    """Derivatives of the synchronous-loss edges, and of the width of zone 1, by every parameter; of slip, impulses,
    wear and power of a whole bearing (nu2310), with standard errors."""

    usual: ClassVar[Mapping[str, tuple[Any, Any]]] = {
        **SearchOptions.usual,
        "by": (("guidance_gap", "eccentricity"), ()),
        "revolutions": (None, 40),
        "spread": (None, 0.05),
        "starts": (None, 2),
    }
    of_cage: ClassVar[str] = "solver steps first last count lasting zone"
    of_whole: ClassVar[str] = "speed load revolutions spread starts chaos"
    called: ClassVar[Mapping[str, str]] = {"directions": "by"}

    lasting: bool = False
    """Instead, of the edges and widths of zones of chaos that lasts, with standard errors, after a sweep (minutes)."""
    zone: FromZero = 0
    """With --lasting: number of the zone, as `jaxcage sweep` counts them; 0 takes all."""
    by: tuple[str, ...] = ()
    """With --lasting, or of a whole bearing: parameters, of which several joined by + change together; if left out
    guidance_gap and eccentricity, and the usual design parameters of a whole bearing."""
    designs: FromTwo = 64
    """With --lasting: designs around this one in each of four rounds, from which an edge is estimated. Of a whole
    bearing: designs around it, in pairs."""
    seed: FromZero = 0
    """With --lasting, or of a whole bearing: seed of these designs."""
    speed: OptionalSpeed = None
    """Of a whole bearing: the shaft's speed [rpm], or with a unit."""
    load: Load = None
    """Of a whole bearing: shaft load [N], or with a unit; its own if left out."""
    revolutions: Annotated[int | None, whole(2, of=2)] = None
    """Of a whole bearing: revolutions of the cage observed, an even number; 40 if left out."""
    spread: Annotated[float | None, number("be above 0 and at most 0.3", lambda x: 0 < x <= 0.3)] = None
    """Of a whole bearing: how far its parameters are moved, relatively; 0.05 if left out."""
    starts: Annotated[int | None, whole(1)] = None
    """Of a whole bearing: starts of each design; 2 if left out."""
    chaos: bool = False
    """Of a whole bearing: the mean slope of the largest Lyapunov exponent as well, which takes twice as long."""

    def check(self) -> None:
        super().check()
        names = ("zone", "by", "designs", "seed")
        if not self.lasting and self.speed is None and any(self._given(n) for n in names):
            raise InputError(
                "Options --zone, --by, --designs and --seed go with --lasting, or with the --speed of a whole bearing."
            )
        if self.lasting and self._given("discard"):
            raise InputError("Option --discard does not go with --lasting, which sweeps as `jaxcage sweep` does.")


@dataclasses.dataclass(frozen=True, kw_only=True)
class MapOptions(SearchOptions):
    """Stability map: the edges followed in two parameters, over colours of the largest exponent; slip, power lost,
    exponent and state of a whole bearing (nu2310) over its shaft's speed and load."""

    usual: ClassVar[Mapping[str, tuple[Any, Any]]] = {
        "discard": (1000, 20),
        "y": ("guidance_gap", "load"),
        "rows": (12, 8),
        "columns": (50, 13),
        "revolutions": (100, 20),
    }
    of_cage: ClassVar[str] = "solver steps count x persist points speed no_curves"

    x: str = "speed"
    """Parameter across: speed, or any parameter of the model, each curve then at its own edge's speed."""
    y: OptionalText = None
    """Parameter upwards, any of the model; guidance_gap if left out, of a whole bearing its load."""
    lower: OptionalText = None
    """Lowest value of y, in SI units or with a unit, e.g. "0.4 mm"; 0.8 of its value if left out, a twentieth of
    a whole bearing's load."""
    upper: OptionalText = None
    """Highest value of y; 1.25 of its value if left out."""
    rows: Annotated[int | None, whole(0)] = None
    """Values of y at which the exponent is computed; with 0 it is left out. 12 if left out, 8 of a whole bearing."""
    columns: Annotated[int | None, whole(2)] = None
    """Speeds at which the exponent is computed; 50 if left out, 13 of a whole bearing."""
    revolutions: Annotated[int | None, whole(1)] = None
    """Revolutions over which the exponent is computed; 100 if left out, 20 of a whole bearing."""
    starts: FromOne = 1
    """Starts of which the largest exponent is taken."""
    persist: FromZero = 0
    """With --points: revolutions that chaos must outlast to count; what has died out by then was a transient."""
    points: Annotated[tuple[int, int] | None, two("x", _SIDES, lambda a, b: a in SIDE and b in SIDE)] = None
    """Instead of rows and columns: a grid of labels, e.g. 300x300."""
    speed: OptionalSpeed = None
    """With --points and another --x than the speed: the speed of all points [rpm]."""
    no_curves: bool = False
    """With --points: do not search for the synchronous-loss edges to draw on top."""

    def check(self) -> None:
        super().check()
        given = lambda *names: any(self._given(name) for name in names)
        if self.points is None:
            if given("no_curves", "persist", "speed"):
                raise InputError("Options --no-curves, --persist and --speed go with --points, e.g. --points 300x300.")
            if self.rows == 1:
                raise InputError("Option --rows must be 0 or at least 2, but 1 was given.")
            return
        if given("rows", "columns"):
            raise InputError("Options --rows and --columns do not go with --points, which says how many there are.")
        if (self.revolutions or 0) % 10:
            raise InputError(f"Option --revolutions must be a multiple of 10, but {self.revolutions} was given.")
        discard = self.usual["discard"][0] if self.discard is None else self.discard
        if 0 < self.persist <= discard:
            allowed = f"0 or above the {discard} of --discard"
            raise InputError(f"Option --persist must be {allowed}, but {self.persist} was given.")
        if self.x == "speed" and self.speed is not None:
            raise InputError("Option --speed goes with an --x that is not the speed.")
        if self.x != "speed" and self.speed is None:
            raise InputError(f"Option --speed must be given for a map over {self.x}.")


@dataclasses.dataclass(frozen=True, kw_only=True)
class StudyOptions(_Length, IntegrationOptions):
    """A sweep over any grid or sample of parameters, stored as it goes; the same command goes on where one stopped."""

    called: ClassVar[Mapping[str, str]] = {"lanes": "chunk", "samples": "sample"}
    usual: ClassVar[Mapping[str, tuple[Any, Any]]] = {"chunk": (2048, 48)}
    of_cage: ClassVar[str] = "solver steps strobe"

    vary: Annotated[Texts, tyro.conf.arg(metavar="NAME=VALUES")] = ()
    """What to vary, once for each parameter, `speed` among them, of a whole bearing the shaft's. A grid:
    speed=4000rpm:27500rpm:100, or single values: oil=32,56,78 (ISO VG grades). Sampled: guidance_gap=0.3mm:0.6mm, or
    within a tolerance: eccentricity=20um+-3um."""
    sample: FromZero = 0
    """Number of samples, best a power of 2."""
    seed: FromZero = 0
    """Seed of the samples."""
    starts: Annotated[int | None, whole(1)] = None
    """Starts at each point; all of the model's own if left out."""
    exponents: FromOne = 1
    """Number of Lyapunov exponents."""
    strobe: FromZero = 0
    """Strobe states stored of each lane, the last ones."""
    store: Annotated[str | None, text("name a folder within --out", is_within)] = None
    """Name of the store within the output folder."""
    chunk: Annotated[int | None, whole(1)] = None
    """Lanes computed and stored together; 2048 if left out, 48 of a whole bearing."""
    shard: Annotated[tuple[int, int], two("/", _PART, lambda i, n: 1 <= i <= n)] = (1, 1)
    """Part of the work, e.g. 2/4: every fourth chunk from the second on. All parts write to the same store."""
    executor: Literal["local", "dask"] = "local"
    """Where to run: on all cores of this machine, or on dask.distributed."""
    scheduler: OptionalText = None
    """Address of a dask scheduler, e.g. tcp://host:8786; a cluster on this machine if left out."""
    workers: Annotated[int | None, whole(1)] = None
    """Processes of the cluster on this machine; one a core if left out."""

    verify: Annotated[bool, tyro.conf.arg(name="check")] = False
    """Compute nothing: compare every chunk of the store with its checksum. Needs only the case, and --store if it
    was given."""

    def check(self) -> None:
        if self.executor == "local" and (self.scheduler is not None or self.workers is not None):
            raise InputError("Options --scheduler and --workers go with --executor dask.")


@dataclasses.dataclass(frozen=True, kw_only=True)
class VaryOptions(_Range):
    """What may be changed in a design."""

    vary: Annotated[Texts, tyro.conf.arg(metavar="NAME=LOWER:UPPER")] = ()
    """What may be changed and between which values, once for each parameter, e.g. guidance_gap=0.3mm:0.6mm. If
    left out, the guidance gap from 0.7 to 1.4 of what it is and the eccentricity from 0.2 to 2.5, but in `design` to 1
    without --worse-balance; of a whole bearing pocket clearance and land width too, as the gap, and the eccentricity
    to 1."""
    first: Speed = 4000.0
    """First cage speed that matters [rpm], or with a unit or of the shaft."""
    last: Speed = 27500.0
    """Last cage speed that matters [rpm]."""
    speeds: Annotated[int, whole(4)] = 48
    """Speeds at which a design is assessed."""
    seed: FromZero = 0
    """Seed of all that is drawn."""
    quick: bool = False
    """Leave out the exact edges, of a design before and after or with their tolerance budget."""
    speed: OptionalSpeed = None
    """Of a whole bearing: the shaft's speed [rpm], or with a unit."""
    load: Load = None
    """Of a whole bearing: shaft load [N], or with a unit; its own if left out."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class DesignOptions(VaryOptions):
    """Change the design so that fewer speeds are chaotic, checked by a fresh sweep. Of a whole bearing (nu2310), make
    wear, forces, impulses, friction power, slip and unbalance small at one speed."""

    usual: ClassVar[Mapping[str, tuple[Any, Any]]] = {
        "wear": (1000.0, 1.0),
        "force": (1000.0, 1.0),
        "impulse": (None, 1.0),
        "power": (0.0, 1.0),
        "slip": (None, 1.0),
        "balance": (None, 1.0),
        "steps": (10, 12),
        "batch": (12, 16),
        "ensemble": (None, 4),
        "discard": (None, 10),
        "revolutions": (None, 20),
    }
    of_cage: ClassVar[str] = "first last speeds quick cost scatter worst"
    of_whole: ClassVar[str] = "speed load impulse slip balance ensemble discard revolutions"

    cost: Annotated[float, number("be at least 0", lambda x: x >= 0)] = 1000.0
    """What one unit of manufacturing cost is worth, in rpm of chaotic speeds; the paper's case 1a costs 2 units."""
    wear: Price = None
    """What the wear load of the guiding land as it is now is worth, in rpm of chaotic speeds; 1000 if left out. Of a
    whole bearing: what the wear of its cage counts beside the other terms; 1 if left out, 0 leaves it out."""
    force: Price = None
    """What the peak force on the guiding land as it is now is worth, in rpm of chaotic speeds; 1000 if left out. Of a
    whole bearing: what the peak forces of pockets and land count; 1 if left out."""
    impulse: Price = None
    """Of a whole bearing: what the impulses of pockets and land in a revolution count; 1 if left out."""
    power: Price = None
    """What the power to shear the film of the land as it is now is worth, in rpm of chaotic speeds; 0 if left out. Of a
    whole bearing: what its friction power counts; 1 if left out."""
    slip: Price = None
    """Of a whole bearing: what the slip of its cage counts; 1 if left out."""
    balance: Price = None
    """Of a whole bearing: what the balance grade G of its cage counts; 1 if left out."""
    worse_balance: bool = False
    """Let the cage be balanced worse than it is; otherwise its eccentricity may only become smaller."""
    scatter: Annotated[Texts, tyro.conf.arg(metavar="NAME=LAW")] = ()
    """Manufacturing scatter of a parameter: uniform within a part of it, guidance_gap=10%, or eccentricity=rayleigh.
    The mean over it is then minimised."""
    worst: Share = 1.0
    """With --scatter: mean over this share of the manufactured cages, the worst ones."""
    starts: FromOne = 1
    """Searches: one from the design itself, others from the best of the scouts."""
    scouts: FromZero = 0
    """Designs spread over the bounds that are looked at beforehand; without any, further searches start anywhere."""
    steps: Annotated[int | None, whole(1)] = None
    """Steps of each search; 10 if left out, 12 of a whole bearing."""
    batch: Annotated[int | None, whole(2)] = None
    """Designs of a step, chosen together by a Gaussian process of what was found before; 12 if left out, 16 of a whole
    bearing."""
    ensemble: Annotated[int | None, whole(1)] = None
    """Of a whole bearing: drawn starts of each design; 4 if left out."""
    discard: Annotated[int | None, whole(0)] = None
    """Of a whole bearing: revolutions of the cage left out at the beginning; 10 if left out."""
    revolutions: Annotated[int | None, whole(2, of=2)] = None
    """Of a whole bearing: revolutions of the cage observed, an even number; 20 if left out."""

    def check(self) -> None:
        super().check()
        if 0 < self.scouts < self.starts - 1:
            raise InputError(f"Option --scouts must be 0 or at least {self.starts - 1}, but {self.scouts} was given.")
        if self.worst != DesignOptions.worst and not self.scatter:
            raise InputError("Option --worst goes with --scatter.")


@dataclasses.dataclass(frozen=True, kw_only=True)
class SensitivityOptions(VaryOptions):
    """What each parameter does to the chaotic speeds over its range, and what tolerances do to the exact edges; the
    same of a measure of a whole bearing (nu2310), such as its wear."""

    usual: ClassVar[Mapping[str, tuple[Any, Any]]] = {
        "samples": (64, 32),
        "of": (None, "wear"),
        "ensemble": (None, 4),
        "discard": (None, 10),
        "revolutions": (None, 20),
    }
    of_cage: ClassVar[str] = "first last speeds"
    of_whole: ClassVar[str] = "speed load of ensemble discard revolutions"

    of: OptionalText = None
    """Of a whole bearing: what is looked at: wear, power, slip, or a statistic such as pocket_force_peak_N; wear if
    left out."""
    samples: Annotated[int | None, whole(2)] = None
    """Base samples of the Sobol indices, a power of 2; 64 if left out, 32 of a whole bearing."""
    ensemble: Annotated[int | None, whole(1)] = None
    """Of a whole bearing: drawn starts of each design; 4 if left out."""
    discard: Annotated[int | None, whole(0)] = None
    """Of a whole bearing: revolutions of the cage left out at the beginning; 10 if left out."""
    revolutions: Annotated[int | None, whole(2, of=2)] = None
    """Of a whole bearing: revolutions of the cage observed, an even number; 20 if left out."""
    tolerance: Annotated[float, number("lie between 0 and 100 percent", lambda x: 0 < x < 100)] = 5.0
    """Tolerance of every parameter but constants, ± so many percent, uniformly distributed."""

    def check(self) -> None:
        super().check()
        if self.samples is not None and self.samples & (self.samples - 1):
            raise InputError(f"Option --samples must be a power of 2, but {self.samples} was given.")


@dataclasses.dataclass(frozen=True, kw_only=True)
class _AtSpeed(Options):
    timed: ClassVar[bool] = False

    speed: Speed
    """Cage speed [rpm], or with a unit or of the shaft, e.g. "900 rad/s", "20000 rpm shaft". A whole bearing's is the
    shaft's."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class PoincareOptions(_AtSpeed, _Length, IntegrationOptions):
    """Strobe section at one speed, from three starts."""

    revolutions: Tens = 1000
    """Revolutions shown, a multiple of 10 (the error bars come from blocks of them)."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class SimulateOptions(_AtSpeed, IntegrationOptions):
    """Time history, orbit and each force at one speed; slips, forces and losses of a whole bearing (nu2310)."""

    revolutions: FromOne = 20
    """Revolutions recorded."""
    discard: FromZero = 0
    """Revolutions left out at the beginning."""
    load: Load = None
    """Shaft load [N] of a whole bearing, or with a unit, e.g. "4.45 kN"; its own if left out."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class StaticsOptions(Options):
    """Load of every roller, loaded zone, static displacement of the cage, kinematics."""

    timed: ClassVar[bool] = False
    called: ClassVar[Mapping[str, str]] = {"centrifugal_force": "shaft_speed"}

    load: Annotated[float | None, number("be above 0 N", lambda x: x > 0, "N", "own")] = None
    """Shaft load [N], or with a unit, e.g. "4.45 kN"; the case's own if left out."""
    shaft_speed: Annotated[float, number("be at least 0 rpm", lambda x: x >= 0, "rpm")] = 0.0
    """Shaft speed [rpm], or with a unit or of the cage, e.g. "10000 rpm cage", for the centrifugal load of the rollers
    and for the kinematics."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class ImpactOptions(_AtSpeed):
    """Impact of one roller on a cage bar: history of both forces."""

    duration: Annotated[float, number("lie between 0 and 1000 ms", lambda x: 0 < x <= 1000, "ms")] = 0.6
    """Length of the history [ms]."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class ReproduceOptions(CommonOptions):
    """The paper beside this model: edges, conclusions, and the orbit diagrams of figures 7 and 8."""

    constants: Literal["identified", "preliminary"] = "identified"
    """Set of constants that the paper does not print."""
    quick: bool = False
    """A coarse grid, short runs and no exact edges: for trying."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class ReportOptions(_Length, _Range, IntegrationOptions):
    """One HTML page about a design: zones, operating speeds, orbits, map, what moves the edges, how sure it is; of a
    whole bearing its drawing, slips, forces, wear, spectra, sweep and gradients."""

    of_cage: ClassVar[str] = "solver steps draws seed"

    operating: str = ""
    """Cage speeds and ranges to assess, e.g. "8500, 12000-15000" [rpm], "900 rad/s" or "20000-24000 rpm shaft"."""
    count: Annotated[int | None, whole(2)] = None
    """Number of speeds; if left out 251, or 126 with --quick; of a whole bearing 13, or 5."""
    draws: Annotated[int, whole(0)] = 64
    """Draws from what the file knows within ranges only; 0 takes the best guesses alone."""
    seed: FromZero = 0
    """Seed of the draws."""
    quick: bool = False
    """Leave out what takes long: gradients, mechanisms of chaotic edges, curves of the map."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class UnknownsOptions(_Range, IntegrationOptions):
    """Which measurement would decide: Sobol indices of the chaotic share over the ranges of a TOML file."""

    speeds: Annotated[int, whole(1)] = 8
    """Speeds at which a draw is assessed."""
    samples: FromTwo = 16
    """Base samples of the Sobol indices, a power of 2; so many times the number of ranges and 2 are run."""
    seed: FromZero = 0
    """Seed of the draws."""

    def check(self) -> None:
        super().check()
        if self.samples & (self.samples - 1):
            raise InputError(f"Option --samples must be a power of 2, but {self.samples} was given.")


@dataclasses.dataclass(frozen=True, kw_only=True)
class CompareOptions(_Length, _Range, IntegrationOptions):
    """Two designs side by side on one scale: what differs, labels, zones, exponents, orbits, forces on the land; of two
    whole bearings slips, impulses, wear, power and states of the cage."""

    called: ClassVar[Mapping[str, str]] = {"operating": "at"}
    usual: ClassVar[Mapping[str, tuple[Any, Any]]] = {"count": (126, 13)}
    of_cage: ClassVar[str] = "solver steps confirm horizon at"

    other: Annotated[tyro.conf.Positional[str], tyro.conf.arg(metavar="OTHER")]
    """The design to compare it with, a case or a TOML file. Both run at the same speeds of the shaft."""
    count: Annotated[int | None, whole(2)] = None
    """Number of speeds; 126 if left out, 13 of a whole bearing."""
    at: str = ""
    """Speeds to be shown in a table, e.g. "8500, 12000" [rpm] or "20000 rpm shaft"; five of the range if left out."""
    confirm: bool = True
    """Confirm labels: what is not periodic, its neighbours and a tenth of the rest are run again with steps half as
    long. --no-confirm turns this off."""
    horizon: FromZero = 3000
    """Revolutions to which chaos is followed, to tell how long it lasts; 0 turns this off."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class RunUpOptions(_Range, IntegrationOptions):
    """Run-up and run-down at a constant rate: how far the cage moves both ways, and where that differs; of
    a whole bearing its slip, eccentricity and power, whose speeds are the shaft's."""

    called: ClassVar[Mapping[str, str]] = {"settle": "discard", "steps": "windows"}
    usual: ClassVar[Mapping[str, tuple[Any, Any]]] = {"discard": (100, 10), "windows": (100, 24)}
    of_cage: ClassVar[str] = "solver steps"
    of_whole: ClassVar[str] = "load"

    rate: Annotated[float, number("be a rate above 0 rpm/s", lambda x: x > 0)] = 5000.0
    """Speed gained per second [rpm/s], in the mean over the ramp; the cage's, or the shaft's if the file says so."""
    windows: Annotated[int | None, whole(2)] = None
    """Parts into which each ramp is cut, in each of which the orbit's size is read; 100 if left out. Of a whole bearing
    steps of the speed, 24 if left out."""
    discard: Annotated[int | None, whole(0)] = None
    """Revolutions at the first speed before the ramp begins; 100 if left out, 10 of a whole bearing."""
    load: Load = None
    """Of a whole bearing: shaft load [N], or with a unit; its own if left out."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class IdentifyOptions(IntegrationOptions):
    """Narrow the ranges of a TOML file by what was measured on the machine, and write them to a new file."""

    measured: Annotated[tyro.conf.Positional[str], tyro.conf.arg(metavar="CSV")]
    """Measurements: a file with the columns quantity, speed, value, tolerance; a quantity is `whirl frequency` [Hz],
    `orbit size` [mm], or without a value `rattles` or `calm`."""
    draws: Annotated[int, whole(16)] = 128
    """Draws from the ranges, in each stage."""
    stages: FromOne = 4
    """Times that the ranges close around the best draws, at most."""
    seed: FromZero = 0
    """Seed of the draws."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class InitOptions(AnyOptions):
    """A commented TOML file that describes a bearing, to be changed and given to the other commands."""

    timed: ClassVar[bool] = False

    path: Annotated[tyro.conf.Positional[str], tyro.conf.arg(metavar="FILE")]
    """Where to write it, e.g. my_bearing.toml; an existing file is left alone."""
    model: Literal["cage", "bearing"] = "cage"
    """What it describes: the cage under prescribed forces, or the whole bearing with its rollers."""


COMMANDS: Mapping[str, tuple[type[AnyOptions], str]] = {
    "init": (InitOptions, "_bearing.init"),
    "simulate": (SimulateOptions, "_one_speed.simulate_at"),
    "sweep": (SweepOptions, "_sweep.sweep_over_speed"),
    "zones": (ZonesOptions, "_sweep.zones_over_speed"),
    "bifurcations": (SearchOptions, "_orbits.bifurcations"),
    "gradient": (GradientOptions, "_orbits.gradient"),
    "compare": (CompareOptions, "_compare.compare"),
    "runup": (RunUpOptions, "_runup.runup"),
    "map": (MapOptions, "_map.map_of"),
    "study": (StudyOptions, "_study.study"),
    "design": (DesignOptions, "_design.design"),
    "sensitivity": (SensitivityOptions, "_design.sensitivity"),
    "unknowns": (UnknownsOptions, "_unknowns.unknowns"),
    "identify": (IdentifyOptions, "_identify.identify_from"),
    "poincare": (PoincareOptions, "_one_speed.poincare_at"),
    "statics": (StaticsOptions, "_bearing.statics"),
    "impact": (ImpactOptions, "_bearing.impact"),
    "reproduce": (ReproduceOptions, "_reproduce.reproduce"),
    "report": (ReportOptions, "_page.report_on"),
}
"""Command -> its options, and the function of this package that carries it out for a cage."""
WHOLE_COMMANDS: Mapping[str, str] = {
    "simulate": "_whole.bearing_at",
    "sweep": "_whole_sweep.bearing_over_speed",
    "zones": "_whole_sweep.bearing_over_speed",
    "map": "_whole_map.bearing_map",
    "runup": "_whole_runup.bearing_runup",
    "gradient": "_whole_gradient.bearing_gradients",
    "compare": "_whole_compare.bearings_compared",
    "report": "_whole_page.bearing_report",
    "design": "_whole_design.design_bearing",
    "study": "_study.study",
    "sensitivity": "_whole_sensitivity.bearing_shares",
}
"""Command that takes a whole bearing -> the function that carries it out for one."""
Command: Any = Union[tuple(Annotated[kind, tyro.conf.subcommand(name)] for name, (kind, _) in COMMANDS.items())]  # noqa: UP007
