"""The known defects of JAX that would make results wrong without a word, and our guards against them."""

import subprocess
import sys

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxcage._checks import BAD_JAX, require_x64


@pytest.mark.parametrize("n", [16383, 16384, 16385, 32769])
def test_batched_reduction_is_right(n: int):
    """jax-ml/jax#39103: the last element of a jitted, vmapped sum of squares of products came out wrong in 0.10.2."""
    m = np.arange(9.0).reshape(3, 3) / 7
    x = np.linspace(-1, 1, 3 * n).reshape(n, 3)
    got = jax.jit(jax.vmap(lambda v: jnp.sum((jnp.asarray(m) @ v) ** 2)))(jnp.asarray(x))
    assert np.allclose(got, np.sum((x @ m.T) ** 2, axis=1), rtol=1e-13)


def test_this_jax_is_not_a_known_bad_one():
    assert jax.__version__ not in BAD_JAX


def test_bad_version_is_refused(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(jax, "__version__", "0.10.2")
    with pytest.raises(RuntimeError, match="0.10.2 gives wrong results"):
        require_x64()


def test_single_precision_is_refused():
    code = "import jaxcage as jc\ntry:\n    jc.case('1a')\nexcept RuntimeError as e:\n    print(e)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert "jaxcage.enable_x64()" in done.stdout


def test_import_leaves_precision_alone():
    code = "import jax, jaxcage\nprint(jax.config.jax_enable_x64)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "False"
