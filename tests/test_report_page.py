"""The report: verdicts, sources of values, the page's words and tables, and the command at a small size."""

import dataclasses
import html.parser
import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers import declared
from report_example import findings, swept

import jaxcage as jc
from jaxcage.analysis import Edge, Zone, Zones
from jaxcage.cli import _page as _command, main
from jaxcage.report import (
    AllFailed,
    Findings,
    Operating,
    _findings,
    _page,
    calmest,
    chaotic_verdict,
    examine,
    loss_verdict,
    page,
    parameter_rows,
    read_operating,
)


PER_RPM = np.pi / 30


@pytest.fixture(scope="module")
def example() -> Findings:
    return findings()


@pytest.fixture
def without_figures(monkeypatch: pytest.MonkeyPatch) -> None:
    """They take seconds, and other tests look at them."""
    monkeypatch.setattr(_page, "pictures", lambda *_: {})


@pytest.fixture(scope="module")
def text(example: Findings) -> str:
    return page(example, read_operating("8500, 12500-15000"), command="jaxcage report 1a")


@pytest.mark.parametrize(
    "text, expected",
    [
        ("8500", [(8500.0, 8500.0)]),
        ("8500 rpm, 12000-15000", [(8500.0, 8500.0), (12000.0, 15000.0)]),
        ("12000 to 15000 rpm", [(12000.0, 15000.0)]),
        ("12000–15000", [(12000.0, 15000.0)]),
        ("900 rad/s", [(900 / PER_RPM, 900 / PER_RPM)]),
        ("900 to 1200 rad/s", [(900 / PER_RPM, 1200 / PER_RPM)]),
        ("900 rad/s - 12000 rpm", [(900 / PER_RPM, 12000.0)]),
        ("", []),
    ],
)
def test_operating_speeds_are_read(text: str, expected: list[tuple[float, float]]):
    found = [(at.low_rpm, at.high_rpm) for at in read_operating(text)]
    assert [x for pair in found for x in pair] == pytest.approx([x for pair in expected for x in pair], rel=1e-12)


@pytest.mark.parametrize(
    "text, said",
    [
        ("fast", '"fast" was given'),
        ("8500 mm", 'has the unit "mm"'),
        ("140 Hz", "is in Hz"),
        ("15000-12000", "ranges that grow"),
        ("0", "speeds above 0"),
        ("8500; 9000", '"8500; 9000" was given'),
    ],
)
def test_operating_speeds_that_make_no_sense(text: str, said: str):
    with pytest.raises(ValueError, match=re.escape(said)):
        read_operating(text)


ZONES = (
    Zone("chaotic", Edge(9000.0, 100.0, "chaotic"), Edge(12000.0, 0.001, "chaotic", "fold", "located"), 1.0),
    Zone("chaotic", Edge(20000.0, 100.0, "chaotic"), None, 1.0),
)


@pytest.mark.parametrize(
    "low, high, state, away, percent",
    [
        (10000.0, 10000.0, "inside", 1000.0, 10.0),
        (8000.0, 8000.0, "clear", 1000.0, 12.5),
        (8800.0, 8800.0, "close", 200.0, 200 / 88),
        (8000.0, 8800.0, "close", 200.0, 200 / 88),
        (8000.0, 9500.0, "partly inside", 0.0, 0.0),
        (12500.0, 15000.0, "close", 500.0, 4.0),
        (13000.0, 15000.0, "clear", 1000.0, 1000 / 130),
        (25000.0, 25000.0, "inside", 5000.0, 20.0),
        (8000.0, 22000.0, "partly inside", 0.0, 0.0),
    ],
)
def test_verdicts(low: float, high: float, state: str, away: float, percent: float):
    zones = Zones(ZONES, (), 100.0, 500.0)
    for v in (
        chaotic_verdict(Operating(low, high), zones, swept()),
        loss_verdict(Operating(low, high), ZONES, 2500.0, 27500.0, True),
    ):
        assert v.state == state
        assert (v.distance_rpm, v.percent) == pytest.approx((away, percent))


def test_nothing_is_said_of_speeds_that_were_not_swept_or_failed():
    zones, sweep = Zones(ZONES, (), 100.0, 500.0), swept()
    assert chaotic_verdict(Operating(2000.0, 2000.0), zones, sweep).state == "unknown"
    assert chaotic_verdict(Operating(15000.0, 28000.0), zones, sweep).state == "unknown"
    assert loss_verdict(Operating(15000.0, 28000.0), ZONES, 2500.0, 27500.0, True).state == "unknown"
    assert loss_verdict(Operating(15000.0, 15000.0), (), 2500.0, 27500.0, False).state == "unknown"
    lost = np.zeros_like(sweep.outcome)
    lost[125] = 1  # 15000 rpm
    broken = dataclasses.replace(sweep, outcome=lost)
    assert chaotic_verdict(Operating(15000.0, 15000.0), zones, sweep).state == "clear"
    assert chaotic_verdict(Operating(15000.0, 15000.0), zones, broken).state == "unknown"
    assert chaotic_verdict(Operating(14000.0, 16000.0), zones, broken).state == "unknown"
    assert chaotic_verdict(Operating(14000.0, 14000.0), zones, broken).state == "clear"
    assert chaotic_verdict(Operating(10000.0, 16000.0), zones, broken).state == "partly inside"


def test_calmest_range_is_outside_both_kinds(example: Findings):
    assert calmest(example) == pytest.approx((12050.0, 20000.0))  # chaos ends at 12050, the orbit is lost at 20000


def test_sources_of_a_published_case():
    rows = {row.path: row for row in parameter_rows(jc.case("1a"), None)}
    assert len(rows) == len(list(declared(jc.case("1a"))))
    assert rows[("guidance_gap",)].source == "paper, Table 2"
    assert (rows[("guidance_gap",)].value, rows[("guidance_gap",)].unit) == ("0.45", "mm")
    assert (rows[("eccentricity",)].value, rows[("eccentricity",)].unit) == ("23", "µm")
    assert rows[("bearing", "bore")].source == "paper, Table 1"
    assert rows[("bearing", "inner_raceway_diameter")].source == "catalogue"
    assert rows[("cage_mass",)].source == "identified, not printed"
    assert rows[("lubricant", "temperature")].value == "40"
    assert rows[("gravity",)].source == "default"


class Reader(html.parser.HTMLParser):
    """Collects what a page is made of, and complains of tags that are not closed."""

    VOID = {"meta", "img", "link", "br"}

    def __init__(self) -> None:
        super().__init__()
        self.open: list[str] = []
        self.images: list[dict[str, Any]] = []
        self.addresses: list[str] = []
        self.ids: list[str] = []
        self.tags: set[str] = set()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        named = dict(attrs)
        self.tags.add(tag)
        if tag not in self.VOID:
            self.open.append(tag)
        if tag == "img":
            self.images.append(named)
        self.addresses += [v for k, v in named.items() if k in ("src", "href", "action", "data", "srcset") and v]
        if (name := named.get("id")) is not None:
            self.ids.append(name)

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag


def test_page_is_well_formed_and_needs_nothing_from_outside(text: str):
    reader = Reader()
    reader.feed(text)
    assert reader.open == []
    assert len(reader.ids) == len(set(reader.ids))
    assert not reader.tags & {"script", "link", "iframe", "object", "embed", "form"}
    inside = [a for a in reader.addresses if a.startswith("#")]
    assert {a[1:] for a in inside} <= set(reader.ids)
    assert all(a.startswith(("#", "data:image/svg+xml;base64,")) for a in reader.addresses)
    assert "url(" not in text and "@import" not in text
    assert 'id="known"' not in text  # of the cage of a paper nothing is known within ranges only
    assert "default-src 'none'" in text
    assert all(len(image["alt"]) > 20 for image in reader.images)
    assert len(reader.images) == 2 * 7  # light and dark
    assert len(text.encode()) < 5e6


def plain(text: str) -> str:
    """The words of the page in one line."""
    return " ".join(re.sub(r"<[^>]*>", " ", re.sub(r"<style>.*?</style>", "", text, flags=re.S)).split())


def test_page_says_what_was_found(text: str):
    words = plain(text)
    assert "Two chaotic zones and two zones without a stable synchronous orbit" in words
    assert "widest range outside all zones goes from 12050 to 20000 rpm" in words
    ratio = (1 - 16 / 81) / 2
    assert f"8500 rpm (shaft {8500 / ratio:.0f} rpm): inside synchronous-loss zones, clear of chaotic zones" in words
    assert "12500 to 15000 rpm" in words and "zone 1 exit, 12000.00 rpm (period-doubling)" in words
    assert "identified, not printed" in words and "paper, Table 2" in words
    assert "Against the published edges" in words and "−0.5 %" in words  # 9050 beside 9100
    assert "jaxcage report 1a" in words
    assert "What moves the edges" in words and "bearing outside diameter" in words


def test_quick_page_leaves_out_gradients_and_says_so(without_figures: None):
    words = plain(page(findings(quick=True)))
    assert "quick report: no gradients" in words
    assert "What moves the edges" not in words and "Operating speeds" not in words
    assert "not tried" in words


def test_words_of_a_file_cannot_break_the_page(without_figures: None, example: Findings):
    nasty = dataclasses.replace(example, name="<script>alert(1)</script>", published=None)
    text = page(nasty, command="jaxcage report '<i>.toml'")
    assert "<script>" not in text and "<i>" not in text
    assert "&lt;script&gt;" in text


def test_command(
    without_figures: None,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
    tmp_path: Path,
    example: Findings,
):
    asked: dict[str, Any] = {}

    def examine(*arguments: Any, **options: Any) -> Findings:
        asked.update(options)
        return example

    monkeypatch.setattr(_command.report, "examine", examine)
    arguments = ["report", "1a", "--quick", "--operating", "8500, 900 rad/s", "--first", "250 rad/s"]
    assert main([*arguments, "--out", str(tmp_path), "--json"]) == 0
    out, err = capsys.readouterr()
    document = json.loads(out, parse_constant=lambda name: pytest.fail(f"{name} is not JSON"))
    assert asked["speeds"].size == 126 and asked["quick"] is True
    assert asked["speeds"][0] == pytest.approx(250.0)
    assert [j["synchronous-loss"]["state"] for j in document["operating"]] == ["inside", "inside"]
    assert document["operating"][1]["low_rpm"] == pytest.approx(900 / PER_RPM)
    written = Path(document["report"]).read_text(encoding="utf-8")
    assert document["bytes"] == len(written.encode()) < 5e6
    assert document["report"] == str(tmp_path / "report_1a.html")
    assert written.startswith("<!DOCTYPE html>")
    assert main([*arguments, "--out", str(tmp_path)]) == 0
    out = capsys.readouterr().out
    assert "Operating speeds" in out and "Synchronous-loss zones of 1a" in out and "Chaotic zones of 1a" in out


@pytest.mark.parametrize(
    "arguments, said",
    [
        ("--operating fast", "Option --operating must be speeds"),
        ("--first 9000 --last 8000", "the range is 9000 to 8000 rpm"),
        ("--count 1", "--count must be at least 2, but 1 was given"),
        ("--revolutions 37", "--revolutions must be a multiple of 10"),
        ("--discard 2.5", "must be a whole number"),
    ],
)
def test_bad_input(capsys: pytest.CaptureFixture[str], tmp_path: Path, arguments: str, said: str):
    assert main(["report", "1a", *arguments.split(), "--out", str(tmp_path / "out")]) == 2
    out, err = capsys.readouterr()
    assert out == "" and said in err and "Traceback" not in err
    assert not (tmp_path / "out").exists()


def test_nothing_is_reported_when_every_simulation_failed(monkeypatch: pytest.MonkeyPatch):
    lost = dataclasses.replace(swept(), outcome=np.ones((251, 3), dtype=int))
    monkeypatch.setattr(_findings, "sweep", lambda *_, **__: lost)
    common: dict[str, Any] = {"discard": 300, "revolutions": 300, "blocks": 20, "sweep_method": None}
    with pytest.raises(AllFailed, match="753"):
        examine("1a", jc.case("1a"), None, speeds=lost.speed, orbit_method=jc.method(), **common)
