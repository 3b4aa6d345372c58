"""Results made by hand for the tests of the report: nothing is computed."""

import json

import numpy as np
import xarray as xr
from helpers import made_sweep, point

import jaxcage as jc
from jaxcage.analysis import zones
from jaxcage.bearing import PUBLISHED_CASES
from jaxcage.orbits import Branch, Sensitivity, StableRange, SynchronousOrbits, unstable_ranges
from jaxcage.show import (
    Section,
    drawn,
    elasticity_bars,
    motion_tables,
    multiplier_circle,
    orbit_diagram_with_branches,
    settings_table,
    sweep_figure,
    unstable_table,
)


PER_RPM = np.pi / 30
RATIO = (1 - 16 / 81) / 2
VERSIONS = {"method": "by hand", "version_jaxcage": "0.1.0", "version_jax": "0.10.1"}


def settled(points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Steps and errors of orbits."""
    return np.full(points.shape, 512), np.full(points.shape, 1e-7)


def swept(first: float = 2500.0, last: float = 27500.0, count: int = 251) -> xr.Dataset:
    """Three initial states: chaotic from 9050 to 12050 and from 20050 rpm on, calm elsewhere."""
    rpm = np.linspace(first, last, count)
    chaotic = ((rpm > 9050) & (rpm < 12050)) | (rpm > 20050)
    wild = np.random.default_rng(1).uniform(-2e-4, 2e-4, (count, 3, 8, 4))
    calm = np.broadcast_to(1e-4 * np.sin(rpm / 5e3)[:, None, None, None], wild.shape)
    growth = np.where(chaotic, 0.3, -0.4)[:, None, None, None] * np.ones((count, 3, 10, 1))
    settled = dict(scale=np.full((count, 4), 1e-4), discard=300, revolutions=300, cage_speed_ratio=RATIO)
    settled["settings"] = json.dumps(VERSIONS)
    return made_sweep(rpm, np.where(chaotic[:, None, None, None], wild, calm), growth, **settled)


def orbits(sweep: xr.Dataset) -> SynchronousOrbits:
    """One orbit that is lost from 7000 to 12000 rpm and from 20000 rpm on."""
    rpm = np.linspace(2500.0, 27500.0, 101)
    special = (
        point("fold", 7000.0, 17),
        point("period-doubling", 12000.0, 37),
        point("Neimark-Sacker", 20000.0, 69),
    )
    stable = (rpm < 7000) | ((rpm > 12000) & (rpm < 20000))
    state = np.column_stack([np.full(101, 1e-5), 1e-4 * np.sin(rpm / 5e3), np.full(101, 0.1), np.full(101, 0.2)])
    turning = np.exp(1j * np.linspace(0.2, 2.0, 101))[:, None]
    mu = np.where(stable, 0.8, 1.2)[:, None] * np.concatenate(
        [turning, turning.conjugate(), 0.3 * np.ones((101, 2))], axis=1
    )
    speed = rpm * PER_RPM
    branch = Branch("speed", speed, speed, state, mu, stable, special, 1, ("range", "range"), *settled(rpm))
    stretches = (
        StableRange(None, special[0], 2500.0, 7000.0, 0, 0, 40, 20),
        StableRange(special[1], special[2], 12000.0, 20000.0, 0, 0, 90, 50),
    )
    return SynchronousOrbits((branch,), stretches, sweep, 0, 2500.0, 27500.0)


def slopes(model: jc.CageModel, name: str, kind: str, rpm: float, turn: float) -> Sensitivity:
    """Elasticities that differ from parameter to parameter and edge to edge."""
    names = list(jc.parameters(model))
    change = {n: turn * np.cos(i + turn) / (1 + i) for i, n in enumerate(names)}
    slope = {n: change[n] * rpm / float(v) if float(v) else 0.0 for n, v in jc.parameters(model).items()}
    balance = {"mass": 1e-13, "length": 2e-13, "time": 3e-13}
    return Sensitivity(name, kind, rpm, slope, change, balance, 0.1, "converged")


def sections(name: str = "1a") -> list[Section]:
    """Answers about a design whose zones are known, as a page shows them."""
    model, sweep = jc.case("1a"), swept()
    found, known = orbits(sweep), zones(sweep)
    edges = [
        slopes(model, n, p.kind, p.speed_rpm, 0.5 + i) for i, (n, p) in enumerate(unstable_ranges(found).edges.items())
    ]
    figures = {
        "orbits": sweep_figure(sweep, known, PUBLISHED_CASES["1a"]),
        "branches": drawn(lambda ax: orbit_diagram_with_branches(sweep, found.branches, ax)),
        "multipliers": drawn(lambda ax: multiplier_circle(found.branches[0], ax)),
        "elasticities": drawn(lambda ax: elasticity_bars(edges, ax)),
    }
    captions = {key: (figure, f"Figure about {key} of a design") for key, figure in figures.items()}
    beside = ("shaft", 1 / RATIO)
    tables = motion_tables(name, known, beside)
    tables.append(unstable_table(name, unstable_ranges(found), beside))
    return [
        Section("Zones", ["2 zones of chaos."], captions, tables),
        Section("Settings", tables=[settings_table(sweep, 1.0)]),
    ]
