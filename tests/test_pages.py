"""The code of README and pages runs, its numbers hold; blocks that a command makes have their entries."""

import contextlib
import io
import pathlib
import re
from collections import Counter

import jax
import numpy as np
import pytest
from literature import DUFFING_DOUBLINGS, EXPONENTS

from benchmarks import pages


ROOT = pathlib.Path(__file__).parent.parent
README = (ROOT / "README.md").read_text()
PAGES = {p.stem: p.read_text() for p in sorted((ROOT / "docs").glob("*.md"))}


def run_blocks(page: str) -> tuple[dict, str]:
    """Return what the Python blocks of a page leave behind, run in order, and what they print."""
    space: dict = {}
    out = io.StringIO()
    with contextlib.redirect_stdout(out):
        for block in re.findall(r"```python\n(.*?)```", page, flags=re.S):
            exec(compile(block, "<page>", "exec"), space)
    return space, out.getvalue()


@pytest.mark.wide
def test_python_blocks_of_the_readme():
    space, text = run_blocks(README)
    assert "at a resolution of 500 rpm" in text
    assert float(space["slope"].guidance_gap) < 0 < float(space["slope"].eccentricity)


@pytest.mark.wide
@pytest.mark.parametrize("name", [name for name, page in PAGES.items() if "```python" in page])
def test_python_blocks_of_the_pages(name: str, tmp_path: pathlib.Path, monkeypatch: pytest.MonkeyPatch):
    """Each page runs by itself, in a folder of its own."""
    monkeypatch.chdir(tmp_path)
    space, _ = run_blocks(PAGES[name])
    PROMISED.get(name, lambda space: None)(space)


def ueda(space: dict) -> None:
    per_time = float(space["got"].exponents[0, :, 0].mean()) / (2 * np.pi)
    error = float(space["got"].standard_error.max()) / (2 * np.pi)
    printed = EXPONENTS["Ueda x'' + .05 x' + x^3 = 7.5 sin t"]
    assert per_time == pytest.approx(printed.value, abs=printed.tolerance + 2 * error)
    assert float(space["force"]) == pytest.approx(DUFFING_DOUBLINGS[1][1].value, abs=1e-7)
    assert float(space["slope"].acceleration.cubic / space["force"]) == pytest.approx(-0.5, abs=1e-9)


def drag(space: dict) -> None:
    assert space["orbit"].converged and float(jax.grad(space["growth"])(2.0)) < 0


PROMISED = {"python": ueda, "own-force": drag}
"""Check of what the text of a page says of its code."""


def test_set_up_commands_are_those_of_the_check():
    check = (ROOT / ".ci" / "run").read_text()
    for command in ("python -m pip install . && jaxcage sweep 1a", 'python -m pip install -e ".[test]" && pytest'):
        assert command in README
        assert command.split(" sweep")[0] in check


def test_toml_of_the_pages_is_accepted(tmp_path: pathlib.Path):
    from jaxcage.files import load_model

    blocks = re.findall(r"```toml\n(.*?)```", "\n".join(PAGES.values()), flags=re.S)
    cage, whole, dimensions = sorted(blocks, key=lambda block: ("bore" in block, "nu2310" in block))
    path = tmp_path / "bearing.toml"
    path.write_text(whole)
    assert float(load_model(path).load) == 1000.0
    path.write_text(cage)
    model = load_model(path)
    assert float(model.guidance_gap) == pytest.approx(0.5e-3)
    assert float(model.lubricant.temperature) == pytest.approx(343.15)
    short = ROOT / "jaxcage" / "files" / "short_template.toml"
    path.write_text(short.read_text().replace('[bearing]\ndesignation = "NU2310"', dimensions))
    assert load_model(path).bearing.n_rollers == 13 and 'designation = "' not in path.read_text()


@pytest.mark.parametrize("page", ["README.md", "CONTRIBUTING.md", *(f"docs/{name}.md" for name in PAGES)])
def test_files_that_pages_point_to_exist(page: str):
    for target in re.findall(r"\]\((?!http)([^)#]+)\)", (ROOT / page).read_text()):
        assert ((ROOT / page).parent / target).exists(), target


FOUND = {
    str(path.relative_to(pages.ROOT)): path.read_text(encoding="utf-8")
    for path in (pages.ROOT / "README.md", *sorted((pages.ROOT / "docs").glob("*.md")))
}


def test_every_marked_block_has_an_entry_and_every_entry_a_block():
    marks = Counter((name, page) for page, text in FOUND.items() for name in re.findall("<!-- made: (.*?) -->", text))
    assert marks == Counter((name, page) for name, (page, _, _) in pages.BLOCKS.items())


@pytest.mark.parametrize("page", sorted({page for page, _, _ in pages.BLOCKS.values()}))
def test_marks_are_closed_and_the_page_says_once_with_which_version_it_was_made(page: str):
    text = FOUND[page]
    whole = re.findall("<!-- made: (?:(?!<!-- made: ).)*?\n<!-- end -->", text, re.S)
    assert len(whole) == text.count("<!-- made: ") == text.count("<!-- end -->")
    assert len(re.findall("^Numbers on this page were made with jaxcage ", text, re.M)) == 1
