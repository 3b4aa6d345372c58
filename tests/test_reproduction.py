"""The published edges beside ours: matching by hand-made zones, and the runs behind the report at a tiny size."""

import dataclasses

import numpy as np
import pytest
from helpers import wide_but

import jaxcage as jc
from jaxcage.analysis import Edge, Zone, Zones
from jaxcage.bearing import PUBLISHED_CASES
from jaxcage.forces import cubic_stiffness
from jaxcage.plotting import paper_figures
from jaxcage.reproduction import (
    READINGS,
    Observer,
    Runs,
    compare_edges,
    conclusions,
    marks,
    observed_zones,
    run_all,
    try_readings,
    wide_zones,
    zones_in_range,
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


def test_a_zone_far_from_the_published_ones_is_none_of_them():
    assert ours([zone(15000, 16000)]) == [None, None, None]


def test_errors_are_relative_to_what_was_published():
    rows = compare_edges(PUBLISHED_CASES["1a"], [zone(9100 * 1.1, 12000 * 0.95)], "lasting")
    assert rows[0].error_percent == pytest.approx(10.0)
    assert rows[1].error_percent == pytest.approx(-5.0)
    assert rows[2].error_percent is None
    assert (rows[0].mechanism, rows[0].uncertainty_rpm, rows[0].kind) == ("fold", 100.0, "lasting")


def test_zones_below_the_range_do_not_count():
    assert len(zones_in_range([zone(2500, 3900), zone(3900, 4100), zone(9000, 12000), zone(27400, None)])) == 3


def test_wide_zones_are_those_that_a_diagram_shows():
    assert len(wide_zones([zone(5000, 5400), zone(9000, 12000), zone(27400, None), zone(2500, 3900)])) == 2


def test_marks_cover_points_on_a_line():
    """A periodic motion takes one for each of its points, a band as many as it is wide."""
    three = np.tile([0.0, 1.0, 5.0], 50) + 1e-3 * np.sin(np.arange(150))
    assert marks(three, 0.01) == 3
    assert marks(np.random.default_rng(0).permutation(np.linspace(0, 1, 1001)), 0.01) == pytest.approx(100, abs=10)


@pytest.mark.wide
def test_an_observer_reads_zones_off_a_diagram():
    """Where the motion is chaotic it fills a band, where it is periodic it does not, whatever is in between."""
    model = jc.case("1a")
    speeds = np.concatenate([jc.rpm(10400, 10800, 3), jc.rpm(16000, 16400, 3)])
    seen = jc.sweep(model, speeds, starts=1, horizon=0, method=jc.method("rk4", steps=1024))
    assert list(np.char.startswith(seen.label[:, 0], "periodic")) == [False] * 3 + [True] * 3
    late, brief = (
        Observer("late", steps=128, discard=300, drawn=200),
        Observer("brief", steps=128, discard=290, drawn=8),
    )
    drawn = observed_zones([model], speeds, [late, brief])
    assert drawn["late"] == observed_zones([model], speeds, [late])["late"]
    assert drawn["brief"] == [()]  # eight points are no band
    ((found,),) = drawn["late"]
    assert found.onset is None and found.exit is not None and found.exit.speed_rpm == pytest.approx(13400)


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
    return Runs(models, cases(swept), cases(found), {}, cases(swept), {"reader": cases((zone(9000, None),))})


def test_figures_of_the_paper_from_given_runs():
    """Eight figures; of figs. 7 and 8 only the pairs whose two cases were run."""
    runs = by_hand([zone(9000, 12000)])
    drawn = dict(paper_figures(runs))
    assert list(drawn) == ["fig5", "fig7a", "fig8a", "fig7b", "fig8b", "fig7c", "fig8c", "fig9"]
    assert all(figure.axes for figure in drawn.values())
    cells = drawn["fig7a"].axes
    assert [ax.get_title(loc="left")[:8] for ax in cells] == ["Case 1a:", "Case 1b:"]
    few = dataclasses.replace(runs, sweeps={"1a": runs.sweeps["1a"], "2a": runs.sweeps["2a"], "2b": runs.sweeps["2b"]})
    assert [name for name, _ in paper_figures(few)] == ["fig5", "fig7b", "fig8b", "fig9"]


def test_zones_of_every_kind_from_given_runs():
    """What lasts is as given; at first, lanes whose exponent is .1 are chaotic at every speed."""
    kinds = by_hand([zone(9000, 12000)]).zones_by_kind("1a")
    assert list(kinds) == ["lasting", "at first", "reader"]
    assert [len(found) for found in kinds.values()] == [1, 1, 1]
    (at_first,) = kinds["at first"]
    assert at_first.onset is None and at_first.exit is None and at_first.share == 1.0
    assert kinds["lasting"][0].exit is not None and kinds["lasting"][0].exit.speed_rpm == 12000


@pytest.fixture(scope="module")
def runs():
    models = {name: jc.case(name, "preliminary") for name in PUBLISHED_CASES}
    return run_all(models, speeds=26, discard=40, revolutions=40, section_revolutions=44, orbits=False, observers=())


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
    found = conclusions(runs)
    assert len(found) == 7
    for c in found:
        assert c.verdict in ("holds", "holds in part", "does not hold")
        assert any(ch.isdigit() for ch in c.evidence) and c.numbers
    guidance = found[-1].numbers["change_m"]
    assert guidance["outer_rib"] == 0.0 and guidance["roller"] == guidance["inner_rib"] > 1e-6  # (1), (5), (6)
    assert found[1].numbers["force_ratio"] == pytest.approx(2 ** (20 / 19), rel=0.02)  # Hertz impact on a stiff bar


@pytest.mark.wide
def test_a_verdict_can_be_no(runs):
    """Six cases with the same zones: the gap does nothing, and conclusion 1 cannot hold."""
    same = dataclasses.replace(runs, zones=dict.fromkeys(runs.zones, runs.zones["1a"]))
    first, *_, oil, _ = conclusions(same)
    assert first.verdict != "holds"
    assert oil.numbers["change"] == pytest.approx(dict.fromkeys(oil.numbers["change"], 0.0), nan_ok=True)


@pytest.mark.wide
def test_figures_of_the_paper(runs):
    names = [name for name, figure in paper_figures(runs) if figure.axes]
    assert names == ["fig5", "fig7a", "fig8a", "fig7b", "fig8b", "fig7c", "fig8c", "fig9"]


@pytest.mark.slow
def test_readings_change_the_model_and_say_what_came_of_it():
    chosen = [r for r in READINGS if r.answer in ("-", "none", "shaft speed") and r.case == "1a"]
    known = {"as the cases have it", "unbalance", "film", "impact", "cross-coupling", "speed axis"}
    assert {r.question for r in chosen} == known
    model = jc.case("1a", "preliminary")
    found = {
        r.reading.question: r
        for r in try_readings({"1a": model}, readings=chosen, speeds=24, discard=60, revolutions=40)
    }
    base, film, impact = (found[q] for q in ("as the cases have it", "film", "impact"))
    assert impact.chaotic_share < 0.5 * base.chaotic_share  # without the impact hardly any chaos
    assert not np.allclose(film.sweep.last, base.sweep.last)
    thin = film.reading.model(model)
    assert float(thin.lubricant.dynamic_viscosity) < 1e-6 * float(model.lubricant.dynamic_viscosity)


@pytest.mark.slow
def test_chaos_that_lasts_and_chaos_at_first_are_read_off_one_sweep():
    """They differ by the horizon alone: what each says is what it says when it is tried without the other."""
    model = {"1a": jc.case("1a", "preliminary")}
    both = [r for r in READINGS if r.case == "1a" and r.question in ("as the cases have it", "chaos")]
    tried = lambda readings: try_readings(model, readings=readings, speeds=12, discard=60, revolutions=40)
    first, lasting = tried(both)
    (alone,) = tried(both[:1])
    assert first.sweep.escape is None and lasting.sweep.escape is not None
    assert (first.edges, first.zones, first.chaotic_share) == (alone.edges, alone.zones, alone.chaotic_share)
    np.testing.assert_array_equal(first.sweep.last, lasting.sweep.last)


@pytest.mark.slow
def test_a_speed_axis_read_as_shaft_speed_stretches_the_picture():
    """Cage speeds are 0.4012 of the shaft's: a zone that ends at 12250 rpm of the cage ends at 30530 on that axis."""
    (reading,) = [r for r in READINGS if r.question == "speed axis"]
    models = {"1a": jc.case("1a", "preliminary")}
    (got,) = try_readings(models, readings=[reading], speeds=7, discard=20, revolutions=20)
    ratio = float(models["1a"].bearing.cage_speed_ratio)
    assert ratio == pytest.approx(0.4012, abs=5e-5)
    own = jc.sweep(models["1a"], ratio * jc.rpm(4000, 27500, 7), discard=20, revolutions=20)
    np.testing.assert_allclose(got.sweep.rpm, np.linspace(4000, 27500, 7))
    np.testing.assert_array_equal(got.sweep.exponents, own.exponents)


def test_a_cubic_term_that_falls_with_the_gap_is_that_of_the_narrow_gap():
    (reading,) = [r for r in READINGS if r.question == "cubic stiffness"]
    narrow, wide = (reading.model(jc.case(name, "preliminary")) for name in ("1a", "1b"))
    at = lambda m: cubic_stiffness(m.support.cubic, 0.0, m.support.cubic_ratio, m.support.stiffness_x, m.clearance)
    assert float(at(narrow)) == pytest.approx(float(jc.case("1a", "preliminary").support.cubic_stiffness), rel=1e-12)
    assert float(at(wide) / at(narrow)) == pytest.approx((0.45 / 0.60) ** 2, rel=1e-12)


@pytest.mark.parametrize(
    "reading",
    wide_but(READINGS, *(r for r in READINGS if r.question == "rib")),
    ids=lambda r: f"{r.case}-{r.question}-{r.answer}",
)
def test_every_reading_can_be_taken(reading):
    model = reading.model(jc.case(reading.case))
    assert model.dimension == (8 if reading.answer == "elastic" else 4)
    speed, method = jc.rpm(9000.0), reading.method() or jc.method("rk4", steps=512)
    y = jc.strobe_map(model, speed, method)(model.starts(speed)[0])
    assert np.all(np.isfinite(np.asarray(y.y)))
