"""Functions that several benchmarks share: tables, a description of the machine, versions, compiler flags."""

import datetime
import os
import pathlib
import platform
import subprocess
from collections.abc import Sequence
from importlib.metadata import PackageNotFoundError, version


ROOT = pathlib.Path(__file__).parent.parent
PACKAGES = ("jaxcage", "jax", "jaxlib", "diffrax", "equinox", "numpy", "scipy", "numba")
FAST_MATH = (
    *("-fno-math-errno", "-ffinite-math-only", "-fno-signed-zeros", "-fno-trapping-math"),
    *("-fassociative-math", "-freciprocal-math", "-fcx-limited-range"),
)
"""All that -ffast-math allows but for the start-up code that it links, which sets numbers below 2.2e-308 to 0 in the
whole process that loads the library."""


def commit() -> str:
    """The commit of the checkout, with a plus where the package differs from it."""
    git = lambda *words: subprocess.run(["git", *words], cwd=ROOT, capture_output=True, text=True).stdout.strip()
    return (git("rev-parse", "--short", "HEAD") or "none") + ("+" if git("status", "--porcelain", "jaxcage") else "")


def made_with() -> str:
    """The line at the foot of a page that says with which version its numbers were made."""
    when = f"{datetime.date.today():%B %Y}"
    return f"Numbers on this page were made with jaxcage {version('jaxcage')} (commit {commit()}, {when})."


def _version(name: str) -> str:
    try:
        return version(name)
    except PackageNotFoundError:
        return "none"


def machine(cores: int) -> str:
    """The processor, its load, and the versions of packages, in one line."""
    cpu = pathlib.Path("/proc/cpuinfo")
    about = cpu.read_text() if cpu.exists() else ""
    models = [line.split(":")[1].strip() for line in about.splitlines() if line.startswith("model name")]
    flags = [word for word in ("avx512f", "avx2") if word in about]
    parts = {
        "processor": ", ".join([models[0] if models else platform.processor(), *flags[:1]]),
        "cores": str(cores),
        "load before": "/".join(f"{x:.1f}" for x in os.getloadavg()),
        "python": platform.python_version(),
        **{name: _version(name) for name in PACKAGES},
        "date": datetime.date.today().isoformat(),
    }
    return "; ".join(f"{name} {value}" for name, value in parts.items())


def markdown(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """A Markdown table with all columns but the first to the right."""
    line = lambda cells: "| " + " | ".join(cells) + " |"
    return "\n".join([line(head), line(["---", *["---:"] * (len(head) - 1)]), *map(line, rows)])


def columns(rows: Sequence[Sequence[str]], right: bool = False) -> str:
    """Rows as plain text in columns; with `right` all columns but the first are flush right."""
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    side = lambda i: ">" if right and i else "<"
    return "\n".join(
        "  ".join(f"{cell:{side(i)}{width}}" for i, (cell, width) in enumerate(zip(row, widths, strict=True))).rstrip()
        for row in rows
    )
