"""The paper's six conclusions and its argument for outer-rib guidance: computed evidence and a verdict on each.

Verdicts follow rules that are written beside them, not taste: `holds`, `holds in part`, `does not hold`.
"""

import dataclasses
from collections.abc import Callable
from typing import Any

import jax.numpy as jnp
import numpy as np

from .._parameters import replace
from ..bearing import PUBLISHED_CASES, load_distribution, static_cage_displacement
from ..forces import PocketImpact, approach_speed, impact_history
from ..models import CageModel
from ..sweeps import rpm, sweep
from ._edges import LASTING, compare_edges, zones_in_range
from ._runs import SECTION_RPM, Runs


HOLDS, IN_PART, NOT = "holds", "holds in part", "does not hold"


@dataclasses.dataclass(frozen=True)
class Conclusion:
    """A claim of the paper and what the model says of it."""

    claim: str
    evidence: str
    verdict: str
    numbers: dict[str, Any]


def _percent(change: float) -> str:
    """A relative change; an edge that is missing has none."""
    return f"{100 * change:+.1f} %" if np.isfinite(change) else "no such edge"


def _verdict(*checks: bool) -> str:
    return HOLDS if all(checks) else IN_PART if any(checks) else NOT


def _edge(runs: Runs, case: str, name: str) -> float:
    """Our chaotic edge [rpm]; NaN if there is none."""
    rows = compare_edges(PUBLISHED_CASES[case], runs.zones[case].zones, LASTING)
    found = next(row.ours_rpm for row in rows if row.edge == name)
    return float("nan") if found is None else found


def two_zones(runs: Runs) -> Conclusion:
    """(1) Two zones in every case; the gap moves the first one most, the oil hardly."""
    counts = {case: len(zones_in_range(z.zones)) for case, z in runs.zones.items()}
    width = lambda case: _edge(runs, case, "zone 1 exit") - _edge(runs, case, "zone 1 onset")
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
        _verdict(all(n == 2 for n in counts.values()), bool(gap > unbalance > oil)),
        {"zones": counts, "width_change": moved},
    )


def impacts(runs: Runs) -> Conclusion:
    """(2) Impacts make small oscillations, whose size the pocket clearance determines."""
    model = runs.models["1a"]
    omega, law = float(rpm(SECTION_RPM)), PocketImpact()

    def peak(clearance: float) -> float:
        v0 = approach_speed(law.approach_ratio, omega, clearance)
        history = impact_history(law, model.bearing.roller_mass, v0, jnp.asarray(1e-3))
        return float(jnp.max(history.contact_force))

    clearance = float(model.bearing.pocket_clearance)
    ratio = peak(2 * clearance) / peak(clearance)
    with_, without = (_reach(m, 16000.0) for m in (model, replace(model, amplitude=0.0)))
    return Conclusion(
        "2. Impacts of the rollers cause small periodic oscillations, of an amplitude that the pocket clearance sets.",
        f"Twice the pocket clearance gives {ratio:.2f} times the peak impact force (with approach speed in proportion "
        f"to it). At 16000 rpm the cage goes {1e3 * with_:.4f} mm from the centre with impacts, "
        f"{1e3 * without:.4f} mm without.",
        _verdict(ratio > 1.5, bool(without < 0.9 * with_)),
        {"force_ratio": ratio, "reach_with_m": with_, "reach_without_m": without},
    )


def _reach(model: CageModel, speed_rpm: float) -> float:
    """Largest distance from the rib's centre at one speed, of the start that swings least [m]."""
    found = sweep(model, rpm(speed_rpm), discard=300, revolutions=100, blocks=1, exponents=0, keep=1)
    return float(np.nanmin(found.peak)) * float(model.clearance)


def eccentricity(runs: Runs) -> Conclusion:
    """(3) Eccentricity brings transients at low speed, and narrows the steady zone."""
    model = runs.models["1a"]
    speeds = rpm(2500, 6500, 17)

    def largest(e: float) -> float:
        seen = sweep(
            replace(model, eccentricity=e),
            speeds,
            starts=1,
            discard=0,
            revolutions=50,
            blocks=1,
            exponents=0,
            keep=1,
        )
        return float(np.nanmean(seen.peak))

    peaks = {f"{1e6 * e:.0f} um": largest(e) for e in (0.0, 23e-6, 57e-6)}
    first, *_, last = peaks.values()
    steady = {c: _edge(runs, c, "zone 2 onset") - _edge(runs, c, "zone 1 exit") for c in ("2a", "2b")}
    listed = ", ".join(f"e = {name}: eps {v:.3f}" for name, v in peaks.items())
    return Conclusion(
        "3. Eccentricity causes strong transients at low speed and knocking; the steady zone shrinks with it.",
        f"Largest excursion in the first 50 revolutions, mean over 2500 to 6500 rpm: {listed}. Steady zone: "
        f"2a {steady['2a']:.0f} rpm, 2b {steady['2b']:.0f} rpm (published 8500 and 6800).",
        _verdict(last > 1.1 * first, bool(steady["2b"] < steady["2a"])),
        {"excursion": peaks, "steady_width_rpm": steady},
    )


def chaos(runs: Runs) -> Conclusion:
    """(4) Bifurcations differ with every parameter, from which the paper concludes chaos.

    The motion may be chaotic, the inference is none: this conclusion can hold in part at most.
    """
    share = {}
    for case, found in runs.sweeps.items():
        exit_ = _edge(runs, case, "zone 1 exit")
        inside = (found.rpm >= _edge(runs, case, "zone 1 onset")) & (found.rpm <= exit_)
        share[case] = float(np.mean(found.chaotic_share[inside] > 0)) if np.any(inside) else float("nan")
    listed = ", ".join(f"{case} {100 * v:.0f} %" for case, v in share.items())
    return Conclusion(
        "4. Bifurcations differ with every parameter, and so the motion is chaotic.",
        f"Speeds of zone 1 with a positive largest exponent (above 0.02 by two standard errors): {listed}. The motion "
        "is chaotic; that diagrams differ would not show it, the exponents do.",
        _verdict(all(v > 0.5 for v in share.values()), False),
        {"chaotic_share": share},
    )


def sections(runs: Runs) -> Conclusion:
    """(5) Strobe sections at 8500 rpm differ from case to case."""
    what = {case: str(s.label[0, 0]) for case, s in runs.sections.items()}
    reach = {case: np.ptp(s.strobe[0, 0, :, 1]) for case, s in runs.sections.items()}
    listed = ", ".join(f"{case} {what[case]}, {1e3 * reach[case]:.3f} mm" for case in what)
    spread = max(reach.values()) / max(min(reach.values()), 1e-12)
    return Conclusion(
        "5. The strobe sections show that zones differ much with the parameters.",
        f"At {SECTION_RPM:.0f} rpm, with the range of Y: {listed}.",
        _verdict(len(set(what.values())) > 1, bool(spread > 1.2)),
        {"label": what, "range_y_m": reach},
    )


def viscosity(runs: Runs) -> Conclusion:
    """(6) The oil does not move the zones."""
    names = ("zone 1 onset", "zone 1 exit", "zone 2 onset")
    moved = {name: _edge(runs, "3b", name) / _edge(runs, "3a", name) - 1 for name in names}
    listed = ", ".join(f"{name} {_percent(v)}" for name, v in moved.items())
    return Conclusion(
        "6. The viscosity does not affect the zones.",
        f"From VG78 to VG32 (a factor of 2.4): {listed}. Below 2 % counts as no effect.",
        _verdict(*(abs(v) < 0.02 for v in moved.values())),
        {"change": moved},
    )


def guidance(runs: Runs) -> Conclusion:
    """The argument for guidance by the outer rib: its static displacement alone does not depend on load and speed."""
    model = runs.models["1a"]

    def displaced(kind: Any, load: float, shaft_rpm: float) -> float:
        shared = load_distribution(model.bearing, load, model.bearing.roller_centrifugal_force(shaft_rpm * np.pi / 30))
        return float(
            static_cage_displacement(
                kind,
                guidance_gap=model.guidance_gap,
                pocket_clearance=model.bearing.pocket_clearance,
                radial_clearance=model.bearing.radial_clearance,
                elastic_approach=shared.elastic_approach,
            )
        )

    kinds = ("outer_rib", "inner_rib", "roller")
    moved = {k: displaced(k, 8900.0, 12000.0) - displaced(k, 4450.0, 0.0) for k in kinds}
    listed = ", ".join(f"{k.replace('_', ' ')} {1e6 * v:+.2f} um" for k, v in moved.items())
    return Conclusion(
        "Guidance: by inner rib or rollers the displacement changes with load and speed, by the outer rib it does not.",
        f"Change of the static displacement from 4450 N at rest to 8900 N at 12000 rpm of the shaft: {listed}.",
        _verdict(moved["outer_rib"] == 0.0, moved["inner_rib"] != 0.0 and moved["roller"] != 0.0),
        {"change_m": moved},
    )


CONCLUSIONS: tuple[Callable[[Runs], Conclusion], ...] = (
    two_zones,
    impacts,
    eccentricity,
    chaos,
    sections,
    viscosity,
    guidance,
)


def conclusions(runs: Runs) -> list[Conclusion]:
    """Every conclusion of the paper, checked."""
    return [check(runs) for check in CONCLUSIONS]
