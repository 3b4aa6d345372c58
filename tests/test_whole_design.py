"""Designs of the whole bearing: the objective from made-up statistics with closed forms, the search for a known
optimum, the command; and all of it once in earnest.
"""

import json
import pathlib

import numpy as np
import pytest

import jaxcage as jc
from jaxcage.analysis import BearingSweep
from jaxcage.cli import main
from jaxcage.design import COMPARED, BearingRuns, DesignSpace, bearing_objective, before_and_after
from jaxcage.models import drawn_places


jc.enable_x64()
SPEED = float(jc.rpm(10000))
MADE_UP = "jaxcage.design._bearing_design.sweep_bearings"


def made_up(noise=0.0, broken=lambda model, start: False, seed=3):
    """Statistics in place of simulations: the power falls with the gap, the slip grows with it, the force has its least
    at a pocket clearance of 0.35 mm; the cage never touches its land. Starts add what is the same for all designs.
    """
    rng = np.random.default_rng(seed)

    def sweep_bearings(models, speeds, *, starts, blocks, **_):
        found = []
        for model in models:
            gap, pocket = float(model.guidance_gap) / 0.45e-3, float(model.bearing.pocket_clearance) / 0.3e-3
            value = dict.fromkeys(COMPARED, 1.0) | {
                "friction_power_W": 400 / gap,
                "cage_slip": 0.01 * gap**0.5,
                "pocket_force_peak_N": 200 * (1 + (pocket - 0.35 / 0.3) ** 2),
                "land_wear_mm3_per_h": 0.0,
            }
            luck = 1 + 0.1 * np.array([x for x, *_ in starts])
            failed = np.array([[broken(model, start) for start in range(len(starts))]])
            lanes = lambda x: (
                np.where(failed, np.nan, x * luck)[..., None] * (1 + noise * rng.normal(size=(1, 1, blocks)))
            )
            one = object.__new__(BearingSweep)
            object.__setattr__(one, "block_means", {n: lanes(x) for n, x in value.items()})
            object.__setattr__(one, "outcome", np.where(failed, "outside", "successful"))
            found.append(one)
        return found

    return sweep_bearings


def test_the_objective_is_what_the_terms_are_beside_now(monkeypatch: pytest.MonkeyPatch):
    """1 now; elsewhere each term by its closed form, weighted; nothing for a design of which a start fails."""
    monkeypatch.setattr(MADE_UP, made_up())
    model, runs = jc.whole_bearing("nu2310"), BearingRuns(SPEED)
    vary = {"guidance_gap": (0.3e-3, 0.6e-3), "eccentricity": (5e-6, 23e-6)}
    objective = bearing_objective(model, vary, runs, {"power": 3.0, "slip": 1.0, "balance": 2.0})
    space = DesignSpace.of(model, vary)
    form = lambda gap, e: (3 * 0.45e-3 / gap + (gap / 0.45e-3) ** 0.5 + 2 * e / 23e-6) / 6
    places = np.array([space.place, [0.2, 0.4], [0.7, 0.995]])
    expected = [form(*space.values(place).values()) for place in places]
    np.testing.assert_allclose(objective.values(space, places), expected, rtol=1e-12)
    assert expected[0] == pytest.approx(1.0)
    monkeypatch.setattr(MADE_UP, made_up(broken=lambda m, start: m.guidance_gap < 0.4e-3 and start == 1))
    np.testing.assert_array_equal(np.isnan(objective.values(space, places)), [False, True, False])


def test_of_two_sums_each_counts_half_and_nothing_is_beside_the_weight(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(MADE_UP, made_up())
    model = jc.whole_bearing("nu2310")
    runs = BearingRuns(SPEED, starts=1)
    luck = 1 + 0.1 * drawn_places(1, 0)[0][0]
    weights = bearing_objective(model, {"guidance_gap": (3e-4, 6e-4)}, runs, {"force": 1.0, "wear": 1.0}).weights
    force = 200 * (1 + (1 - 0.35 / 0.3) ** 2) * luck
    assert weights["pocket_force_peak_N"] == pytest.approx(0.25 / force)
    assert weights["land_force_peak_N"] == pytest.approx(0.25 / (0.25 * 9.81))  # 1 N is less than the cage weighs
    assert weights["pocket_wear_mm3_per_h"] == weights["land_wear_mm3_per_h"]  # volumes are added
    turning = float(model.rolling_cage_speed(SPEED))
    rubbed = 0.01 * 0.25 * 9.81 * turning * float(model.land_radius)
    assert weights["land_wear_mm3_per_h"] == pytest.approx(0.5 / max(luck, 6e-4 * rubbed / 0.93e9 * 3.6e12))


def test_before_and_after_are_of_the_same_starts(monkeypatch: pytest.MonkeyPatch):
    """What starts add is in both errors, and not in that of the change; starts that fail once are left out of both."""
    model = jc.whole_bearing("nu2310")
    better = jc.replace(model, guidance_gap=0.9e-3, eccentricity=10e-6)
    monkeypatch.setattr(MADE_UP, made_up())
    weights = {"friction_power_W": 1 / 400, "balance_grade_mm_per_s": 0.0}
    rows, failed = before_and_after(model, better, BearingRuns(SPEED, starts=6), weights)
    found = {row.name: row for row in rows}
    power = found["friction_power_W"]
    luck = 1 + 0.1 * np.array([x for x, *_ in drawn_places(6)])
    assert failed == 0 and power.unit == "W" and power.known
    assert power.before_error == pytest.approx(400 * luck.std(ddof=1) / np.sqrt(6))
    assert power.change / power.before == pytest.approx(-0.5)
    assert power.change_error == pytest.approx(power.before_error / 2)
    assert not found["land_wear_mm3_per_h"].known and not found["pocket_impulse_N_s"].known
    grade = found["balance_grade_mm_per_s"]
    assert grade.before == pytest.approx(23e-3 * float(model.rolling_cage_speed(SPEED)))
    assert grade.change == pytest.approx(-13 / 23 * grade.before)
    assert found["objective"].change == pytest.approx(power.change / 400) and found["objective"].unit == "1"
    assert found["objective"].change_error == pytest.approx(power.change_error / 400) and found["objective"].known
    monkeypatch.setattr(MADE_UP, made_up(broken=lambda m, start: m.guidance_gap > 0.8e-3 and start < 2))
    rows, failed = before_and_after(model, better, BearingRuns(SPEED, starts=6))
    assert failed == 2
    assert {row.name: row for row in rows}["friction_power_W"].before == pytest.approx(400 * luck[2:].mean())


@pytest.mark.wide
def test_the_command_finds_a_known_optimum(
    capsys: pytest.CaptureFixture[str], tmp_path: pathlib.Path, monkeypatch: pytest.MonkeyPatch
):
    """A force that is least at 0.35 mm of pocket clearance, and power over slip that balance at a gap of 0.714 mm."""
    monkeypatch.setattr(MADE_UP, made_up(noise=0.002))
    asked = ["design", "nu2310", "--speed", "10000 rpm shaft", "--vary", "pocket_clearance=0.2mm:0.5mm"]
    asked += ["--vary", "guidance_gap=0.3mm:1mm", "--vary", "eccentricity=5um:60um", "--load", "1 kN", "--steps", "16"]
    assert main([*asked, "--wear", "0", "--impulse", "0", "--json", "--out", str(tmp_path)]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["load_N"] == 1000 and found["prices"] == dict(wear=0, force=1, impulse=0, power=1, slip=1, balance=1)
    assert found["optimum"]["pocket_clearance"] == pytest.approx(0.35e-3, rel=0.08)
    assert found["optimum"]["guidance_gap"] == pytest.approx(0.45e-3 * 2 ** (2 / 3), rel=0.1)
    assert found["vary"]["eccentricity"] == pytest.approx([5e-6, 23e-6]) and found["at_bound"] == ["eccentricity"]
    assert found["optimum"]["eccentricity"] == pytest.approx(5e-6, rel=0.05)
    after = found["before_and_after"]["friction_power_W"]
    gap = found["optimum"]["guidance_gap"] / 0.45e-3
    assert after["change"] / after["before"] == pytest.approx(1 / gap - 1, abs=0.01) and after["known"]
    assert found["before_and_after"]["objective"]["before"] == pytest.approx(1.0, rel=0.1)
    assert found["better"] and found["check"]["starts"] == 8 and found["check"]["tolerance"] == pytest.approx(1e-5)
    assert pathlib.Path(found["figure"]).stat().st_size > 20_000 and not any(tmp_path.glob(".design*"))


@pytest.mark.wide
def test_the_command_in_earnest(capsys: pytest.CaptureFixture[str], tmp_path: pathlib.Path):
    """Power alone by the gap: a wider gap drags less (Petroff), which the search finds and the check confirms."""
    asked = ["design", "nu2310", "--speed", "10000 rpm shaft", "--vary", "guidance_gap=0.4mm:0.6mm", "--batch", "4"]
    asked += ["--ensemble", "2", "--discard", "2", "--revolutions", "2", "--steps", "2"]
    asked += [x for name in ("wear", "force", "impulse", "slip", "balance") for x in (f"--{name}", "0")]
    assert main([*asked, "--json", "--out", str(tmp_path)]) == 0
    found = json.loads(capsys.readouterr().out)
    power = found["before_and_after"]["friction_power_W"]
    assert found["optimum"]["guidance_gap"] > 0.48e-3 and power["known"] and power["change"] < 0
    rows = found["before_and_after"].values()
    assert all(np.isfinite([row["before"], row["after"], row["change_error"]]).all() for row in rows)


@pytest.mark.parametrize(
    "arguments, said",
    [
        ([], "Option --speed must be given for a whole bearing"),
        (["--speed", "1e4", "--vary", "load=1kN:5kN"], "Option --vary must name one of guidance_gap, pocket_clearance"),
        (
            ["--speed", "1e4", "--vary", "eccentricity=30um:60um"],
            "Option --vary must let the eccentricity become smaller",
        ),
        (["--speed", "1e4", "--vary", "guidance_gap=0.6mm:0.3mm"], "Option --vary guidance_gap"),
        (["--speed", "1e4", "--revolutions", "3"], "Option --revolutions must be a multiple of 2 above 0, but 3"),
        (["--speed", "1e4", "--cost", "3"], "Option --cost does not go with a whole bearing."),
        (["--speed", "1e4", "--batch", "1"], "Option --batch must be at least 2"),
        (
            [
                "--speed",
                "1e4",
                *(x for n in ("wear", "force", "impulse", "power", "slip", "balance") for x in (f"--{n}", "0")),
            ],
            "must not all be 0",
        ),
    ],
)
def test_refusals(arguments: list[str], said: str, capsys: pytest.CaptureFixture[str], tmp_path: pathlib.Path):
    assert main(["design", "nu2310", *arguments, "--out", str(tmp_path / "out")]) == 2
    assert said in capsys.readouterr().err and not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    "given, said",
    [
        ({"vary": {"load": (1.0, 2.0)}}, "`vary` must name parameters of the cage"),
        ({"prices": {"noise": 1.0}}, "`prices` must name some of wear, force"),
        ({"prices": {"wear": 0.0}}, "`prices` must be at least 0 and not all 0"),
        ({"prices": {"wear": -1.0, "slip": 2.0}}, "`prices` must be at least 0"),
    ],
)
def test_refusals_in_python(given, said):
    usual = {"vary": {"guidance_gap": (3e-4, 6e-4)}, "prices": {"wear": 1.0}}
    with pytest.raises(ValueError, match=said):
        bearing_objective(jc.whole_bearing("nu2310"), runs=BearingRuns(SPEED), **usual | given)


@pytest.mark.parametrize("given", [{"revolutions": 3}, {"starts": 0}, {"seed": -1}])
def test_runs_that_cannot_be(given):
    with pytest.raises(ValueError, match=f"`{next(iter(given))}`"):
        BearingRuns(SPEED, **given)


@pytest.mark.parametrize("starts", [[(0.0, 1.2, 0.0, 0.0)], [(np.nan, 0.0, 0.0, 0.0)]])
def test_places_outside_are_refused(starts):
    with pytest.raises(ValueError, match="`starts` must hold places of the cage within its clearance"):
        jc.sweep_bearing(jc.whole_bearing("nu2310"), SPEED, starts=starts)
