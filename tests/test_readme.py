"""The code of README and guide runs, its numbers hold, and the commands are those of the check."""

import contextlib
import io
import pathlib
import re

import jax
import numpy as np
import pytest

from jaxcage.validation._literature import DUFFING_DOUBLINGS, EXPONENTS


ROOT = pathlib.Path(__file__).parent.parent
README = (ROOT / "README.md").read_text()
GUIDE = (ROOT / "docs" / "guide.md").read_text()


def run_blocks(page: str) -> tuple[dict, str]:
    """What the Python blocks of a page leave behind, run in order, and what they print."""
    space: dict = {}
    out = io.StringIO()
    with contextlib.redirect_stdout(out):
        for block in re.findall(r"```python\n(.*?)```", page, flags=re.S):
            exec(compile(block, "<page>", "exec"), space)
    return space, out.getvalue()


def test_python_blocks_of_the_readme():
    space, text = run_blocks(README)
    assert "Sweep of 9 speeds x 3 starts" in text and "at a resolution of 500 rpm" in text
    assert float(space["force"]) == pytest.approx(DUFFING_DOUBLINGS[1][1].value, abs=1e-7)
    assert float(space["slope"].acceleration.cubic / space["force"]) == pytest.approx(-0.5, abs=1e-9)


@pytest.mark.wide
def test_python_blocks_of_the_guide():
    space, _ = run_blocks(GUIDE)
    per_time = space["got"].exponents[0, :, 0].mean() / (2 * np.pi)
    error = np.max(space["got"].standard_error) / (2 * np.pi)
    ueda = EXPONENTS["Ueda x'' + .05 x' + x^3 = 7.5 sin t"]
    assert space["orbit"].converged and float(jax.grad(space["growth"])(2.0)) < 0
    assert per_time == pytest.approx(ueda.value, abs=ueda.tolerance + 2 * error)


def test_set_up_commands_are_those_of_the_check():
    check = (ROOT / ".ci" / "run").read_text()
    for command in ("python -m pip install . && jaxcage sweep 1a", 'python -m pip install -e ".[test]" && pytest'):
        assert command in README
        assert command.split(" sweep")[0] in check


def test_toml_of_the_guide_is_accepted(tmp_path: pathlib.Path):
    from jaxcage.io import load_model

    (block,) = re.findall(r"```toml\n(.*?)```", GUIDE, flags=re.S)
    path = tmp_path / "bearing.toml"
    path.write_text(block)
    model = load_model(path)
    assert float(model.guidance_gap) == pytest.approx(0.5e-3)
    assert float(model.lubricant.temperature) == pytest.approx(343.15)


@pytest.mark.parametrize(
    "page", ["README.md", "CONTRIBUTING.md", "docs/guide.md", "docs/reproduction.md", "docs/transcript.md"]
)
def test_files_that_pages_point_to_exist(page: str):
    for target in re.findall(r"\]\((?!http)([^)#]+)\)", (ROOT / page).read_text()):
        assert ((ROOT / page).parent / target).exists(), target
