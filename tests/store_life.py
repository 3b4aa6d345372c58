"""The life of a store as a state machine: runs, kills, damage, readers and two processes in any order.

What the store must say is not taken from a model of it but from its bytes: a chunk of which each file is what an
unbroken run wrote is finished, any other one pending. Used by `test_studies_damage`.
"""

import multiprocessing
import os
import random
import shutil
import signal
from pathlib import Path
from typing import Any

import hypothesis.strategies as st
import store_faults as faults
from hypothesis.stateful import RuleBasedStateMachine, invariant, precondition, rule

from jaxcage.studies import Plan, Study, check_study, open_study, run_study


REFUSED, LOST = 3, 4
"""Exit statuses of a child: one sentence, or what nobody expected."""
CHUNKS = 6


def serve(pipe: Any, study: Study, results: dict[int, Any]) -> None:
    """The second process: each call is a child of it, killed at a point of its writing if that is asked for."""
    Study.chunk = lambda self, number: results[number]
    while (asked := pipe.recv()) is not None:
        store, shard, last = asked
        if (child := os.fork()) == 0:
            os._exit(_run(study, store, shard, last))
        pipe.send(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]))


def _run(study: Study, store: str, shard: tuple[int, int], last: int) -> int:
    done = 0

    def counted(call: Any) -> Any:
        def run(*args: Any, **kwargs: Any) -> Any:
            nonlocal done
            done += 1
            if done == last:
                os.kill(os.getpid(), signal.SIGKILL)
            return call(*args, **kwargs)

        return run

    for name in ("replace", "rename", "fsync", "mkdir"):
        setattr(os, name, counted(getattr(os, name)))
    try:
        run_study(study, store, shard)
    except (ValueError, OSError) as error:
        return REFUSED if str(error).endswith(".") and "\n" not in str(error) else LOST
    except BaseException:
        return LOST
    return 0


class Other:
    """The second process."""

    def __init__(self, bench: faults.Bench):
        assert bench.study.fingerprint  # worked out here: the process itself never starts JAX, and so may fork
        context = multiprocessing.get_context("spawn")
        self.pipe, theirs = context.Pipe()
        self.process = context.Process(target=serve, args=(theirs, bench.study, bench.results), daemon=True)
        self.process.start()

    def begin(self, store: Path, shard: tuple[int, int] = (1, 1), last: int = 0) -> None:
        """Have it run a shard, and be killed at the `last` step of its writing, if that is not 0."""
        self.pipe.send((str(store), shard, last))

    def end(self) -> int:
        """Exit status of what it began."""
        assert self.pipe.poll(60), "the other process does not answer"
        return self.pipe.recv()

    def close(self) -> None:
        self.pipe.send(None)
        self.process.join(10)


class StoreLife(RuleBasedStateMachine):
    """Anything that may become of a store."""

    def __init__(self, bench: faults.Bench, other: Other, folder: Path):
        super().__init__()
        self.bench, self.other, self.store = bench, other, folder / "life.zarr"
        self.count = 0
        shutil.rmtree(self.store, ignore_errors=True)

    @property
    def there(self) -> bool:
        return os.path.lexists(self.store)

    def differing(self) -> set[int]:
        return set(self.bench.differing(self.store)) if self.there else set(range(CHUNKS))

    def here(self, shard: tuple[int, int] = (1, 1)) -> list[int] | None:
        """Run a shard in this process. **Returns:** what was computed, None if it was refused in a sentence."""
        computed: list[int] = []
        true = Study.chunk
        Study.chunk = lambda _, number: computed.append(number) or self.bench.results[number]
        try:
            run_study(self.bench.study, self.store, shard)
        except (ValueError, OSError) as error:
            self.bench.said(error, self.store)
            return None
        finally:
            Study.chunk = true
        return computed

    def given_up(self) -> None:
        """What nobody can recognise any more is put away by its user."""
        shutil.rmtree(self.store)

    shards = st.sampled_from([(1, 1), (1, 2), (2, 2), (2, 3)])

    @rule(shard=shards)
    def start_or_resume(self, shard: tuple[int, int]) -> None:
        before = self.differing()
        mine = set(range(CHUNKS)[shard[0] - 1 :: shard[1]])
        computed = self.here(shard)
        if computed is None:
            return self.given_up()
        assert computed == sorted(mine & before) and self.differing() == before - mine

    @rule(shard=shards, last=st.integers(1, 60))
    def the_other_is_killed(self, shard: tuple[int, int], last: int) -> None:
        before = self.differing()
        self.other.begin(self.store, shard, last)
        status = self.other.end()
        assert status in (0, REFUSED, -signal.SIGKILL), status
        if status == REFUSED:
            return self.given_up()
        assert self.differing() <= before, "a kill undid what was finished"

    @rule(mine=shards, theirs=shards, last=st.sampled_from([0, 0, 5, 25]))
    def both_at_once(self, mine: tuple[int, int], theirs: tuple[int, int], last: int) -> None:
        before = self.differing()
        self.other.begin(self.store, theirs, last)
        computed = self.here(mine)
        status = self.other.end()
        assert status in (0, REFUSED, -signal.SIGKILL), status
        if computed is None or status == REFUSED:
            return self.given_up()
        done = set(range(CHUNKS)[mine[0] - 1 :: mine[1]])
        done |= set(range(CHUNKS)[theirs[0] - 1 :: theirs[1]]) if status == 0 else set()
        assert self.differing() <= before - done

    @precondition(lambda self: self.there)
    @rule(kind=st.sampled_from(sorted(faults.FAULTS)), seed=st.integers(0, 2**32))
    def damage(self, kind: str, seed: int) -> None:
        files = sorted(faults.contents(self.store))
        if not any("/c/" in name for name in files):
            return
        faults.FAULTS[kind](random.Random(seed), self.store, files)

    @precondition(lambda self: self.there)
    @rule()
    def extend(self) -> None:
        """More revolutions are another study: refused, and nothing is changed."""
        before = faults.contents(self.store)
        study = self.bench.study
        plan = Plan(study.plan.grid, {}, 0, 0, 2, 2)
        longer = Study(study.system, plan, study.method, 10, 40, 4, 2, 3)
        try:
            run_study(longer, self.store)
        except (ValueError, OSError) as error:
            self.bench.said(error, self.store)
        else:
            raise AssertionError("another study was mixed in")
        assert faults.contents(self.store) == before

    @rule()
    def finish(self) -> None:
        """Whatever came before, the store of an unbroken run, byte for byte, and nothing left beside it."""
        if self.here() is None:
            self.given_up()
            assert self.here() == list(range(CHUNKS))
        assert faults.contents(self.store) == self.bench.files
        assert [p.name for p in self.store.parent.iterdir()] == [self.store.name]

    @invariant()
    def what_is_read_is_true(self) -> None:
        if not self.there:
            for read in (open_study, check_study):
                try:
                    read(self.store)
                except FileNotFoundError:
                    continue
                raise AssertionError("there is nothing to read")
            return
        pending = sorted(self.differing())
        self.bench.read(self.store, pending)
        try:
            state = check_study(self.store)
        except (ValueError, OSError) as error:
            return self.bench.said(error, self.store)
        assert not state.chunks or state.finished == CHUNKS - len(pending)
