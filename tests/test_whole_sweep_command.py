"""`jaxcage sweep` of a whole bearing: what it computes is what it prints, draws and stores."""

import json
import pathlib

import numpy as np
import pytest

import jaxcage as jc
from jaxcage.cli import main
from jaxcage.io import open_sweep, stored_configuration, whole_bearing_from


jc.enable_x64()


@pytest.mark.wide
def test_sweep(capsys: pytest.CaptureFixture[str], tmp_path: pathlib.Path):
    path = tmp_path / "mine.toml"
    path.write_text('base = "nu2310"\nload = "1 kN"')
    asked = ["sweep", str(path), "--first", "8000", "--last", "12000 rpm shaft", "--count", "2", "--discard", "1"]
    assert main([*asked, "--revolutions", "10", "--json", "--out", str(tmp_path)]) == 0
    found = json.loads(capsys.readouterr().out)
    model = jc.replace(jc.whole_bearing("nu2310"), load=1000.0)
    expected = jc.sweep_bearing(model, jc.rpm(8000, 12000, 2), discard=1, revolutions=10, blocks=10)
    assert found["outcomes"] == {"successful": 6} and found["load_N"] == 1000
    assert found["shaft_speed_rpm"] == pytest.approx([8000, 12000])
    for name in ("cage_slip", "exponent", "pocket_force_mean_sum_N", "synchronous_force_x_N"):
        np.testing.assert_allclose(found[name], getattr(expected, name), rtol=1e-9)
    assert pathlib.Path(found["figure"]).stat().st_size > 50_000
    stored = open_sweep(found["data"])
    np.testing.assert_allclose(stored["cage_slip_blocks"].values, expected.block_means["cage_slip"], rtol=1e-9)
    np.testing.assert_allclose(stored["speed_rpm"].values, [8000, 12000])
    assert stored["power_parts_W"].sel(part="film").values == pytest.approx(expected.power_parts_W["film"])
    names = stored["state"].attrs["flag_meanings"].split()
    assert [names[code] for code in stored["state"].values.ravel()] == expected.state.ravel().tolist()
    configured = stored_configuration(stored)
    assert configured is not None and float(whole_bearing_from(configured).load) == 1000


@pytest.mark.parametrize(
    "options, said",
    [
        (["--horizon", "10"], "Option --horizon does not go with a whole bearing."),
        (["--solver", "rk4"], "Option --solver does not go with a whole bearing."),
        (["--exponents", "2"], "Option --exponents must be 1 for a whole bearing, but 2 was given."),
        (["--first", "9000 rpm cage", "--last", "10000"], "must be above --first, but the range is"),
        (["--last", "200000"], "Option --last must leave the cage at most 300 m/s at its land"),
    ],
)
def test_refusals(options: list[str], said: str, capsys: pytest.CaptureFixture[str], tmp_path: pathlib.Path):
    assert main(["sweep", "nu2310", *options, "--out", str(tmp_path / "out")]) == 2
    assert said in capsys.readouterr().err and not (tmp_path / "out").exists()
