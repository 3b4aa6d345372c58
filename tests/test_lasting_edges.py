"""Edges of lasting chaos by survival regression, against maps whose escape rate is known."""

import json
import types
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers import cage_sweep

import jaxcage as jc
from jaxcage import analysis
from jaxcage.analysis import Edge, Zone, hazard
from jaxcage.cli import main
from jaxcage.design import lasting_edge, zone_width


CASE = jc.case("1a")
NAMES = ("guidance_gap", "eccentricity")
HORIZON = 300
LAW = np.array([np.log(1 / HORIZON) + 0.2, 1.2, -0.5, 0.25])
"""log kappa at the middle, and its slopes."""


def escapes(x: np.ndarray, rng: np.random.Generator, curvature: float = 0.0) -> np.ndarray:
    """When lanes leave the unit interval under tent maps of slope 2 exp(kappa), which lose 1 - exp(-kappa) in each step
    and keep their uniform density; in blocks of ten steps, infinity for lanes that stay."""
    kappa = np.exp(LAW[0] + x @ LAW[1:] + curvature * x[:, 0] ** 2)
    y, times = rng.random(len(x)), np.full(len(x), np.inf)
    for n in range(1, HORIZON + 1):
        y = 2 * np.exp(kappa) * np.minimum(y, 1 - y)
        times[(y > 1) & np.isinf(times)] = 10 * np.ceil(n / 10)
    return times


def covariates(rng: np.random.Generator, lanes: int) -> np.ndarray:
    return np.column_stack([rng.uniform(-1.5, 1.5, lanes), rng.normal(size=(lanes, 2)).clip(-2, 2)])


def test_the_law_of_open_tent_maps_is_recovered():
    """Every coefficient within two of its standard errors in about 95 of 100 seeds."""
    within, fits = np.zeros(4), 0
    for seed in range(100):
        rng = np.random.default_rng(seed)
        x = covariates(rng, 300)
        found = hazard(escapes(x, rng), HORIZON, x, block=10)
        within += np.abs(found.coefficients - LAW) < 2 * np.sqrt(np.diag(found.covariance))
        fits += found.p_value > 0.05
    assert np.all(within >= 90) and fits >= 85


def test_a_law_that_is_not_log_linear_is_found_out():
    rng = np.random.default_rng(1)
    x = covariates(rng, 1000)
    assert hazard(escapes(x, rng, curvature=-1.5), HORIZON, x, block=10).p_value < 1e-3


def test_too_few_escapes_are_refused():
    times = np.where(np.arange(50) < 4, 100.0, np.inf)
    with pytest.raises(ValueError, match="at least 10 escapes .* 4 of 50 chaotic lanes escaped"):
        hazard(times, HORIZON, np.zeros((50, 1)), block=10)


# Edges of a planted law: chaos ends where the speed passes EDGE, which moves with the design by known elasticities.

EDGE, STEEP = 12000.0, 0.015
ELASTICITY = np.array([-0.3, 0.5])


class Planted:
    """In place of the sweeps: three lanes of each design, which leave chaos at a known rate."""

    def __init__(self, seed: int, rate_at_edge: float = 1.0, steep: float = STEEP, curvature: float = 0.0):
        self.rng, self.rate, self.steep, self.curvature = np.random.default_rng(seed), rate_at_edge, steep, curvature

    def __call__(self, designs: Any, rpm: np.ndarray, run: Any, _: Any) -> Any:
        base, *values = (np.array([float(jc.parameters(m)[n]) for n in NAMES]) for m in (CASE, *designs))
        horizon = run.horizon
        away = rpm - EDGE * np.prod((np.array(values) / base) ** ELASTICITY, axis=1)
        beyond = self.steep * away
        rate = self.rate * np.exp(beyond + self.curvature * beyond**2) / horizon
        block = analysis.LIFE_BLOCK
        times = block * np.ceil(self.rng.exponential(1 / rate[:, None], (rpm.size, 3)) / block) + 100
        return np.where(times <= horizon, times, np.inf), horizon


@pytest.fixture
def planted(monkeypatch: pytest.MonkeyPatch):
    def plant(seed: int, **law: float) -> None:
        monkeypatch.setattr("jaxcage.design.survival_edges._escapes", Planted(seed, **law))

    return plant


@pytest.mark.parametrize("curvature, errors, most", [(0.0, 2, 34), (0.15, 3, 38)])
def test_planted_edges_and_elasticities_lie_within_their_errors(planted, curvature: float, errors: int, most: int):
    """Some 38 of 40 seeds should lie within two standard errors where the fitted law holds, and within three where a
    square acts on the design that is not fitted."""
    inside, steady = np.zeros(4), 0
    for seed in range(40):
        planted(seed, curvature=curvature)
        found = lasting_edge(CASE, 12100.0, 150.0, names=NAMES, seed=seed)
        error = np.array([found.value - EDGE, *(found.elasticity - ELASTICITY), found.elasticity_of(*NAMES)[0] - 0.2])
        stated = np.array([found.value_error, *found.elasticity_error, found.elasticity_of(*NAMES)[1]])
        inside += np.abs(error) < errors * stated
        steady += found.status == "converged"
        assert found.value_error < 30 and np.all(found.elasticity_error < 0.15)
    assert np.all(inside >= most) and steady >= 36


def test_what_cannot_be_is_refused():
    with pytest.raises(ValueError, match="`names` must hold parameters of the design that are not 0, but has 'gap'"):
        lasting_edge(CASE, 12000.0, 100.0, names=("gap",))
    with pytest.raises(ValueError, match="`within_rpm` must be positive, but 0.0"):
        lasting_edge(CASE, 12000.0, 0.0)
    with pytest.raises(ValueError, match="`horizon` must be above 400 revolutions, but 300"):
        lasting_edge(CASE, 12000.0, 100.0, horizon=300)


def test_an_open_zone_has_no_width_and_the_gradient_of_its_one_edge(planted):
    planted(3)
    found = lasting_edge(CASE, EDGE, 100.0)
    for end, sign, missing in (("exit", 1.0, "onset"), ("onset", -1.0, "exit")):
        width = zone_width({f"zone 2 {end}": found}, 2)
        assert width.open and width.trusted and width.status == f"open: no {missing} within the range"
        assert np.isnan(width.value)
        by, error = width.change(*NAMES)
        assert by == pytest.approx(sign * found.value * found.elasticity_of(*NAMES)[0])
        assert error == pytest.approx(found.value * found.elasticity_of(*NAMES)[1], rel=0.01)
    with pytest.raises(ValueError, match="`zone` must be one with an edge among zone 2 exit, but is 1"):
        zone_width({"zone 2 exit": found})
    with pytest.raises(ValueError, match="`names` must be among guidance_gap, eccentricity, but has 'gap'"):
        width.change("gap")


def test_gradient_command_of_lasting_zones(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, planted
):
    """A zone with both edges, and one without an onset."""
    planted(5)
    edge = Edge(EDGE, 100.0, "chaotic")
    both = Zone("chaotic", edge, edge, 1.0), Zone("chaotic", None, edge, 1.0)
    monkeypatch.setattr(jc, "sweep", lambda *_, **__: cage_sweep().assign_attrs(horizon=3000))
    monkeypatch.setattr(jc, "zones", lambda _: types.SimpleNamespace(zones=both))
    asked = ["gradient", "1a", "--lasting", "--designs", "32", "--out", str(tmp_path)]
    assert main([*asked, "--json"]) == 0
    got = json.loads(capsys.readouterr().out)
    assert [e["name"] for e in got["edges"]] == ["zone 1 onset", "zone 1 exit", "zone 2 exit"]
    for edge in got["edges"]:
        for name, true in zip((*NAMES, "gap at fixed rho"), (*ELASTICITY, 0.2), strict=True):
            assert abs(edge[name] - true) < 4 * edge[f"{name}_error"] < 0.6
    closed, opened = got["widths"]
    assert abs(closed["width_rpm"]) < 4 * closed["standard_error_rpm"]
    assert opened["open"] and opened["status"] == "open: no onset within the range" and opened["width_rpm"] is None
    last = got["edges"][-1]
    assert opened["eccentricity"] == pytest.approx(0.01 * last["speed_rpm"] * last["eccentricity"])
    assert main(asked) == 0
    out = capsys.readouterr().out
    assert "mean life of chaos passes 3000 revolutions" in out and "what 1 % more of a parameter adds" in out
    assert "open: no onset within the range" in out
    assert main([*asked, "--zone", "3"]) == 2
    assert "--zone must be at most 2" in capsys.readouterr().err
    assert main([*asked, "--by", "gap"]) == 2
    assert main(["gradient", "1a", "--zone", "1"]) == 2
