"""Sobol indices and tolerance budgets of the whole bearing, by laws with closed forms in place of its motion; the
command; and once in earnest.
"""

import json
import pathlib

import numpy as np
import pytest

import jaxcage as jc
from jaxcage.analysis import BearingSweep
from jaxcage.cli import main
from jaxcage.design import COMPARED, BearingRuns, bearing_budget, bearing_gradient, bearing_sensitivity


jc.enable_x64()
SPEED = float(jc.rpm(10000))
VARY = {"guidance_gap": (0.3e-3, 0.6e-3), "pocket_clearance": (0.2e-3, 0.4e-3)}
COMMAND = ["sensitivity", "nu2310", "--speed", "10000 rpm shaft"]


@pytest.fixture
def by_law(monkeypatch: pytest.MonkeyPatch):
    """Wear of pockets that grows by 30 from bound to bound of the gap, wear of the land by 10 of the pocket clearance;
    the impulse of the land is 1; every half of a run is off by `noise`."""
    noise, numbers = {"": 0.0}, np.random.default_rng(0)

    def sweep_bearings(models, speeds, *, starts, blocks, **_):
        found = []
        count = starts if isinstance(starts, int) else len(starts)
        for model in models:
            gap, pocket = float(model.guidance_gap), float(model.bearing.pocket_clearance)
            value = dict.fromkeys(COMPARED, 1.0) | {
                "pocket_wear_mm3_per_h": 1e5 * gap,
                "land_wear_mm3_per_h": 0.5e5 * pocket,
            }
            off = noise[""] * numbers.normal(size=blocks)
            one = object.__new__(BearingSweep)
            fields = {
                "block_means": {name: np.full((1, count, blocks), x) + off for name, x in value.items()},
                "outcome": np.full((1, count), "successful"),
                "cage_slip": np.ones((1, count)),
            }
            for field, x in fields.items():
                object.__setattr__(one, field, x)
            found.append(one)
        return found

    for module in ("_bearing_design", "_bearing_gradient"):
        monkeypatch.setattr(f"jaxcage.design.{module}.sweep_bearings", sweep_bearings)
    return noise


@pytest.mark.wide
def test_shares_of_a_sum(by_law):
    """A sum of 30 u and 10 v: nine tenths and one tenth of the variance, and nothing together."""
    found, scatter = bearing_sensitivity(jc.whole_bearing("nu2310"), VARY, BearingRuns(SPEED), "wear", samples=128)
    assert found.first == pytest.approx({"guidance_gap": 0.9, "pocket_clearance": 0.1}, abs=0.03)
    assert found.total == pytest.approx(found.first, abs=0.03) and scatter == 0 and found.evaluations == 512


@pytest.mark.wide
def test_scatter_is_what_no_parameter_has(by_law):
    """A constant with scatter is nothing but scatter; wear has a variance of (30^2 + 10^2)/12 without."""
    by_law[""], model = 3.0, jc.whole_bearing("nu2310")
    _, alone = bearing_sensitivity(model, VARY, BearingRuns(SPEED), "land_impulse_N_s", samples=128)
    # The wear is a sum of two statistics that are off alike: twice as far.
    _, some = bearing_sensitivity(model, VARY, BearingRuns(SPEED), "wear", samples=128)
    assert alone == pytest.approx(1.0, abs=0.15) and some == pytest.approx(18 / (1000 / 12 + 18), rel=0.2)


def test_the_budget_is_slopes_times_tolerances(by_law):
    """Of a linear law the slopes are exact."""
    names = "pocket_wear_mm3_per_h", "land_wear_mm3_per_h"
    found = bearing_gradient(
        jc.whole_bearing("nu2310"), SPEED, directions=tuple(VARY), statistics=names, designs=12, revolutions=2
    )
    budget = bearing_budget(found, "wear", 0.02)
    assert budget.deviation == pytest.approx({"guidance_gap": 0.02 * 45, "pocket_clearance": 0.02 * 15})
    assert budget.total == pytest.approx(0.02 * np.hypot(45, 15)) and budget.value == pytest.approx(60)
    assert budget.elasticity == pytest.approx({"guidance_gap": 0.75, "pocket_clearance": 0.25})
    assert budget.unit == "mm^3/h" and budget.unclear == ()
    with pytest.raises(ValueError, match="`found` must have the statistic friction_power_W"):
        bearing_budget(found, "power", 0.02)


def test_the_command(by_law, capsys: pytest.CaptureFixture[str], tmp_path: pathlib.Path):
    asked = [*COMMAND, "--load", "1 kN", "--tolerance", "3", "--samples", "64", "--out", str(tmp_path)]
    asked += [x for name, (low, high) in VARY.items() for x in ("--vary", f"{name}={1e3 * low}mm:{1e3 * high}mm")]
    assert main([*asked, "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["of"] == "wear" and found["load_N"] == 1000 and found["tolerance_percent"] == 3
    assert found["sobol"]["total"] == pytest.approx({"guidance_gap": 0.9, "pocket_clearance": 0.1}, abs=0.05)
    assert found["sobol"]["designs"] == 256 and found["sobol"]["scatter"] == 0
    (budget,) = found["measures"]
    assert budget["by_parameter"]["guidance_gap"] == pytest.approx(45 * 0.03 / np.sqrt(3))
    assert budget["by_parameter"]["eccentricity"] == pytest.approx(0, abs=1e-9)
    assert pathlib.Path(found["figure"]).stat().st_size > 10_000
    assert main([*asked, "--quick", "--of", "land_impulse_N_s"]) == 0
    said = capsys.readouterr().out
    assert "Land impulse N s of nu2310" in said and "4 drawn starts, the same for every design" in said
    assert "standard deviation" not in said


@pytest.mark.wide
def test_in_earnest(capsys: pytest.CaptureFixture[str], tmp_path: pathlib.Path):
    """The power over a wide range of gap and a narrow one of the pockets: Petroff's drag is the gap's."""
    asked = [*COMMAND, "--of", "power", "--samples", "8", "--ensemble", "1", "--discard", "1", "--revolutions", "2"]
    asked += ["--vary", "guidance_gap=0.4mm:0.6mm", "--vary", "pocket_clearance=0.29mm:0.31mm", "--quick", "--json"]
    assert main([*asked, "--out", str(tmp_path)]) == 0
    total = json.loads(capsys.readouterr().out)["sobol"]["total"]
    assert total["guidance_gap"] > 3 * total["pocket_clearance"] > 0  # 0.86 and 0.10, with bars of some 0.5 and 0.07


@pytest.mark.parametrize(
    "arguments, said",
    [
        (["--of", "noise"], "Option --of must be one of wear, power, slip, cage_slip"),
        (["--samples", "12"], "Option --samples must be a power of 2, but 12 was given"),
        (["--vary", "load=1kN:5kN"], "Option --vary must name one of guidance_gap, pocket_clearance"),
        (["--revolutions", "3"], "Option --revolutions must be a multiple of 2 above 0, but 3"),
        (["--speeds", "6"], "Option --speeds does not go with a whole bearing"),
    ],
)
def test_refusals(arguments: list[str], said: str, capsys: pytest.CaptureFixture[str], tmp_path: pathlib.Path):
    assert main([*COMMAND, *arguments, "--out", str(tmp_path / "out")]) == 2
    assert said in capsys.readouterr().err and not (tmp_path / "out").exists()
