"""Unstable ranges between stable stretches of the synchronous orbit, and the mechanisms of chaotic edges."""

import numpy as np
import pytest
from helpers import made_sweep, point
from laws import hardening as hardening_law
from literature import DUFFING_FOLDS

import jaxcage as jc
from jaxcage.orbits import StableRange, SynchronousOrbits


METHOD = jc.method("rodas4", steps=256)
PER_RPM = np.pi / 30


def stretch(
    lower, upper, family=0, met=10, first=None, open_below=False, open_above=False, kinds=("fold", "Neimark-Sacker")
):
    """A stretch between two speeds [rpm], of a branch with the number of its family."""
    return StableRange(
        None if open_below else point(kinds[0], float(lower), state=(0.0, 0.0)),
        None if open_above else point(kinds[1], float(upper), state=(0.0, 0.0)),
        float(lower),
        float(upper),
        family,
        family,
        met,
        met if first is None else first,
    )


def simulations(rpm, synchronous):
    """A sweep of one start, settled on the synchronous orbit where `synchronous`, else wandering about."""
    count = rpm.size
    strobe = np.zeros((count, 1, 8, 2))
    strobe[~synchronous] = np.linspace(0.1, 0.9, 16).reshape(8, 2)
    return made_sweep(rpm, strobe, np.full((count, 1, 2, 1), -1.0), discard=0, revolutions=8)


def found(*stretches, lower=2000.0, upper=20000.0):
    rpm = np.arange(lower, upper + 1, 100.0)
    inside = np.zeros(rpm.size, dtype=bool)
    for s in stretches:
        inside |= (rpm >= s.lower_rpm) & (rpm <= s.upper_rpm)
    ordered = tuple(sorted(stretches, key=lambda s: s.lower_rpm))
    return SynchronousOrbits((), ordered, simulations(rpm, inside), 0, lower, upper)


def ends(zones):
    """Onset and exit of each zone [rpm]; None where it is open."""
    speed = lambda edge: None if edge is None else round(edge.speed_rpm, 6)
    return [(speed(z.onset), speed(z.exit)) for z in zones.zones]


BELOW = stretch(2000, 6000, met=30, open_below=True)
ABOVE = stretch(15000, 20000, family=3, open_above=True)
# Stretches, and the zones that are left between them.
LAYOUTS = {
    "open ends": ([BELOW, ABOVE], [(6000, 15000)]),
    "stable throughout": ([stretch(2000, 20000, open_below=True, open_above=True)], []),
    "a window of 499 rpm is closed": ([BELOW, stretch(6499, 9000, family=1), ABOVE], [(9000, 15000)]),
    "a window of 501 rpm is not": (
        [BELOW, stretch(6501, 9000, family=1), ABOVE],
        [(6000, 6501), (9000, 15000)],
    ),
    "a stretch of 499 rpm is not counted": ([BELOW, stretch(9000, 9499, family=1), ABOVE], [(6000, 15000)]),
    "a stretch of 501 rpm is": (
        [BELOW, stretch(9000, 9501, family=1), ABOVE],
        [(6000, 9000), (9501, 15000)],
    ),
    "slivers do not carry an edge away": (
        [BELOW, *(stretch(x, x + 50, family=f) for x, f in ((6400, 0), (6900, 1), (7400, 0), (7900, 2))), ABOVE],
        [(6000, 15000)],
    ),
    "another branch that overlaps only coexists": ([BELOW, stretch(5000, 9000, family=1), ABOVE], [(6000, 15000)]),
    "the same branch that overlaps belongs to it": ([BELOW, stretch(5000, 9000, family=0), ABOVE], [(9000, 15000)]),
    "the same branch far away is on its own": (
        [BELOW, stretch(9000, 10000, family=0), ABOVE],
        [(6000, 9000), (10000, 15000)],
    ),
    "none": ([], []),
}


@pytest.mark.parametrize("name", LAYOUTS)
def test_zones_are_what_is_left_between_the_stretches(name):
    stretches, expected = LAYOUTS[name]
    result = jc.unstable_ranges(found(*stretches))
    assert ends(result) == [tuple(None if e is None else float(e) for e in pair) for pair in expected]
    assert result.close_below_rpm == 500.0
    names = [f"zone {i} {end}" for i, pair in enumerate(expected, 1) for end, e in zip(("onset", "exit"), pair) if e]
    assert list(result.edges) == names and list(result.coexisting) == names
    for zone in result.zones:
        assert zone.kind == "unstable"
        if zone.onset is not None:
            assert zone.onset.mechanism == "Neimark-Sacker" and zone.onset.basis == "located"
        if zone.exit is not None:
            assert zone.exit.mechanism == "fold" and zone.exit.kind == "unstable"
        for edge in (zone.onset, zone.exit):
            assert edge is None or 0 < edge.uncertainty_rpm < 0.01
    if not stretches:
        assert result.principal is None


def test_where_a_branch_was_not_followed_further_the_range_has_an_edge_of_unknown_mechanism():
    below = stretch(2000, 9000, met=30, open_below=True, open_above=True)
    above = stretch(12000, 20000, family=1, open_below=True, open_above=True)
    result = jc.unstable_ranges(found(below, above))
    (zone,) = result.zones
    assert ends(result) == [(9000, 12000)] and not result.edges
    assert {(e.basis, e.mechanism, np.isnan(e.uncertainty_rpm)) for e in (zone.onset, zone.exit)} == {
        ("followed", "unknown", True)
    }
    shown = str(jc.show.unstable_table("this", result))
    assert "9000" in shown and "nan" not in shown and "past range" not in shown


def test_principal_stretch_is_the_one_of_the_conventional_start():
    """The first start decides; then all of them; then the width. What overlaps the principal one only coexists."""
    long = stretch(2000, 9000, family=0, met=40, first=5, open_below=True)
    usual = stretch(8000, 12000, family=1, met=20, first=15)
    result = jc.unstable_ranges(found(long, usual, ABOVE))
    assert result.principal == usual
    assert ends(result) == [(None, 8000.0), (12000.0, 15000.0)]
    tied = stretch(2000, 9000, family=0, met=40, first=15, open_below=True)
    result = jc.unstable_ranges(found(tied, usual, ABOVE))
    assert result.principal == tied and ends(result) == [(9000.0, 15000.0)]
    narrow = stretch(8000, 8900, family=1, met=40, first=15)
    assert jc.unstable_ranges(found(tied, narrow, ABOVE)).principal == tied


def chaotic(onset=None, leaves=None, uncertainty=100.0):
    edge = lambda rpm: None if rpm is None else jc.analysis.Edge(float(rpm), uncertainty, "chaotic")
    zone = jc.analysis.Zone("chaotic", edge(onset), edge(leaves), 0.8)
    return jc.analysis.Zones((zone,), (), uncertainty, 500.0)


def explained(zones, *stretches):
    return jc.orbits.explain(zones, found(*stretches))


def test_chaotic_edges_at_bifurcations_take_their_mechanism():
    result = explained(chaotic(6090, 14950), BELOW, ABOVE)
    onset, leaves = result.zones.zones[0].onset, result.zones.zones[0].exit
    assert (onset.mechanism, onset.basis, onset.kind) == ("Neimark-Sacker", "located", "chaotic")
    assert (leaves.mechanism, leaves.basis, leaves.kind) == ("fold", "located", "chaotic")
    assert abs(onset.speed_rpm - 6000) < 1e-9 and abs(leaves.speed_rpm - 15000) < 1e-9
    assert onset.uncertainty_rpm < 0.01
    assert result.sources == {"zone 1 onset": BELOW.upper, "zone 1 exit": ABOVE.lower}
    assert str(onset) == "6000.00 rpm (Neimark-Sacker)"
    assert result.zones.zones[0].share == 0.8 and result.zones.resolution_rpm == 100.0


# Edges at which nothing that was located explains the zone.
UNEXPLAINED = {
    "beyond the uncertainty": (chaotic(6101, 14899), (BELOW, ABOVE)),
    "an onset where an orbit begins": (chaotic(15000, None), (BELOW, ABOVE)),
    "an exit where an orbit ends": (chaotic(None, 6000), (BELOW, ABOVE)),
    "a fold on the calm side": (chaotic(6300, 14800), (BELOW, ABOVE)),
}


@pytest.mark.parametrize("name", UNEXPLAINED)
def test_other_chaotic_edges_stay_statistical(name):
    zones, stretches = UNEXPLAINED[name]
    result = explained(zones, *stretches)
    assert result.sources == {} and result.zones == zones
    for edge in (result.zones.zones[0].onset, result.zones.zones[0].exit):
        assert edge is None or (edge.basis, edge.mechanism) == ("statistical", "unknown")


FOLDS = DUFFING_FOLDS["down"].value, DUFFING_FOLDS["up"].value
LOWER, UPPER = 0.6, 2.4
GRID = np.linspace(LOWER, UPPER, 13)


@pytest.fixture(scope="module")
def hardening():
    initial_states = ((0.1, 0.2), (2.0, 1.0), (-1.5, 2.0))
    system = hardening_law(initial_states=initial_states)
    return jc.synchronous_orbits(system, LOWER, UPPER, count=GRID.size, discard=100, method=METHOD)


@pytest.mark.wide
def test_synchronous_orbits_of_the_hardening_duffing(hardening):
    """Two stable stretches that overlap between the folds, on one branch."""
    low, high = hardening.stretches
    assert low.lower is None and high.upper is None
    assert (low.upper.kind, high.lower.kind) == ("fold", "fold")
    assert abs(low.upper.speed - FOLDS[1]) < 1e-6 and abs(high.lower.speed - FOLDS[0]) < 1e-6
    assert abs(low.upper_rpm * PER_RPM - FOLDS[1]) < 1e-6 and abs(high.lower_rpm * PER_RPM - FOLDS[0]) < 1e-6
    assert abs(low.lower_rpm - LOWER / PER_RPM) < 1e-9 and abs(high.upper_rpm - UPPER / PER_RPM) < 1e-9
    assert low.family == high.family and hardening.missed == 0
    np.testing.assert_allclose([p.speed for p in hardening.edges], FOLDS, rtol=0, atol=1e-6)
    assert len(hardening.points) == 2 and [len(hardening.coexisting(v)) for v in (LOWER, 1.6, UPPER)] == [1, 3, 1]
    # Every simulation is on one of the two, and from the first start each speed is counted once.
    periodic = hardening.sweep.label == "periodic-1"
    assert low.met + high.met == np.sum(periodic) >= 0.9 * periodic.size
    assert low.met_first + high.met_first == np.sum(periodic[:, 0])
    outside = (GRID < FOLDS[0]) | (GRID > FOLDS[1])
    assert np.all(periodic[outside]) and min(low.met, high.met) >= 3 * 4
    assert "2 stable stretches" in str(hardening) and "(fold)" in str(hardening)
