"""What is shown is in one table, and the command that makes it again finds what is old, missing or changed by hand."""

import json
import pathlib
import re

import pytest

from benchmarks.remake import _stamps as stamps
from benchmarks.remake.__main__ import main
from benchmarks.remake._excerpts import (
    EDGES,
    against_paper,
    every_kind,
    fenced,
    printed,
    readings,
    speed,
    tables,
)
from benchmarks.remake._runs import ROOT, Run, fingerprint, folder_of
from benchmarks.remake._shown import SHOWN, Shown


PAGES = ("README.md", *sorted(p.relative_to(ROOT).as_posix() for p in ROOT.glob("docs/*.md")))
FAKE = "python fake.py"
STAMP = stamps.Stamp("abc1234", "tree", "2026-11-24", "3 starts", "0123456789ab")


@pytest.fixture
def checkout(tmp_path: pathlib.Path) -> pathlib.Path:
    """A checkout with a package of one file, a page with a block, and a command that counts how often it ran."""
    (tmp_path / "jaxcage").mkdir()
    (tmp_path / "jaxcage" / "law.py").write_text("force = 1\n")
    (tmp_path / "fake.py").write_text(
        "import pathlib\n"
        "ran = pathlib.Path('ran')\n"
        "ran.write_text(ran.read_text() + '.' if ran.exists() else '.')\n"
        "print(pathlib.Path('jaxcage/law.py').read_text())\n"
    )
    (tmp_path / "page.md").write_text("Before\n\n<!-- made: law -->\n```text\nforce = 0\n```\n<!-- end -->\n\nAfter\n")
    return tmp_path


LAW = Shown("law", "page.md", [FAKE], printed)


def remake(root: pathlib.Path, *words: str, table: tuple[Shown, ...] = (LAW,)) -> int:
    return main(words, table, root)


def test_everything_that_a_command_prints_is_in_the_table():
    """Fenced text, figures and tables of numbers of the pages are within marks, and all marks are in the table."""
    for name in PAGES:
        text = (ROOT / name).read_text()
        assert re.findall("<!-- made: (.*?) -->", text) == re.findall("<!-- made: (.*?) -->.*?<!-- end -->", text, re.S)
        assert sorted(re.findall("<!-- made: (.*?) -->", text)) == sorted(s.name for s in SHOWN if s.page == name)
        outside = re.sub("<!-- made: .*?<!-- end -->", "", text, flags=re.S)
        assert set(re.findall(r"^```(\w*)\n.*?^```$", outside, re.M | re.S)) <= {"sh", "python", "toml"}
        assert "![" not in outside
        assert [
            t
            for t in re.findall(r"^\|(.*)\|\n\|-", outside, re.M)
            if "what it does" not in t and "what was tried" not in t
        ] == []


def test_every_page_figure_and_notebook_is_in_the_table():
    made = {s.page for s in SHOWN} | {file for s in SHOWN for file in s.files}
    there = [*ROOT.glob("experiments/*.ipynb"), *ROOT.glob("experiments/*.png"), *ROOT.glob("benchmarks/*.md")]
    assert {p.relative_to(ROOT).as_posix() for p in there} | {"VALIDATION.md"} <= made
    assert len({s.name for s in SHOWN}) == len(SHOWN)


@pytest.mark.parametrize("shown", SHOWN, ids=lambda s: s.name)
def test_nothing_shown_was_changed_by_hand(shown: Shown):
    assert stamps.state(shown, fingerprint()) in ("fresh", "stale")
    _, found = stamps.read(shown)
    assert found is not None and found.commit in (ROOT / shown.page).read_text()


def test_a_block_is_made_stamped_and_not_made_twice(checkout: pathlib.Path, capsys: pytest.CaptureFixture[str]):
    assert stamps.state(LAW, fingerprint(checkout), checkout) == "never made"
    assert remake(checkout) == 0
    assert capsys.readouterr().out.splitlines()[-2:] == ["  -force = 0", "  +force = 1"]
    text = (checkout / "page.md").read_text()
    assert text.startswith("Before\n\n<!-- made: law -->\n```text\nforce = 1\n```\n\n<!-- stamp {")
    assert re.search(rf"<sub>Made at commit \S+, 20\d\d-\d\d-\d\d, by `{FAKE}`\.</sub>\n<!-- end -->\n\nAfter\n$", text)
    assert remake(checkout) == 0 and (checkout / "page.md").read_text() == text
    assert (checkout / "ran").read_text() == "."
    assert remake(checkout, "--force") == 0 and (checkout / "ran").read_text() == ".."


def test_what_was_run_is_kept(checkout: pathlib.Path):
    """A page that was lost is made again without a run; one is run when the package changes, not a page."""
    page = (checkout / "page.md").read_text()
    remake(checkout)
    (checkout / "page.md").write_text("New. " + page)
    remake(checkout)
    assert "force = 1" in (checkout / "page.md").read_text() and (checkout / "ran").read_text() == "."
    (checkout / "jaxcage" / "law.py").write_text("force = 2\n")
    remake(checkout)
    assert "force = 2" in (checkout / "page.md").read_text() and (checkout / "ran").read_text() == ".."


def test_a_block_changed_by_hand_is_found(checkout: pathlib.Path, capsys: pytest.CaptureFixture[str]):
    remake(checkout)
    path = checkout / "page.md"
    path.write_text(path.read_text().replace("force = 1", "force = 9"))
    remake(checkout, "--list")
    assert "changed by hand" in capsys.readouterr().out
    remake(checkout)
    assert "force = 1" in path.read_text()


def test_a_block_with_nothing_in_it_does_not_reach_for_the_next(checkout: pathlib.Path):
    path = checkout / "page.md"
    path.write_text("<!-- made: law -->\n<!-- end -->\n\nBetween\n\n<!-- made: other -->\nx\n<!-- end -->\n")
    with pytest.raises(ValueError, match="must have the block 'law' once"):
        stamps.read(LAW, checkout)


def test_a_stale_block_says_so(checkout: pathlib.Path, capsys: pytest.CaptureFixture[str]):
    remake(checkout)
    (checkout / "jaxcage" / "law.py").write_text("force = 2\n")
    remake(checkout, "--list")
    assert "stale" in capsys.readouterr().out
    remake(checkout, "--mark")
    text = (checkout / "page.md").read_text()
    assert "force = 1" in text and f"<sub>Not yet made again by `{FAKE}` since commit" in text


def test_a_package_that_gives_the_same_leaves_blocks_fresh_but_for_times(
    checkout: pathlib.Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
):
    remake(checkout)
    before = fingerprint(checkout)
    (checkout / "jaxcage" / "law.py").write_text("force = 2 - 1\n")
    monkeypatch.setattr(stamps, "SAME", {fingerprint(checkout): {"cage": (before,)}})
    assert stamps.state(LAW, fingerprint(checkout), checkout) == "stale"  # its command may follow orbits
    monkeypatch.setattr(stamps, "SAME", {fingerprint(checkout): {"cage": (before,), "orbits": (before,)}})
    assert stamps.state(LAW, fingerprint(checkout), checkout) == "fresh"
    remake(checkout, "--mark")
    assert "<sub>Made at commit" in (checkout / "page.md").read_text()
    monkeypatch.setattr(Shown, "timed", True)
    assert stamps.state(LAW, fingerprint(checkout), checkout) == "stale"
    monkeypatch.setattr(stamps, "AS_FAST", {fingerprint(checkout): (before,)})
    assert stamps.state(LAW, fingerprint(checkout), checkout) == "fresh"


def test_a_failure_leaves_the_others(checkout: pathlib.Path, capsys: pytest.CaptureFixture[str]):
    page = "<!-- made: {0} -->\n{0}\n<!-- end -->\n"
    (checkout / "page.md").write_text(page.format("bad") + page.format("odd") + page.format("law"))
    bad = Shown("bad", "page.md", ["python -c 'import sys; print(1); sys.exit(3)'"], printed)
    odd = Shown("odd", "page.md", ["python -c 'print(2)'"], tables("Zones"))
    assert remake(checkout, table=(bad, odd, LAW)) == 1
    out, text = capsys.readouterr().out, (checkout / "page.md").read_text()
    assert "bad: left as it was" in out and "there is no table 'Zones'" in out
    assert "-->\nbad\n" in text and "-->\nodd\n" in text and "force = 1" in text
    assert not (folder_of(bad.commands[0], checkout) / "record.json").exists()


def test_a_page_that_its_command_writes_in_place(checkout: pathlib.Path):
    (checkout / "fake.py").write_text("open('whole.md', 'w').write('# New\\n')\n")
    (checkout / "whole.md").write_text("# Old\n")
    whole = Shown("whole", "whole.md", [FAKE], lambda runs: (runs[0].folder / "whole.md").read_text().strip(), True)
    assert remake(checkout, table=(whole,)) == 0
    assert (checkout / "whole.md").read_text().startswith("<!-- made: whole -->\n# New\n\n<!-- stamp {")
    assert stamps.state(whole, fingerprint(checkout), checkout) == "fresh"


def test_numbers_put_in_by_hand_are_stamped_when_read(checkout: pathlib.Path):
    law = Shown("law", "page.md", [FAKE])
    remake(checkout, "--read", table=(law,))
    assert stamps.state(law, fingerprint(checkout), checkout) == "never made"
    remake(checkout, table=(law,))
    assert stamps.state(law, fingerprint(checkout), checkout) == "never made" and (checkout / "ran").exists()
    remake(checkout, "--read", table=(law,))
    assert stamps.state(law, fingerprint(checkout), checkout) == "fresh"
    assert "put in by hand" in (checkout / "page.md").read_text()


def test_a_notebook_has_its_stamp_in_the_metadata_and_in_its_last_cell(tmp_path: pathlib.Path):
    book = Shown("book", "book.ipynb", [FAKE], printed, True)
    cell = {"cell_type": "code", "id": "a", "source": ["1"], "outputs": [{"text": ["one\n"]}]}
    content = json.dumps({"cells": [cell], "metadata": {"kernelspec": {}}, "nbformat": 4})
    found = STAMP._replace(digest=stamps.digest(book, content, tmp_path))
    for tree in ("tree", "another"):
        stamps.write(book, content, found, tree, tmp_path)
        text, again = stamps.read(book, tmp_path)
        cells = json.loads(text)["cells"]
        assert again == found and cells[0] == cell and len(cells) == 2
        assert ("Made at commit abc1234" in cells[1]["source"][0]) == (tree == "tree")
        content = text
    (tmp_path / "book.ipynb").write_text(text.replace("one", "two"))
    assert stamps.state(book, "tree", tmp_path) == "changed by hand"


def test_tables_are_taken_by_their_titles(tmp_path: pathlib.Path):
    text = "Lanes: 3\nlabel\n\nChaotic zones of 1a\n1  2\n\nTransient chaos of 1a\n3  4\n\nTime: 1 s\n"
    made = tables("Chaotic zones of", "Transient chaos of")([Run(text, {}, tmp_path, {})])
    assert made == fenced("Chaotic zones of 1a\n1  2\n\nTransient chaos of 1a\n3  4")


def document(**of: object) -> Run:
    return Run("", of, ROOT / "benchmarks", {})


def test_edges_of_the_reproduction():
    edge = lambda kind, name, ours: {
        "case": "1a", "edge": name, "kind": kind, "published_rpm": 100.0, "ours_rpm": ours,
        "error_percent": None if ours is None else ours - 100.0,
    }  # fmt: skip
    of_kind = lambda kind, values: [edge(kind, n, v) for n, v in zip(EDGES, values, strict=True)]
    found = of_kind("lasting", (98.0, 105.5, None)) + of_kind("synchronous-loss", (101.0, None, 90.0))
    run = document(edges=found, summary={"lasting": {}, "synchronous-loss": {}})
    assert against_paper([run]).splitlines()[2] == "| 1a | 100 / 98 (-2.0 %) | 100 / 106 (+5.5 %) | 100 / none |"
    assert [row.split() for row in every_kind([run]).splitlines()[2:5]] == [
        "1a zone 1 onset 100 98 -2.0 % 101 +1.0 %".split(),
        "1a zone 1 exit 100 106 +5.5 % none".split(),
        "1a zone 2 onset 100 none 90 -10.0 %".split(),
    ]


def test_readings_of_the_reproduction():
    one = {"case": "1a", "question": "film", "answer": "none", "chaotic_share": 0.88, "zones": 1}
    own = one | {"question": "as the cases have it", "answer": "-"}
    edges = {"zone 1 onset": 6750.0, "zone 1 exit": None}
    rows = readings([document(readings=[r | {"edges": edges} for r in (own, one, one | {"case": "1b"})])]).splitlines()
    assert len(rows) == 5 and rows[2].startswith("as the cases have it  ")
    assert rows[3].split() == "film: none 88 % 1 6750 - -".split()


def test_the_row_of_the_speed_table():
    head, _, row = speed([document()]).splitlines()
    assert head.split(" | ")[0] == "| jaxcage sweep" and len(re.findall(r"\d", row)) > 5


def test_what_a_document_says_of_resolution_and_horizon():
    document = {"speeds": 251, "starts": 3, "resolution_rpm": 100.0, "horizon": 3000, "error": 8.4e-4, "zones": []}
    assert stamps.about(document) == (
        "251 speeds, 3 starts, resolution 100 rpm, chaos followed to 3000 revolutions, "
        "error of a revolution at most 8e-04"
    )


def test_names_are_those_of_blocks_and_pages(capsys: pytest.CaptureFixture[str]):
    assert main(["readme", "--list"]) == 0
    listed = capsys.readouterr().out.splitlines()
    assert len(listed) == sum(s.page == "README.md" for s in SHOWN) and all("README.md" in row for row in listed)
    with pytest.raises(SystemExit):
        main(["nothing", "--list"])
    assert "nothing is called nothing" in capsys.readouterr().err
