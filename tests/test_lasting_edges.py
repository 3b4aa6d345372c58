"""Edges of lasting chaos by survival regression, against maps whose escape rate is known."""

import dataclasses
import json
import types
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import jaxcage as jc
from jaxcage import analysis
from jaxcage.analysis import Edge, Zone, hazard
from jaxcage.cli import main
from jaxcage.design import LastingWidth, lasting_edge, lasting_edges


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


def test_lanes_that_fail_or_are_calm_at_the_beginning_do_not_count():
    rng = np.random.default_rng(0)
    x = covariates(rng, 400)
    times = escapes(x, rng)
    found = hazard(times, HORIZON, x, block=10, t0=20)
    more = hazard(
        np.concatenate([times, [np.nan, 0.0, 20.0]]), HORIZON, np.vstack([x, np.ones((3, 3))]), block=10, t0=20
    )
    np.testing.assert_allclose(more.coefficients, found.coefficients, rtol=1e-6)
    assert more.lanes == found.lanes == np.sum(times > 20)
    assert np.all(np.abs(found.coefficients - LAW) < 3 * np.sqrt(np.diag(found.covariance)))


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

    def __call__(self, model: Any, names: Any, values: np.ndarray, rpm: np.ndarray, horizon: int, *_: Any) -> Any:
        base = np.array([float(jc.parameters(model)[n]) for n in names])
        beyond = self.steep * (rpm - EDGE * np.prod((values / base) ** ELASTICITY, axis=1))
        rate = self.rate * np.exp(beyond + self.curvature * beyond**2) / horizon
        block = analysis.LIFE_BLOCK
        times = block * np.ceil(self.rng.exponential(1 / rate[:, None], (rpm.size, 3)) / block) + 100
        return np.where(times <= horizon, times, np.inf), horizon


@pytest.fixture
def planted(monkeypatch: pytest.MonkeyPatch):
    def plant(seed: int, **law: float) -> None:
        monkeypatch.setattr("jaxcage.design._lasting._escapes", Planted(seed, **law))

    return plant


@pytest.mark.parametrize("curvature, errors, most", [(0.0, 2, 34), (0.15, 3, 38)])
def test_planted_edges_and_elasticities_lie_within_their_errors(planted, curvature: float, errors: int, most: int):
    """Of 40 seeds some 38 should be within two standard errors, where the law is what is fitted; where its square
    acts on the design, too, which is not, within three."""
    inside, steady = np.zeros(4), 0
    for seed in range(40):
        planted(seed, curvature=curvature)
        found = lasting_edge(CASE, 12100.0, 150.0, names=NAMES, seed=seed)
        error = np.array([found.speed_rpm - EDGE, *(found.elasticity - ELASTICITY), found.sum_of(*NAMES)[0] - 0.2])
        stated = np.array([found.standard_error_rpm, *found.elasticity_error, found.sum_of(*NAMES)[1]])
        inside += np.abs(error) < errors * stated
        steady += found.status == "converged"
        assert found.standard_error_rpm < 30 and np.all(found.elasticity_error < 0.15)
    assert np.all(inside >= most) and steady >= 36


def test_an_edge_far_from_where_it_is_looked_for_is_walked_to(planted):
    planted(0, rate_at_edge=100.0)
    found = lasting_edge(CASE, EDGE, 150.0, names=NAMES)
    assert abs(found.speed_rpm - EDGE + np.log(100.0) / STEEP) < 4 * found.standard_error_rpm < 100


@pytest.mark.parametrize("rate", [0.1, 10.0])
def test_an_edge_that_is_not_there_says_so(planted, rate: float):
    planted(0, rate_at_edge=rate, steep=0.0)
    assert lasting_edge(CASE, EDGE, 150.0, names=NAMES).status.startswith("no edge")


def test_chaos_that_nobody_leaves_is_refused(planted):
    planted(0, rate_at_edge=1e-6)
    with pytest.raises(ValueError, match="at least 10 escapes"):
        lasting_edge(CASE, EDGE, 150.0, names=NAMES)


def test_a_parameter_that_is_zero_or_unknown_is_refused():
    with pytest.raises(ValueError, match="`names` must hold parameters of the design that are not 0, but has 'gap'"):
        lasting_edge(CASE, 12000.0, 100.0, names=("gap",))


def test_a_window_and_a_horizon_that_are_none_are_refused():
    with pytest.raises(ValueError, match="`within_rpm` must be positive, but 0.0"):
        lasting_edge(CASE, 12000.0, 0.0)
    with pytest.raises(ValueError, match="`horizon` must be above 400 revolutions, but 300"):
        lasting_edge(CASE, 12000.0, 100.0, horizon=300)


def test_an_open_zone_has_one_edge_and_a_closed_one_a_width(planted):
    planted(3)
    leaves = Edge(EDGE, 100.0, "chaotic")
    assert list(lasting_edges(CASE, Zone("chaotic", None, leaves, 1.0))) == ["exit"]
    found = lasting_edges(CASE, Zone("chaotic", None, leaves, 1.0))["exit"]
    onset = dataclasses.replace(found, speed_rpm=found.speed_rpm / 2)
    width = LastingWidth(onset, found)
    assert width.width_rpm == pytest.approx(found.speed_rpm / 2)
    assert width.change("eccentricity")[0] == pytest.approx(width.width_rpm * found.elasticity[1])
    assert width.change(*NAMES)[0] == pytest.approx(width.width_rpm * found.sum_of(*NAMES)[0])
    assert width.standard_error_rpm == pytest.approx(np.sqrt(2) * found.standard_error_rpm)


def test_gradient_command_of_lasting_zones(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, planted
):
    planted(5)
    zone = Zone("chaotic", Edge(EDGE, 100.0, "chaotic"), Edge(EDGE, 100.0, "chaotic"), 1.0)
    swept = types.SimpleNamespace(outcome=np.zeros((1, 3), int), horizon=3000)
    monkeypatch.setattr("jaxcage.cli._lasting.sweep", lambda *_, **__: swept)
    monkeypatch.setattr("jaxcage.cli._lasting.zones", lambda _: types.SimpleNamespace(zones=(zone,)))
    asked = ["gradient", "1a", "--lasting", "--designs", "32", "--out", str(tmp_path)]
    assert main([*asked, "--json"]) == 0
    got = json.loads(capsys.readouterr().out)
    assert [e["name"] for e in got["edges"]] == ["zone 1 onset", "zone 1 exit"]
    for edge in got["edges"]:
        for name, true in zip((*NAMES, "gap at fixed rho"), (*ELASTICITY, 0.2), strict=True):
            found = edge["elasticity"][name]
            assert abs(found["value"] - true) < 4 * found["error"] < 0.6
    assert abs(got["widths"][0]["width_rpm"]) < 4 * got["widths"][0]["standard_error_rpm"]
    assert main(asked) == 0
    out = capsys.readouterr().out
    assert "mean life of chaos passes 3000 revolutions" in out and "what 1 % more of a parameter adds" in out
    assert main([*asked, "--zone", "2"]) == 2
    assert "--zone must be at most 1" in capsys.readouterr().err
    assert main([*asked, "--by", "gap"]) == 2
    assert main(["gradient", "1a", "--zone", "1"]) == 2


def test_lanes_of_an_edge_tell_a_crisis_too(planted):
    """The law is exponential in speed, not a power: near the edge both fit, and the crisis lies on the lasting side."""
    planted(0)
    found = lasting_edge(CASE, 12100.0, 150.0, names=NAMES)
    crisis = found.crisis()
    assert crisis.beyond == "above" and crisis.speed < found.speed_rpm and crisis.lanes == found.fit.lanes
    assert crisis.mean_life(found.speed_rpm) == pytest.approx(found.horizon, rel=0.3)
    relative = crisis.slope / found.speed_rpm
    assert np.all(np.abs(relative - ELASTICITY) < 0.1)
