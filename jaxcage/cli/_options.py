"""Commands and their options. Nothing heavy is imported here, so that `--help` and typing errors
answer at once.
"""

import dataclasses
from typing import Annotated, ClassVar

import tyro


@dataclasses.dataclass(frozen=True)
class CommonOptions:
    """What every command takes."""

    implementation: ClassVar[str] = ""
    """Module of this package whose `run` carries the command out."""

    json: bool = False
    """Print one JSON document on standard output instead of tables."""
    out: str = "out"
    """Folder for figures and data; it is made if need be."""
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

    solver: str | None = None
    """Integration method: rodas3, rodas4, rk4, newmark, tsit5, kvaerno3, kvaerno5, kencarp4."""
    steps: int | None = None
    """Equal steps per revolution."""
    tolerance: float | None = None
    """Adaptive steps with this tolerance instead of equal ones."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class SweepOptions(IntegrationOptions):
    """Sweep over speed from three starts: orbit diagram, exponents, chaotic zones."""

    implementation: ClassVar[str] = "_sweep"

    first: float = 2500.0
    """First cage speed [rpm]."""
    last: float = 27500.0
    """Last cage speed [rpm]."""
    count: int = 251
    """Number of speeds; with one, only the first speed is run."""
    discard: int = 300
    """Revolutions left out at the beginning."""
    revolutions: int = 300
    """Revolutions observed, a multiple of 10 (the error bars come from blocks of them)."""
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

    first: float = 2500.0
    """First cage speed [rpm]."""
    last: float = 27500.0
    """Last cage speed [rpm]."""
    count: int = 101
    """Speeds that are simulated, from three starts each."""
    discard: int = 250
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


@dataclasses.dataclass(frozen=True, kw_only=True)
class PoincareOptions(IntegrationOptions):
    """Strobe section at one speed, from three starts."""

    implementation: ClassVar[str] = "_poincare"

    speed: float
    """Cage speed [rpm]."""
    discard: int = 300
    """Revolutions left out at the beginning."""
    revolutions: int = 1000
    """Revolutions shown, a multiple of 10 (the error bars come from blocks of them)."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class SimulateOptions(IntegrationOptions):
    """Time history, orbit and each force at one speed."""

    implementation: ClassVar[str] = "_simulate"

    speed: float
    """Cage speed [rpm]."""
    revolutions: int = 20
    """Revolutions recorded."""
    discard: int = 0
    """Revolutions left out at the beginning."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class StaticsOptions(Options):
    """Load of every roller, loaded zone, static displacement of the cage, kinematics."""

    implementation: ClassVar[str] = "_statics"

    load: float | None = None
    """Shaft load [N]; the case's own if left out."""
    shaft_speed: float = 0.0
    """Shaft speed [rpm], for the centrifugal load of the rollers and for the kinematics."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class ImpactOptions(Options):
    """Impact of one roller on a cage bar: history of both forces."""

    implementation: ClassVar[str] = "_impact"

    speed: float
    """Cage speed [rpm]."""
    duration: float = 0.6
    """Length of the history [ms]."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class ReproduceOptions(CommonOptions):
    """The paper beside this model: edges, figures 5, 7, 8 and 9, conclusions, readings."""

    implementation: ClassVar[str] = "_reproduce"

    constants: str = "identified"
    """Set of constants that the paper does not print: identified or preliminary."""
    quick: bool = False
    """A coarse grid, short runs and no exact edges: for trying."""


Command = (
    Annotated[SimulateOptions, tyro.conf.subcommand("simulate")]
    | Annotated[SweepOptions, tyro.conf.subcommand("sweep")]
    | Annotated[ZonesOptions, tyro.conf.subcommand("zones")]
    | Annotated[BifurcationsOptions, tyro.conf.subcommand("bifurcations")]
    | Annotated[GradientOptions, tyro.conf.subcommand("gradient")]
    | Annotated[MapOptions, tyro.conf.subcommand("map")]
    | Annotated[PoincareOptions, tyro.conf.subcommand("poincare")]
    | Annotated[StaticsOptions, tyro.conf.subcommand("statics")]
    | Annotated[ImpactOptions, tyro.conf.subcommand("impact")]
    | Annotated[ReproduceOptions, tyro.conf.subcommand("reproduce")]
)
