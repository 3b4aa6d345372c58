"""The known defects of JAX that would make results wrong without a word, and our guards against them."""

import subprocess
import sys

import jax
import jax.numpy as jnp
import numpy as np
import pytest


@pytest.mark.parametrize("n", [16383, 16384, 16385, 32769])
def test_batched_reduction_is_right(n: int):
    """jax-ml/jax#39103: the last element of a jitted, vmapped sum of squares of products came out wrong in 0.10.2."""
    m = np.arange(9.0).reshape(3, 3) / 7
    x = np.linspace(-1, 1, 3 * n).reshape(n, 3)
    got = jax.jit(jax.vmap(lambda v: jnp.sum((jnp.asarray(m) @ v) ** 2)))(jnp.asarray(x))
    assert np.allclose(got, np.sum((x @ m.T) ** 2, axis=1), rtol=1e-13)


def asked_of(version: str) -> tuple[list[str], str]:
    """Return what a process of its own prints, and its warnings, if JAX were of this version."""
    code = (
        f"import jax\njax.__version__ = {version!r}\nimport jaxcage as jc\n"
        "try:\n    jc.case('1a')\nexcept RuntimeError as e:\n    print(e)\nprint(jax.config.jax_enable_x64)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    return done.stdout.splitlines(), done.stderr


@pytest.mark.wide
def test_single_precision_is_refused_and_left_alone():
    said, warned = asked_of(jax.__version__)
    assert "jaxcage.enable_x64()" in said[0] and said[1] == "False" and "wrong" not in warned


def test_bad_version_is_said_at_import_and_refused():
    said, warned = asked_of("0.10.2")
    assert "0.10.2 gives wrong results" in said[0] and "RuntimeWarning: JAX 0.10.2 gives wrong results" in warned
