"""Two designs side by side: what differs, tables and figures on one scale, what probes would read."""

import dataclasses
import json
from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure
from report_example import swept

import jaxcage as jc
from jaxcage.analysis import orbit_measures
from jaxcage.cli import main
from jaxcage.orbits import Sensitivity
from jaxcage.plotting import over_speed, sweeps_beside
from jaxcage.report import (
    Compared,
    at_speeds_compared,
    compared_document,
    compared_zones_table,
    differences,
    differences_table,
    overall_table,
    to_be_turned,
)
from jaxcage.sweeps import Motion, motions


TINY = "--first 12000 --last 13000 --count 3 --discard 20 --revolutions 20 --horizon 0 --no-confirm".split()
TINY += ["--solver", "rk4", "--steps", "256"]


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
    warm = differences([pair[0].model, jc.replace(pair[0].model, temperature=323.15)])
    assert warm["lubricant.temperature"][3:] == ("°C", "+10 K")
    same = differences_table(("a", "b"), [pair[0].model] * 2)
    assert [row[0] for row in same.rows] == ["nothing"]


def test_another_law_is_a_difference_with_its_own_values():
    model = jc.case("1a")
    other = jc.replace(model, rib=jc.forces.ElasticRib(mass=1.0, stiffness=5e7, damping=500.0))
    found = differences([model, other])
    assert found["rib.kind"][1:3] == ("rigid", "elastic") and found["rib.mass"][1:3] == ("", "1")


def test_tables_hold_both_designs(pair: list[Compared]):
    rows = {row[0]: row[1:3] for row in overall_table(pair).rows}
    share = float(np.mean(pair[0].swept.restless))
    assert rows["speeds at which some start is chaotic"] == (f"{100 * share:.1f}",) * 2
    assert rows["size of the orbit, mean over speed"] == ("0.1", "0.3")
    assert rows["peak land force, mean over speed"] == ("1", "3")
    zones = compared_zones_table(pair).rows
    assert [row[:3] for row in zones] == [(n, "any", i) for n in ("first", "second") for i in ("1", "2")]
    at = at_speeds_compared(pair, [100]).rows
    assert [row[2] for row in at] == ["first", "second"]
    assert at[0][1] == at[1][1] == "12500" and [row[5] for row in at] == ["0.100", "0.300"]
    assert compared_document(pair[1])["means"]["mean_wear_load_N_m_per_s"] == pytest.approx(6.0)


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


def test_bars_show_what_a_designer_can_turn():
    model = jc.case("1a")
    every = dict.fromkeys(jc.parameters(model), 0.1)
    one = Sensitivity("zone 1 onset", "fold", 9000.0, every, every, {}, 0.1, "converged")
    (found,) = to_be_turned(model, [one])
    assert {"guidance_gap", "eccentricity", "cage_mass"} <= set(found.elasticity) < set(every)
    assert not {"stiffness_x", "cubic_stiffness", "amplitude", "onset", "gravity"} & set(found.elasticity)


def test_speeds_outside_and_unknown_cases_are_refused(capsys: pytest.CaptureFixture[str], tmp_path: Path):
    assert main(["compare", "1a", "1b", "--at", "99000", "--out", str(tmp_path)]) == 2
    assert "Option --at must lie between --first and --last" in capsys.readouterr().err
    assert main(["compare", "1a", "9z", "--out", str(tmp_path)]) == 2
    assert "Case '9z' is unknown" in capsys.readouterr().err
    (large := tmp_path / "large.toml").write_text(
        'base = "1a"\n[bearing]\nbore = 0.2\ninner_raceway_diameter = 0.26\nroller_diameter = 0.052\n'
        "rib_diameter = 0.35\noutside_diameter = 0.42\nwidth = 0.08\nroller_length = 0.052\n"
    )
    assert main(["compare", "1a", str(large), "--out", str(tmp_path)]) == 2
    assert "at which the other's land runs at 300 m/s" in capsys.readouterr().err


@pytest.mark.wide
def test_the_command(capsys: pytest.CaptureFixture[str], tmp_path: Path):
    other = tmp_path / "narrow.toml"
    other.write_text('base = "1a"\nguidance_gap = "0.3 mm"\n[bearing]\nroller_diameter = "15 mm"\n')
    asked = ["compare", "1a", str(other), *TINY, "--at", "12321", "--out", str(tmp_path), "--json"]
    assert main(asked) == 0
    found = json.loads(capsys.readouterr().out)
    assert set(found["differences"]) == {"guidance_gap", "bearing.roller_diameter"}
    first, second = found["designs"]["1a"], found["designs"]["narrow"]
    assert len(first["speeds_rpm"]) == 4 and any(abs(x - 12321) < 1e-6 for x in first["speeds_rpm"])
    assert second["shaft_speeds_rpm"] == pytest.approx(first["shaft_speeds_rpm"])
    assert second["speeds_rpm"] != pytest.approx(first["speeds_rpm"])
    assert Path(found["figure"]).name == "compare_1a_narrow.png" and Path(found["measures"]).exists()


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
