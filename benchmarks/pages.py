"""Tables and figures of README and docs, made again: `python -m benchmarks.pages [PAGE ...]`.

A block stands between `<!-- made: NAME -->` and `<!-- end -->`. Its command is run, and what belongs into the block is
taken from what it prints; the figure of a block that shows one is copied to `experiments`. Each block is printed too,
and the last line of its page says with which version it was made. All pages together take hours.
"""

import argparse
import functools
import json
import pathlib
import re
import shlex
import shutil
import subprocess
import sys
from collections import defaultdict
from collections.abc import Callable
from typing import Any

from .common import ROOT, columns, made_with, markdown


Part = Callable[[str], str | None]
"""From what a command printed to the text of a block; None if the text stays."""


def printed(text: str) -> str:
    """All of it; there must be something."""
    if not text.strip():
        raise ValueError("The command printed nothing for this block.")
    return f"```text\n{text.strip()}\n```"


def tables(*titles: str) -> Part:
    """The tables whose titles begin so."""
    return lambda text: printed("\n\n".join(part for part in text.split("\n\n") if part.startswith(titles)))


def sentence(text: str) -> str:
    """The sentence that answers."""
    return printed(text.split("\n\n")[0])


def answer(text: str) -> str:
    """All but what a command says of its run and its files."""
    parts = text.split("\n\n")
    return printed("\n\n".join([*parts[:-1], parts[-1].split("\nReadings:")[0]]))


def figure(left: str, shown: str = "") -> Part:
    """The figure that the command left in `out`, under the name that it has in `experiments`."""
    return lambda text: shutil.copy(ROOT / "out" / left, ROOT / "experiments" / (shown or left)) and None


def _ours(edge: dict[str, Any], apart: str) -> str:
    return "none" if edge["ours_rpm"] is None else f"{edge['ours_rpm']:.0f}{apart.format(edge['error_percent'])}"


def against_paper(text: str) -> str:
    """The edges of lasting chaos of `experiments.reproduce`, a case to a row."""
    cases: dict[str, list[str]] = {}
    for edge in (e for e in json.loads(text)["edges"] if e["kind"] == "lasting"):
        cases.setdefault(edge["case"], []).append(f"{edge['published_rpm']:.0f} / {_ours(edge, ' ({:+.1f} %)')}")
    return markdown(("case", "zone 1 from", "to", "zone 2 from"), [(name, *row) for name, row in cases.items()])


def every_kind(text: str) -> str:
    """The edges of every kind of `experiments.reproduce`, the cases in which they agree, and the numbers of zones."""
    document = json.loads(text)
    kinds, rows, close = list(document["summary"]), {}, defaultdict(list)
    for edge in document["edges"]:
        key = (edge["case"], edge["edge"], f"{edge['published_rpm']:.0f}")
        rows.setdefault(key, {})[edge["kind"]] = _ours(edge, " {:+.1f} %")
        if edge["ours_rpm"] is not None and abs(edge["error_percent"]) <= 10:
            close[edge["edge"], edge["kind"]].append(edge["case"])
    body = [(*key, *(found.get(kind, "none") for kind in kinds)) for key, found in rows.items()]
    names = dict.fromkeys(edge["edge"] for edge in document["edges"])
    agree = [(name, *(" ".join(close[name, kind]) or "none" for kind in kinds)) for name in names]
    count = [(zones["case"], *(str(zones[kind]) for kind in ("published", *kinds))) for zones in document["zones"]]
    shown = [("case", "edge", "published", *kinds), *body], [("within 10 %", *kinds), *agree]
    each = [*shown, [("zones of 500 rpm and more", "published", *kinds), *count]]
    return printed("\n\n".join(columns(rows, right=True) for rows in each))


README, EDGE, DESIGN, PAPER = "README.md", "docs/edges.md", "docs/design.md", "docs/reproduction.md"
COMMANDS = "docs/commands.md"
REPRODUCE = "python -m experiments.reproduce --json"
BETTER = 'jaxcage design nu2310 --speed "10000 rpm shaft"'
CALM = 'jaxcage design 1a --operating "31500-44000 rpm shaft"'
CHECK = 'jaxcage init my_bearing.toml && jaxcage check my_bearing.toml --operating "4000-14000 rpm shaft"'
BLOCKS: dict[str, tuple[str, str, Part]] = {
    "sweep-1a-figure": (README, "jaxcage sweep 1a", figure("sweep_1a.png")),
    "sweep-1a": (README, "jaxcage sweep 1a", tables("Chaotic zones of")),
    "check-template": (README, CHECK, sentence),
    "design-1a": (README, CALM, sentence),
    "against-paper": (README, REPRODUCE, against_paper),
    "guide-zones-1a": (EDGE, "jaxcage zones 1a", tables("Unstable ranges", "Elasticities", "Chaotic zones of")),
    "bifurcations-1a-figure": (EDGE, "jaxcage bifurcations 1a", figure("bifurcations_1a.png")),
    "design-calm": (DESIGN, CALM, answer),
    "design-calm-figure": (DESIGN, CALM, figure("design_1a.png")),
    "design-1b": (DESIGN, "jaxcage design 1b", tables("Before and after", "Design of")),
    "design-1b-figure": (DESIGN, "jaxcage design 1b", figure("design_1b.png")),
    "searches-of-eight": (DESIGN, "python -m benchmarks.pay --table", printed),
    "statics-figure": (COMMANDS, "jaxcage statics 1a --speed 10000", figure("statics_1a.png")),
    "simulate-figure": (
        *(COMMANDS, "jaxcage simulate 1a --speed 11000"),
        figure("simulate_1a_11000rpm.png", "simulate_1a.png"),
    ),
    "poincare-figure": (
        *(COMMANDS, "jaxcage poincare 1a --speed 11000"),
        figure("poincare_1a_11000rpm.png", "poincare_1a.png"),
    ),
    "runup-figure": (COMMANDS, "jaxcage runup 1a --first 8000 --last 14000", figure("runup_1a.png")),
    "map-figure": (
        *(COMMANDS, "jaxcage map 1a --points 60x40 --quick"),
        figure("map_1a_speed_guidance_gap.png", "map_1a.png"),
    ),
    "gradient-figure": (COMMANDS, "jaxcage gradient 1a", figure("gradient_1a.png")),
    "compare-figure": (COMMANDS, "jaxcage compare 1a 1b", figure("compare_1a_1b.png")),
    "both-kinds": (PAPER, REPRODUCE, every_kind),
    "reproduction-figure": (PAPER, REPRODUCE, figure("reproduce_fig7a.png", "reproduce_7a.png")),
    "bearing-design": ("docs/whole-bearing.md", BETTER, tables("Before and after", "Design of")),
    "transcript": ("docs/transcript.md", "python -m benchmarks.transcript", printed),
}
"""Blocks by name: the page, the command that makes the block, and the part of its output that is shown."""


@functools.cache
def output(command: str) -> str:
    """Run a command once in this process and return what it prints."""
    printed_by_last = ""
    own = ROOT / "my_bearing.toml"
    for part in command.split(" && "):
        program, *words = shlex.split(part)
        words = ["-m", "jaxcage", *words] if program == "jaxcage" else words
        print(f"$ {part}", flush=True)
        done = subprocess.run([sys.executable, *words], cwd=ROOT, stdout=subprocess.PIPE, text=True, check=True)
        printed_by_last = done.stdout
    own.unlink(missing_ok=True)
    return printed_by_last


def refresh(page: str) -> None:
    """Make the blocks of a page again."""
    path, text = ROOT / page, (ROOT / page).read_text(encoding="utf-8")
    for name, (where, command, part) in BLOCKS.items():
        if where == page and (new := part(output(command))) is not None:
            print(f"{new}\n", flush=True)
            marks = f"<!-- made: {name} -->", "<!-- end -->"
            text = re.sub(rf"(?s)({marks[0]}\n).*?(\n{marks[1]})", lambda m, new=new: m[1] + new + m[2], text, count=1)
    text = re.sub(r"(?m)^Numbers on this page were made with .*$", lambda m: made_with(), text)
    path.write_text(text, encoding="utf-8")


def main() -> None:
    """Make the pages that are named, or all."""
    pages = {pathlib.Path(page).stem.lower(): page for page, _, _ in BLOCKS.values()}
    parser = argparse.ArgumentParser(prog="python -m benchmarks.pages", description=(__doc__ or "").split("\n")[0])
    parser.add_argument("pages", nargs="*", metavar="PAGE", help=", ".join(pages))
    for name in parser.parse_args().pages or pages:
        if name not in pages:
            parser.error(f"there is no page {name}; pages with blocks: {', '.join(pages)}")
        refresh(pages[name])


if __name__ == "__main__":
    main()
