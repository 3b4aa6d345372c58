import os


os.environ.setdefault("JAX_PLATFORMS", "cpu")

import jax
import pytest


jax.config.update("jax_enable_x64", True)
jax.config.update("jax_numpy_rank_promotion", "raise")
jax.config.update("jax_numpy_dtype_promotion", "strict")


@pytest.fixture(autouse=True, scope="module")
def forget_compiled_programs():
    """Compiled programs hold memory maps, of which a process has only so many: let go of them after each file."""
    yield
    jax.clear_caches()
