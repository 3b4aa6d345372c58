"""The report in a real browser: no complaint, no request, every figure drawn; skipped where there is no chromium."""

import functools
import html.parser
import re
import shutil
import subprocess
from pathlib import Path

import matplotlib.image
import numpy as np
import pytest
from report_example import findings

from jaxcage.report import page, read_operating


CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
pytestmark = [
    pytest.mark.wide,
    pytest.mark.skipif(CHROMIUM is None, reason="there is no chromium here to look at the report"),
]
WIDTH, HEIGHT = 1280, 6000
QUIET = (
    "--headless --no-sandbox --disable-gpu --disable-quic --no-first-run --disable-background-networking "
    "--disable-component-update --disable-sync --disable-extensions --hide-scrollbars --enable-logging=stderr --v=0"
).split() + ["--host-resolver-rules=MAP * ~NOTFOUND"]  # the browser itself would call its maker
DARK = "--blink-settings=preferredColorScheme=0"
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


def browse(folder: Path, file: Path, *options: str) -> subprocess.CompletedProcess[str]:
    """Have the browser open a file, with a profile of its own."""
    assert CHROMIUM is not None
    profile = f"--user-data-dir={folder / 'profile'}"
    command = [CHROMIUM, *QUIET, profile, f"--window-size={WIDTH},{HEIGHT}", *options, file.as_uri()]
    return subprocess.run(command, capture_output=True, text=True, timeout=240, check=True)


@pytest.fixture(scope="module")
def report(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("report") / "report_1a.html"
    path.write_text(page(findings(), read_operating("8500, 12500-15000"), command="jaxcage report 1a"))
    return path


@pytest.fixture(scope="module")
def measured(report: Path) -> list[str]:
    """What a script measures in the page: the page itself forbids scripts, so its rule is lifted in a copy."""
    text, changed = re.subn(r'<meta http-equiv="Content-Security-Policy"[^>]*>', MEASURE, report.read_text())
    assert changed == 1
    copy = report.with_name("measured.html")
    copy.write_text(text)
    (title,) = re.findall(r"<title>(MEASURED.*?)</title>", browse(report.parent, copy, "--dump-dom").stdout)
    return title.split("|")[1:]


def boxes(measured: list[str]) -> dict[str, tuple[float, ...]]:
    """Place and size of each figure that is shown: left, top, width, height [px]."""
    rows = [row.split(",") for row in measured[2:]]
    assert all(row[1] == "true" for row in rows), rows
    return {row[0]: tuple(map(float, row[2:])) for row in rows}


def shot(report: Path, name: str, *options: str) -> np.ndarray:
    """The page as pixels, 0 to 255."""
    path = report.with_name(name)
    done = browse(report.parent, report, f"--screenshot={path}", *options)
    complaints = [line for line in done.stderr.splitlines() if "CONSOLE" in line]
    assert complaints == []
    return np.rint(255 * matplotlib.image.imread(path)[..., :3]).astype(int)


def test_every_figure_is_shown_and_fits(measured: list[str]):
    found = boxes(measured)
    assert set(found) == {
        f"fig-{key}" for key in ("strip", "orbits", "branches", "multipliers", "map", "elasticities", "statics")
    }
    assert all(width > 400 and height > 100 for _, _, width, height in found.values())
    assert float(measured[0]) <= WIDTH  # nothing sticks out to the right


def test_nothing_is_asked_for_from_outside(report: Path, measured: list[str]):
    """Every address is in the page or the page itself; the browser lists no resource that it loaded beside it."""
    addresses = Addresses.of(report.read_text())
    assert len(addresses) > 14 and all(a.startswith(("#", "data:image/svg+xml;base64,")) for a in addresses)
    asked = [name for name in measured[1].split(" ") if name and not name.startswith("data:")]
    assert asked == []
    assert report.stat().st_size < 5e6


class Addresses(html.parser.HTMLParser):
    """Everything that a page points to."""

    def __init__(self) -> None:
        super().__init__()
        self.found: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.found += [v for k, v in attrs if v and k in ("src", "href", "srcset", "data", "action", "poster")]

    @classmethod
    def of(cls, text: str) -> list[str]:
        reader = cls()
        reader.feed(text)
        return reader.found


@pytest.mark.parametrize("scheme, options", [("light", ()), ("dark", (DARK,))])
def test_figures_are_not_blank_in_either_scheme(
    report: Path, measured: list[str], scheme: str, options: tuple[str, ...]
):
    image = shot(report, f"{scheme}.png", *options)
    paper = {"light": (255, 255, 255), "dark": (0x15, 0x18, 0x1D)}[scheme]
    assert image.shape[:2] == (HEIGHT, WIDTH)
    assert tuple(image[5, 5]) == paper
    cut = functools.partial(_inside, image)
    for name, (left, top, width, height) in boxes(measured).items():
        if top + height > HEIGHT:
            continue
        part = cut(left, top, width, height)
        drawn = np.any(np.abs(part - np.array(paper)) > 24, axis=-1)
        assert 0.005 < np.mean(drawn) < 0.9, name
        assert len(np.unique(part.reshape(-1, 3), axis=0)) > 20, name  # more than a frame


def _inside(image: np.ndarray, left: float, top: float, width: float, height: float) -> np.ndarray:
    return image[int(top) : int(top + height), int(left) : int(left + width)]


def test_it_prints(report: Path):
    path = report.with_name("report.pdf")
    browse(report.parent, report, f"--print-to-pdf={path}", "--no-pdf-header-footer")
    pages = len(re.findall(rb"/Type\s*/Page\b", path.read_bytes()))
    assert 4 <= pages <= 14
