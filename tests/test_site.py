"""The documentation site is built without a warning, and has every public name, equation and figure."""

import json
import pathlib
import re
import subprocess
import sys

import pytest

import jaxcage


pytest.importorskip("mkdocs", reason="the site needs `.[docs]`")
pytestmark = pytest.mark.wide
ROOT = pathlib.Path(__file__).parent.parent
LAYERS = sorted(p.parent.name for p in (ROOT / "jaxcage").glob("*/__init__.py"))
NOTEBOOKS = sorted(p.stem for p in ROOT.glob("experiments/*.ipynb"))


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> pathlib.Path:
    folder = tmp_path_factory.mktemp("site")
    command = [sys.executable, "-m", "mkdocs", "build", "--strict", "--quiet", "--site-dir", str(folder)]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr[-3000:]
    return folder


def anchors(page: pathlib.Path) -> set[str]:
    return set(re.findall(r'id="([^"]+)"', page.read_text()))


@pytest.mark.parametrize("layer", LAYERS)
def test_every_name_of_a_layer_is_in_its_reference(site: pathlib.Path, layer: str):
    text = (ROOT / "jaxcage" / layer / "__init__.py").read_text()
    names = set(re.findall(r"\b([A-Za-z]\w*) as \1\b", text)) | set(re.findall(r"^([A-Z]\w*)\b.*=", text, re.M))
    assert names and {f"jaxcage.{layer}.{name}" for name in names} <= anchors(site / "api" / f"{layer}.html")


def test_every_name_of_the_package_is_in_its_reference(site: pathlib.Path):
    modules = {name for name in dir(jaxcage) if isinstance(getattr(jaxcage, name), type(jaxcage))}
    names = {name for name in dir(jaxcage) if not name.startswith("_")} - modules - {"TYPE_CHECKING"}
    found = anchors(site / "api" / "jaxcage.html")
    assert len(names) > 40 and {f"jaxcage.{name}" for name in names} <= found


def test_every_equation_is_drawn(site: pathlib.Path):
    pages = {p.name: p.read_text() for p in site.glob("*.html")}
    assert pages["theory.html"].count('display="block"') >= 12
    assert all('class="arithmatex"' not in text and "\\frac" not in text for text in pages.values())


@pytest.mark.parametrize("name", NOTEBOOKS)
def test_every_notebook_shows_its_figures(site: pathlib.Path, name: str):
    cells = json.loads((ROOT / "experiments" / f"{name}.ipynb").read_text())["cells"]
    pictures = [o for c in cells for o in c.get("outputs", ()) if "image/png" in o.get("data", {})]
    shown = re.findall(rf'<img [^>]*src="({name}_\d+\.png)"', (site / "gallery" / f"{name}.html").read_text())
    assert len(shown) == len(pictures) > 0 and all((site / "gallery" / file).stat().st_size > 5000 for file in shown)


def test_a_page_loads_nothing_from_elsewhere(site: pathlib.Path):
    loaded = [
        tag
        for page in site.rglob("*.html")
        for tag in re.findall(r"<(?:script|img|link|iframe)\b[^>]*>", page.read_text())
        if re.search(r'(?:src|href)="(?:https?:)?//', tag)
    ]
    assert loaded == []


def test_what_commands_printed_stands_on_the_pages_that_show_it(site: pathlib.Path):
    """Blocks of the README on other pages, and the pages that commands write."""
    assert "Chaotic zones of 1a [rpm]" in (site / "tutorial.html").read_text()
    assert "sweep_1a.png" in (site / "index.html").read_text() and (site / "figures" / "sweep_1a.png").exists()
    for page in ("validation", "speed", "orbits"):
        assert "made with jaxcage" in re.sub(r"<[^>]*>", "", (site / f"{page}.html").read_text()), page
    assert not [p for p in site.rglob("*.html") if "<!-- shown:" in p.read_text()]
