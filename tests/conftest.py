import gc
import os
import pathlib


os.environ.setdefault("JAX_PLATFORMS", "cpu")
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # threads of several processes wait for each other
# Both processes of a run, the commands they start and the next run share what has been compiled.
PROGRAMS = os.environ.setdefault(
    "JAXCAGE_CACHE", str(pathlib.Path(__file__).parent.parent / ".pytest_cache" / "programs")
)

import jax
import on_call
import pytest


jax.config.update("jax_enable_x64", True)
jax.config.update("jax_numpy_rank_promotion", "raise")
jax.config.update("jax_numpy_dtype_promotion", "strict")
gc.set_threshold(200_000, 50, 100)  # tracing makes so many objects that looking for dead ones takes a tenth of the time
if PROGRAMS != "off":
    jax.config.update("jax_compilation_cache_dir", PROGRAMS)
    jax.config.update("jax_persistent_cache_min_compile_time_secs", 0.1)


on_call.check_first_calls()

MAPS = pathlib.Path("/proc/self/maps")
MOST_MAPS = 30_000
"""Compiled programs hold memory maps, of which Linux gives a process 65 530."""


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Whole bearings first: their files take longest, and at the end one process would wait for the other."""
    items.sort(key=lambda item: not item.path.name.startswith("test_whole"))


@pytest.fixture(autouse=True)
def check_types_again():
    """Each test begins with the types of all calls checked."""
    on_call.begin_test()


@pytest.fixture(autouse=True, scope="module")
def forget_compiled_programs():
    """Files share what they compile, until there is too much of it."""
    yield
    if not MAPS.exists() or MAPS.read_bytes().count(b"\n") > MOST_MAPS:
        jax.clear_caches()
