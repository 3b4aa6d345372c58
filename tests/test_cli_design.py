"""`jaxcage design` and `jaxcage sensitivity` in their smallest sizes: what they print, draw and refuse."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import report_example

import jaxcage as jc
from jaxcage.cli import _design, main
from jaxcage.orbits import Sensitivity


RANGE = ["--first", "8000rpm", "--last", "14000rpm", "--speeds", "6", "--quick"]
DESIGN = ["design", "1b", *RANGE, "--starts", "2", "--scouts", "2", "--steps", "1", "--batch", "4"]
AFTER = "before", "after"
SENSITIVITY = ["sensitivity", "1a", *RANGE, "--samples", "2"]


def document(capsys: pytest.CaptureFixture[str], *arguments: str) -> dict[str, Any]:
    """The only thing that `arguments` with --json print on standard output."""
    assert main([*arguments, "--json"]) == 0
    return json.loads(capsys.readouterr().out, parse_constant=lambda name: pytest.fail(f"{name} is not JSON"))


def bowl(model: jc.CageModel) -> Any:
    """Smallest, with the value 1, at a gap of 0.5 mm and 20 um of eccentricity."""
    return 1.0 + (1e4 * model.guidance_gap - 5.0) ** 2 + (1e5 * model.eccentricity - 2.0) ** 2


def test_design_of_a_known_optimum(capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """The search is one in a bowl; the fresh sweeps, by hand, are chaotic from 9050 to 12050 rpm and from 20050 on."""
    swept: list[jc.CageModel] = []

    def search(model: Any, vary: Any, width: Any, **given: Any) -> Any:
        batches = 3 if swept else 10  # of the first it is seen that it is found
        small = dict(batches=batches, batch=8, scouts=0)
        return jc.design.surrogate_search(model, vary, jc.design.Smooth(bowl), **given | small)

    monkeypatch.setattr(_design, "surrogate_search", search)
    monkeypatch.setattr(_design, "judged", lambda found, width: jc.design.judged(found, jc.design.Smooth(bowl)))
    monkeypatch.setattr(_design, "sweep", lambda model, *_, **__: (swept.append(model), report_example.swept())[1])
    monkeypatch.setattr(_design, "_objective", lambda job, width, vary, scatter: width)
    rest = {"peak land force": [2.0, np.nan], "film drag power": [3.0, 5.0], "least film": [4e-6, 3e-6]}
    loads = lambda model, found, error: {"wear load": [1e9 * model.eccentricity], **rest}
    monkeypatch.setattr(_design, "land_loads", loads)
    said = document(capsys, *DESIGN, "--cost", "0", "--out", str(tmp_path))
    assert said["optimum"] == pytest.approx({"guidance_gap": 0.5e-3, "eccentricity": 20e-6}, rel=0.02)
    assert said["objective"] == pytest.approx(1.0, abs=0.01) and said["at_bound"] == []
    assert said["objective_before"] == pytest.approx(bowl(jc.case("1b")))
    assert [float(m.guidance_gap) for m in swept] == [0.6e-3, said["optimum"]["guidance_gap"]]
    assert said["cost"] == pytest.approx({n: float(jc.design.cost().function(m)) for n, m in zip(AFTER, swept)})
    assert said["vary"]["eccentricity"] == pytest.approx([4.6e-6, 23e-6])  # no worse balanced than it is
    assert said["wear_load_N_m_per_s"] == pytest.approx({"before": 23e3, "after": 20e3}, rel=0.02)
    assert said["peak_land_force_N"] == {"before": 2.0, "after": 2.0}
    assert said["film_drag_power_W"] == {"before": 4.0, "after": 4.0}
    assert said["least_film_um"] == pytest.approx({"before": 3.0, "after": 3.0})
    grade = 23e-6 * 14000 * np.pi / 30 * 1e3  # [mm/s]
    assert said["balance_grade_mm_per_s"] == pytest.approx({"before": grade, "after": grade * 20 / 23}, rel=0.02)
    zones = [(z["onset_rpm"], z["exit_rpm"]) for z in said["chaotic_zones"]["after"]]
    assert zones == [(9050, 12050), (20050, None)]
    assert said["chaotic_rpm"]["before"] == pytest.approx(np.mean(report_example.swept().restless) * 25000)
    assert Path(said["figure"]).stat().st_size > 10_000 and not any(tmp_path.glob(".design*"))
    assert main([*DESIGN, "--cost", "0", "--out", str(tmp_path)]) == 0
    text = capsys.readouterr().out
    assert "Design of 1b" in text and "Optima" in text and "Chaotic zones before and after" in text
    assert "Balance may only get better: eccentricity of at most 23 um" in text
    assert "2 rpm before, 1 rpm after" in text and "stays as it is" not in text
    monkeypatch.setattr(_design, "land_loads", lambda m, *_: {"wear load": [1e-3 / m.eccentricity], **rest})
    stays = document(capsys, *DESIGN, "--cost", "0", "--out", str(tmp_path))
    assert stays["status"] == "not confirmed" and stays["optimum"]["guidance_gap"] == pytest.approx(0.6e-3)
    assert stays["objective"] == stays["objective_before"] > 1.5 * min(o["objective"] for o in stays["optima"])
    fresh = stays["objective_by_fresh_sweeps"]
    assert fresh["after"] - fresh["before"] == pytest.approx(
        1000 * (23e-6 / stays["optima"][1]["values"]["eccentricity"] - 1)
    )
    assert stays["wear_load_N_m_per_s"]["after"] == stays["wear_load_N_m_per_s"]["before"]
    assert main([*DESIGN, "--cost", "0", "--out", str(tmp_path)]) == 0
    assert "is no better by fresh sweeps from other starts (" in capsys.readouterr().out
    monkeypatch.setattr(_design, "land_loads", loads)
    worse = document(capsys, *DESIGN, "--cost", "0", "--worse-balance", "--out", str(tmp_path))
    assert worse["vary"]["eccentricity"] == pytest.approx([4.6e-6, 57.5e-6])


@pytest.mark.wide
def test_a_design_that_no_other_beats_stays(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    """What the search sees as better the finer look does not."""
    away = jc.design.Smooth(lambda model: 1e4 * model.guidance_gap)
    finer = lambda model: (1e4 * (model.guidance_gap - 0.6e-3)) ** 2
    search = lambda model, vary, width, **given: jc.design.surrogate_search(model, vary, away, **given)
    monkeypatch.setattr(_design, "surrogate_search", search)
    monkeypatch.setattr(_design, "judged", lambda found, width: jc.design.judged(found, jc.design.Smooth(finer)))
    monkeypatch.setattr(_design, "sweep", lambda model, *_, **__: report_example.swept())
    monkeypatch.setattr(_design, "_objective", lambda job, width, vary, scatter: width)
    monkeypatch.setattr(_design, "land_loads", lambda *_: dict.fromkeys([*jc.design.MEASURES, "least film"], [1.0]))
    given = [*DESIGN, "--starts", "1", "--steps", "9", "--out", str(tmp_path)]
    said = document(capsys, *given)
    own = jc.parameters(jc.case("1b"))
    assert said["optimum"] == pytest.approx({n: float(own[n]) for n in ("guidance_gap", "eccentricity")})
    assert said["status"] == "nothing better found" and said["objective"] == said["objective_before"]
    assert main(given) == 0
    assert "No design that was looked at is better than the given one, which stays as it is." in capsys.readouterr().out


def test_sensitivity_of_a_known_objective(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    """Shares of a bowl's variance: as printed they are those of the library's own call."""
    shares = lambda model, vary, width, **given: jc.design.global_sensitivity(
        model, vary, jc.design.Smooth(bowl), **given
    )
    monkeypatch.setattr(_design, "global_sensitivity", shares)
    said = document(capsys, *SENSITIVITY[:-1], "64", "--seed", "3", "--out", str(tmp_path))
    vary = {name: tuple(bounds) for name, bounds in said["vary"].items()}
    own = shares(jc.case("1a"), vary, None, samples=64, seed=3)
    assert said["sobol"]["designs"] == own.evaluations == 64 * 4
    assert said["sobol"]["first"] == pytest.approx(own.first) and said["sobol"]["total"] == pytest.approx(own.total)
    assert sum(own.first.values()) == pytest.approx(1.0, abs=0.2)  # nothing is in both
    assert said["sobol"]["doubtful"] == list(own.doubtful) and said["sobol"]["samples_wanted"] == own.samples_wanted
    assert said["edges"] == [] and said["figure"] is None


def test_no_tolerance_is_budgeted_for_what_nobody_makes(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    loss, own, bowled = report_example.findings().loss, jc.design.global_sensitivity, jc.design.Smooth(bowl)
    moved = dict.fromkeys(jc.parameters(jc.case("1a")), 0.5)
    edge = Sensitivity("zone 1 exit", "fold", 12000.0, moved, moved, {}, 1e-3, "converged")
    monkeypatch.setattr(
        _design, "global_sensitivity", lambda model, vary, width, **given: own(model, vary, bowled, **given)
    )
    monkeypatch.setattr(_design, "synchronous_orbits", lambda *_, **__: None)
    monkeypatch.setattr(_design, "loss_zones", lambda _: loss)
    monkeypatch.setattr(_design, "sensitivities", lambda *_: {edge.name: edge})
    arguments = [x for x in SENSITIVITY if x != "--quick"]
    said = document(capsys, *arguments, "--tolerance", "1", "--out", str(tmp_path))
    (budget,) = said["edges"]
    assert set(budget["elasticity"]) - set(budget["by_parameter_rpm"]) == {
        *("gravity", "printed_unit", "reference_speed", "reference_viscosity", "approach_speed", "palmgren_constant"),
        *(n for n in moved if "smoothing" in n),
    }
    assert budget["deviation_rpm"] == pytest.approx(60 / 3**0.5 * len(budget["by_parameter_rpm"]) ** 0.5)


@pytest.mark.parametrize(
    "arguments, said",
    [
        ("design 1a --starts 0", "--starts must be at least 1, but 0 was given"),
        ("design 1a --starts 3 --scouts 1", "--scouts must be 0 or at least 2, but 1 was given"),
        ("design 1a --batch 1", "--batch must be at least 2, but 1 was given"),
        ("design 1a --cost nan", "--cost must be at least 0, but nan was given"),
        ("design 1a --last 3000", "the range is 4000 to 3000 rpm"),
        ("design 1a --vary gap=0.3mm:0.6mm", "gap"),
        ("design 1a --vary guidance_gap=0.6mm:0.3mm", "must ascend"),
        ("design 1a --vary guidance_gap=0.3kg:0.6kg", "guidance_gap"),
        ("design 1a --scatter eccentricity=weibull", "weibull"),
        ("design 1a --scatter damping=10%", "damping"),
        (
            "design 1a --vary eccentricity=30um:60um",
            "--vary must let the eccentricity become smaller than the 2.3e-05 m",
        ),
        ("sensitivity 1a --samples 3", "--samples must be a power of 2, but 3 was given"),
        ("sensitivity 1a --tolerance 0", "--tolerance must lie between 0 and 100 percent, but 0 was given"),
        ("sensitivity 1a --first nan", "--first must be a speed above 0 rpm, but nan was given"),
    ],
)
def test_refused_in_one_sentence(capsys: pytest.CaptureFixture[str], tmp_path: Path, arguments: str, said: str):
    assert main([*arguments.split(), "--out", str(tmp_path)]) == 2
    out, err = capsys.readouterr()
    lines = [line for line in err.splitlines() if not line.startswith("Warning:")]
    assert out == "" and len(lines) == 1 and said in lines[0] and lines[0].endswith(".")
