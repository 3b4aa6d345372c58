"""The rule on imports: a file imports only from layers below its own, and from their public names."""

import ast
import pathlib

import pytest

import jaxcage


ROOT = pathlib.Path(jaxcage.__file__).parent
LAYERS = "bearing forces models files solve analysis lanes orbits design show cli".split()
FILES = sorted(p for layer in LAYERS for p in (ROOT / layer).rglob("*.py"))


@pytest.mark.parametrize("path", FILES, ids=lambda p: str(p.relative_to(ROOT)))
def test_imports_go_down_and_to_public_names_only(path: pathlib.Path):
    """Imports inside functions too; a folder within a layer is public, a file is not."""
    layer, *inner = path.relative_to(ROOT).parts[:-1]
    for node in ast.walk(ast.parse(path.read_text())):
        if not isinstance(node, ast.ImportFrom):
            continue
        assert node.level or layer == "cli" or not (node.module or "").startswith("jaxcage"), "imports by full name"
        if node.level != len(inner) + 2:
            continue
        top, *rest = (node.module or "").split(".")
        if top in LAYERS:
            assert LAYERS.index(top) < LAYERS.index(layer), f"{layer} imports {node.module}"
            assert (ROOT / top).joinpath(*rest).is_dir(), f"{node.module} is a file of another layer"


def test_every_layer_is_on_the_list():
    assert {p.parent.name for p in ROOT.glob("*/__init__.py")} == set(LAYERS)
