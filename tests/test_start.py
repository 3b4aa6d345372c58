"""What is loaded when: help, version and errors of typing answer without JAX, the library comes with its first name."""

import ast
import pathlib
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


@pytest.mark.wide
def test_names_are_there_without_having_been_used():
    offered = {
        alias.asname
        for node in ast.walk(ast.parse((pathlib.Path(jaxcage.__file__).parent / "_public.py").read_text()))
        if isinstance(node, ast.ImportFrom)
        for alias in node.names
    }
    assert 35 <= len(offered) <= 60, "the top holds what most scripts need; the layers hold the rest"
    names, same = run("import jaxcage as jc; print(*dir(jc)); print(jc.orbits.branch is jc.branch)")
    assert set(names.split()) >= offered | {"orbits", "keep_compiled_programs"} and same == "True"


@pytest.mark.wide
def test_the_library_computes_without_loading_tables():
    """Whoever makes a data set, a store or a figure loads what that takes."""
    code = """
import sys
import jaxcage as jc
jc.enable_x64()
jc.case("1a"), jc.sweep, jc.study, jc.open_study, jc.studies.Store
import jaxcage.io
print(sorted({"xarray", "pandas", "zarr", "matplotlib", "pint", "tyro", "rich", "jinja2", "dask"} & set(sys.modules)))
"""
    assert run(code) == ["[]"]


@pytest.mark.parametrize("name", ["no_such_name", "_no_such_name", "__wrapped__"])
def test_other_names_are_not(name: str):
    with pytest.raises(AttributeError, match=f"module 'jaxcage' has no attribute '{name}'"):
        getattr(jaxcage, name)
