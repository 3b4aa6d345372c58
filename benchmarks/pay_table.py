"""The table of `benchmarks.pay`, from its ledger."""

from collections.abc import Sequence
from typing import Any

import numpy as np


RIVALS = ("CMA-ES", "differential evolution")
"""Searches without gradients: the better of them is what there is to be reached."""
DESIGNS, SHORT = 300, 5
"""What each search may ask for, and the part of it at which its best is shown too."""


def best_after(trace: Sequence[Sequence[float]], designs: float) -> float:
    """The lowest value that a search had seen after so many designs; NaN before its first batch."""
    return min((value for count, _, value in trace if count <= designs), default=float("nan"))


def designs_until(trace: Sequence[Sequence[float]], value: float) -> float:
    """After how many designs a search had seen a value as low; infinity for never."""
    return next((float(count) for count, _, found in trace if found <= value), float("inf"))


def to_be_reached(runs: Sequence[dict[str, Any]]) -> float:
    """The rivals' best: of each the median of its seeds, of these the lower."""
    of = lambda name: [r["best"] for r in runs if r["search"] == name]
    return min((float(np.median(of(name))) for name in RIVALS if of(name)), default=float("nan"))


def table(ledger: Sequence[dict[str, Any]]) -> str:
    """What each search found in each bearing: medians of its seeds, in brackets the lowest and the highest."""
    parts = []
    for bearing in dict.fromkeys(r["bearing"] for r in ledger):
        of = [r for r in ledger if r["bearing"] == bearing]
        runs, own = [r for r in of if r["search"] != "none"], next(r for r in of if r["search"] == "none")
        if not runs:
            continue
        goal = to_be_reached(runs)
        rows = [_head()]
        for name in dict.fromkeys(r["search"] for r in runs):
            rows.append(_row(name, [r for r in runs if r["search"] == name], goal))
        head = (
            f"{bearing}: {own['best']:.0f} rpm as it is, {own['check']['value']:.0f} by the finer check; "
            f"to be reached: {goal:.0f}"
        )
        parts.append(f"{head}\n{_aligned(rows)}")
    return "\n\n".join(parts)


def _head() -> list[str]:
    return [
        *("search", "seeds", f"after {DESIGNS // SHORT}", f"after {DESIGNS}", "checked", "reached after"),
        *("10^6 lane-rev", "processor s"),
    ]


def _row(name: str, runs: Sequence[dict[str, Any]], goal: float) -> list[str]:
    until = np.array([designs_until(r["trace"], goal) for r in runs])
    median = float(np.sort(until)[(len(until)) // 2])
    reached = f"{int(np.sum(np.isfinite(until)))} of {len(until)}" + ("" if np.isinf(median) else f": {median:.0f}")
    return [
        name,
        str(len(runs)),
        _spread([best_after(r["trace"], DESIGNS / SHORT) for r in runs]),
        _spread([r["best"] for r in runs]),
        _spread([r["check"]["value"] for r in runs]),
        reached,
        f"{np.median([r['lane_revolutions'] for r in runs]) / 1e6:.2f}",
        f"{np.median([r['seconds'] for r in runs]):.0f}",
    ]


def _spread(values: Sequence[float]) -> str:
    return f"{np.median(values):.0f} ({np.min(values):.0f} to {np.max(values):.0f})"


def _aligned(rows: Sequence[Sequence[str]]) -> str:
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    line = lambda row: [f"{row[0]:<{widths[0]}}", *(f"{c:>{w}}" for c, w in zip(row[1:], widths[1:], strict=True))]
    return "\n".join("  ".join(line(row)).rstrip() for row in rows)
