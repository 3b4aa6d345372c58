"""The one table of everything shown: where it stands, which commands make it, and how."""

import dataclasses
import pathlib
from collections.abc import Sequence

from . import _excerpts as ex
from ._excerpts import Excerpt


@dataclasses.dataclass(frozen=True)
class Shown:
    """A block of a page between its marks, a whole page, or a notebook.

    Without an excerpt the words of the block stay: it shows a figure, which is in `files`, or holds numbers that
    someone puts in by hand.
    """

    name: str
    page: str
    """Markdown file or notebook."""
    commands: Sequence[str]
    excerpt: Excerpt | None = None
    whole: bool = False
    """Whether the block is the whole page."""
    files: dict[str, str] = dataclasses.field(default_factory=dict)
    """Other files of the checkout that belong to it, each with where a command run elsewhere leaves it; nothing for one
    that is left in place."""

    @property
    def by_hand(self) -> bool:
        """Whether someone has to put the numbers in."""
        return self.excerpt is None and not self.files

    @property
    def timed(self) -> bool:
        """Whether it says how long sweeps take."""
        return self.commands[0] in (SPEED, STUDY)

    @property
    def parts(self) -> tuple[str, ...]:
        """Parts of the package that its commands run."""
        if self.name.startswith("bearing-"):
            return ("bearing",)
        alone = self.commands[0] == SWEEP or self.commands[0] == REPRODUCE and self.name != "both-kinds"
        return ("cage",) if alone else ("cage", "orbits")

    @property
    def in_place(self) -> list[str]:
        """Files that its commands write in the checkout."""
        own = [self.page] if self.whole and not self.commands[0].startswith("jaxcage") else []
        return own + [name for name, left in self.files.items() if not left]

    def answers_to(self, word: str) -> bool:
        """Whether `word` is its name, or that of its page."""
        return word in (self.name, self.page, pathlib.Path(self.page).stem.lower())


def _figure(name: str, page: str, command: str, file: str) -> Shown:
    return Shown(name, page, [command], files={f"experiments/{file}": f"out/{file}"})


def _whole(name: str, page: str, command: str, left: str) -> Shown:
    return Shown(name, page, [command], ex.page(left), whole=True)


def _notebook(name: str) -> Shown:
    page, files = f"experiments/{name}.ipynb", {f"experiments/{name}.png": ""}
    command = f"python -m jupytext --to ipynb --execute experiments/{name}.py"
    return Shown(name.replace("_", "-"), page, [command], ex.page(f"{name}.ipynb"), whole=True, files=files)


README, EDGES, DESIGNS, STUDIES, REPRODUCTION = (
    "README.md",
    *(f"docs/{name}.md" for name in ("edges", "design", "studies", "reproduction")),
)
WHOLE, TRENDS = "docs/whole-bearing.md", "python -m benchmarks.bearing_trends"
SLOPES = "python -m benchmarks.bearing_gradients"
SMALL = "--designs 32 --starts 16 --seeds 1 --discard 10 --revolutions 20"
BETTER = 'jaxcage design nu2310 --speed "10000 rpm shaft"'
PAPER = "python -m benchmarks.bearing_paper"
PAPER_PARTS = (("force", ""), ("support", " --revolutions 12 --discard 8"), ("cases", ""))
SWEEP, ZONES, DESIGN, REPRODUCE = "jaxcage sweep 1a", "jaxcage zones 1a", "jaxcage design 1b", "jaxcage reproduce"
SPEED, STUDY = "python -m benchmarks", "python -m benchmarks.study --size 0.05"
PAPER_FIGURE = {"experiments/reproduce_7a.png": "out/fig7a.png"}
CHAOS = ("Chaotic zones of", "Transient chaos of")

SHOWN = (
    _figure("sweep-1a-figure", README, SWEEP, "sweep_1a.png"),
    Shown("sweep-1a", README, [SWEEP], ex.tables(*CHAOS)),
    Shown("zones-1a", README, [ZONES], ex.tables("Elasticities", *CHAOS)),
    Shown("against-paper", README, [REPRODUCE], ex.against_paper),
    Shown("reproduce-figure", README, [REPRODUCE], files=PAPER_FIGURE),
    _whole("speed-page", "benchmarks/speed.md", SPEED, "speed.md"),
    Shown("speed", README, [SPEED], ex.speed),
    Shown("speed-text", README, [SPEED]),
    Shown("guide-zones-1a", EDGES, [ZONES], ex.tables("Synchronous-loss", "Elasticities", *CHAOS)),
    _figure("bifurcations-1a-figure", EDGES, "jaxcage bifurcations 1a", "bifurcations_1a.png"),
    Shown("design-1b", DESIGNS, [DESIGN], ex.tables("Design of", "Optima", "Chaotic zones", "Synchronous-loss")),
    _figure("design-1b-figure", DESIGNS, DESIGN, "design_1b.png"),
    _notebook("optimise_gap_and_balance"),
    Shown("studies-text", STUDIES, [STUDY]),
    _whole("validation-page", "VALIDATION.md", "jaxcage validate", "out/VALIDATION.md"),
    Shown("both-kinds", REPRODUCTION, [REPRODUCE], ex.every_kind),
    Shown("reproduction-figure", REPRODUCTION, [REPRODUCE], files=PAPER_FIGURE),
    Shown("readings", REPRODUCTION, [REPRODUCE], ex.readings),
    Shown("bearing-threshold", WHOLE, [f"{TRENDS} threshold --discard 100 --revolutions 50"], ex.printed),
    Shown("bearing-trends", WHOLE, [f"{TRENDS} trends --starts 1 --discard 10 --revolutions 10"], ex.printed),
    Shown("bearing-gradients", WHOLE, [f"{SLOPES} --cases 0"], ex.printed),
    Shown("bearing-gradients-elsewhere", WHOLE, [f"{SLOPES} --cases 3 4 {SMALL}"], ex.printed),
    Shown("bearing-design", WHOLE, [BETTER], ex.tables("Design of", "Before and after")),
    *(Shown(f"bearing-paper-{what}", WHOLE, [f"{PAPER} {what}{more}"], ex.printed) for what, more in PAPER_PARTS),
    Shown("bearing-stiffness", WHOLE, ["python -m benchmarks.bearing_stiffness"], ex.printed),
    Shown("transcript", "docs/transcript.md", ["python -m benchmarks.transcript"], ex.printed),
    _whole("convergence-page", "benchmarks/convergence.md", "python -m benchmarks.convergence", "convergence.md"),
    _whole("solvers-page", "benchmarks/solvers.md", "python -m benchmarks.solvers", "solvers.md"),
    _whole("orbits-page", "benchmarks/orbits.md", "python -m benchmarks.orbits", "orbits.md"),
    _notebook("orbit_diagrams"),
    _notebook("gradient_tour"),
    _notebook("sensitivity_and_tolerances"),
    _notebook("your_own_bearing"),
    _notebook("your_own_oscillator"),
)
