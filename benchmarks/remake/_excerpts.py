"""How the output of commands becomes a block of a page."""

import json
import re
from collections.abc import Callable, Sequence

from ._runs import Run


Excerpt = Callable[[Sequence[Run]], str]
EDGES = ("zone 1 onset", "zone 1 exit", "zone 2 onset")


def fenced(text: str) -> str:
    """A block of plain text."""
    return f"```text\n{text.strip()}\n```"


def aligned(rows: Sequence[Sequence[str]]) -> str:
    """Rows as plain text, the first column to the left."""
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    line = lambda row: [f"{row[0]:<{widths[0]}}", *(f"{c:>{w}}" for c, w in zip(row[1:], widths[1:], strict=True))]
    return fenced("\n".join("  ".join(line(row)).rstrip() for row in rows))


def markdown(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """A Markdown table."""
    return "\n".join(f"| {' | '.join(row)} |" for row in (head, *rows)).replace("\n", f"\n|{'---|' * len(head)}\n", 1)


def tables(*titles: str) -> Excerpt:
    """Of what commands printed the tables whose titles begin so; each must have the first of them."""

    def made(runs: Sequence[Run]) -> str:
        of = lambda run: [part for part in run.text.split("\n\n") if part.startswith(titles)]
        if not all(any(part.startswith(titles[0]) for part in of(run)) for run in runs):
            raise ValueError(f"there is no table '{titles[0]}'")
        found = [part for run in runs for part in of(run)]
        return fenced("\n\n".join(found))

    return made


def lines(start: str) -> Excerpt:
    """Of one command's output the lines that begin so."""
    return lambda runs: fenced("\n".join(x for x in runs[0].text.splitlines() if x.startswith(start)))


def printed(runs: Sequence[Run]) -> str:
    """All that one command printed."""
    return fenced(runs[0].text)


def page(name: str) -> Excerpt:
    """A whole file that one command left."""
    return lambda runs: (runs[0].folder / name).read_text(encoding="utf-8").strip()


def _ours(edge: dict, apart: str) -> str:
    if edge["ours_rpm"] is None:
        return "none"
    return f"{edge['ours_rpm']:.0f}{apart.format(edge['error_percent'])}"


def against_paper(runs: Sequence[Run]) -> str:
    """The edges of lasting chaos of `jaxcage reproduce`, a case to a row."""
    cases: dict[str, list[str]] = {}
    for edge in (e for e in runs[0].document["edges"] if e["kind"] == "lasting"):
        cases.setdefault(edge["case"], []).append(f"{edge['published_rpm']:.0f} / {_ours(edge, ' ({:+.1f} %)')}")
    return markdown(("case", "zone 1 from", "to", "zone 2 from"), [(name, *row) for name, row in cases.items()])


def every_kind(runs: Sequence[Run]) -> str:
    """The edges of every kind of `jaxcage reproduce`."""
    kinds = list(runs[0].document["summary"])
    rows: dict[tuple[str, str, str], dict[str, str]] = {}
    for edge in runs[0].document["edges"]:
        key = (edge["case"], edge["edge"], f"{edge['published_rpm']:.0f}")
        rows.setdefault(key, {})[edge["kind"]] = _ours(edge, " {:+.1f} %")
    body = [(*key, *(found.get(kind, "none") for kind in kinds)) for key, found in rows.items()]
    return aligned([("case", "edge", "published", *kinds), *body])


def lasting_fit(runs: Sequence[Run]) -> str:
    """Constants of the package beside those of a search on lasting chaos, case by case, from `identify_nu2310.py`."""
    whose, rows = ("package", "search"), []
    lines = [run.text.strip().splitlines() for run in runs]
    for pair in zip(*(each[:-1] for each in lines), strict=True):
        for constants, line in zip(whose, pair, strict=True):
            name, rest = line.split(": ", 1)
            found = dict(re.findall(r"(zone \d \w+) (none|\S+ %)", rest))
            rows.append((name, constants, *(found[e] for e in EDGES), rest.split("; ")[1].split()[0]))
    counts = (f"{constants}: {each[-1]}" for constants, each in zip(whose, lines, strict=True))
    table = aligned([("case", "constants", *EDGES, "wide zones"), *rows])
    return f"{table}\n\nIn all, {'; '.join(counts)}."


RIVALS = {
    "jaxcage sweep": "jaxcage, default",
    "diffrax Tsit5": "diffrax Tsit5, vmap",
    "SciPy LSODA": "SciPy LSODA, numba",
    "diffrax Kvaerno3": "diffrax Kvaerno3, vmap",
    "C, Rodas4": "C, rodas4",
    "C, RK4": "C, rk4",
}


def speed(runs: Sequence[Run]) -> str:
    """Microseconds of some rivals, from the page of `python -m benchmarks`."""
    text = (runs[0].folder / "speed.md").read_text(encoding="utf-8").split("\n## ")[1]
    rows = [[cell.strip() for cell in row.strip("|").split("|")] for row in text.splitlines() if row.startswith("| ")]
    us = {row[0].removesuffix(" (below)"): row[rows[0].index("us")] for row in rows[1:]}
    short = lambda x: x if float(x) < 10 else f"{float(x):.0f}"
    return markdown(tuple(RIVALS), [[short(us[name]) for name in RIVALS.values()]])


def said(notebook: str) -> str:
    """All that the cells of a notebook printed."""
    outputs = [output for cell in json.loads(notebook)["cells"] for output in cell.get("outputs", ())]
    return "".join("".join(output.get("text", ())) for output in outputs)


SEARCHES = {
    "gradient, from the best scout": "gradient, from the best of the scouts",
    "gradient, from the design": "gradient, from the given design",
    "differential evolution": "differential evolution (scipy, 60 designs)",
    "CMA-ES": "CMA-ES from the given design (60 designs)",
}


def searches(runs: Sequence[Run]) -> str:
    """What each search of `optimise_gap_and_balance` reached."""
    text = said((runs[0].folder / "optimise_gap_and_balance.ipynb").read_text(encoding="utf-8"))
    found = re.findall(r"^(\S.*?) +best +(\S+) rpm, designs until (\S+) rpm: (\S+)$", text, flags=re.M)
    best = {name: (value, "-" if count == "None" else count) for name, value, _, count in found}
    head = ("search", "best objective [rpm]", f"designs until {found[0][2]} rpm")
    return markdown(head, [(words, *best[name]) for name, words in SEARCHES.items()])
