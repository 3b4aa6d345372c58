"""Commands and their options. Nothing heavy is imported here, so that `--help` and typing errors
answer at once.
"""

import dataclasses
from typing import Annotated, ClassVar, Literal

import tyro

from ._quantities import Milliseconds, OptionalCount, OptionalNewton, OptionalNumber, OptionalRpm, OptionalText, Rpm


SETTLED = 1000
"""Revolutions after which a lightly damped cage has found its orbit."""


@dataclasses.dataclass(frozen=True)
class CommonOptions:
    """What every command takes."""

    implementation: ClassVar[str] = ""
    """Module of this package whose `run` carries the command out."""

    json: bool = False
    """Print one JSON document on standard output instead of tables."""
    out: str = "out"
    """Folder for figures and data; it is made if need be."""
    style: Literal["light", "dark", "print"] = "light"
    """Style of the figures: for white pages, dark screens, or black-and-white paper."""
    no_cache: bool = False
    """Compile everything anew instead of using programs kept from earlier runs."""


@dataclasses.dataclass(frozen=True)
class _Case:
    case: Annotated[tyro.conf.Positional[str], tyro.conf.arg(metavar="CASE")]
    """A published case (1a, 1b, 2a, 2b, 3a, 3b) or the path of a TOML file."""


@dataclasses.dataclass(frozen=True)
class Options(CommonOptions, _Case):
    """What every command about a case takes."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class IntegrationOptions(Options):
    """How to integrate."""

    solver: OptionalText = None
    """Integration method: rodas3, rodas4, rk4, newmark, tsit5, kvaerno3, kvaerno5, kencarp4."""
    steps: OptionalCount = None
    """Equal steps per revolution."""
    tolerance: OptionalNumber = None
    """Adaptive steps with this tolerance instead of equal ones."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class SweepOptions(IntegrationOptions):
    """Sweep over speed from three starts: orbit diagram, exponents, chaotic zones."""

    implementation: ClassVar[str] = "_sweep"

    first: Rpm = 2500.0
    """First cage speed [rpm], or with a unit, e.g. "300 rad/s"."""
    last: Rpm = 27500.0
    """Last cage speed [rpm]."""
    count: int = 251
    """Number of speeds; with one, only the first speed is run."""
    discard: int = 300
    """Revolutions left out at the beginning."""
    revolutions: int = 300
    """Revolutions observed, a multiple of 10 (the error bars come from blocks of them)."""
    confirm: bool = True
    """Run what is not periodic, its neighbours and a tenth of the rest again with steps half as long."""
    horizon: int = 3000
    """Revolutions to which chaos is followed, to tell how long it lasts; 0 does not ask."""
    exponents: int = 1
    """Number of Lyapunov exponents."""
    waterfall: int = 0
    """Speeds of a waterfall of spectra of the vertical motion; none by default."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class ZonesOptions(SweepOptions):
    """Zones without a stable synchronous orbit, with exact edges, and chaotic zones, beside the published ones."""

    implementation: ClassVar[str] = "_zones"

    quick: bool = False
    """Leave out the gradients of the edges, which take about a minute to compile."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class SearchOptions(IntegrationOptions):
    """How to search for synchronous orbits: simulations on a grid of speeds, then branches through all they met."""

    first: Rpm = 2500.0
    """First cage speed [rpm], or with a unit, e.g. "300 rad/s"."""
    last: Rpm = 27500.0
    """Last cage speed [rpm]."""
    count: int = 101
    """Speeds that are simulated, from three starts each."""
    discard: int = SETTLED
    """Revolutions left out at the beginning."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class BifurcationsOptions(SearchOptions):
    """Synchronous orbits over speed: where they are stable, how they lose it, and the zones without one."""

    implementation: ClassVar[str] = "_bifurcations"


@dataclasses.dataclass(frozen=True, kw_only=True)
class GradientOptions(SearchOptions):
    """Derivatives of the synchronous-loss edges, and of the width of zone 1, by every parameter."""

    implementation: ClassVar[str] = "_gradient"


@dataclasses.dataclass(frozen=True, kw_only=True)
class MapOptions(SearchOptions):
    """Stability map: the edges followed in two parameters, over colours of the largest exponent."""

    implementation: ClassVar[str] = "_map"

    x: str = "speed"
    """Parameter across: speed, or any parameter of the model, each curve then at its own edge's speed."""
    y: str = "guidance_gap"
    """Parameter upwards, any of the model."""
    lower: str | None = None
    """Lowest value of y, in SI units or with a unit, e.g. "0.4 mm"; 0.8 of its value if left out."""
    upper: str | None = None
    """Highest value of y; 1.25 of its value if left out."""
    rows: int = 12
    """Values of y at which the exponent is computed; with 0 it is left out."""
    columns: int = 50
    """Speeds at which the exponent is computed."""
    revolutions: int = 100
    """Revolutions over which the exponent is computed."""
    starts: int = 1
    """Starts of which the largest exponent is taken."""
    persist: int = 0
    """With --points: revolutions that chaos must outlast to count; what has died out by then was a transient."""
    points: OptionalText = None
    """Instead of rows and columns: a grid of labels, e.g. 300x300, from a coarse picture to the full grid."""
    adaptive: bool = False
    """With --points: only points near a change of label are computed."""
    refine: Literal["chaos", "label"] = "chaos"
    """With --adaptive: follow where chaos begins and ends, or where any label changes."""
    most: OptionalCount = None
    """With --points: points computed at most."""
    speed: OptionalRpm = None
    """With --points and another --x than the speed: the speed of all points [rpm]."""
    no_curves: bool = False
    """With --points: do not search for the synchronous-loss edges to draw on top."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class StudyOptions(IntegrationOptions):
    """A sweep over any grid or sample of parameters, stored as it goes; the same command goes on where one stopped."""

    implementation: ClassVar[str] = "_study"

    vary: Annotated[tuple[str, ...], tyro.conf.UseAppendAction, tyro.conf.arg(metavar="NAME=VALUES")] = ()
    """What to vary, once for each parameter, `speed` among them. A grid: speed=4000rpm:27500rpm:100, or single values:
    oil=32,56,78 (ISO VG grades). Sampled: guidance_gap=0.3mm:0.6mm, or within a tolerance: eccentricity=20um+-3um."""
    sample: int = 0
    """Number of samples, best a power of 2."""
    seed: int = 0
    """Seed of the samples."""
    starts: OptionalCount = None
    """Starts at each point; all of the model's own if left out."""
    discard: int = 300
    """Revolutions left out at the beginning."""
    revolutions: int = 300
    """Revolutions observed, a multiple of 10 (the error bars come from blocks of them)."""
    exponents: int = 1
    """Number of Lyapunov exponents."""
    strobe: int = 0
    """Strobe states stored of each lane, the last ones."""
    store: OptionalText = None
    """Name of the store within the output folder."""
    chunk: int = 2048
    """Lanes computed and stored together."""
    shard: str = "1/1"
    """Part of the work, e.g. 2/4: every fourth chunk from the second on. All parts write to the same store."""
    executor: Literal["local", "dask"] = "local"
    """Where to run: on all cores of this machine, or on dask.distributed."""
    scheduler: OptionalText = None
    """Address of a dask scheduler, e.g. tcp://host:8786; a cluster on this machine if left out."""
    workers: OptionalCount = None
    """Processes of the cluster on this machine; one a core if left out."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class _VaryOptions(Options):
    """What may be changed in a design."""

    vary: Annotated[tuple[str, ...], tyro.conf.UseAppendAction, tyro.conf.arg(metavar="NAME=LOWER:UPPER")] = ()
    """What may be changed and between which values, once for each parameter, e.g. guidance_gap=0.3mm:0.6mm; the
    guidance gap from 0.3 to 0.6 mm and the eccentricity from 5 to 60 um if left out."""
    first: Rpm = 4000.0
    """First cage speed that matters [rpm], or with a unit."""
    last: Rpm = 27500.0
    """Last cage speed that matters [rpm]."""
    speeds: int = 48
    """Speeds at which a design is judged."""
    seed: int = 0
    """Seed of all that is drawn."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class DesignOptions(_VaryOptions):
    """Make the chaotic speeds few by changing the design: gradient search, checked by a fresh sweep."""

    implementation: ClassVar[str] = "_design"

    cost: float = 1000.0
    """What one unit of manufacturing cost is worth, in rpm of chaotic speeds; the paper's case 1a costs 2 units."""
    scatter: Annotated[tuple[str, ...], tyro.conf.UseAppendAction, tyro.conf.arg(metavar="NAME=LAW")] = ()
    """What manufacture makes of a parameter: evenly within a part of it, guidance_gap=10%, or eccentricity=rayleigh.
    The mean over it is then made small."""
    worst: float = 1.0
    """With --scatter: mean of this share of the made cages, the worst ones."""
    starts: int = 3
    """Searches: one from the design itself, others from the best of the scouts."""
    scouts: int = 32
    """Designs all over the bounds that are looked at beforehand."""
    steps: int = 12
    """Steps of each search at most."""
    cloud: int = 12
    """Designs around each one from which its gradient is taken."""
    spread: float = 0.1
    """Their scatter, as a part of the distance between the bounds: structure that is finer is smoothed away."""
    quick: bool = False
    """Leave out the exact edges before and after."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class SensitivityOptions(_VaryOptions):
    """What each parameter does to the chaotic speeds over its range, and what tolerances do to the exact edges."""

    implementation: ClassVar[str] = "_sensitivity"

    samples: int = 64
    """Base samples of the Sobol indices, a power of 2."""
    tolerance: float = 5.0
    """Tolerance of every parameter, +- so many percent, evenly used."""
    quick: bool = False
    """Leave out the exact edges and their tolerance budget."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class PoincareOptions(IntegrationOptions):
    """Strobe section at one speed, from three starts."""

    implementation: ClassVar[str] = "_poincare"

    speed: Rpm
    """Cage speed [rpm], or with a unit, e.g. "900 rad/s"."""
    discard: int = 300
    """Revolutions left out at the beginning."""
    revolutions: int = 1000
    """Revolutions shown, a multiple of 10 (the error bars come from blocks of them)."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class SimulateOptions(IntegrationOptions):
    """Time history, orbit and each force at one speed."""

    implementation: ClassVar[str] = "_simulate"

    speed: Rpm
    """Cage speed [rpm], or with a unit, e.g. "900 rad/s"."""
    revolutions: int = 20
    """Revolutions recorded."""
    discard: int = 0
    """Revolutions left out at the beginning."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class StaticsOptions(Options):
    """Load of every roller, loaded zone, static displacement of the cage, kinematics."""

    implementation: ClassVar[str] = "_statics"

    load: OptionalNewton = None
    """Shaft load [N], or with a unit, e.g. "4.45 kN"; the case's own if left out."""
    shaft_speed: Rpm = 0.0
    """Shaft speed [rpm], for the centrifugal load of the rollers and for the kinematics."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class ImpactOptions(Options):
    """Impact of one roller on a cage bar: history of both forces."""

    implementation: ClassVar[str] = "_impact"

    speed: Rpm
    """Cage speed [rpm], or with a unit, e.g. "900 rad/s"."""
    duration: Milliseconds = 0.6
    """Length of the history [ms]."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class ReproduceOptions(CommonOptions):
    """The paper beside this model: edges, figures 5, 7, 8 and 9, conclusions, readings."""

    implementation: ClassVar[str] = "_reproduce"

    constants: Literal["identified", "preliminary"] = "identified"
    """Set of constants that the paper does not print."""
    quick: bool = False
    """A coarse grid, short runs and no exact edges: for trying."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class ValidateOptions(CommonOptions):
    """Numbers of this package beside printed ones, closed forms and other programs, as VALIDATION.md."""

    implementation: ClassVar[str] = "_validate"

    topics: str = ""
    """Topics, e.g. "film, statics"; all of them if left out."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class ReportOptions(IntegrationOptions):
    """One HTML page about a design: zones, operating speeds, orbits, map, what moves the edges, how sure it is."""

    implementation: ClassVar[str] = "_report_page"

    operating: str = ""
    """Cage speeds and ranges to judge, e.g. "8500, 12000-15000" [rpm] or "900 rad/s"."""
    first: Rpm = 2500.0
    """First cage speed [rpm], or with a unit, e.g. "300 rad/s"."""
    last: Rpm = 27500.0
    """Last cage speed [rpm]."""
    count: OptionalCount = None
    """Number of speeds; 251, or 126 with --quick."""
    discard: OptionalCount = None
    """Revolutions left out at the beginning; 300 by default."""
    revolutions: OptionalCount = None
    """Revolutions observed, a multiple of 10; 300 by default."""
    quick: bool = False
    """Leave out what takes long: gradients, mechanisms of chaotic edges, curves of the map."""


@dataclasses.dataclass(frozen=True)
class InitOptions:
    """A commented TOML file that describes a bearing, to be changed and given to the other commands."""

    implementation: ClassVar[str] = "_init"
    no_cache: ClassVar[bool] = True
    style: ClassVar[Literal["light"]] = "light"

    path: Annotated[tyro.conf.Positional[str], tyro.conf.arg(metavar="FILE")]
    """Where to write it, e.g. my_bearing.toml; an existing file is left alone."""
    json: bool = False
    """Print one JSON document on standard output instead of text."""


Command = (
    Annotated[InitOptions, tyro.conf.subcommand("init")]
    | Annotated[SimulateOptions, tyro.conf.subcommand("simulate")]
    | Annotated[SweepOptions, tyro.conf.subcommand("sweep")]
    | Annotated[ZonesOptions, tyro.conf.subcommand("zones")]
    | Annotated[BifurcationsOptions, tyro.conf.subcommand("bifurcations")]
    | Annotated[GradientOptions, tyro.conf.subcommand("gradient")]
    | Annotated[MapOptions, tyro.conf.subcommand("map")]
    | Annotated[StudyOptions, tyro.conf.subcommand("study")]
    | Annotated[DesignOptions, tyro.conf.subcommand("design")]
    | Annotated[SensitivityOptions, tyro.conf.subcommand("sensitivity")]
    | Annotated[PoincareOptions, tyro.conf.subcommand("poincare")]
    | Annotated[StaticsOptions, tyro.conf.subcommand("statics")]
    | Annotated[ImpactOptions, tyro.conf.subcommand("impact")]
    | Annotated[ReproduceOptions, tyro.conf.subcommand("reproduce")]
    | Annotated[ValidateOptions, tyro.conf.subcommand("validate")]
    | Annotated[ReportOptions, tyro.conf.subcommand("report")]
)
