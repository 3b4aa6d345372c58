"""`study` of whole bearings: every lane in its place, the same numbers as a sweep."""

import json
import pathlib
import types
from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest
import xarray as xr

import jaxcage as jc
from jaxcage.analysis import BearingSweep
from jaxcage.cli import main
from jaxcage.models import CAGE_STARTS
from jaxcage.studies import Between, check_study


jc.enable_x64()
BEARING = jc.whole_bearing("nu2310")
LENGTH: dict[str, Any] = dict(discard=1, revolutions=10, blocks=5)


@pytest.fixture
def told_apart(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """In the place of sweeps: numbers that say whose they are, from the second start none; the lanes of each."""
    lanes = []

    def sweeps(models: Sequence[jc.BearingModel], speeds: np.ndarray, starts: Any, **_: Any) -> list[Any]:
        assert np.all(np.diff(speeds) > 0)
        lanes.append(len(models) * len(speeds) * len(starts))
        place = np.array([CAGE_STARTS.index(start) for start in starts])
        found = []
        for model in models:
            value = float(model.load) + float(model.cage_mass) + 10 * speeds[:, None] + 1e6 * place
            lost = np.broadcast_to(place == 1, value.shape)
            what = {name: np.where(lost, np.nan, value) for name in BearingSweep.__dataclass_fields__}
            what |= {"outcome": np.where(lost, "outside", "successful"), "state": np.where(lost, "failed", "circular")}
            error = lambda name, value=value: -value
            found.append(types.SimpleNamespace(**what, standard_error=error))
        return found

    monkeypatch.setattr("jaxcage.studies._whole_study.sweep_bearings", sweeps)
    return lanes


@pytest.mark.wide
@pytest.mark.parametrize("order", [("speed", "load"), ("load", "speed")])
def test_every_lane_is_in_its_place(told_apart: list[int], order: tuple[str, ...], tmp_path: pathlib.Path):
    """Speeds that do not ascend, on the slow axis or the fast one, in chunks that cut axes and starts."""
    values = {"speed": np.array([1200.0, 900.0, 1000.0]), "load": np.array([500.0, 2000.0])}
    for most in (4, 3, 100):
        store = tmp_path / f"{most}"
        found = jc.study(BEARING, {name: values[name] for name in order}, store=store, lanes=most, **LENGTH)
        assert found["cage_slip"].dims == (*order, "start") and not check_study(store).damaged
        expected = (
            found["load"]
            + float(BEARING.cage_mass)
            + 10 * found["speed"]
            + 1e6 * xr.DataArray(np.arange(3.0), dims="start")
        )
        well = found["outcome"].transpose(..., "start").values == 0
        assert np.array_equal(well[0, 0], [True, False, True])
        for name, sign in (("cage_slip", 1), ("cage_slip_standard_error", -1), ("pocket_force_max_N", 1)):
            there = found[name].where(found["outcome"] == 0)
            wanted = (sign * expected).where(found["outcome"] == 0).transpose(*there.dims)
            np.testing.assert_array_equal(there, wanted)
        names = found["state"].attrs["flag_meanings"].split()
        assert names[0] == "pending" and names[1 + int(found["state"].values.flat[0])] == "circular"
        assert found["speed"].attrs["long_name"] == "shaft speed" and sum(told_apart) == 18
        told_apart.clear()


def test_a_tolerance_is_not_ignored(tmp_path: pathlib.Path):
    with pytest.raises(ValueError, match="`tolerance` goes with a whole bearing"):
        jc.study(jc.case("1a"), {"speed": np.array([900.0])}, store=tmp_path / "store", tolerance=1e-5)


@pytest.mark.parametrize(
    "vary, options, said",
    [
        ({"load": [1e3]}, {}, "`vary` must hold values of the shaft's speed"),
        ({"speed": Between(900.0, 1000.0)}, {"samples": 2}, "`vary` must hold values of the shaft's speed"),
        ({"speed": [900.0], "oil": [32.0]}, {}, "`vary` must name speed or parameters of the bearing, but names oil"),
        ({"speed": [900.0]}, {"strobe": 3}, "`strobe` and `method` must be left out for a whole bearing"),
        ({"speed": [900.0]}, {"starts": 9}, "`starts` must be 1 to 3"),
        ({"speed": [900.0]}, {"blocks": 3}, "`blocks` must divide the 10 revolutions"),
    ],
)
def test_refusals(vary: dict[str, Any], options: dict[str, Any], said: str, tmp_path: pathlib.Path):
    arrays = {name: np.array(x) if isinstance(x, list) else x for name, x in vary.items()}
    with pytest.raises(ValueError) as caught:
        jc.study(BEARING, arrays, store=tmp_path / "store", **{**LENGTH, **options})
    assert said in str(caught.value) and not (tmp_path / "store").exists()


def test_command(told_apart: list[int], tmp_path: pathlib.Path, capsys: pytest.CaptureFixture[str]):
    asked = ["study", "nu2310", "--vary", "speed=9000rpm,5000 rpm cage", "--vary", "load=1kN:2kN:3"]
    asked += ["--discard", "1", "--revolutions", "10", "--out", str(tmp_path)]
    assert main([*asked, "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["axes"] == {"speed": 2, "load": 3, "start": 3} and told_apart == [18]
    assert found["states"] == {"failed": 6, "circular": 12} and found["failed"] == {"outside": 6}
    stored = jc.open_study(found["store"])
    ratio = float(BEARING.rolling_cage_speed(1.0))
    np.testing.assert_allclose(stored["speed_rpm"], [9000, 5000 / ratio])
    np.testing.assert_allclose(stored["load"], [1000, 1500, 2000])
    assert main([*asked]) == 0 and told_apart == [18]
    said = capsys.readouterr().out
    assert "circular" in said and "Failed lanes: 6 outside" in said and "Computed: 0 lanes" in said
    assert main(["study", "nu2310", "--check", "--out", str(tmp_path)]) == 0


@pytest.mark.parametrize(
    "options, said",
    [
        (["--vary", "oil=32", "--vary", "speed=9000"], "Option --vary must name one of speed, "),
        (["--vary", "speed=9000", "--steps", "64"], "Option --steps does not go with a whole bearing."),
        (["--vary", "speed=900000"], "Option --vary must leave the cage at most 300 m/s at its land"),
        (["--vary", "load=1kN"], "Option --vary must be given for the speed too"),
    ],
)
def test_refusals_of_the_command(options: list[str], said: str, capsys: pytest.CaptureFixture[str], tmp_path):
    assert main(["study", "nu2310", *options, "--out", str(tmp_path / "out")]) == 2
    assert said in capsys.readouterr().err and not (tmp_path / "out").exists()


@pytest.mark.wide
def test_lanes_are_those_of_a_sweep(tmp_path: pathlib.Path):
    speeds, loads = np.asarray(jc.rpm(8000, 12000, 2)), np.array([1000.0, 3000.0])
    found = jc.study(BEARING, {"load": loads, "speed": speeds}, store=tmp_path / "store", starts=1, **LENGTH)
    swept = jc.sweep_bearings([jc.replace(BEARING, load=x) for x in loads], speeds, starts=1, **LENGTH)
    for name in ("cage_slip", "exponent", "land_force_max_N", "eccentricity_mean"):
        np.testing.assert_array_equal(found[name], np.stack([getattr(one, name) for one in swept]))
