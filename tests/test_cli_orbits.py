"""Commands about synchronous orbits: bifurcations, gradient, map."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import report_example

import jaxcage as jc
from jaxcage.analysis import Sweep
from jaxcage.bearing import PUBLISHED_CASES
from jaxcage.cli import _orbits, _sweep, main
from jaxcage.cli._show import plain
from jaxcage.io import load_sweep, read_columns
from jaxcage.orbits import (
    Branch,
    Curve,
    Explained,
    Point,
    Sensitivity,
    Stretch,
    SynchronousOrbits,
    loss_zones,
)
from jaxcage.report import (
    contact_notes,
    orbits_document,
    touching,
)


PNG = b"\x89PNG\r\n"
PER_RPM = np.pi / 30


def point(kind: str, rpm: float, critical: complex, index: int, edge: bool = True) -> Point:
    others = [complex(critical).conjugate(), 0.5] if kind == "Neimark-Sacker" else [0.5, 0.4]
    multipliers = np.array([critical, *others, 0.1], dtype=complex)
    state = np.array([1e-5, 2e-5, 0.1, 0.2])
    outcome = 5 if kind == "unexplained" else 0  # `unexplained`, `converged`
    known = dict(multipliers=multipliers, index=index, edge=edge, steps=1024, error=1e-4 * PER_RPM, outcome=outcome)
    return Point(kind, rpm * PER_RPM, state, **known)


def branch(rpm: np.ndarray, stable: np.ndarray, *special: Point, height: float = 2e-5) -> Branch:
    state = np.tile([1e-5, height, 0.1, 0.2], (rpm.size, 1))
    size = np.where(stable, 0.5, 1.5)[:, None]
    mu = size * np.array([1.0, 0.5, 0.4, 0.1], dtype=complex)
    speed = rpm * PER_RPM
    return Branch(
        "speed", speed, speed, state, mu, stable, special, 1, ("range", "range"), np.full(rpm.size, 512), 0 * rpm
    )


@pytest.fixture(scope="module")
def found() -> SynchronousOrbits:
    """One orbit that is lost from 7000 to 12000 rpm and from 20000 rpm on, where another one is stable."""
    rpm = np.linspace(2500.0, 27500.0, 51)
    fold, doubling = point("fold", 7000.0, 1.0, 8), point("period-doubling", 12000.0, -1.0, 19)
    torus = point("Neimark-Sacker", 20000.0, np.exp(2.0j), 35)
    inner = point("fold", 9000.0, 1.0, 13, edge=False)
    stable = (rpm < 7000) | ((rpm > 12000) & (rpm < 20000))
    first = branch(rpm, stable, fold, inner, doubling, torus)
    above = np.linspace(18000.0, 27500.0, 20)
    second = branch(above, above > 0, height=9e-5)
    stretches = (
        Stretch(None, fold, 2500.0, 7000.0, 0, 0, 4, 2),
        Stretch(doubling, torus, 12000.0, 20000.0, 0, 0, 30, 20),
        Stretch(None, None, 18000.0, 27500.0, 1, 1, 3, 0),
    )
    shape = (3, 1)
    sweep = Sweep(
        speed=np.array([3000.0, 10000.0, 15000.0]) * PER_RPM,
        strobe=np.zeros((*shape, 8, 4)),
        last=np.zeros((*shape, 4)),
        block_growth=np.zeros((*shape, 1, 0)),
        peak=np.zeros(shape),
        outcome=np.zeros(shape, dtype=int),
        error=np.zeros(shape),
        doubt=np.zeros((*shape, 0)),
        scale=np.ones((3, 4)),
        discard=0,
        revolutions=8,
    )
    return SynchronousOrbits((first, second), stretches, sweep, 2, 2500.0, 27500.0)


def test_document_of_a_search(found: SynchronousOrbits):
    document = plain(orbits_document("1a", found, loss_zones(found), PUBLISHED_CASES["1a"]))
    assert document["range_rpm"] == [2500.0, 27500.0]
    assert [p["speed_rpm"] for p in document["points"]] == pytest.approx([7000, 9000, 12000, 20000])
    assert [p["edge"] for p in document["points"]] == [True, False, True, True]
    assert [p["angle_deg"] for p in document["points"]] == pytest.approx([0, 0, 180, np.degrees(2.0)])
    assert document["points"][3]["multiplier"] == pytest.approx([np.cos(2.0), np.sin(2.0)])
    assert document["points"][0]["state"] == [1e-5, 2e-5, 0.1, 0.2]
    ends = [(s["lower_kind"], s["upper_kind"], s["branch"], s["met"]) for s in document["stretches"]]
    assert ends == [
        ("range", "fold", 0, 4),
        ("period-doubling", "Neimark-Sacker", 0, 30),
        ("unknown", "range", 1, 3),
    ]
    zone = document["zones"][0]
    assert (zone["kind"], zone["onset_mechanism"], zone["exit_mechanism"]) == (
        "synchronous-loss",
        "fold",
        "period-doubling",
    )
    assert zone["width_rpm"] == pytest.approx(5000)
    edges = {e["name"]: e for e in document["edges"]}
    assert list(edges)[:2] == ["zone 1 onset", "zone 1 exit"]
    assert [(o["branch"], o["stable"]) for o in edges["zone 2 onset"]["coexisting"]][-1] == (1, True)
    assert document["published"][1] == {"zone": 2, "onset_rpm": 25500.0, "exit_rpm": None}
    assert document["missed"] == 2
    assert document["unexplained"] == []
    json.dumps(document, allow_nan=False)


def edge(name: str, rpm: float, status: str = "converged", **elasticity: float) -> Sensitivity:
    model = jc.case("1a")
    value = {n: float(v) for n, v in jc.parameters(model).items()}
    change = dict.fromkeys(value, 0.0) | elasticity
    slope = {n: e * rpm / value[n] if e else 0.0 for n, e in change.items()}
    residual = {"mass": 1e-12, "length": -3e-12, "time": 0.0}
    return Sensitivity(name, "fold", rpm, slope, change, residual, 1e-3, status, error_rpm=2e-3)


def is_png(path: str) -> bool:
    return Path(path).read_bytes().startswith(PNG)


def document(capsys: pytest.CaptureFixture[str], *arguments: str) -> dict[str, Any]:
    """The only thing that `arguments` with --json print on standard output."""
    assert main([*arguments, "--json"]) == 0
    return json.loads(capsys.readouterr().out, parse_constant=lambda name: pytest.fail(f"{name} is not JSON"))


def test_bifurcations_command(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, found: SynchronousOrbits
):
    """What a search found, to figures, columns and print."""
    asked: list[dict[str, Any]] = []
    monkeypatch.setattr(_orbits, "synchronous_orbits", lambda *a, **k: (asked.append(k | {"span": a[1:]}), found)[1])
    monkeypatch.setattr("jaxcage.report.contact_notes", lambda *_: ["One touches the land"])
    arguments = ["--first", "3000", "--last", "9000", "--count", "9", "--discard", "1500", "--out", str(tmp_path)]
    got = document(capsys, "bifurcations", "1a", *arguments)
    assert (asked[0]["count"], asked[0]["discard"]) == (9, 1500)
    assert asked[0]["span"] == pytest.approx((3000 * PER_RPM, 9000 * PER_RPM))
    assert [p["speed_rpm"] for p in got["points"]] == pytest.approx([7000, 9000, 12000, 20000])
    assert is_png(got["figure"]) and is_png(got["multipliers"])
    columns = read_columns(got["data"])
    size = np.hypot(columns["multiplier 1 (real part)"], columns["multiplier 1 (imaginary part)"])
    assert np.array_equal(columns["stable"] == 1, size < 1)
    assert columns["speed [rpm]"].size == sum(b.value.size for b in found.branches)
    assert main(["bifurcations", "1a", *arguments]) == 0
    out = capsys.readouterr().out
    assert "One touches the land" in out and "Further bifurcations, on unstable parts: 1 (listed by --json)" in out
    assert "Settled orbits that are on no branch: 2" in out


def test_zones_command(capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """A sweep and a search made by hand: the zones of both, with what the orbits say about the edges."""
    sweep = report_example.swept()
    orbits = report_example.orbits(sweep)
    asked: list[Any] = []
    monkeypatch.setattr(_sweep, "sweep", lambda model, speeds, **k: (asked.append((speeds, k)), sweep)[1])
    monkeypatch.setattr(_sweep, "synchronous_orbits", lambda *a, **k: (asked.append((a[1:], k)), orbits)[1])
    monkeypatch.setattr(_sweep, "explain", lambda found, *_: Explained(found, {}))
    monkeypatch.setattr("jaxcage.report.contact_notes", lambda *_: [])
    small = ["--count", "251", "--discard", "40", "--revolutions", "50", "--quick", "--out", str(tmp_path)]
    got = document(capsys, "zones", "1a", *small)
    (speeds, how), (span, searched) = asked
    assert speeds == pytest.approx(jc.rpm(2500, 27500, 251)) and span == pytest.approx(sweep.speed[[0, -1]])
    assert (how["discard"], how["revolutions"], searched["settled"] is sweep) == (40, 50, True)
    assert [(z["onset_rpm"], z["exit_rpm"]) for z in got["zones"]] == [(9050, 12050), (20050, None)]
    lost = got["synchronous_loss"]
    assert [z["onset_mechanism"] for z in lost] == ["fold", "Neimark-Sacker"]
    assert [z["onset_rpm"] for z in lost] == pytest.approx([7000, 20000]) and lost[0]["onset_gradient"] is None
    assert load_sweep(got["data"]).rpm == pytest.approx(sweep.rpm)


def test_gradient_command(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, found: SynchronousOrbits
):
    def sensitivities(system: Any, points: dict[str, Point], method: Any) -> dict[str, Sensitivity]:
        moved = {n: edge(n, float(p.speed_rpm), cage_mass=-0.75, guidance_gap=0.1) for n, p in points.items()}
        return moved | {"zone 2 onset": edge("zone 2 onset", float("nan"), status="no such point")}

    monkeypatch.setattr(_orbits, "synchronous_orbits", lambda *_, **__: found)
    monkeypatch.setattr(_orbits, "sensitivities", sensitivities)
    got = document(capsys, "gradient", "1a", "--out", str(tmp_path))
    assert [(e["name"], e["trusted"]) for e in got["edges"]] == [
        ("zone 1 onset", True),
        ("zone 1 exit", True),
        ("zone 2 onset", False),
    ]
    assert got["edges"][2]["speed_rpm"] is None
    assert got["width"]["elasticity"]["cage_mass"] == pytest.approx(-0.75)
    assert is_png(got["figure"])
    assert main(["gradient", "1a", "--out", str(tmp_path)]) == 0
    out = capsys.readouterr().out
    assert out.index("Zone 1 width of 1a: 5000.000 ± 0.004") < out.index("Zone 1 onset of 1a: 7000.000 ± 0.002")
    assert "Left out: zone 2 onset, fold (no such point)." in out
    assert "Zone 2 onset of 1a" not in out


def lines_through(system: Any, point: Any, x: str, y: str, **given: Any) -> Curve:
    """In place of the continuation: straight up, and none through a Neimark-Sacker bifurcation."""
    if point.kind == "Neimark-Sacker":
        raise ValueError("none there")
    height = np.linspace(given["lower"], given["upper"], 5)
    return Curve(
        kind=point.kind,
        x=x,
        y=y,
        x_value=np.full(5, point.value),
        y_value=height,
        state=np.tile(point.state, (5, 1)),
        multipliers=np.tile(point.multipliers, (5, 1)),
        genuine=np.ones(5, dtype=bool),
        ended=("range", "range"),
        name=given["name"],
    )


@pytest.fixture
def map_of_lines(monkeypatch: pytest.MonkeyPatch, found: SynchronousOrbits):
    monkeypatch.setattr(_orbits, "synchronous_orbits", lambda *_, **__: found)
    monkeypatch.setattr("jaxcage.report._map.curve", lines_through)


@pytest.mark.wide
def test_map_command(capsys: pytest.CaptureFixture[str], tmp_path: Path, map_of_lines: None):
    small = ["--first", "3000", "--last", "9000", "--rows", "2", "--columns", "3", "--revolutions", "10"]
    small += ["--discard", "10", "--steps", "64", "--starts", "2", "--lower", "0.4 mm", "--upper", "5e-4"]
    got = document(capsys, "map", "1a", *small, "--out", str(tmp_path))
    assert (got["x"], got["y"]) == ("speed", "guidance_gap")
    assert got["x_range"] == pytest.approx([3000, 9000])
    assert got["y_range"] == pytest.approx([4e-4, 5e-4])
    assert [c["name"] for c in got["curves"]] == ["zone 1 onset", "zone 1 exit"]
    assert got["refused"] == {"zone 2 onset": "Newton's method did not find it again"}
    onset = got["curves"][0]
    assert onset["x"] == pytest.approx([7000] * 5)
    assert onset["y"] == pytest.approx(np.linspace(4e-4, 5e-4, 5))
    assert is_png(got["figure"])
    assert read_columns(got["data"])["guidance_gap [mm]"][:2] == pytest.approx([0.4, 0.425])
    grid = got["exponents"]
    assert grid["x"] == pytest.approx([3000, 6000, 9000])
    model = jc.replace(jc.case("1a"), guidance_gap=5e-4)
    speeds, method = jc.rpm(3000, 9000, 3), jc.method(steps=64)
    one = jc.sweep(model, speeds, discard=10, revolutions=10, blocks=1, keep=1, method=method)
    assert grid["largest"][1] == pytest.approx(np.max(one.exponents[:, :2, 0], axis=1), rel=1e-6)
    stored = read_columns(got["exponent_data"])
    assert stored["largest exponent"][1::2] == pytest.approx(grid["largest"][1])


def test_map_without_exponents(capsys: pytest.CaptureFixture[str], tmp_path: Path, map_of_lines: None):
    arguments = ["map", "1a", "--rows", "0", "--y", "eccentricity", "--out", str(tmp_path)]
    assert main(arguments) == 0
    out = capsys.readouterr().out
    assert "Edges of 1a over speed and eccentricity" in out
    assert any(row.split()[:6] == "zone 1 onset fold 7000.00 7000.00".split() for row in out.splitlines())
    assert "18.4" in out and "28.75" in out  # 0.8 and 1.25 of 23 micrometres
    assert "Not followed: zone 2 onset (Newton's method did not find it again)" in out
    assert sorted(p.name for p in tmp_path.iterdir()) == [
        "map_1a_speed_eccentricity.csv",
        "map_1a_speed_eccentricity.png",
    ]


REFUSALS = [
    ("bifurcations 4z", "'4z' is unknown: it must be one of 1a, 1b, 2a, 2b, 3a, 3b"),
    ("bifurcations 1a --first 0", "--first must be a speed above 0 rpm, but 0 was given"),
    ("bifurcations 1a --first 9000 --last 9000", "the range is 9000 to 9000 rpm"),
    ("map 1a --y gap", "--y must be one of bore, "),
    ("map 1a --x guidance_gap", "must be two different parameters, but both are guidance_gap"),
    ("map 1a --rows 1", "--rows must be 0 or at least 2, but 1 was given"),
    ("map 1a --revolutions 0", "--revolutions must be at least 1, but 0 was given"),
    ("map 1a --starts 4", "--starts must be at most 3, but 4 was given"),
    ("map 1a --lower 0.4kg", '--lower has the unit "kg"'),
    ("map 1a --lower 0.5mm", "must have guidance_gap = 0.00045 m between them, but the range is 0.0005 to"),
]


@pytest.mark.parametrize("arguments, said", REFUSALS, ids=[a for a, _ in REFUSALS])
def test_bad_input_is_refused_before_the_search(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path, arguments: str, said: str
):
    monkeypatch.setattr(_orbits, "synchronous_orbits", lambda *_, **__: pytest.fail("the search was started"))
    assert main([*arguments.split(), "--out", str(tmp_path / "out")]) == 2
    out, err = capsys.readouterr()
    lines = [line for line in err.splitlines() if not line.startswith("Warning:")]
    assert out == "" and len(lines) == 1
    assert said in lines[0].replace("`", "")
    assert lines[0].endswith((".", ".)"))
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("command", ["bifurcations", "gradient", "map"])
def test_search_without_a_result_says_so(
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
    tmp_path: Path,
    found: SynchronousOrbits,
    command: str,
):
    nothing = SynchronousOrbits((), (), found.sweep, 0, 2500.0, 27500.0)
    monkeypatch.setattr(_orbits, "synchronous_orbits", lambda *_, **__: nothing)
    assert main([command, "1a", "--out", str(tmp_path)]) == 1
    out, err = capsys.readouterr()
    assert out == ""
    assert "No simulation between 2500 and 27500 rpm settled on a synchronous orbit" in err
    assert not any(tmp_path.iterdir())


# Case 3a: strobe states of two edges' orbits, over the scale; that of the second is beyond contact by 0.007.
CLEAR = (13190.0103, (0.39853465, -0.18250099, 0.73636913, 0.32681643))
TOUCHES = (18945.34, (0.49968944, -0.43603818, 0.58386151, 0.51114893))


@pytest.mark.wide
def test_edges_whose_orbit_touches_the_land_are_named():
    model, method = jc.case("3a"), jc.method("rodas4", steps=512)
    edges = {}
    for name, (rpm, scaled) in (("zone 1 exit", CLEAR), ("zone 2 onset", TOUCHES)):
        speed = rpm * np.pi / 30
        state = np.array(scaled) * [float(c) for c in model.scale(speed)]
        edges[name] = Point("Neimark-Sacker", speed, state, steps=8192, error=0.3 * np.pi / 30)
    (sentence,) = contact_notes(model, edges, method)
    assert sentence.startswith(
        "Zone 2 onset: its orbit touches the land (eps 0.977, contact from 0.97); by half of its "
    )
    assert sentence.endswith(" 8192 steps it is 0.3 rpm away")
    assert touching(model, edges, method)["zone 2 onset"] == pytest.approx(0.97666, abs=2e-4)
