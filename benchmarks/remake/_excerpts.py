"""How the output of commands becomes a block of a page."""

import json
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


def readings(runs: Sequence[Run]) -> str:
    """The readings of case 1a that `jaxcage reproduce` tried."""
    number = lambda x: "-" if x is None else f"{x:.0f}"
    body = [
        (
            f"{r['question']}: {r['answer']}".removesuffix(": -"),
            f"{100 * r['chaotic_share']:.0f} %",
            str(r["zones"]),
            *(number(r["edges"].get(e)) for e in EDGES),
        )
        for r in runs[0].document["readings"]
        if r["case"] == "1a"
    ]
    return aligned([("reading", "chaotic", "zones", *EDGES), *body])


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
