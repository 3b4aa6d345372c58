"""Stored results: labelled, complete, read back equal, written whole or not at all."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest
from helpers import cage_sweep

import jaxcage as jc
from jaxcage.io import (
    check_writable,
    configuration,
    load_sweep,
    model_from,
    open_sweep,
    read_columns,
    save_sweep,
    stored_configuration,
    trajectory_columns,
    write_columns,
)


def test_round_trip(tmp_path: Path):
    sweep = cage_sweep()
    again = load_sweep(save_sweep(tmp_path / "sweep.zarr", sweep, jc.case("1a", "preliminary")))
    for field in dataclasses.fields(sweep):
        stored, expected = getattr(again, field.name), getattr(sweep, field.name)
        if isinstance(expected, np.ndarray):
            assert stored.dtype == expected.dtype
            np.testing.assert_array_equal(stored, expected)
        else:
            assert stored == expected
    np.testing.assert_array_equal(again.label, sweep.label)


def test_labels_units_and_configuration_are_stored(tmp_path: Path):
    model = jc.replace(jc.case("2b", "preliminary"), guidance_gap=0.5e-3)
    sweep = cage_sweep()
    dataset = open_sweep(save_sweep(tmp_path / "sweep.zarr", sweep, model))
    assert dataset["strobe"].dims == ("speed", "start", "revolution", "component")
    assert dataset["block_growth"].dims == ("speed", "start", "block", "exponent")
    assert dataset["component"].values.tolist() == ["x_C", "y_C", "vx_C", "vy_C"]
    assert dataset["speed"].attrs["units"] == "rad/s"
    assert dataset["speed_rpm"].values == pytest.approx(np.linspace(8000, 8400, 5))
    one = dataset.isel(start=0).sel(component="y_C", speed=sweep.speed[2])
    np.testing.assert_array_equal(one["strobe"].values, sweep.strobe[2, 0, :, 1])
    meanings = dataset["label"].attrs["flag_meanings"].split()
    assert [meanings[i] for i in dataset["label"].values[1]] == ["chaotic"] * 3
    assert meanings[int(dataset["label"].values[3, 2])] == "failed"
    assert dataset["outcome"].attrs["flag_meanings"].split()[1] == "not_finite"
    kept = stored_configuration(dataset)
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


def test_writable_folders_are_made(tmp_path: Path):
    assert check_writable(tmp_path / "a" / "b").is_dir()
    assert not any((tmp_path / "a" / "b").iterdir())
    (tmp_path / "file").write_text("")
    with pytest.raises(ValueError, match="must be a folder that can be written to, but: "):
        check_writable(tmp_path / "file")
