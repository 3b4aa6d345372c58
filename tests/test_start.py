"""What is loaded when: help, version and errors of typing answer without JAX."""

import subprocess
import sys

import pytest

import jaxcage


def run(code: str, *arguments: str) -> list[str]:
    """Lines that a process of its own prints."""
    return subprocess.run(
        [sys.executable, "-c", code, *arguments], capture_output=True, text=True, check=True
    ).stdout.splitlines()


COMMAND = """
import sys
from jaxcage.cli import main
status = main(sys.argv[1:])
print(status, sorted({"jax", "numpy", "scipy", "matplotlib"} & set(sys.modules)))
"""


@pytest.mark.parametrize(
    "arguments, status",
    [("--help", 0), ("--version", 0), ("sweep --help", 0), ("sweep 1a --sped 3", 2), ("sweep 1a --count 2.5", 2)],
)
def test_what_needs_no_computation_loads_no_jax(arguments: str, status: int):
    lines = run(COMMAND, *arguments.split())
    assert lines[-1] == f"{status} []"
    if arguments == "--version":
        assert lines[0] == f"jaxcage {jaxcage.__version__}"
