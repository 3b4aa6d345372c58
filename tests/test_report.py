"""The report: verdicts, sources of values, the page's words and tables, and the page in a real browser."""

import dataclasses
import html.parser
import re
import shutil
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from report_example import RATIO, orbits, sections, swept

import jaxcage as jc
from jaxcage.cli.options import read_range
from jaxcage.cli.orbit_commands import of_orbits
from jaxcage.cli.subject import read_case
from jaxcage.show import page


PER_RPM = np.pi / 30


@pytest.fixture(scope="module")
def text() -> str:
    at = 12500 * PER_RPM, 15000 * PER_RPM
    return page("Case 1a", "A bearing", sections(), sweep=swept(), operating=at, command="jaxcage report 1a")


def test_an_orbit_that_is_nowhere_stable_is_no_stable_one():
    found = dataclasses.replace(orbits(swept()), stretches=())
    said = of_orbits(read_case("1a"), found, jc.unstable_ranges(found)).sentence
    assert said == "No synchronous orbit that was found is stable."


@pytest.mark.parametrize(
    "text, expected",
    [
        ("12000 to 15000", (12000.0, 15000.0)),
        ("900 rad/s - 12000 rpm", (900 / PER_RPM, 12000.0)),
        ("20000–24000 rpm shaft", (20000.0, 24000.0)),
        ("20000 .. 24000 rpm shaft", (20000.0, 24000.0)),
    ],
)
def test_an_operating_range_is_read(text: str, expected: tuple[float, float]):
    found = read_range(text)
    assert found == pytest.approx(expected, rel=1e-12)
    assert [getattr(end, "whose", None) for end in found] == ["shaft" if "shaft" in text else None] * 2
    cage, _ = read_case("1a").operating(found)[1]
    assert cage == pytest.approx(expected[0] * (RATIO if "shaft" in text else 1) * PER_RPM)


@pytest.mark.parametrize(
    "text, said",
    [
        ("8500 mm", 'has the unit "mm"'),
        ("140-150 Hz", "is in Hz"),
        ("15000-12000", "must be two speeds above 0, the lower one first"),
        ("8500", "must be two speeds"),
        ("0-100", "above 0"),
        ("20000 rpm shaft - 9000 rpm cage", "names both cage and shaft"),
    ],
)
def test_operating_ranges_that_make_no_sense(text: str, said: str):
    with pytest.raises(ValueError, match=re.escape(said)):
        read_range(text)


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
    """Return what a script measures in the page: the page itself forbids scripts, so its rule is lifted in a copy."""
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
