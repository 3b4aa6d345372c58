"""Differences between two designs; the published edges and conclusions beside ours."""

import re

import numpy as np
import pytest
from helpers import followed, made_sweep, preliminary

import jaxcage as jc
from experiments.reproduce import Runs, compare_edges, conclusions_on_zones, reproduction, run_all
from jaxcage.analysis import Edge, Zone, Zones
from jaxcage.bearing import PUBLISHED_CASES
from jaxcage.show import differences


def test_only_what_differs_is_listed():
    model = jc.case("1a")
    other = jc.replace(model, guidance_gap=0.3e-3, eccentricity=46e-6)
    found = {row["name"]: row for row in differences([model, other])}
    assert set(found) == {"guidance_gap", "eccentricity"}
    assert found["guidance_gap"]["values"] == pytest.approx([0.45e-3, 0.3e-3])
    assert found["guidance_gap"]["unit"] == "m" and found["guidance_gap"]["change"] == pytest.approx(-1 / 3)
    assert differences([model, model]) == []


def zone(onset, leaves):
    edge = lambda rpm: None if rpm is None else Edge(float(rpm), 100.0, "chaotic", "fold")
    return Zone("chaotic", edge(onset), edge(leaves), 1.0)


def ours(zones, case="1a"):
    return [row["ours_rpm"] for row in compare_edges(PUBLISHED_CASES[case], zones, "lasting")]


def test_edges_of_the_zones_that_overlap_most():
    """Published for 1a: 9100 to 12000 and from 25500."""
    assert ours([zone(4500, 5000), zone(9000, 12500), zone(25000, None)]) == [9000, 12500, 25000]
    assert ours([zone(9000, 9500), zone(10000, 13000), zone(26000, 27000)]) == [10000, 13000, 26000]
    assert ours([zone(9000, 12000), zone(22000, 27000), zone(27400, None)]) == [9000, 12000, 22000]


def test_errors_are_relative_to_what_was_published():
    rows = compare_edges(PUBLISHED_CASES["1a"], [zone(9100 * 1.1, 12000 * 0.95)], "lasting")
    assert [row["error_percent"] for row in rows] == [pytest.approx(10.0), pytest.approx(-5.0), None]
    assert (rows[0]["mechanism"], rows[0]["uncertainty_rpm"], rows[0]["kind"]) == ("fold", 100.0, "lasting")


def by_hand(zones, speeds=8):
    """Runs of all cases with the same zones, in which every lane drew the same points."""
    points = np.random.default_rng(0).uniform(-1e-4, 1e-4, (speeds, 1, 40, 4))
    growth, scale = np.full((speeds, 1, 2, 1), 0.1), np.full((speeds, 4), 1e-4)
    swept = made_sweep(np.linspace(2500, 27500, speeds), points, growth, scale=scale)
    swept = followed(swept, np.full((speeds, 1), np.inf), 3000)
    cases = lambda value: dict.fromkeys(PUBLISHED_CASES, value)
    found = Zones(tuple(zones), (), 100.0, 500.0)
    models = {name: jc.case(name) for name in PUBLISHED_CASES}
    return Runs(models, cases(swept), cases(found), {})


@pytest.fixture(scope="module")
def runs():
    models = {name: preliminary(name) for name in PUBLISHED_CASES}
    return run_all(models, speeds=26, discard=40, revolutions=40, orbits=False)


@pytest.mark.wide
def test_every_conclusion_has_evidence_and_a_verdict(runs):
    document, tables, notes = reproduction(runs)
    assert [len(table.rows) for table in tables] == [6, 18] and len(document["edges"]) == 36
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
    (_, _, two), *_, (_, oil, checks) = conclusions_on_zones(same)
    assert two == (False, False) and checks == (True, True, False)
    assert "zone 1 exit +0.0 %, zone 2 onset no such edge" in oil
