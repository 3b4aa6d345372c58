"""Stored results: labelled, complete, read back equal, written whole or not at all."""

from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from helpers import cage_sweep, preliminary, read_columns

import jaxcage as jc
from jaxcage.files import configuration, model_from
from jaxcage.lanes import load, save, stored_configuration
from jaxcage.show import trajectory_columns, write_columns


def test_round_trip(tmp_path: Path):
    sweep = cage_sweep()
    again = load(save(tmp_path / "sweep.zarr", sweep))
    xr.testing.assert_identical(again, sweep)


def test_labels_units_and_configuration_are_stored(tmp_path: Path):
    model = jc.replace(preliminary("2b"), guidance_gap=0.5e-3)
    sweep = jc.sweep(model, jc.rpm(8000, 8400, 2), discard=4, revolutions=16, blocks=4, confirm=False, horizon=0)
    stored = xr.open_zarr(save(tmp_path / "sweep.zarr", sweep), consolidated=False, chunks=None)
    assert stored["strobe"].dims == ("speed", "initial_state", "revolution", "component")
    assert stored["component"].values.tolist() == ["x_C", "y_C", "vx_C", "vy_C"]
    assert stored["speed"].attrs["units"] == "rad/s" and stored["rpm"].values == pytest.approx([8000, 8400])
    assert stored["shaft_rpm"].values == pytest.approx(stored["rpm"] / float(model.bearing.cage_speed_ratio))
    for name in ("label", "outcome"):
        meanings = dict(zip(stored[name].attrs["flag_values"], stored[name].attrs["flag_meanings"].split()))
        assert [meanings[i] for i in stored[name].values.ravel()] == sweep[name].values.ravel().tolist()
    kept = stored_configuration(stored)
    assert kept is not None
    assert configuration(model_from(kept)) == configuration(model)


def test_trajectory_as_csv(tmp_path: Path):
    n = 8
    rng = np.random.default_rng(1)
    time, state = np.arange(n) * 1e-3, rng.normal(size=(n, 4)) * 1e-4
    run = jc.Trajectory(time, time * 100, state, np.full(n, 100.0), 4, 0.5, "successful")
    force = {"film": rng.normal(size=(n, 2))}
    columns = read_columns(write_columns(tmp_path / "run.csv", trajectory_columns(run, force)))
    expected = "time [s],tau [rad],x_C [m],y_C [m],vx_C [m/s],vy_C [m/s],film_x [N],film_y [N]"
    assert ",".join(columns) == expected
    np.testing.assert_allclose(columns["vy_C [m/s]"], state[:, 3], rtol=1e-11)
    np.testing.assert_allclose(columns["film_y [N]"], force["film"][:, 1], rtol=1e-11)
