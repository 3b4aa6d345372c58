"""The comparison of searches: what its table counts."""

import numpy as np

from benchmarks.pay import best_after, designs_until, table, to_be_reached


TRACE = [(10.0, 1.0, 9000.0), (70.0, 5.0, 5000.0), (290.0, 30.0, 4000.0)]


def run(search: str, seed: int, best: float, trace: list, bearing: str = "1b"):
    return {
        **dict(
            bearing=bearing, search=search, seed=seed, best=best, trace=trace, lane_revolutions=218400, seconds=30.0
        ),
        "check": {"value": best + 100},
    }


def test_what_a_search_had_seen_by_then():
    assert best_after(TRACE, 60) == 9000 and best_after(TRACE, 300) == 4000 and np.isnan(best_after(TRACE, 5))
    assert designs_until(TRACE, 5000) == 70 and designs_until(TRACE, 3999) == np.inf


def test_the_better_rival_is_to_be_reached_and_failures_are_said():
    """Medians of the seeds; the surrogate gets there in one of two seeds only."""
    runs = [run("CMA-ES", s, b, TRACE) for s, b in enumerate((3000.0, 4000.0, 5000.0))]
    runs += [run("differential evolution", 0, 6000.0, TRACE)]
    runs += [run("surrogate", 0, 4000.0, TRACE), run("surrogate", 1, 7000.0, [(300.0, 30.0, 7000.0)])]
    assert to_be_reached(runs) == 4000
    text = table([run("none", 0, 23000.0, TRACE[:1]), *runs])
    assert text.startswith("1b: 23000 rpm as it is, 23100 by the finer check; to be reached: 4000\n")
    row = next(line for line in text.splitlines() if line.startswith("surrogate"))
    assert row.split()[-5:] == ["1", "of", "2", "0.22", "30"]
    assert "5500 (4000 to 7000)" in row and "5600 (4100 to 7100)" in row
