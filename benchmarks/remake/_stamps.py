"""Blocks of pages and notebooks, and the stamps under them.

In Markdown a block stands between `<!-- made: name -->` and `<!-- end -->`, its stamp before the end: a comment for
programs and a line of small print. A notebook has the same in its metadata and in a last cell.
"""

import hashlib
import json
import pathlib
import re
import subprocess
from collections.abc import Mapping
from typing import Any, NamedTuple

from ._excerpts import said
from ._runs import ROOT, Run
from ._shown import Shown


CHANGES = {
    "46df402": "steps are refined until they agree and shortened near the land",
    "7b86501": "sweeps confirm labels and follow chaos to a horizon",
}
"""Commits since which numbers are other ones, and what they changed."""
SAME: dict[str, dict[str, tuple[str, ...]]] = {
    "31a753513afe": {
        "cage": ("5c33d126312e", "c633f1ecf147", "974cdd2d96e5", "e7b05ed4dee3", "aef914506520"),
        "bearing": (
            "5c33d126312e",
            "c633f1ecf147",
            "974cdd2d96e5",
            "e7b05ed4dee3",
            "aef914506520",
            "c30ebb27dcdf",
            "5ca768802638",
        ),
        "orbits": ("974cdd2d96e5", "e7b05ed4dee3", "aef914506520"),
    },
}
"""Fingerprints of packages with those of earlier ones of which a part gives the same to the last bit, if not in the
same time: checked by `python -m benchmarks.same PATH --part NAME`."""
AS_FAST: dict[str, tuple[str, ...]] = {}
"""The same of those that take the same time too: no sweep meets what is new."""
KEY, CELL = "jaxcage", "stamp"


class Stamp(NamedTuple):
    """With what a block was made."""

    commit: str
    tree: str
    """Fingerprint of the package."""
    date: str
    about: str
    """Resolution and horizon, in words."""
    digest: str
    """Of the block and its files: it tells what was changed by hand."""


def about(document: Mapping[str, Any]) -> str:
    """Resolution and horizon as far as a command's document says."""
    words = {
        "speeds": "{} speeds",
        "starts": "{} starts",
        "resolution_rpm": "resolution {:g} rpm",
        "discard": "{} revolutions discarded",
        "revolutions": "{} observed",
        "horizon": "chaos followed to {} revolutions",
        "error": "error of a revolution at most {:.0e}",
    }
    return ", ".join(text.format(document[key]) for key, text in words.items() if document.get(key))


def digest(shown: Shown, content: str, root: pathlib.Path = ROOT) -> str:
    """Of what a block shows; of a notebook what it printed, and its figures."""
    found = hashlib.sha256((said(content) if shown.page.endswith(".ipynb") else content).encode())
    for name in shown.files:
        found.update((root / name).read_bytes())
    return found.hexdigest()[:12]


def stamp(shown: Shown, content: str, run: Run, root: pathlib.Path = ROOT) -> Stamp:
    """The stamp of a block that was just made."""
    of = run.record
    return Stamp(of["commit"], of["tree"], of["date"], about(run.document), digest(shown, content, root))


def state(shown: Shown, tree: str, root: pathlib.Path = ROOT) -> str:
    """`fresh`, `stale`, `never made` or `changed by hand`."""
    content, found = read(shown, root)
    if found is None:
        return "never made"
    if not shown.by_hand and found.digest != digest(shown, content, root):
        return "changed by hand"
    return "fresh" if _is_of(shown, found, tree) else "stale"


def _is_of(shown: Shown, found: Stamp, tree: str) -> bool:
    """Whether a block would be the same if it were made with a package now."""
    if shown.timed:
        return found.tree in (tree, *AS_FAST.get(tree, ()))
    return found.tree == tree or all(found.tree in SAME.get(tree, {}).get(part, ()) for part in shown.parts)


def words(shown: Shown, found: Stamp | None, tree: str, root: pathlib.Path = ROOT) -> str:
    """What the small print says."""
    by = f"`{shown.commands[0]}`" + (" and the like" if len(shown.commands) > 1 else "")
    if found is None:
        return f"Not yet made by {by}."
    what = f": {found.about}" if found.about else ""
    hand = ", put in by hand" if shown.by_hand else ""
    if _is_of(shown, found, tree):
        return f"Made at commit {found.commit}, {found.date}, by {by}{hand}{what}."
    why = [text for change, text in CHANGES.items() if _lacks(found.commit, change, root)]
    since = f" Since then {', '.join(why)}." if why else ""
    return f"Not yet made again by {by} since commit {found.commit}, {found.date}{what}.{since}"


def _lacks(commit: str, change: str, root: pathlib.Path) -> bool:
    asked = ["git", "merge-base", "--is-ancestor", change, commit.rstrip("+")]
    return subprocess.run(asked, cwd=root, capture_output=True).returncode == 1


def _block(name: str) -> re.Pattern[str]:
    last = r"(?:\n\n<!-- stamp (?P<stamp>.*?) -->\n<sub>.*?</sub>)?"
    inside = r"(?P<content>(?:(?!<!-- end -->).)*?)"  # one without its own end does not reach for that of the next
    return re.compile(rf"<!-- made: {re.escape(name)} -->\n{inside}{last}\n<!-- end -->", re.S)


def read(shown: Shown, root: pathlib.Path = ROOT) -> tuple[str, Stamp | None]:
    """A block as it stands, and its stamp.

    **Raises:** `ValueError` if the page does not have the block once.
    """
    text = (root / shown.page).read_text(encoding="utf-8")
    if shown.page.endswith(".ipynb"):
        notebook = json.loads(text)
        found = notebook["metadata"].get(KEY)
        return text, Stamp(**found) if found else None
    if shown.whole and "<!-- made: " not in text:  # its command was run by hand
        return text.strip(), None
    blocks = list(_block(shown.name).finditer(text))
    if len(blocks) != 1:
        raise ValueError(f"{shown.page} must have the block '{shown.name}' once, but has it {len(blocks)} times.")
    found = json.loads(blocks[0]["stamp"] or "{}")
    return blocks[0]["content"], Stamp(**found) if found else None


def write(shown: Shown, content: str, found: Stamp | None, tree: str, root: pathlib.Path = ROOT) -> None:
    """Put a block and its stamp in the place of what is there."""
    path, line = root / shown.page, words(shown, found, tree, root)
    data = found._asdict() if found else {}
    if shown.page.endswith(".ipynb"):
        path.write_text(_stamped(json.loads(content), data, line), encoding="utf-8")
        return
    small = f"<!-- stamp {json.dumps(data)} -->\n<sub>{line}</sub>"
    block = f"<!-- made: {shown.name} -->\n{content}\n\n{small}\n<!-- end -->"
    text = block + "\n" if shown.whole else _block(shown.name).sub(lambda _: block, path.read_text(encoding="utf-8"))
    path.write_text(text, encoding="utf-8")


def _stamped(notebook: dict[str, Any], data: dict[str, str], line: str) -> str:
    """A notebook with its stamp in the metadata and in a last cell."""
    notebook["metadata"] = {k: v for k, v in notebook["metadata"].items() if k != KEY} | ({KEY: data} if data else {})
    cells = [cell for cell in notebook["cells"] if cell.get("id") != CELL]
    last = {"cell_type": "markdown", "id": CELL, "metadata": {}, "source": [f"<sub>{line}</sub>"]}
    return json.dumps(notebook | {"cells": [*cells, last]}, indent=1, ensure_ascii=False) + "\n"


def mark(shown: Shown, tree: str, root: pathlib.Path = ROOT) -> None:
    """Say under a block whether it was made with the package as it is."""
    write(shown, *read(shown, root), tree, root)
