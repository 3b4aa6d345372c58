"""The comparisons as one page of Markdown."""

from collections.abc import Mapping, Sequence

from ._comparison import Comparison


def page(found: Mapping[str, Sequence[Comparison]], made_by: str) -> str:
    """A table for every topic: what, source, theirs, ours, difference, tolerance, verdict.

    **Arguments:** comparisons by topic; how the page was made, in one sentence.
    """
    everything = [c for rows in found.values() for c in rows]
    passed = sum(c.passed for c in everything)
    lines = [
        "# Validation",
        "",
        f"{passed} of {len(everything)} comparisons pass. {made_by}",
        "",
        "A tolerance is what the source supports: half a unit of the last printed digit where ours is exact, more",
        "where theirs was computed on a coarse grid or ours is a finite sample. FAILS marks a difference beyond it.",
        "A source is one that can be opened, or a second computation that shares no code with what it is held against.",
    ]
    for topic, rows in found.items():
        lines += ["", f"## {topic.capitalize()}", "", "| what | theirs | ours | difference | tolerance | | source |"]
        lines += ["|---|---:|---:|---:|---:|---|---|"]
        lines += [_row(c) for c in rows]
    return "\n".join(lines) + "\n"


def _row(c: Comparison) -> str:
    cells = (
        c.what,
        f"{c.theirs:.10g}",
        _ours(c),
        f"{c.difference:+.2g}",
        f"{c.tolerance:.2g}",
        "pass" if c.passed else "**FAILS**",
        c.source,
    )
    return "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |"


def _ours(c: Comparison) -> str:
    """Ours with as many digits as the tolerance asks for, and one more."""
    if not c.tolerance > 0 or not abs(c.ours) > 0:
        return f"{c.ours:.10g}"
    digits = 2
    while digits < 12 and abs(c.ours) * 10.0 ** (1 - digits) > c.tolerance:
        digits += 1
    return f"{c.ours:.{digits}g}"
