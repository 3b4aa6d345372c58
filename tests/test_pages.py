"""Blocks of pages that a command makes: each has its entry, and each entry its block."""

import re
from collections import Counter

import pytest

from benchmarks import pages


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
