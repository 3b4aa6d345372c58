"""The report: verdicts, sources of values, the page's words and tables, and the page in a real browser."""

import html.parser
import re
import shutil
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from report_example import RATIO, sections, swept

import jaxcage as jc
from jaxcage.analysis import Edge, Zone, Zones
from jaxcage.show import Operating, calmest, page, read_operating
from jaxcage.show.operating_speeds import chaotic_verdict, unstable_verdict


PER_RPM = np.pi / 30


@pytest.fixture(scope="module")
def text() -> str:
    at = read_operating("8500, 12500-15000", jc.case("1a"))
    return page("Case 1a", "A bearing", sections(), sweep=swept(), operating=at, command="jaxcage report 1a")


@pytest.mark.parametrize(
    "text, expected",
    [
        ("8500 rpm, 12000 to 15000", [(8500.0, 8500.0), (12000.0, 15000.0)]),
        ("900 rad/s - 12000 rpm", [(900 / PER_RPM, 12000.0)]),
        ("20000–24000 rpm shaft", [(20000 * RATIO, 24000 * RATIO)]),
        ("", []),
    ],
)
def test_operating_speeds_are_read(text: str, expected: list[tuple[float, float]]):
    found = [(at.low_rpm, at.high_rpm) for at in read_operating(text, jc.case("1a"))]
    assert [x for pair in found for x in pair] == pytest.approx([x for pair in expected for x in pair], rel=1e-12)


@pytest.mark.parametrize(
    "text, said",
    [
        ("8500 mm", 'has the unit "mm"'),
        ("140 Hz", "is in Hz"),
        ("15000-12000", "ranges that grow"),
        ("0", "speeds above 0"),
        ("20000 rpm shaft - 9000 rpm cage", "names both cage and shaft"),
    ],
)
def test_operating_speeds_that_make_no_sense(text: str, said: str):
    with pytest.raises(ValueError, match=re.escape(said)):
        read_operating(text, jc.case("1a"))


ZONES = (
    Zone("chaotic", Edge(9000.0, 100.0, "chaotic"), Edge(12000.0, 0.001, "chaotic", "fold", "located"), 1.0),
    Zone("chaotic", Edge(20000.0, 100.0, "chaotic"), None, 1.0),
)


@pytest.mark.parametrize(
    "low, high, state, away, percent",
    [
        (10000.0, 10000.0, "inside", 1000.0, 10.0),
        (8000.0, 8000.0, "clear", 1000.0, 12.5),
        (8000.0, 8800.0, "close", 200.0, 200 / 88),
        (8000.0, 9500.0, "partly inside", 0.0, 0.0),
        (25000.0, 25000.0, "inside", 5000.0, 20.0),
    ],
)
def test_verdicts(low: float, high: float, state: str, away: float, percent: float):
    zones = Zones(ZONES, (), 100.0, 500.0)
    for v in (
        chaotic_verdict(Operating(low, high), zones, swept()),
        unstable_verdict(Operating(low, high), ZONES, 2500.0, 27500.0, True),
    ):
        assert v.state == state and (v.distance_rpm, v.percent) == pytest.approx((away, percent))


def test_nothing_is_said_of_speeds_that_were_not_swept_or_failed():
    zones, sweep = Zones(ZONES, (), 100.0, 500.0), swept()
    state = lambda low, high, sweep=sweep: chaotic_verdict(Operating(low, high), zones, sweep).state
    assert state(2000.0, 2000.0) == state(15000.0, 28000.0) == "unknown"
    assert unstable_verdict(Operating(15000.0, 28000.0), ZONES, 2500.0, 27500.0, True).state == "unknown"
    lost = sweep["label"].copy()
    lost[125] = "failed"  # 15000 rpm
    broken = sweep.assign(label=lost)
    assert state(15000.0, 15000.0) == "clear" and state(14000.0, 14000.0, broken) == "clear"
    assert state(15000.0, 15000.0, broken) == state(14000.0, 16000.0, broken) == "unknown"


def test_calmest_range_is_outside_all_zones():
    loss = Zone("unstable", Edge(7000.0, 0.1, "fold"), Edge(19000.0, 0.1, "fold"), 1.0)
    assert calmest(ZONES, 2500.0, 27500.0) == (12000.0, 20000.0)
    assert calmest((*ZONES, loss), 2500.0, 27500.0) == (2500.0, 7000.0) and calmest(ZONES, 21000.0, 27500.0) is None


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
    assert reader.open == [] and len(reader.ids) == len(set(reader.ids))
    assert not reader.tags & {"script", "link", "iframe", "object", "embed", "form"}
    assert {a[1:] for a in reader.addresses if a.startswith("#")} <= set(reader.ids)
    assert all(a.startswith(("#", "data:image/svg+xml;base64,")) for a in reader.addresses)
    assert "url(" not in text and "@import" not in text and "default-src 'none'" in text
    assert all(len(image["alt"]) > 20 for image in reader.images)
    assert len(reader.images) == 4
    assert len(text.encode()) < 5e6


def test_page_says_what_was_found(text: str):
    words = " ".join(re.sub(r"<[^>]*>", " ", re.sub(r"<style>.*?</style>", "", text, flags=re.S)).split())
    assert "Unstable ranges of the synchronous orbit of 1a" in words and f"{12000 / RATIO:.2f}" in words
    assert "2 zones of chaos." in words and "jaxcage report 1a" in words


def test_words_of_a_file_cannot_break_the_page():
    name = "<script>alert(1)</script>"
    text = page(name, name, sections(name), sweep=swept(), command="jaxcage report '<i>.toml'")
    assert "<script>" not in text and "<i>" not in text and "&lt;script&gt;" in text


# In a browser: no complaint, no request, every figure drawn.

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
WIDTH, HEIGHT = 1280, 6000
QUIET = (
    "--headless --no-sandbox --disable-gpu --disable-quic --no-first-run --disable-background-networking "
    "--disable-component-update --disable-sync --disable-extensions --hide-scrollbars --enable-logging=stderr --v=0"
).split() + ["--host-resolver-rules=MAP * ~NOTFOUND"]  # the browser itself would call its maker
MEASURE = """<script>
addEventListener("load", () => {
  const boxes = [...document.images].filter(i => getComputedStyle(i).display !== "none").map(i => {
    const b = i.getBoundingClientRect();
    return [i.parentNode.id, i.complete && i.naturalWidth > 0, b.left, b.top, b.width, b.height].join(",");
  });
  const wide = document.documentElement.scrollWidth;
  const asked = performance.getEntriesByType("resource").map(r => r.name.slice(0, 80)).join(" ").replaceAll(";", ",");
  document.title = ["MEASURED", wide, asked, ...boxes].join("|");
});
</script>"""


def browser_test(test):
    return pytest.mark.wide(pytest.mark.skipif(CHROMIUM is None, reason="there is no chromium here")(test))


def browse(file: Path, *options: str) -> subprocess.CompletedProcess[str]:
    """Have the browser open a file, with a profile of its own."""
    profile = f"--user-data-dir={file.parent / 'profile'}"
    command = [str(CHROMIUM), *QUIET, profile, f"--window-size={WIDTH},{HEIGHT}", *options, file.as_uri()]
    return subprocess.run(command, capture_output=True, text=True, timeout=240, check=True)


@pytest.fixture(scope="module")
def report(tmp_path_factory: pytest.TempPathFactory, text: str) -> Path:
    path = tmp_path_factory.mktemp("report") / "report_1a.html"
    path.write_text(text)
    return path


@pytest.fixture(scope="module")
def measured(report: Path) -> list[str]:
    """What a script measures in the page: the page itself forbids scripts, so its rule is lifted in a copy."""
    text, changed = re.subn(r'<meta http-equiv="Content-Security-Policy"[^>]*>', MEASURE, report.read_text())
    assert changed == 1
    copy = report.with_name("measured.html")
    copy.write_text(text)
    (title,) = re.findall(r"<title>(MEASURED.*?)</title>", browse(copy, "--dump-dom").stdout)
    return title.split("|")[1:]


def boxes(measured: list[str]) -> dict[str, tuple[float, ...]]:
    """Place and size of each figure that is shown: left, top, width, height [px]."""
    rows = [row.split(",") for row in measured[2:]]
    assert all(row[1] == "true" for row in rows), rows
    return {row[0]: tuple(map(float, row[2:])) for row in rows}


@browser_test
def test_every_figure_is_shown_and_fits_and_nothing_is_loaded(measured: list[str]):
    found = boxes(measured)
    assert set(found) == {f"fig-zones-{name}" for name in ("orbits", "branches", "multipliers", "elasticities")}
    assert all(width > 400 and height > 100 for _, _, width, height in found.values())
    assert float(measured[0]) <= WIDTH  # nothing sticks out to the right
    assert [name for name in measured[1].split(" ") if name and not name.startswith("data:")] == []
