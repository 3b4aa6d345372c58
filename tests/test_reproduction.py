"""The published edges beside ours: matching by hand-made zones, and the runs behind the report at a tiny size."""

import dataclasses
import re

import numpy as np
import pytest

import jaxcage as jc
from jaxcage.analysis import Edge, Zone, Zones
from jaxcage.bearing import PUBLISHED_CASES
from jaxcage.report import (
    CONCLUSIONS,
    Runs,
    compare_edges,
    paper_diagrams,
    reproduction,
    run_all,
)


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


def test_one_zone_over_both_has_no_second():
    assert ours([zone(9000, None)]) == [9000, None, None]
    assert ours([]) == [None, None, None]


def test_errors_are_relative_to_what_was_published():
    rows = compare_edges(PUBLISHED_CASES["1a"], [zone(9100 * 1.1, 12000 * 0.95)], "lasting")
    assert rows[0].error_percent == pytest.approx(10.0)
    assert rows[1].error_percent == pytest.approx(-5.0)
    assert rows[2].error_percent is None
    assert (rows[0].mechanism, rows[0].uncertainty_rpm, rows[0].kind) == ("fold", 100.0, "lasting")


def by_hand(zones, speeds=8):
    """Runs of all cases with the same zones, in which every lane drew the same points."""
    grid = jc.rpm(2500, 27500, speeds)
    points = np.random.default_rng(0).uniform(-1e-4, 1e-4, (speeds, 1, 40, 4))
    lane = np.zeros((speeds, 1))
    swept = jc.Sweep(
        speed=grid,
        strobe=points,
        last=points[:, :, -1],
        block_growth=np.full((speeds, 1, 2, 1), 0.1),
        peak=lane + 0.9,
        outcome=np.zeros((speeds, 1), dtype=np.int32),
        error=lane,
        doubt=lane[..., None],
        scale=np.full((speeds, 4), 1e-4),
        discard=0,
        revolutions=40,
        escape=lane + np.inf,
        horizon=3000,
    )
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
def test_runs_cover_the_published_range(runs):
    assert list(runs.sweeps) == list(PUBLISHED_CASES)
    for found in runs.sweeps.values():
        assert found.rpm[0] == pytest.approx(2500) and found.rpm[-1] == pytest.approx(27500)
        assert not np.any(found.failed)
    for name, section in runs.sections.items():
        assert section.strobe.shape == (1, 1, 40, 4)
        assert section.rpm[0] == pytest.approx(8500)
        assert not np.array_equal(section.strobe, runs.sections["1b" if name == "1a" else "1a"].strobe)


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
