"""The paper beside the model, its edges, conclusions and orbit diagrams: `python -m experiments.reproduce`.

`--json` prints one document instead of tables, `--quick` takes a coarse sweep, `--out` names the folder of the figures.
"""

import argparse
import dataclasses
import json
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import jax.numpy as jnp
import numpy as np
import xarray as xr
from matplotlib.figure import Figure

import jaxcage as jc
from jaxcage.analysis import Zone, Zones, chaotic_share, resolution_rpm
from jaxcage.bearing import PUBLISHED_CASES, PUBLISHED_SPEED_RANGE_RPM, PublishedCase, load_distribution
from jaxcage.forces import PocketImpact, approach_speed, impact_history
from jaxcage.orbits import UnstableRanges, synchronous_orbits
from jaxcage.show import Column, Table, table, zone_span


ZONE_RANGE_RPM = (4000.0, 27500.0)
"""Speeds between which a case should have exactly two zones."""
LASTING, AT_FIRST, LOSS = "lasting", "at first", "unstable"
"""Chaos that lasts beyond the horizon; chaos while observed, lasting or not; loss of the synchronous orbit."""
SECTION_RPM, WIDE_RPM = 8500.0, 500.0  # speed of fig. 9; smallest width of the zones that a diagram shows
QUICK: dict[str, Any] = {"speeds": 101, "discard": 150, "revolutions": 100, "orbits": False}
Conclusion = tuple[str, str, tuple[bool, ...]]  # claim of the paper, evidence of the model, checks that decide


def zones_in_range(zones: Sequence[Zone], least: float = 0.0) -> list[Zone]:
    """Zones that reach into the range in which two were published, of a width of at least `least` [rpm] or open."""
    low, high = ZONE_RANGE_RPM
    wide = (z for z in zones if z.width_rpm is None or z.width_rpm >= least)
    return [z for z in wide if zone_span(z)[1] > low and zone_span(z)[0] < high]


def compare_edges(published: PublishedCase, zones: Sequence[Zone], kind: str) -> list[dict[str, Any]]:
    """The three published edges of a case beside those of the zones found in the range in which they were published."""
    first, second = (published.zone_1_onset_rpm, published.zone_1_exit_rpm), published.zone_2_onset_rpm
    one, two = _matched([first, (second, ZONE_RANGE_RPM[1])], zones_in_range(zones))
    ends = (one and one.onset, one and one.exit, two and two.onset)
    return [
        {"case": published.name, "edge": name, "published_rpm": rpm, "kind": kind}
        | {"ours_rpm": edge and edge.speed_rpm, "uncertainty_rpm": edge and edge.uncertainty_rpm}
        | {"mechanism": edge and edge.mechanism, "error_percent": edge and 100 * (edge.speed_rpm / rpm - 1)}
        for (name, rpm), edge in zip(jc.show.published_edges(published).items(), ends, strict=True)
    ]


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

    models: Mapping[str, Any]
    sweeps: Mapping[str, xr.Dataset]
    zones: Mapping[str, Zones]
    loss: Mapping[str, UnstableRanges]
    """Empty where the orbits were left out."""

    def zones_by_kind(self, name: str) -> dict[str, Sequence[Zone]]:
        """The zones of a case of every kind."""
        at_first = jc.zones(self.sweeps[name].drop_vars("escape", errors="ignore")).zones
        kinds: dict[str, Sequence[Zone]] = {LASTING: self.zones[name].zones, AT_FIRST: at_first}
        return kinds | ({LOSS: self.loss[name].zones} if name in self.loss else {})

    def edges(self, case: str) -> dict[str, float]:
        """The edges of lasting chaos [rpm] by name; NaN for those that were not found."""
        rows = compare_edges(PUBLISHED_CASES[case], self.zones[case].zones, LASTING)
        return {row["edge"]: float("nan") if row["ours_rpm"] is None else row["ours_rpm"] for row in rows}


def run_all(
    models: Mapping[str, Any], speeds: int = 251, discard: int = 300, revolutions: int = 300, orbits: bool = True
) -> Runs:
    """Sweep every case over the published range from three initial states, and find its synchronous orbits."""
    grid, loss = jc.rpm(*PUBLISHED_SPEED_RANGE_RPM, speeds), {}
    found = jc.sweep(list(models.values()), grid, discard=discard, revolutions=revolutions)
    swept = {name: found.isel(design=i) for i, name in enumerate(models)}
    for name, model in models.items() if orbits else ():
        loss[name] = jc.unstable_ranges(synchronous_orbits(model, float(grid[0]), float(grid[-1]), settled=swept[name]))
    return Runs(models, swept, {name: jc.zones(s) for name, s in swept.items()}, loss)


def _changes(moved: Mapping[str, float]) -> str:
    """Relative changes by name; an edge that is missing has none."""
    words = lambda x: f"{100 * x:+.1f} %" if np.isfinite(x) else "no such edge"
    return ", ".join(f"{name} {words(x)}" for name, x in moved.items())


def conclusions_on_zones(runs: Runs) -> Iterator[Conclusion]:
    """The paper's conclusions that follow from zones, exponents and strobe points."""
    counts = {case: len(zones_in_range(z.zones)) for case, z in runs.zones.items()}
    edges = {case: runs.edges(case) for case in runs.zones}
    width = lambda case: edges[case]["zone 1 exit"] - edges[case]["zone 1 onset"]
    names = {"gap 0.45 to 0.60 mm": "1", "eccentricity 35 to 57 um": "2", "oil VG78 to VG32": "3"}
    moved = {name: width(f"{pair}b") / width(f"{pair}a") - 1 for name, pair in names.items()}
    gap, unbalance, oil = map(abs, moved.values())
    listed = ", ".join(f"{case}: {n}" for case, n in counts.items())
    yield (
        "1. There are two zones in every case; gap and eccentricity, the gap above all, set the first; the oil hardly.",
        f"Chaotic zones between 4000 and 27500 rpm: {listed}. Change of zone 1's width: {_changes(moved)}.",
        (all(n == 2 for n in counts.values()), gap > unbalance > oil),
    )
    share, what, reach = {}, {}, {}
    for case, found in runs.sweeps.items():
        rpm = found["rpm"].values
        at = found.isel(speed=int(np.argmin(abs(rpm - SECTION_RPM))), initial_state=0)
        inside = (rpm >= edges[case]["zone 1 onset"]) & (rpm <= edges[case]["zone 1 exit"])
        share[case] = float(np.mean(chaotic_share(found)[inside] > 0)) if np.any(inside) else np.nan
        what[case], reach[case] = str(at["label"].values), float(np.ptp(at["strobe"].values[:, 1]))
    listed = ", ".join(f"{case} {100 * v:.0f} %" for case, v in share.items())
    yield (
        "4. Bifurcations differ with every parameter, and so the motion is chaotic.",
        f"Speeds of zone 1 with a positive largest exponent (above 0.02 by two standard errors): {listed}. The motion "
        "is chaotic; that diagrams differ would not show it, the exponents do.",
        (all(v > 0.5 for v in share.values()), False),  # it can hold in part at most
    )
    listed = ", ".join(f"{case} {what[case]}, {1e3 * reach[case]:.3f} mm" for case in what)
    yield (
        "5. The strobe sections show that zones differ much with the parameters.",
        f"Next to {SECTION_RPM:.0f} rpm, from the first initial state, with the range of Y: {listed}.",
        (len(set(what.values())) > 1, max(reach.values()) > 1.2 * max(min(reach.values()), 1e-12)),
    )
    moved = {name: edge / edges["3a"][name] - 1 for name, edge in edges["3b"].items()}
    said = f"From VG78 to VG32 (a factor of 2.4): {_changes(moved)}. Below 2 % counts as no effect."
    yield "6. The viscosity does not affect the zones.", said, tuple(abs(v) < 0.02 for v in moved.values())


def conclusions_on_forces(runs: Runs) -> Iterator[Conclusion]:
    """The paper's conclusions on impacts and unbalance, and its argument for guidance by the outer rib."""
    model, law, brief = runs.models["1a"], PocketImpact(), {"blocks": 1, "exponents": 0, "keep": 1}

    def hit(clearance: float) -> float:
        v0 = approach_speed(law.approach_ratio, float(jc.rpm(SECTION_RPM)), clearance)
        return float(jnp.max(impact_history(law, model.bearing.roller_mass, v0, jnp.asarray(1e-3)).contact_force))

    clearance, at = float(model.bearing.pocket_clearance), jc.rpm(16000.0)
    ratio, both = hit(2 * clearance) / hit(clearance), [model, jc.replace(model, amplitude=0.0)]
    peaks = jc.sweep(both, at, discard=300, revolutions=100, **brief)["peak"].values
    with_, without = 1e3 * float(model.clearance) * peaks.reshape(2, -1).min(axis=1)
    yield (
        "2. Impacts of the rollers cause small periodic oscillations, of an amplitude that the pocket clearance sets.",
        f"Twice the pocket clearance gives {ratio:.2f} times the peak impact force (with approach speed in proportion "
        f"to it). At 16000 rpm the cage goes {with_:.4f} mm from the centre with impacts, {without:.4f} mm without.",
        (ratio > 1.5, bool(without < 0.9 * with_)),
    )
    balance = [jc.replace(model, eccentricity=e) for e in (0.0, 23e-6, 57e-6)]
    peaks = jc.sweep(balance, jc.rpm(2500, 6500, 17), initial_states=1, discard=0, revolutions=50, **brief)[
        "peak"
    ].values
    best, middle, worst = peaks.reshape(3, -1).mean(axis=1)
    edges = {case: runs.edges(case) for case in ("2a", "2b")}
    steady = {case: found["zone 2 onset"] - found["zone 1 exit"] for case, found in edges.items()}
    yield (
        "3. Eccentricity causes strong transients at low speed and knocking; the steady zone shrinks with it.",
        f"Largest excursion in the first 50 revolutions, mean over 2500 to 6500 rpm: e = 0 um: eps {best:.3f}, "
        f"23 um: {middle:.3f}, 57 um: {worst:.3f}. Steady zone: 2a {steady['2a']:.0f} rpm, 2b {steady['2b']:.0f} rpm "
        "(published 8500 and 6800).",
        (bool(worst > 1.1 * best), steady["2b"] < steady["2a"]),
    )
    thrown = model.bearing.roller_centrifugal_force(12000.0 * np.pi / 30)
    shared = [load_distribution(model.bearing, *given) for given in ((4450.0,), (8900.0, thrown))]
    light, loaded = (jc.show.displacements(model, each) for each in shared)
    moved = {kind: loaded[kind] - light[kind] for kind in loaded}
    listed = ", ".join(f"{kind.replace('_', ' ')} {1e6 * v:+.2f} um" for kind, v in moved.items())
    yield (
        "Guidance: by inner rib or rollers the displacement changes with load and speed, by the outer rib it does not.",
        f"Change of the static displacement from 4450 N at rest to 8900 N at 12000 rpm of the shaft: {listed}.",
        (moved["outer_rib"] == 0.0, moved["inner_rib"] != 0.0 and moved["roller"] != 0.0),
    )


def paper_diagrams(runs: Runs) -> Iterator[tuple[str, Figure]]:
    """Panels of fig. 7 by name, published edges dotted."""
    for number, panel in zip("123", "abc", strict=True):
        cells = (drawn := jc.show.new_figure(9.5, 6.4)).subplots(2, 1, sharex=True)
        for case, ax in zip((f"{number}a", f"{number}b"), cells, strict=True):
            published = PUBLISHED_CASES[case]
            jc.show.mark_published(jc.show.orbit_diagram(runs.sweeps[case], 1, ax), published, text=False)
            oil, gap = f"VG{published.viscosity_grade:g}", f"gap {published.guidance_gap_mm} mm"
            text = f"Case {case}: {gap}, eccentricity {published.eccentricity_um:g} µm, {oil}"
            ax.set_title(text, loc="left", fontsize=10)
        cells[0].set_xlabel("")
        jc.show.legend_below(drawn)
        yield f"fig7{panel}", jc.show.add_shaft_axes(drawn, runs.sweeps[f"{number}a"])


def reproduction(runs: Runs) -> tuple[dict[str, Any], list[Table], list[str]]:
    """The comparison with the paper: a document, tables, and lines below them."""
    kinds = {name: runs.zones_by_kind(name) for name in runs.sweeps}
    edges = [e for n, of in kinds.items() for kind, z in of.items() for e in compare_edges(PUBLISHED_CASES[n], z, kind)]
    count = lambda found: {kind: len(zones_in_range(zones, WIDE_RPM)) for kind, zones in found.items()}
    wide = [{"case": name, "published": 2} | count(found) for name, found in kinds.items()]
    names = tuple(next(iter(kinds.values())))
    each = sorted([*conclusions_on_zones(runs), *conclusions_on_forces(runs)])
    verdict = lambda checks: "holds" if all(checks) else "holds in part" if any(checks) else "does not hold"
    checked = [{"claim": c, "evidence": e, "verdict": verdict(checks)} for c, e, checks in each]
    summary, notes = {}, []
    for kind in names:
        own = [e["error_percent"] for e in edges if e["kind"] == kind]
        errors = [abs(error) for error in own if error is not None]
        median, within = float(np.median(errors or [np.inf])), sum(error <= 10 for error in errors)
        summary[kind] = {"published": len(own), "found": len(errors), "within_10_percent": within}
        summary[kind]["median_error_percent"] = median
        notes.append(f"{kind}: {len(errors)} of {len(own)} edges found, {within} within 10 %, median {median:.1f} %")
    resolution = resolution_rpm(next(iter(runs.sweeps.values())))
    document = {"resolution_rpm": resolution, "edges": edges, "summary": summary, "zones": wide, "conclusions": checked}
    rows: dict[tuple[str, ...], dict[str, Any]] = {}
    for e in edges:
        row = rows.setdefault((e["case"], e["edge"]), e | {"published": e["published_rpm"]})
        row[e["kind"]] = "none" if e["ours_rpm"] is None else f"{e['ours_rpm']:.0f} ({e['error_percent']:+.1f} %)"
    columns = [Column("published", digits=0), *names]
    tables = [table("Zones of 500 rpm and more, 4000 to 27500 rpm", wide, ["case", *columns])]
    columns, title = ["edge", *columns], f"Published edges and ours [rpm], sweeps at {resolution:.0f} rpm"
    tables.append(table(title, rows.values(), ["case", *columns]))
    return document, tables, [*notes, *(f"{c['claim']} {c['verdict'].upper()}. {c['evidence']}" for c in checked)]


def main() -> None:
    """Run all cases, write the figures, and print the tables or the document."""
    parser = argparse.ArgumentParser(prog="python -m experiments.reproduce", description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--json", action="store_true", help="print one JSON document")
    parser.add_argument("--quick", action="store_true", help="a coarse sweep without orbits")
    parser.add_argument("--out", type=Path, default=Path("out"), help="folder of the figures")
    given = parser.parse_args()
    jc.enable_x64()
    jc.keep_compiled_programs()
    runs = run_all({name: jc.case(name) for name in PUBLISHED_CASES}, **(QUICK if given.quick else {}))
    document, tables, notes = reproduction(runs)
    given.out.mkdir(parents=True, exist_ok=True)
    for name, figure in paper_diagrams(runs):
        figure.savefig(given.out / f"reproduce_{name}.png")
    print(json.dumps(document, indent=2, default=float) if given.json else "\n\n".join([*map(str, tables), *notes]))


if __name__ == "__main__":
    main()
