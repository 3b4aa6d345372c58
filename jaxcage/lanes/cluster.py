"""The chunks of a study on dask.distributed: a cluster of its own on this machine, or any other.

Workers only compute; this process writes. A worker that dies loses nothing but its present chunk, which another one
takes up: a chunk is the same bits wherever it is computed. Few chunks are under way at a time, so that memory does not
grow with the study.
"""

import contextlib
import itertools
import pickle
import tempfile
import threading
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any

from .._cache import keep_compiled_programs
from .._errors import ArgumentError
from ..solve import cores
from .store import Results


if TYPE_CHECKING:
    from .study import Study


AHEAD = 2
"""Chunks under way for each worker: one that is computed, one that waits."""
WAIT_S = 30
"""Seconds to wait for a scheduler and its first worker, or for workers after all have died."""
DEATHS = 10
"""Workers of a cluster of our own that may die of one chunk before it is given up."""
_one_at_a_time = threading.Lock()  # a chunk uses all cores, however many threads the worker has


def chunks_on_dask(
    about: "Study", chunks: Sequence[int], scheduler: str | None = None, workers: int | None = None
) -> Iterator[tuple[int, Results]]:
    """The results of `chunks` as they arrive.

    **Raises:** `ImportError` without dask.distributed; `OSError` if the scheduler does not answer or has no workers, or
    none any more.
    """
    import_distributed()
    import cloudpickle  # comes with it

    waiting, packed = iter(chunks), cloudpickle.dumps(about)
    with _client(scheduler, workers) as client:
        submit = lambda n: client.submit(_compute, packed, n, about.description, pure=False, key=f"chunk-{n}")
        room = AHEAD * len(client.scheduler_info()["workers"])
        under_way = {submit(n): n for n in itertools.islice(waiting, room)}
        while under_way:
            for future in _finished(client, list(under_way)):
                yield under_way.pop(future), future.result()
                under_way |= {submit(n): n for n in itertools.islice(waiting, 1)}


def _finished(client: Any, futures: list[Any]) -> set[Any]:
    """Those that are done, one at least.

    **Raises:** `OSError` if there are no workers any more: dask would wait for ever.
    """
    distributed, deserted = import_distributed(), False
    while True:
        try:
            return distributed.wait(futures, timeout=WAIT_S, return_when="FIRST_COMPLETED").done
        except distributed.TimeoutError:
            if client.scheduler_info()["workers"]:
                deserted = False
            elif deserted:
                raise OSError(f"The dask cluster has had no workers for {WAIT_S} s.") from None
            else:
                deserted = True


def import_distributed() -> Any:
    """**Raises:** `ImportError` with the line that cures it."""
    try:
        import distributed
    except ImportError as error:
        raise ImportError('dask.distributed is missing: python -m pip install "jaxcage[dask]".') from error
    return distributed


def _compute(packed: bytes, chunk: int, description: str) -> Results:
    """In a worker. A worker with other versions of anything that matters refuses.

    The study comes as bytes: dask would unpack it before double precision is on, and so round its numbers.
    """
    import jax

    with _one_at_a_time:
        jax.config.update("jax_enable_x64", True)
        keep_compiled_programs()
        about: Any = pickle.loads(packed)
        if about.description != description:
            raise RuntimeError("A worker has another version of jaxcage, jax or NumPy than this process.")
        return about.chunk(chunk)


@contextlib.contextmanager
def _client(scheduler: str | None, workers: int | None) -> Iterator[Any]:
    distributed = import_distributed()
    if scheduler is not None:
        try:
            there = distributed.Client(scheduler, timeout=f"{WAIT_S}s")
        except ValueError as error:
            said = f"must be an address such as tcp://host:8786, but '{scheduler}' was given."
            raise ArgumentError("scheduler", said=said) from error
        with there as client:
            client.wait_for_workers(1, timeout=WAIT_S)
            yield client
        return
    from dask import config

    with (
        tempfile.TemporaryDirectory() as scratch,
        config.set({"distributed.scheduler.allowed-failures": DEATHS}),
        distributed.LocalCluster(
            n_workers=workers or cores(),
            threads_per_worker=1,
            dashboard_address=":0",
            local_directory=scratch,
            memory_limit=0,
        ) as cluster,
        distributed.Client(cluster) as client,
    ):
        yield client
