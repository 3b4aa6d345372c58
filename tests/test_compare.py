"""Designs side by side: what differs, figures on one scale; the published edges beside ours."""

import dataclasses
import re

import numpy as np
import pytest
from helpers import made_sweep
from matplotlib.figure import Figure
from report_example import swept

import jaxcage as jc
from jaxcage.analysis import Edge, Zone, Zones, orbit_measures
from jaxcage.bearing import PUBLISHED_CASES
from jaxcage.plotting import over_speed, sweeps_beside
from jaxcage.report import (
    CONCLUSIONS,
    Compared,
    Runs,
    compare_edges,
    differences,
    differences_table,
    paper_diagrams,
    reproduction,
    run_all,
)
from jaxcage.sweeps import Motion, motions


def planted(name: str, model: jc.CageModel, factor: float) -> Compared:
    """Chaotic from 9050 to 12050 and from 20050 rpm on, with orbits and loads `factor` times as large as the first."""
    found = swept()
    found = dataclasses.replace(found, strobe=factor * found.strobe)
    size = np.full(found.outcome.shape, factor * 1e-4)
    loads = {"wear load": np.full(found.speed.size, factor * 2.0), "peak land force": np.full(found.speed.size, factor)}
    return Compared(name, model, found, jc.zones(found), Motion(size, size / 2, np.ones_like(size)), loads)


@pytest.fixture(name="pair")
def _pair() -> list[Compared]:
    model = jc.case("1a")
    other = jc.replace(model, guidance_gap=0.3e-3, eccentricity=46e-6)
    return [planted("first", model, 1.0), planted("second", other, 3.0)]


def test_only_what_differs_is_listed_in_the_units_people_read(pair: list[Compared]):
    found = differences([one.model for one in pair])
    assert set(found) == {"guidance_gap", "eccentricity"}
    assert found["guidance_gap"][1:] == ("0.45", "0.3", "mm", "-33.3 %")
    assert found["eccentricity"][1:] == ("23", "46", "µm", "+100 %")
    same = differences_table(("a", "b"), [pair[0].model] * 2)
    assert [row[0] for row in same.rows] == ["nothing"]


def test_figures_show_both_on_the_scale_that_holds_both(pair: list[Compared]):
    figure = sweeps_beside([p.name for p in pair], [p.swept for p in pair], [p.zones for p in pair], (0.4, 0.4))
    assert isinstance(figure, Figure)
    above, below = figure.axes[:2], figure.axes[2:4]
    for row in (above, below):
        assert row[0].get_ylim() == row[1].get_ylim()
    low, high = above[0].get_ylim()
    points = 1e3 * np.concatenate([p.swept.strobe[..., 1].ravel() for p in pair])
    assert low < points.min() and points.max() < high
    curves = [("size [mm]", [1e3 * p.size for p in pair])]
    lines = over_speed([p.name for p in pair], [p.rpm for p in pair], curves).axes[0]
    assert [line.get_label() for line in lines.get_lines()] == ["first", "second"]
    assert lines.get_ylim()[1] > 0.3 and lines.get_legend() is not None


@pytest.mark.wide
def test_size_and_whirl_against_a_time_history():
    model = jc.case("1a")
    method = jc.method("rk4", steps=1024)
    length = dict(discard=200, revolutions=20, confirm=False, horizon=0)
    found = jc.sweep(model, jc.rpm(14000, 15000), starts=1, method=method, **length)
    motion = motions([model], [found])[0]
    run = jc.simulate(model, found.speed[0], revolutions=32, samples=512, start=tuple(found.last[0, 0]), method=method)
    x, y = np.ptp(run.state[:, :2], axis=0)
    assert motion.horizontal[0, 0] == pytest.approx(x, rel=0.01) and motion.vertical[0, 0] == pytest.approx(y, rel=0.01)
    assert motion.whirl_order[0, 0] == pytest.approx(orbit_measures(model, run).whirl_ratio, abs=0.01)


def zone(onset, leaves):
    edge = lambda rpm: None if rpm is None else Edge(float(rpm), 100.0, "chaotic", "fold")
    return Zone("chaotic", edge(onset), edge(leaves), 1.0)


def ours(zones, case="1a"):
    return [row.ours_rpm for row in compare_edges(PUBLISHED_CASES[case], zones, "lasting")]


def test_edges_of_the_zones_that_overlap_most():
    """Published for 1a: 9100 to 12000 and from 25500."""
    assert ours([zone(4500, 5000), zone(9000, 12500), zone(25000, None)]) == [9000, 12500, 25000]
    assert ours([zone(9000, 9500), zone(10000, 13000), zone(26000, 27000)]) == [10000, 13000, 26000]
    assert ours([zone(9000, 12000), zone(22000, 27000), zone(27400, None)]) == [9000, 12000, 22000]


def test_errors_are_relative_to_what_was_published():
    rows = compare_edges(PUBLISHED_CASES["1a"], [zone(9100 * 1.1, 12000 * 0.95)], "lasting")
    assert rows[0].error_percent == pytest.approx(10.0)
    assert rows[1].error_percent == pytest.approx(-5.0)
    assert rows[2].error_percent is None
    assert (rows[0].mechanism, rows[0].uncertainty_rpm, rows[0].kind) == ("fold", 100.0, "lasting")


def by_hand(zones, speeds=8):
    """Runs of all cases with the same zones, in which every lane drew the same points."""
    points = np.random.default_rng(0).uniform(-1e-4, 1e-4, (speeds, 1, 40, 4))
    growth, followed = np.full((speeds, 1, 2, 1), 0.1), dict(escape=np.full((speeds, 1), np.inf), horizon=3000)
    swept = made_sweep(np.linspace(2500, 27500, speeds), points, growth, scale=np.full((speeds, 4), 1e-4), **followed)
    cases = lambda value: dict.fromkeys(PUBLISHED_CASES, value)
    found = Zones(tuple(zones), (), 100.0, 500.0)
    models = {name: jc.case(name) for name in PUBLISHED_CASES}
    return Runs(models, cases(swept), cases(found), {}, cases(swept))


def test_figures_of_the_paper_from_given_runs():
    """Only the pairs whose two cases were run."""
    runs = by_hand([zone(9000, 12000)])
    drawn = dict(paper_diagrams(runs))
    assert list(drawn) == ["fig7a", "fig8a", "fig7b", "fig8b", "fig7c", "fig8c"]
    assert all(figure.axes for figure in drawn.values())
    cells = drawn["fig7a"].axes
    assert [ax.get_title(loc="left")[:8] for ax in cells] == ["Case 1a:", "Case 1b:"]
    few = dataclasses.replace(runs, sweeps={"1a": runs.sweeps["1a"], "2a": runs.sweeps["2a"], "2b": runs.sweeps["2b"]})
    assert [name for name, _ in paper_diagrams(few)] == ["fig7b", "fig8b"]


def test_zones_of_every_kind_from_given_runs():
    """What lasts is as given; at first, lanes whose exponent is .1 are chaotic at every speed."""
    kinds = by_hand([zone(9000, 12000)]).zones_by_kind("1a")
    assert list(kinds) == ["lasting", "at first"]
    assert [len(found) for found in kinds.values()] == [1, 1]
    (at_first,) = kinds["at first"]
    assert at_first.onset is None and at_first.exit is None and at_first.share == 1.0
    assert kinds["lasting"][0].exit is not None and kinds["lasting"][0].exit.speed_rpm == 12000


@pytest.fixture(scope="module")
def runs():
    models = {name: jc.case(name, "preliminary") for name in PUBLISHED_CASES}
    return run_all(models, speeds=26, discard=40, revolutions=40, section_revolutions=44, orbits=False)


@pytest.mark.wide
def test_every_conclusion_has_evidence_and_a_verdict(runs):
    document, tables, notes = reproduction(runs)
    assert [len(table.rows) for table in tables] == [6, 18, 7] and len(document["edges"]) == 36
    for c in document["conclusions"]:
        assert c["verdict"] in ("holds", "holds in part", "does not hold") and re.search(r"\d", c["evidence"])
        assert any(c["evidence"] in note for note in notes)
    evidence = [c["evidence"] for c in document["conclusions"]]
    outer, inner, roller = map(float, re.findall(r"([+-][\d.]+) um", evidence[-1]))
    assert outer == 0.0 and inner == roller > 1.0  # (1), (5), (6)
    ratio = float(evidence[1].split(" times")[0].split()[-1])
    assert ratio == pytest.approx(2 ** (20 / 19), rel=0.02)  # Hertz impact on a stiff bar


def test_a_verdict_can_be_no():
    """Six cases with the same zone: the gap does nothing, and there is no second zone."""
    same = by_hand([zone(9000, 12000)])
    assert CONCLUSIONS[0](same).verdict == "does not hold"
    oil = CONCLUSIONS[5](same)
    assert oil.verdict == "holds in part" and "zone 1 exit +0.0 %, zone 2 onset no such edge" in oil.evidence
