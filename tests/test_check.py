"""The verdict for an operating range."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from helpers import document
from report_example import orbits, swept

import jaxcage as jc
from jaxcage.cli.orbit_commands import of_orbits
from jaxcage.cli.subject import read_case
from jaxcage.design import Checked, Ensemble, indices, range_chance
from jaxcage.files import Range, Unknown
from jaxcage.show import forces_note, indices_note, range_sentence
from jaxcage.show.tables import number


def ensemble(chaotic: np.ndarray, failed: np.ndarray | None = None, unknowns: int = 1) -> Ensemble:
    """Draws with given outcomes at two speeds, 1000 and 2000 rpm; the first unknown grows from draw to draw."""
    draws = len(chaotic)
    place = np.stack([(np.arange(draws) + 0.5) / draws, *np.random.default_rng(1).random((unknowns - 1, draws))], 1)
    lost = np.zeros_like(chaotic) if failed is None else failed
    known = tuple(Unknown(f"u{i}", (f"u{i}",), Range(0.0, 1.0)) for i in range(unknowns))
    return Ensemble(known, ("measure it",) * unknowns, place, jc.rpm(1000, 2000, 2), chaotic, lost, 1, 1)


def test_probability_of_a_range_is_joint():
    """Draws chaotic at either speed count, a failed one only if it was chaotic at the other speed."""
    chaotic, failed = np.zeros((64, 2), bool), np.zeros((64, 2), bool)
    chaotic[:4, 0] = chaotic[2:8, 1] = True
    failed[6:10, 0] = True
    chance, rough, known = range_chance(ensemble(chaotic, failed), 900, 2100)
    assert (chance.chaotic, chance.known, chance.draws) == (8, 62, 64)
    assert chance.share == 1 - 8 / 62 and rough.sum() == 8 and known.sum() == 62
    assert chance.state == "not decided"
    # Clopper and Pearson, 8 and 10 of 64: scipy.stats.binomtest(k, 64).proportion_ci()
    assert chance.interval == pytest.approx((1 - 0.2685, 1 - 0.0555), abs=1e-3)


def test_an_index_tells_what_decides():
    """An outcome that one unknown decides alone has index 1 for it, and none for three others."""
    chaotic = np.repeat((np.arange(128) < 32)[:, None], 2, axis=1)
    rows = indices(ensemble(chaotic, unknowns=4), chaotic[:, 0], np.ones(128, bool))
    assert [row.label for row in rows if row.telling] == ["u0"]
    assert rows[0].share > 0.95


@pytest.mark.wide
def test_a_published_case(capsys: pytest.CaptureFixture[str], tmp_path: Path):
    """Margins are those of the golden edges of zones 1 and 2; the change that is named helps as much as it says."""
    found = document(capsys, "check", "1a", "--operating", "12639-17654 rpm cage", "--out", str(tmp_path))
    assert found["verdict"] in ("calm", "not calm")
    lower, upper = found["margins"]
    assert lower["rpm"] == pytest.approx(12355.535, abs=0.01) and upper["rpm"] == pytest.approx(18686.338, abs=0.01)
    first = found["changes"][0]
    factor = 1.01 if first["up"] else 0.99
    name = first["name"]
    changed = jc.replace(jc.case("1a"), **{name: factor * first["value"]})
    orbit = jc.periodic_orbit(changed, jc.rpm(13000))
    edge = jc.bifurcation(changed, "period-doubling", orbit)
    gain = 100 * (12355.535 - float(edge.speed_rpm)) / 12639
    assert gain == pytest.approx(first["gain"] / 10, rel=0.1)


@pytest.mark.wide
def test_a_bearing_with_its_rollers(capsys: pytest.CaptureFixture[str], tmp_path: Path):
    found = document(capsys, "check", "nu2310", "--operating", "10000-14000 rpm shaft", "--out", str(tmp_path))
    assert found["verdict"] in ("calm", "circling", "rattles", "rattles in part")
    assert [row["rpm"] for row in found["speeds"]] == pytest.approx(np.linspace(10000, 14000, 9))


def test_failures_are_no_knowledge():
    """No force is the largest where a simulation failed, and draws that all failed say nothing about the ranges."""
    note = forces_note({"900 rpm": {"film": 2.0, "weight": 1.0}, "990 rpm": {"film": np.nan, "weight": 1.0}}, ())
    assert note == "The largest force on the cage at 990 rpm is not known: the simulation there failed"
    found = ensemble(np.zeros((64, 2), bool), np.ones((64, 2), bool))
    chance, *outcomes = range_chance(found, 900, 2100)
    assert chance.known == 0 and indices_note(indices(found, *outcomes)).startswith("No unknown value stands out")
    few = ensemble(np.array([[True, True], [False, False], [False, False]]))
    assert indices(few, *range_chance(few, 900, 2100)[1:]) == []


@pytest.mark.parametrize(
    "shares, chaotic, begins, ends",
    [
        ({"failed": 1.0}, 0, "Not decided", "100.0 % failed."),
        (
            {"periodic-1": 0.75, "failed": 0.25},
            0,
            "Not decided",
            "75.0 % of the simulations end calm, and 25.0 % failed.",
        ),
        ({"quasi-periodic": 1.0}, 0, "Not calm", "0.0 % end calm, the others on other motions."),
        ({"chaotic": 0.5, "failed": 0.5}, 2, "The cage rattles", "on a calm motion, and 50.0 % failed."),
        ({"chaotic": 0.5, "periodic-1": 0.5}, 1, "Not calm", "50.0 % end calm, and chaos is seen at some speeds."),
    ],
)
def test_only_chaos_rattles(shares: dict[str, float], chaotic: int, begins: str, ends: str):
    speeds = np.array([900.0, 990.0])
    said = range_sentence("A", Checked(speeds, 2, shares, speeds[:chaotic], speeds[:chaotic], "tsit5"))
    assert said.startswith(begins) and said.endswith(ends)


@pytest.mark.parametrize(
    "life, ends",
    [
        ([415.0], "at 1 of the speeds, 900 rpm of the cage, with a mean life of 415 revolutions"),
        ([98.0, 461.0], "900 to 990 rpm of the cage, with a mean life of 98 to 461 revolutions"),
        ([98.0, np.inf], "with a mean life of at least 98 revolutions"),
        ([np.inf, np.inf], "900 to 990 rpm of the cage, and no end of it is seen"),
        ([np.nan, np.nan], "at 2 of the speeds, 900 to 990 rpm of the cage"),
    ],
)
def test_ranges_of_one_value_are_one_number(life: list[float], ends: str):
    speeds = np.array([900.0, 990.0])
    shares = {"chaotic": 0.5, "periodic-1": 0.5}
    assert str(Checked(speeds, 2, shares, speeds[: len(life)], np.array(life), "tsit5")).endswith(ends)


def test_what_is_rounded_to_zero_has_no_sign():
    assert [number(-4e-7, digits=6), number(-0.004, 0.3), number(-0.04, 0.3)] == [
        "0.000000",
        "0.00 ± 0.30",
        "-0.04 ± 0.30",
    ]


def test_narrow_ranges_do_not_count_where_an_orbit_is_said_to_be_stable():
    """Between 14000 and 14300 rpm there is no stable orbit, which is no unstable range of the answer."""
    found = orbits(sweep := swept())
    low, high = found.stretches
    parts = dataclasses.replace(high, upper_rpm=14e3), dataclasses.replace(high, lower_rpm=14.3e3)
    found = dataclasses.replace(found, stretches=(low, *parts), sweep=sweep)
    said = of_orbits(read_case("1a"), found, jc.unstable_ranges(found)).sentence
    assert "except 7000 to 12000 rpm, from 20000 rpm on (ranges narrower than 500 rpm do not count)." in said


def test_the_motion_of_a_whole_bearing_counts_what_is_undecided_and_why_others_failed():
    names = np.array([["locally_periodic", "failed"], ["undecided", "disordered"]])
    ended = np.array([["successful", "max_steps_reached"], ["inaccurate", "successful"]])
    data = {"label": (("speed", "initial_state"), names), "outcome": (("speed", "initial_state"), ended)}
    said = jc.show.motion_sentence("the range", xr.Dataset(data, coords={"rpm": ("speed", [1e3, 2e3])}))
    assert said == (
        "The cage rattles in part, at 2000 rpm: over the range the cage is calm in 1, rattling in 1, "
        "undecided in 1 of 4 simulations; 1 failed (max steps reached)."
    )
