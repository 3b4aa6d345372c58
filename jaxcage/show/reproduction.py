"""The paper beside the model: its edges, its conclusions, and its orbit diagrams."""

import dataclasses
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

import jax.numpy as jnp
import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from .._parameters import replace
from ..analysis import Zone, Zones, chaotic_share, resolution_rpm, zones
from ..bearing import PUBLISHED_CASES, PUBLISHED_SPEED_RANGE_RPM, PublishedCase, load_distribution
from ..forces import PocketImpact, approach_speed, impact_history
from ..lanes import rpm, sweep
from ..models import CageModel
from ..orbits import LossZones, loss_zones, synchronous_orbits
from .diagrams import orbit_diagram
from .quantity_tables import displacements
from .speed_axes import add_shaft_axes, mark_published, published_edges
from .style import new_figure
from .tables import Column, Table, rows_table
from .zone_tables import zone_span


ZONE_RANGE_RPM = (4000.0, 27500.0)
"""Speeds between which a case should have exactly two zones."""
LASTING, AT_FIRST, LOSS = "lasting", "at first", "synchronous-loss"
"""Chaos that lasts beyond the horizon; chaos while observed, lasting or not; loss of the synchronous orbit."""
WIDE_RPM = 500.0
"""Smallest width of the zones that a diagram over 25000 rpm shows."""
SECTION_RPM, SECTION_REVOLUTIONS = 8500.0, (4, 4000)
"""Fig. 9: speed, and first and last revolution of its strobe points."""
PANELS = {
    "a": (("1a", "1b"), (7000.0, 22000.0)),
    "b": (("2a", "2b"), (7500.0, 14000.0)),
    "c": (("3a", "3b"), (7500.0, 14000.0)),
}
"""Cases of each panel of figs. 7 and 8, and the speed axis of the latter [rpm]."""


@dataclasses.dataclass(frozen=True)
class ComparedEdge:
    """A published edge beside the computed one of one kind; None where there is none."""

    case: str
    edge: str
    """`zone 1 onset`, `zone 1 exit` or `zone 2 onset`."""
    published_rpm: float
    kind: str
    """`lasting`, `at first` or `synchronous-loss`."""
    ours_rpm: float | None
    uncertainty_rpm: float | None
    mechanism: str | None

    @property
    def error_percent(self) -> float | None:
        """Difference of the computed from the published edge, relative to that [%]."""
        return None if self.ours_rpm is None else 100 * (self.ours_rpm / self.published_rpm - 1)


def zones_in_range(zones: Sequence[Zone]) -> list[Zone]:
    """Zones that reach into the range in which two were published."""
    low, high = ZONE_RANGE_RPM
    return [z for z in zones if zone_span(z)[1] > low and zone_span(z)[0] < high]


def wide_zones(zones: Sequence[Zone]) -> list[Zone]:
    """The zones in range that are wide, or run past the swept range."""
    return [z for z in zones_in_range(zones) if z.width_rpm is None or z.width_rpm >= WIDE_RPM]


def compare_edges(published: PublishedCase, zones: Sequence[Zone], kind: str) -> list[ComparedEdge]:
    """The three published edges of a case beside those of the zones found in the range in which they were published."""
    low, high, next_low = published.zone_1_onset_rpm, published.zone_1_exit_rpm, published.zone_2_onset_rpm
    first, second = _matched([(low, high), (next_low, ZONE_RANGE_RPM[1])], zones_in_range(zones))
    found = (first and first.onset, first and first.exit, second and second.onset)
    ours = [(e.speed_rpm, e.uncertainty_rpm, e.mechanism) if e else (None, None, None) for e in found]
    edges = published_edges(published).items()
    return [ComparedEdge(published.name, name, rpm, kind, *of) for (name, rpm), of in zip(edges, ours, strict=True)]


def _matched(published: Sequence[tuple[float, float]], found: Sequence[Zone]) -> list[Zone | None]:
    """The zone that shares most speeds with each published one, None if there is none; each is taken once."""
    shared = lambda zone, low, high: min(zone_span(zone)[1], high) - max(zone_span(zone)[0], low)
    taken: list[Zone | None] = []
    for ends in published:
        best = max(found, key=lambda zone: shared(zone, *ends), default=None)
        lost = best is None or shared(best, *ends) <= 0 or any(best is zone for zone in taken)
        taken.append(None if lost else best)
    return taken


@dataclasses.dataclass(frozen=True)
class Runs:
    """Sweeps and their zones by case, from which all comparisons are made."""

    models: Mapping[str, CageModel]
    sweeps: Mapping[str, xr.Dataset]
    zones: Mapping[str, Zones]
    loss: Mapping[str, LossZones]
    """Empty where the orbits were left out."""
    sections: Mapping[str, xr.Dataset]
    """At the speed of fig. 9, from the paper's start, with its transient."""

    def zones_by_kind(self, name: str) -> dict[str, Sequence[Zone]]:
        """The zones of a case of every kind."""
        at_first = zones(self.sweeps[name].drop_vars("escape", errors="ignore")).zones
        kinds: dict[str, Sequence[Zone]] = {LASTING: self.zones[name].zones, AT_FIRST: at_first}
        return kinds | ({LOSS: self.loss[name].zones} if name in self.loss else {})

    def edge(self, case: str, name: str) -> float:
        """An edge of lasting chaos [rpm]; NaN if there is none."""
        rows = compare_edges(PUBLISHED_CASES[case], self.zones[case].zones, LASTING)
        return next(float("nan") if row.ours_rpm is None else row.ours_rpm for row in rows if row.edge == name)


def run_all(
    models: Mapping[str, CageModel],
    *,
    speeds: int = 251,
    discard: int = 300,
    revolutions: int = 300,
    section_revolutions: int = SECTION_REVOLUTIONS[1],
    orbits: bool = True,
    report: Callable[[str, int, int], None] | None = None,
) -> Runs:
    """Sweep every case over the published range from three starts, find its synchronous orbits, and run fig. 9."""
    say = report or (lambda what, done, total: None)
    grid, cases = rpm(*PUBLISHED_SPEED_RANGE_RPM, speeds), list(models.values())
    by_name = lambda found: {name: found.isel(design=i) for i, name in enumerate(models)}
    progress = lambda done, total: say("sweeps", done, total)
    swept = by_name(sweep(cases, grid, discard=discard, revolutions=revolutions, progress=progress))
    loss: dict[str, LossZones] = {}
    for i, (name, model) in enumerate(models.items() if orbits else ()):
        say(f"orbits of {name}", i, len(models))
        loss[name] = loss_zones(synchronous_orbits(model, float(grid[0]), float(grid[-1]), settled=swept[name]))
    say("strobe sections", 0, 1)
    first = SECTION_REVOLUTIONS[0]
    observed = section_revolutions - first
    blocks = max(n for n in range(1, 21) if observed % n == 0)
    length: dict[str, Any] = {"discard": first, "revolutions": observed, "blocks": blocks, "keep": observed}
    sections = sweep(cases, np.array([rpm(SECTION_RPM)]), starts=1, **length)
    return Runs(models, swept, {name: zones(s) for name, s in swept.items()}, loss, by_name(sections))


@dataclasses.dataclass(frozen=True)
class Conclusion:
    """A claim of the paper with the evidence of the model, decided by the checks that are written beside it."""

    claim: str
    evidence: str
    checks: tuple[bool, ...]

    @property
    def verdict(self) -> str:
        """`holds`, `holds in part` or `does not hold`."""
        return "holds" if all(self.checks) else "holds in part" if any(self.checks) else "does not hold"


def _percent(change: float) -> str:
    """A relative change; an edge that is missing has none."""
    return f"{100 * change:+.1f} %" if np.isfinite(change) else "no such edge"


def two_zones(runs: Runs) -> Conclusion:
    counts = {case: len(zones_in_range(z.zones)) for case, z in runs.zones.items()}
    width = lambda case: runs.edge(case, "zone 1 exit") - runs.edge(case, "zone 1 onset")
    moved = {
        "gap 0.45 to 0.60 mm": width("1b") / width("1a") - 1,
        "eccentricity 35 to 57 um": width("2b") / width("2a") - 1,
        "oil VG78 to VG32": width("3b") / width("3a") - 1,
    }
    gap, unbalance, oil = (abs(v) for v in moved.values())
    listed = ", ".join(f"{case}: {n}" for case, n in counts.items())
    changes = ", ".join(f"{name} {_percent(v)}" for name, v in moved.items())
    return Conclusion(
        "1. There are two zones in every case; gap and eccentricity, the gap above all, set the first; the oil hardly.",
        f"Chaotic zones between 4000 and 27500 rpm: {listed}. Change of zone 1's width: {changes}.",
        (all(n == 2 for n in counts.values()), bool(gap > unbalance > oil)),
    )


def impacts(runs: Runs) -> Conclusion:
    model, law = runs.models["1a"], PocketImpact()
    clearance = float(model.bearing.pocket_clearance)

    def peak(clearance: float) -> float:
        v0 = approach_speed(law.approach_ratio, float(rpm(SECTION_RPM)), clearance)
        history = impact_history(law, model.bearing.roller_mass, v0, jnp.asarray(1e-3))
        return float(jnp.max(history.contact_force))

    def reach(model: CageModel) -> float:
        """Largest distance from the rib's centre, of the start that swings least [mm]."""
        found = sweep(model, rpm(16000.0), discard=300, revolutions=100, blocks=1, exponents=0, keep=1)
        return 1e3 * float(found["peak"].min()) * float(model.clearance)

    ratio = peak(2 * clearance) / peak(clearance)
    with_, without = reach(model), reach(replace(model, amplitude=0.0))
    return Conclusion(
        "2. Impacts of the rollers cause small periodic oscillations, of an amplitude that the pocket clearance sets.",
        f"Twice the pocket clearance gives {ratio:.2f} times the peak impact force (with approach speed in proportion "
        f"to it). At 16000 rpm the cage goes {with_:.4f} mm from the centre with impacts, {without:.4f} mm without.",
        (ratio > 1.5, without < 0.9 * with_),
    )


def eccentricity(runs: Runs) -> Conclusion:
    def largest(e: float) -> float:
        brief: Any = dict(starts=1, discard=0, revolutions=50, blocks=1, exponents=0, keep=1)
        found = sweep(replace(runs.models["1a"], eccentricity=e), rpm(2500, 6500, 17), **brief)
        return float(found["peak"].mean())

    peaks = {f"{1e6 * e:.0f} um": largest(e) for e in (0.0, 23e-6, 57e-6)}
    steady = {c: runs.edge(c, "zone 2 onset") - runs.edge(c, "zone 1 exit") for c in ("2a", "2b")}
    listed = ", ".join(f"e = {name}: eps {v:.3f}" for name, v in peaks.items())
    return Conclusion(
        "3. Eccentricity causes strong transients at low speed and knocking; the steady zone shrinks with it.",
        f"Largest excursion in the first 50 revolutions, mean over 2500 to 6500 rpm: {listed}. Steady zone: "
        f"2a {steady['2a']:.0f} rpm, 2b {steady['2b']:.0f} rpm (published 8500 and 6800).",
        (peaks["57 um"] > 1.1 * peaks["0 um"], bool(steady["2b"] < steady["2a"])),
    )


def chaos(runs: Runs) -> Conclusion:
    """The motion may be chaotic, but that does not follow from the bifurcations: this can hold in part at most."""
    share = {}
    for case, found in runs.sweeps.items():
        ends = runs.edge(case, "zone 1 onset"), runs.edge(case, "zone 1 exit")
        inside = (found["rpm"].values >= ends[0]) & (found["rpm"].values <= ends[1])
        share[case] = float(np.mean(chaotic_share(found)[inside] > 0)) if np.any(inside) else float("nan")
    listed = ", ".join(f"{case} {100 * v:.0f} %" for case, v in share.items())
    return Conclusion(
        "4. Bifurcations differ with every parameter, and so the motion is chaotic.",
        f"Speeds of zone 1 with a positive largest exponent (above 0.02 by two standard errors): {listed}. The motion "
        "is chaotic; that diagrams differ would not show it, the exponents do.",
        (all(v > 0.5 for v in share.values()), False),
    )


def sections(runs: Runs) -> Conclusion:
    what = {case: str(s["label"].values[0, 0]) for case, s in runs.sections.items()}
    reach = {case: np.ptp(s["strobe"].values[0, 0, :, 1]) for case, s in runs.sections.items()}
    listed = ", ".join(f"{case} {what[case]}, {1e3 * reach[case]:.3f} mm" for case in what)
    return Conclusion(
        "5. The strobe sections show that zones differ much with the parameters.",
        f"At {SECTION_RPM:.0f} rpm, with the range of Y: {listed}.",
        (len(set(what.values())) > 1, bool(max(reach.values()) > 1.2 * max(min(reach.values()), 1e-12))),
    )


def viscosity(runs: Runs) -> Conclusion:
    names = ("zone 1 onset", "zone 1 exit", "zone 2 onset")
    moved = {name: runs.edge("3b", name) / runs.edge("3a", name) - 1 for name in names}
    listed = ", ".join(f"{name} {_percent(v)}" for name, v in moved.items())
    return Conclusion(
        "6. The viscosity does not affect the zones.",
        f"From VG78 to VG32 (a factor of 2.4): {listed}. Below 2 % counts as no effect.",
        tuple(abs(v) < 0.02 for v in moved.values()),
    )


def guidance(runs: Runs) -> Conclusion:
    model = runs.models["1a"]

    def displaced(load: float, shaft_rpm: float) -> dict[str, float]:
        centrifugal = model.bearing.roller_centrifugal_force(shaft_rpm * np.pi / 30)
        return displacements(model, load_distribution(model.bearing, load, centrifugal))

    loaded, light = displaced(8900.0, 12000.0), displaced(4450.0, 0.0)
    moved = {kind: loaded[kind] - light[kind] for kind in loaded}
    listed = ", ".join(f"{kind.replace('_', ' ')} {1e6 * v:+.2f} um" for kind, v in moved.items())
    return Conclusion(
        "Guidance: by inner rib or rollers the displacement changes with load and speed, by the outer rib it does not.",
        f"Change of the static displacement from 4450 N at rest to 8900 N at 12000 rpm of the shaft: {listed}.",
        (moved["outer_rib"] == 0.0, moved["inner_rib"] != 0.0 and moved["roller"] != 0.0),
    )


CONCLUSIONS = two_zones, impacts, eccentricity, chaos, sections, viscosity, guidance
"""The paper's six conclusions and its argument for guidance by the outer rib."""


def paper_diagrams(runs: Runs) -> Iterator[tuple[str, Figure]]:
    """Figs. 7 and 8 by name, published edges dotted; panels of cases that were not run are left out."""
    for panel, (pair, zoom) in PANELS.items():
        for figure, limits in (("fig7", None), ("fig8", zoom)) if all(case in runs.sweeps for case in pair) else ():
            drawn = new_figure(9.5, 6.4)
            cells = drawn.subplots(2, 1, sharex=True)
            for case, ax in zip(pair, cells, strict=True):
                published = PUBLISHED_CASES[case]
                mark_published(orbit_diagram(runs.sweeps[case], 1, ax, limits_rpm=limits), published, text=False)
                oil, gap = f"VG{published.viscosity_grade:g}", f"gap {published.guidance_gap_mm} mm"
                text = f"Case {case}: {gap}, eccentricity {published.eccentricity_um:g} um, {oil}"
                ax.set_title(f"{text}; dotted, published edges", loc="left", fontsize=10)
            cells[0].set_xlabel("")
            yield f"{figure}{panel}", add_shaft_axes(drawn, runs.sweeps[pair[0]])


def reproduction(runs: Runs) -> tuple[dict[str, Any], list[Table], list[str]]:
    """The comparison with the paper: a document, tables, and lines below them."""
    kinds = {name: runs.zones_by_kind(name) for name in runs.sweeps}
    edges = [e for n, of in kinds.items() for kind, z in of.items() for e in compare_edges(PUBLISHED_CASES[n], z, kind)]
    wide = {name: {kind: len(wide_zones(found)) for kind, found in of.items()} for name, of in kinds.items()}
    names = tuple(next(iter(kinds.values())))
    resolution = resolution_rpm(next(iter(runs.sweeps.values())))
    checked = [check(runs) for check in CONCLUSIONS]
    summary, notes = {}, []
    for kind in names:
        own = [e for e in edges if e.kind == kind]
        errors = [abs(e.error_percent) for e in own if e.error_percent is not None]
        median, within = float(np.median(errors)) if errors else None, sum(error <= 10 for error in errors)
        found = {"published": len(own), "found": len(errors), "within_10_percent": within}
        summary[kind] = found | {"median_error_percent": median}
        said = "-" if median is None else f"{median:.1f} %"
        notes.append(f"{kind}: {len(errors)} of {len(own)} edges found, {within} within 10 %, median error {said}")
    document = {
        "resolution_rpm": resolution,
        "edges": [vars(e) | {"error_percent": e.error_percent} for e in edges],
        "summary": summary,
        "zones": wide,
        "conclusions": [vars(c) | {"verdict": c.verdict} for c in checked],
    }
    rows: dict[tuple[str, str], dict[str, Any]] = {}
    for e in edges:
        cell = "none" if e.ours_rpm is None else f"{e.ours_rpm:.0f} ({e.error_percent:+.1f} %)"
        row = rows.setdefault((e.case, e.edge), {"case": e.case, "edge": e.edge, "published": e.published_rpm})
        row[e.kind] = cell
    columns = [Column("published", (), digits=0), *(Column(name, ()) for name in names)]
    counted = [{"case": name, "published": 2} | found for name, found in wide.items()]
    title = f"Published edges and ours [rpm], sweeps at {resolution:.0f} rpm"
    verdicts = [vars(c) | {"verdict": c.verdict} for c in checked]
    tables = [
        rows_table("Zones of 500 rpm and more, 4000 to 27500 rpm", counted, [Column("case", ()), *columns]),
        rows_table(title, rows.values(), [Column("case", ()), Column("edge", ()), *columns]),
        rows_table("The paper's conclusions", verdicts, [Column("claim", ()), Column("verdict", ())]),
    ]
    evidence = [f"  {c.claim.split('.')[0].split(':')[0]}: {c.evidence}" for c in checked]
    return document, tables, ["Evidence", *evidence, *notes]
