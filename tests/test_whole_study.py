"""`study` of whole bearings: every lane in its place, the same numbers as a sweep."""

import pathlib
from typing import Any

import numpy as np
import pytest

import jaxcage as jc


jc.enable_x64()
BEARING = jc.whole_bearing("nu2310")
LENGTH: dict[str, Any] = dict(discard=0, revolutions=1, blocks=1, method=jc.native(1e-6, 1e-2))


@pytest.mark.wide
@pytest.mark.parametrize("order", [("speed", "load"), ("load", "speed")])
def test_every_lane_is_in_its_place(order: tuple[str, ...], tmp_path: pathlib.Path):
    """Speeds that do not ascend, on the slow axis or the fast one, in chunks that cut axes and starts."""
    values = {"speed": np.asarray(jc.rpm(8000, 12000, 2))[::-1], "load": np.array([1000.0, 3000.0])}
    store = tmp_path / "store"
    found = jc.study(BEARING, {name: values[name] for name in order}, store=store, lanes=3, initial_states=2, **LENGTH)
    assert found["cage_slip"].dims == (*order, "initial_state")
    assert found["speed"].attrs["long_name"] == "shaft speed"
    swept = jc.sweep(
        [jc.replace(BEARING, load=x) for x in values["load"]], values["speed"][::-1], initial_states=2, **LENGTH
    )
    errors = {"cage_slip": 1e-4, "friction_power_W": 1.0, "eccentricity_mean": 1e-3}
    mine = [found[n].transpose("load", "speed", "initial_state").values.ravel() / e for n, e in errors.items()]
    theirs = [swept[n].values[:, ::-1].ravel() / e for n, e in errors.items()]
    apart = np.abs(np.array(mine)[:, :, None] - np.array(theirs)[:, None]).max(axis=0)
    assert np.all((apart < 1) == np.eye(8, dtype=bool))  # each lane is like its own one only


@pytest.mark.parametrize(
    "vary, options, said",
    [
        ({"load": [1e3]}, {}, "`vary` must hold the speed"),
        ({"speed": [900.0], "grease": [32.0]}, {}, "grease"),
        ({"speed": [900.0]}, {"initial_states": 9}, "`initial_states` must be at most 3, but 9 was given"),
    ],
)
def test_refusals(vary: dict[str, Any], options: dict[str, Any], said: str, tmp_path: pathlib.Path):
    arrays = {name: np.array(x) if isinstance(x, list) else x for name, x in vary.items()}
    with pytest.raises(ValueError, match=said):
        jc.study(BEARING, arrays, store=tmp_path / "store", **LENGTH | options)
    assert not (tmp_path / "store").exists()
