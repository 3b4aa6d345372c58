"""What the tests catch: small faults put into forces, orbits, labels and zones, each against its module's own tests.

`python -m benchmarks.mutants --count 200 --seed 0` draws faults from all modules alike, each module as often as it has
places for one, and runs the tests that are named for its module in a copy of the repository. Survivors are printed with
their line: they are to be read one by one, as some change nothing that anyone could see.
"""

import argparse
import ast
import copy
import os
import pathlib
import random
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator

import pytest


ROOT = pathlib.Path(__file__).parent.parent
FORCES = "test_support_and_forcing test_contact_analytic test_film_analytic"
SLOPES = "test_kernels::test_analytic_slopes_of_the_cage_against_autodiff"
MOMENTS = "test_own_force::test_forces_and_moments_of_a_run_name_it"
SEARCH = "test_loss_zones test_missed test_branches"
NEWTON = "test_orbits_literature test_orbits_hard_cases"
TESTS = {
    "analysis/_labels": "test_labels test_guards",
    "analysis/_zones": "test_labels test_loss_zones",
    "forces/_axial": "test_reynolds",
    "forces/_contact": f"{FORCES} {SLOPES}",
    "forces/_film": f"test_film_analytic test_equilibrium_literature {SLOPES}",
    "forces/_finite_film": "test_reynolds",
    "forces/_gravity": "test_reference test_models",
    "forces/_impact_forcing": "test_support_and_forcing test_reference",
    "forces/_land": f"test_contact_analytic test_reference {SLOPES}",
    "forces/_land_film": f"test_film_analytic test_reference test_reynolds {SLOPES} {MOMENTS}",
    "forces/_phase": "test_support_and_forcing",
    "forces/_pocket_impact": "test_support_and_forcing",
    "forces/_pulse": "test_support_and_forcing",
    "forces/_reynolds": "test_reynolds",
    "forces/_rib": "test_support_and_forcing test_models",
    "forces/_ring": "test_reynolds",
    "forces/_smooth": "test_contact_analytic",
    "forces/_support": f"test_support_and_forcing {SLOPES}",
    "forces/_unbalance": "test_support_and_forcing",
    "orbits/_arclength": "test_missed test_branches",
    "orbits/_branch": "test_branches",
    "orbits/_cascade": "test_branches",
    "orbits/_curve": "test_curves",
    "orbits/_follower": "test_branches test_curves",
    "orbits/_implicit": "test_orbits_derivatives test_orbits_steps",
    "orbits/_located": SEARCH,
    "orbits/_loss": "test_loss_zones",
    "orbits/_orbit": f"{NEWTON} test_orbits_steps",
    "orbits/_bifurcation": NEWTON,
    "orbits/_problem": NEWTON,
    "orbits/_search": SEARCH,
    "orbits/_sensitivity": "test_edges_of_the_cage test_objectives",
    "orbits/_singularity": "test_branches test_curves",
    "orbits/_steps": "test_orbits_steps",
}
"""Module -> test files, or tests, that are there for it."""
FLIPS = {
    ast.Lt: ast.GtE,
    ast.LtE: ast.Gt,
    ast.Gt: ast.LtE,
    ast.GtE: ast.Lt,
    ast.Eq: ast.NotEq,
    ast.NotEq: ast.Eq,
    ast.Is: ast.IsNot,
    ast.IsNot: ast.Is,
    ast.In: ast.NotIn,
    ast.NotIn: ast.In,
    ast.Add: ast.Sub,
    ast.Sub: ast.Add,
    ast.Mult: ast.Div,
    ast.Div: ast.Mult,
    ast.Pow: ast.Mult,
    ast.MatMult: ast.Add,
    ast.And: ast.Or,
    ast.Or: ast.And,
}
NO_TESTS = int(pytest.ExitCode.NO_TESTS_COLLECTED)
NOT_CODE = "annotation", "returns", "decorator_list", "type_params"


def places(node: ast.AST) -> Iterator[ast.AST]:
    """Nodes of a module that can be made wrong, in the order of the text."""
    if isinstance(node, (ast.Raise, ast.JoinedStr, ast.Import, ast.ImportFrom)):
        return  # what is said, and to whom
    if can_be_wrong(node):
        yield node
    for name, value in ast.iter_fields(node):
        if name not in NOT_CODE:
            for child in value if isinstance(value, list) else [value]:
                if isinstance(child, ast.AST):
                    yield from places(child)


def can_be_wrong(node: ast.AST) -> bool:
    if isinstance(node, ast.Compare):
        return type(node.ops[0]) in FLIPS
    if isinstance(node, (ast.BinOp, ast.BoolOp)):
        return type(node.op) in FLIPS
    if isinstance(node, ast.UnaryOp):
        return isinstance(node.op, (ast.Not, ast.USub))
    return isinstance(node, ast.IfExp) or isinstance(node, ast.Constant) and type(node.value) in (int, float)


def fault(node: ast.AST) -> ast.AST:
    """The node made wrong."""
    wrong = copy.deepcopy(node)
    if isinstance(wrong, ast.Compare):
        wrong.ops[0] = FLIPS[type(wrong.ops[0])]()
        return wrong
    if isinstance(wrong, (ast.BinOp, ast.BoolOp)):
        wrong.op = FLIPS[type(wrong.op)]()
        return wrong
    if isinstance(wrong, ast.UnaryOp):
        return wrong.operand
    if isinstance(wrong, ast.Constant):
        assert isinstance(wrong.value, (int, float))
        wrong.value = 2 * wrong.value if wrong.value and isinstance(wrong.value, float) else wrong.value + 1
        return wrong
    assert isinstance(wrong, ast.IfExp)
    wrong.body, wrong.orelse = wrong.orelse, wrong.body
    return wrong


def mutant(source: str, index: int) -> tuple[int, str, str, str]:
    """Line, old and new text of the fault of this number, and the module with it."""
    tree = ast.parse(source)
    node = list(places(tree))[index]
    assert isinstance(node, ast.expr) and node.end_lineno is not None and node.end_col_offset is not None
    lines = source.splitlines(keepends=True)
    start = sum(len(x.encode()) for x in lines[: node.lineno - 1]) + node.col_offset
    end = sum(len(x.encode()) for x in lines[: node.end_lineno - 1]) + node.end_col_offset
    new = f"({ast.unparse(fault(node))})"
    text = source.encode()
    return node.lineno, ast.unparse(node), new, (text[:start] + new.encode() + text[end:]).decode()


def survives(copied: pathlib.Path, files: str, seconds: float) -> bool:
    """Whether the tests pass, those of the default suite and then the wide ones; one that takes too long fails."""
    tests = [f"tests/{file}.py{colons}{test}" for file, colons, test in (x.partition("::") for x in files.split())]
    command = [sys.executable, "-m", "pytest", "-n0", "-x", "-q", "-p", "no:cacheprovider", *tests]
    cache = {"JAXCAGE_CACHE": str(ROOT / ".pytest_cache" / "mutants"), "PYTHONPATH": str(copied)}
    for marks in "not slow and not wide", "wide and not slow":
        marked = [*command, "-m", marks]
        try:
            done = subprocess.run(marked, cwd=copied, env=os.environ | cache, capture_output=True, timeout=seconds)
        except subprocess.TimeoutExpired:
            return False
        if done.returncode not in (0, NO_TESTS):
            return False
    return True


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.mutants", description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--count", type=int, default=200, help="faults (%(default)s)")
    parser.add_argument("--seed", type=int, default=0, help="of the draw (%(default)s)")
    parser.add_argument("--skip", type=int, default=0, help="go on after this many faults of the draw (%(default)s)")
    parser.add_argument("--only", default="", help="modules whose name has this in it, e.g. forces/")
    parser.add_argument("--seconds", type=float, default=600.0, help="for the tests of one fault (%(default)s)")
    given = parser.parse_args()
    sources = {name: (ROOT / "jaxcage" / f"{name}.py").read_text() for name in TESTS if given.only in name}
    all_of_them = [(name, i) for name, text in sources.items() for i, _ in enumerate(places(ast.parse(text)))]
    drawn = random.Random(given.seed).sample(all_of_them, min(given.count, len(all_of_them)))
    survivors = 0
    with tempfile.TemporaryDirectory() as folder:
        copied = pathlib.Path(folder) / "copy"
        hidden = shutil.ignore_patterns(".*", "__pycache__", "out", "*.zarr")
        shutil.copytree(ROOT, copied, ignore=hidden)
        for k, (name, index) in enumerate(drawn[given.skip :], start=given.skip + 1):
            line, old, new, text = mutant(sources[name], index)
            path, began = copied / "jaxcage" / f"{name}.py", time.perf_counter()
            path.write_text(text)
            alive = survives(copied, TESTS[name], given.seconds)
            path.write_text(sources[name])
            survivors += alive
            said = f"{'SURVIVED' if alive else 'killed'} {name}.py:{line}: {old} -> {new}"
            print(f"{k}/{len(drawn)} {said} ({time.perf_counter() - began:.0f} s)", flush=True)
    count = len(drawn) - given.skip
    print(f"{count - survivors} of {count} killed, of {len(all_of_them)} places (seed {given.seed})")


if __name__ == "__main__":
    main()
