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
    "solve",
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


def test_every_layer_is_on_the_list():
    assert {p.name for p in ROOT.iterdir() if p.is_dir() and p.name != "__pycache__"} == set(LAYERS)
