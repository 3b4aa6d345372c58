import os
import pathlib


os.environ.setdefault("JAX_PLATFORMS", "cpu")
# Both processes of a run, the commands they start and the next run share what has been compiled.
PROGRAMS = os.environ.setdefault(
    "JAXCAGE_CACHE", str(pathlib.Path(__file__).parent.parent / ".pytest_cache" / "programs")
)

import jax
import pytest


jax.config.update("jax_enable_x64", True)
jax.config.update("jax_numpy_rank_promotion", "raise")
jax.config.update("jax_numpy_dtype_promotion", "strict")
if PROGRAMS != "off":
    jax.config.update("jax_compilation_cache_dir", PROGRAMS)
    jax.config.update("jax_persistent_cache_min_compile_time_secs", 0.1)


@pytest.fixture(autouse=True, scope="module")
def forget_compiled_programs():
    """Compiled programs hold memory maps, of which a process has only so many: let go of them after each file."""
    yield
    jax.clear_caches()
