"""The house rule on imports: a file imports only from layers below its own."""

import ast
import pathlib

import pytest

import jaxcage


ROOT = pathlib.Path(jaxcage.__file__).parent
LAYERS = [
    "bearing",
    "forces",
    "models",
    "integrate",
    "analysis",
    "sweeps",
    "orbits",
    "design",
    "io",
    "studies",
    "plotting",
    "report",
    "cli",
]
SAME_LEVEL = {"io": {"plotting"}, "plotting": {"io"}}
OUTSIDE_CORE = {"matplotlib", "xarray", "zarr", "pint", "tyro", "rich", "dask", "distributed", "jinja2"}
FILES = sorted(p for layer in LAYERS for p in (ROOT / layer).glob("*.py"))


def _imports(path: pathlib.Path) -> list[tuple[int, str]]:
    """(level, module) of every import statement of a file, those inside functions too."""
    found = []
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.ImportFrom):
            found.append((node.level, node.module or ""))
        elif isinstance(node, ast.Import):
            found += [(0, alias.name) for alias in node.names]
    return found


@pytest.mark.parametrize("path", FILES, ids=lambda p: f"{p.parent.name}/{p.name}")
def test_imports_go_down_only(path: pathlib.Path):
    layer = path.parent.name
    below = set(LAYERS[: LAYERS.index(layer)]) - SAME_LEVEL.get(layer, set())
    for level, module in _imports(path):
        top = module.split(".")[0]
        if level == 2 and top in LAYERS:
            assert top in below, f"{layer} imports {module}"
        if level == 0 and top == "jaxcage":
            assert layer == "cli", f"{layer} imports {module} by its full name"


@pytest.mark.parametrize(
    "path",
    [p for p in FILES if p.parent.name not in ("io", "studies", "plotting", "report", "cli")],
    ids=lambda p: f"{p.parent.name}/{p.name}",
)
def test_core_stays_free_of_figures_tables_and_units(path: pathlib.Path):
    used = {module.split(".")[0] for level, module in _imports(path) if level == 0}
    assert not used & OUTSIDE_CORE


def test_every_layer_is_on_the_list():
    assert {p.name for p in ROOT.iterdir() if p.is_dir() and p.name != "__pycache__"} == set(LAYERS)


FEW = 68
"""Imports of private modules from tests and benchmarks: mostly commands without their computation, and kernels."""


def _private(node: ast.AST) -> bool:
    if not isinstance(node, ast.ImportFrom) or (node.module or "").split(".")[0] != "jaxcage":
        return False
    names = [*(node.module or "").split("."), *(alias.name for alias in node.names)]
    return any(name.startswith("_") for name in names)


def test_others_use_public_names_but_for_a_few_that_do_not_grow():
    root = pathlib.Path(__file__).parent
    paths = [p for folder in (root, root.parent / "benchmarks") for p in folder.rglob("*.py")]
    found = [p.name for p in paths for node in ast.walk(ast.parse(p.read_text())) if _private(node)]
    assert len(found) <= FEW, found
