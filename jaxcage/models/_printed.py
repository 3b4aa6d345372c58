"""A model as people read it: every value with its unit, and who knows it."""

from typing import Any

import equinox as eqx
import numpy as np

from .._parameters import ParameterInfo, get, walk


def printed(model: eqx.Module) -> str:
    """One line for every parameter, choice and count of `model`: name, value, unit, where it comes from."""
    rows = [_row(".".join(path), get(model, path), field.metadata) for path, field in walk(model)]
    widths = [max(len(row[i]) for row in rows) for i in range(3)]
    lines = ["  ".join(cell.ljust(width) for cell, width in zip(row[:3], widths, strict=True)) for row in rows]
    said = [f"  {line}  {row[3]}".rstrip() for line, row in zip(lines, rows, strict=True)]
    return "\n".join([f"{type(model).__name__}, values in SI units", *said])


def _row(name: str, value: Any, metadata: Any) -> tuple[str, str, str, str]:
    info: ParameterInfo | None = metadata.get("parameter")
    if info is None:
        said = metadata.get("readings", {}).get(value, metadata.get("text", ""))
        return name, str(value), "", said
    unit = "" if info.unit in ("1", "?") else info.unit
    return name, _number(value), unit, _source(info)


def _number(value: Any) -> str:
    try:
        known = np.asarray(value, dtype=float)
    except Exception:  # traced, or a placeholder of tree surgery
        return "traced"
    if known.ndim == 0:
        return f"{float(known):.6g}"
    return f"{np.min(known):.6g} to {np.max(known):.6g} ({known.size} values)"


def _source(info: ParameterInfo) -> str:
    if info.kind != "unknown" or info.within is None:
        return f"{info.kind}: {info.source}"
    low, high = info.within
    return f"unknown, {low:g} to {high:g} if not measured: {info.source}"
