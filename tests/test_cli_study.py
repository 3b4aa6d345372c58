"""`jaxcage study` and `jaxcage map --points`: stores, figures, one sentence for every misuse, going on."""

import json
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from helpers import raw_sweep

import jaxcage as jc
from jaxcage.cli import _label_map, main
from jaxcage.cli._vary import read_vary
from jaxcage.orbits import Curve
from jaxcage.studies import label_names


CASE = ["study", "1a", "--vary", "speed=9000:12000rpm:6", "--vary", "guidance_gap=0.4mm:0.5mm:2", "--starts", "2"]
SMALL = [*CASE, "--discard", "10", "--revolutions", "20", "--solver", "rk4", "--steps", "128", "--chunk", "6"]
MAP = ["map", "1a", "--points", "9x7", "--discard", "10", "--revolutions", "20", "--steps", "64"]


def document(capsys: pytest.CaptureFixture[str], *arguments: str) -> dict[str, Any]:
    """The only thing that `arguments` with --json print on standard output."""
    assert main([*arguments, "--json"]) == 0
    return json.loads(capsys.readouterr().out, parse_constant=lambda name: pytest.fail(f"{name} is not JSON"))


@pytest.mark.wide
def test_study_is_stored_and_goes_on(capsys: pytest.CaptureFixture[str], tmp_path: Path):
    out = ["--out", str(tmp_path)]
    half = document(capsys, *SMALL, *out, "--shard", "2/2")
    assert half["axes"] == {"speed": 6, "guidance_gap": 2, "start": 2}
    assert (half["lanes"], half["stored"], half["stored_before"], half["chunks"]) == (24, 12, 0, 6)
    assert main([*SMALL, *out]) == 0
    text, said = capsys.readouterr()
    assert "Lanes: 6 speed x 2 guidance_gap x 2 start" in text and "Computed: 12 lanes" in text
    assert "left for the other shards" not in said
    whole = document(capsys, *SMALL, *out)
    assert (whole["stored"], whole["stored_before"], whole["lanes_per_second"]) == (24, 24, None)
    stored = xr.open_zarr(whole["store"], chunks=None)
    model = jc.replace(jc.case("1a"), guidance_gap=0.5e-3)
    speeds = jc.rpm(9000, 12000, 6)
    np.testing.assert_allclose(stored["speed"], speeds, rtol=1e-14)
    starts = np.array([[[float(c) for c in y] for y in model.starts(s)[:2]] for s in speeds])
    method = jc.method("rk4", steps=128)
    length = dict(discard=10, revolutions=20, blocks=20, keep=16)
    swept = raw_sweep(model, speeds, starts=starts, method=method, **length)
    mine = stored.isel(guidance_gap=1)
    # rounding grows with the exponent: 30 revolutions are short enough
    np.testing.assert_allclose(mine["largest_exponent"], swept.exponents[..., 0], rtol=0, atol=1e-3)
    np.testing.assert_allclose(mine["peak"], swept.peak, rtol=0, atol=1e-3)
    counts = dict(zip(*np.unique(label_names(stored), return_counts=True), strict=True))
    assert whole["labels"] == counts and sum(counts.values()) == 24


def refused(capsys: pytest.CaptureFixture[str], *arguments: str) -> str:
    assert main(list(arguments)) == 2
    out, err = capsys.readouterr()
    lines = [line for line in err.splitlines() if not line.startswith("Warning:")]
    assert out == "" and len(lines) == 1, err
    assert lines[0].endswith(".")
    return lines[0]


SPEED = "--vary speed=9000:12000:3"


@pytest.mark.parametrize(
    "arguments, said",
    [
        ("", "--vary must be given for the speed too"),
        ("--vary guidance_gap=0.4mm", "--vary must be given for the speed too"),
        ("--vary speed", "--vary must be NAME=VALUES"),
        ("--vary speed=", "--vary must be NAME=VALUES"),
        (f"{SPEED} --vary gap=0.4mm", "must name one of speed, oil, bore, "),
        (f"{SPEED} --vary gap=0.4mm", "but names 'gap'"),
        (f"{SPEED} --vary speed=3000", "name each parameter once, but speed was given twice"),
        (f"{SPEED} --vary guidance_gap=0.4kg", 'guidance_gap has the unit "kg"'),
        (f"{SPEED} --vary guidance_gap=0.4", "guidance_gap must stay from 1e-05 to 0.005 m, but holds 0.4"),
        (f"{SPEED} --vary guidance_gap=0.4mm:0.5mm:0", "a number of values above 0 at its end, but has '0'"),
        (f"{SPEED} --vary guidance_gap=0.4mm:0.5mm:many", "but has 'many'"),
        (f"{SPEED} --vary guidance_gap=1:2:3:4", "must have values such as"),
        (f"{SPEED} --vary guidance_gap=0.4mm,0.4mm", "must have distinct values"),
        (f"{SPEED} --vary guidance_gap=0.5mm:0.4mm --sample 4", "must ascend"),
        (f"{SPEED} --vary guidance_gap=0.5mm+-0mm --sample 4", "above 0"),
        (f"{SPEED} --vary guidance_gap=0.4mm:0.5mm", "--sample must say how many samples to take of guidance_gap"),
        (f"{SPEED} --sample 8", "--sample needs an interval or a tolerance to sample, but 8"),
        (f"{SPEED} --vary eccentricity=0.5mm", "must be smaller than `guidance_gap`"),
        (f"{SPEED} --vary oil=1", "oil must stay from 2 to 10000"),
        ("--vary speed=-3", "speed must stay above 0 rad/s"),
        ("--vary speed=140Hz", 'is in Hz, where "rpm" or "rad/s" is wanted'),
        ("--vary speed=nan", "speed must be a finite number"),
        (f"{SPEED} --shard 0/4", "--shard must be I/N with I from 1 to N, e.g. 1/4, but '0/4'"),
        (f"{SPEED} --shard 5/4", "but '5/4'"),
        (f"{SPEED} --shard half", "but 'half'"),
        (f"{SPEED} --revolutions 37", "--revolutions must be a multiple of 10"),
        (f"{SPEED} --starts 9", "--starts must be at most 3, but 9"),
        (f"{SPEED} --exponents 9", "--exponents must be at most 4, but 9"),
        (f"{SPEED} --strobe 301", "--strobe must lie between 0 and the 300 revolutions"),
        (f"{SPEED} --chunk 0", "--chunk must be at least 1, but 0"),
        (f"{SPEED} --seed -1", "--seed"),
        (f"{SPEED} --workers 2", "--scheduler and --workers go with --executor dask"),
        (f"{SPEED} --executor dask --workers 0", "--workers must be at least 1"),
        (f"{SPEED} --executor slurm", "--executor"),
        (f"{SPEED} --store /tmp/elsewhere", "--store must name a folder within --out"),
        (f"{SPEED} --store ../elsewhere", "--store must name a folder within --out"),
    ],
)
def test_misuse_gets_one_sentence(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path, arguments: str, said: str
):
    from jaxcage.cli import _study

    monkeypatch.setattr(_study, "run_study", lambda *_, **__: pytest.fail("the study was started"))
    sentence = refused(capsys, "study", "1a", *arguments.split(), "--out", str(tmp_path / "out"))
    assert said in sentence and not (tmp_path / "out").exists()


@pytest.mark.wide
def test_stores_of_others_and_missing_dask_get_one_sentence(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
):
    out = ["--out", str(tmp_path)]
    assert main([*SMALL, *out, "--shard", "1/6"]) == 0
    capsys.readouterr()
    said = refused(capsys, *SMALL, *out, "--discard", "20")
    assert "holds another study, which differs in discard: choose another folder" in said
    (tmp_path / "mine").mkdir()
    assert "--store must be a new folder" in refused(capsys, *SMALL, *out, "--store", "mine")
    monkeypatch.setitem(sys.modules, "distributed", None)
    said = refused(capsys, *SMALL, *out, "--executor", "dask")
    assert 'dask.distributed is missing: python -m pip install "jaxcage[dask]"' in said


def test_what_can_be_varied():
    """Bare speeds are rpm, all else SI or with its unit; grids, lists, single values, intervals and tolerances."""
    given = ["speed=9000:12000:4", "guidance_gap=0.4mm:5e-4", "eccentricity=20um±3um", "oil=32,56.5,78"]
    got = read_vary(given, jc.case("1a"))
    np.testing.assert_allclose(got["speed"], np.array([9000, 10000, 11000, 12000]) * np.pi / 30, rtol=1e-14)
    gap, eccentricity = got["guidance_gap"], got["eccentricity"]
    assert isinstance(gap, jc.studies.Between) and isinstance(eccentricity, jc.studies.Tolerance)
    assert gap.bounds == pytest.approx((4e-4, 5e-4), rel=1e-12)
    assert (eccentricity.value, eccentricity.deviation) == pytest.approx((20e-6, 3e-6), rel=1e-12)
    np.testing.assert_array_equal(got["oil"], [32, 56.5, 78])
    one = read_vary(["speed=100rad/s"], jc.case("1a"))
    np.testing.assert_allclose(one["speed"], [100.0], rtol=1e-14)


@pytest.mark.wide
def test_map_of_labels(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path):
    """Curves come on top; the data hold all points."""
    line = np.full(5, jc.rpm(7000))
    height, rest = np.linspace(4e-4, 5e-4, 5), (np.zeros((5, 4)), np.zeros((5, 4), complex), np.ones(5, bool))
    edge = Curve("fold", "speed", "guidance_gap", line, height, *rest, ("range", "range"), "zone 1 onset")
    monkeypatch.setattr(_label_map, "_curves", lambda *_: ([edge], {"zone 2 onset": "a branch point"}))
    small = [*MAP, "--first", "3000", "--last", "9000", "--out", str(tmp_path)]
    got = document(capsys, *small)
    assert got["points"] == [9, 7] and got["x_range"] == pytest.approx([3000, 9000])
    assert got["curves"] == ["zone 1 onset"] and got["refused"] == {"zone 2 onset": "a branch point"}
    assert sum(got["kinds"].values()) == 63
    assert Path(got["figure"]).read_bytes().startswith(b"\x89PNG\r\n")
    data = xr.open_zarr(got["data"], consolidated=False, chunks=None)
    assert data["label"].dims == ("speed", "guidance_gap", "start")
    assert data["label"].size == 63 and int(np.min(data["label"])) >= 0
    np.testing.assert_allclose(data["speed"], jc.rpm(3000, 9000, 9), rtol=1e-14)


@pytest.mark.parametrize(
    "arguments, said",
    [
        ("--points 300", "--points must be ACROSSxUPWARDS, each from 2 to 10000, e.g. 300x300, but '300' was given"),
        ("--points 1x300", "but '1x300' was given"),
        ("--points 9x7 --revolutions 37", "--revolutions must be a multiple of 10"),
        ("--points 9x7 --speed 9000", "--speed goes with an --x that is not the speed"),
        ("--points 9x7 --x eccentricity", "--speed must be given for a map over eccentricity"),
        ("--points 9x7 --x eccentricity --speed -1", "--speed must be a speed above 0 rpm, but -1"),
        ("--points 9x7 --starts 4", "--starts must be at most 3, but 4"),
        ("--no-curves", "--no-curves, --persist and --speed go with --points"),
    ],
)
def test_impossible_maps_get_one_sentence(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, arguments: str, said: str
):
    sentence = refused(capsys, "map", "1a", *arguments.split(), "--out", str(tmp_path / "out"))
    assert said in sentence and not (tmp_path / "out").exists()
