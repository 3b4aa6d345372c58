"""Stored results: labelled, complete, read back equal, written whole or not at all."""

import dataclasses
import json
import os
from pathlib import Path

import numpy as np
import pytest

import jaxcage as jc
from jaxcage.io import (
    check_writable,
    configuration,
    load_sweep,
    model_from,
    open_sweep,
    read_columns,
    replacing,
    save_sweep,
    stored_configuration,
    to_dataset,
    trajectory_columns,
    write_columns,
)


def sweep_of(speeds: int = 5, starts: int = 3) -> jc.Sweep:
    """A made-up sweep: the second speed is chaotic, the others periodic, one lane failed."""
    rng = np.random.default_rng(0)
    rpm = np.linspace(8000.0, 8400.0, speeds)
    strobe = np.repeat(rng.normal(size=(speeds, starts, 1, 4)), 16, axis=2) * 1e-4
    strobe[1] += rng.normal(size=(starts, 16, 4)) * 1e-4
    growth = rng.normal(-0.2, 0.01, size=(speeds, starts, 10, 1))
    growth[1] += 0.5
    outcome = np.zeros((speeds, starts), dtype=np.int32)
    outcome[3, 2] = 1
    strobe[3, 2], growth[3, 2] = np.nan, np.nan
    return jc.Sweep(
        speed=rpm * np.pi / 30,
        strobe=strobe,
        last=strobe[:, :, -1],
        block_growth=growth,
        peak=np.where(outcome == 0, 0.7, np.nan),
        outcome=outcome,
        error=np.full((speeds, starts), 1e-4),
        doubt=np.full((speeds, starts, 1), 1e-3),
        scale=np.broadcast_to(np.array([4.5e-4, 4.5e-4, 0.4, 0.4]), (speeds, 4)).copy(),
        discard=30,
        revolutions=100,
        settings={"method": "made up", "version_jaxcage": "0"},
    )


def test_round_trip(tmp_path: Path):
    sweep = sweep_of()
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
    sweep = sweep_of()
    dataset = open_sweep(save_sweep(tmp_path / "sweep.zarr", sweep, model))
    assert dataset["strobe"].dims == ("speed", "start", "revolution", "component")
    assert dataset["block_growth"].dims == ("speed", "start", "block", "exponent")
    assert dataset["component"].values.tolist() == ["x_C", "y_C", "vx_C", "vy_C"]
    assert dataset["revolution"].values.tolist() == list(range(115, 131))
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
    assert json.loads(dataset.attrs["settings"])["method"] == "made up"


def test_other_systems_than_cages_have_numbered_components():
    dataset = to_dataset(sweep_of())
    assert dataset["component"].values.tolist() == ["y0", "y1", "y2", "y3"]
    assert stored_configuration(dataset) is None


def test_replacing_an_earlier_result(tmp_path: Path):
    path = tmp_path / "sweep.zarr"
    save_sweep(path, sweep_of(5))
    save_sweep(path, sweep_of(7))
    assert load_sweep(path).speed.size == 7
    assert [p.name for p in tmp_path.iterdir()] == ["sweep.zarr"]


def test_a_folder_that_cannot_move_in_leaves_the_earlier_one(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    path = tmp_path / "result"
    path.mkdir()
    (path / "old").write_text("kept")
    rename = os.rename

    def fails_to_move_in(source: Path, target: Path) -> None:
        if target == path and source.name != "earlier":
            raise OSError("the disk is gone")
        rename(source, target)

    monkeypatch.setattr(os, "rename", fails_to_move_in)
    with pytest.raises(OSError, match="the disk is gone"), replacing(path) as temporary:
        temporary.mkdir()
    assert (path / "old").read_text() == "kept"
    assert [p.name for p in tmp_path.iterdir()] == ["result"]


def test_missing_store(tmp_path: Path):
    with pytest.raises(FileNotFoundError, match="no stored sweep"):
        load_sweep(tmp_path / "nothing.zarr")


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
