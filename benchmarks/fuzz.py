"""Random and hostile files, command lines and calls: `python -m benchmarks.fuzz [--count 10000] [--seed 0]`.

A third are TOML files, a third command lines, whose computations are not carried out, and a third calls of public
functions with strange arguments. Each is refused with one sentence, or means what it says: see `tests/hostile.py` for
how they are made and what is checked. Prints one JSON document; exit status 1 if anything else happened.
"""

import argparse
import collections
import json
import pathlib
import tempfile
import time
import traceback
from collections.abc import Callable
from typing import Any

import jax
from hypothesis import HealthCheck, Phase, given, seed, settings
from hypothesis.strategies import SearchStrategy


jax.config.update("jax_enable_x64", True)

from tests import hostile


KINDS = {hostile.SilentDefault: "silent defaults", hostile.Unclear: "unclear refusals", hostile.Astray: "writes astray"}
SHOWN = 10
"""Inputs shown of those that went wrong."""


class Tally:
    """What became of all inputs."""

    def __init__(self):
        self.count: collections.Counter[str] = collections.Counter()
        self.wrong: list[dict[str, str]] = []

    def note(self, check: Callable[[], str], given: Any) -> None:
        """Check one input."""
        try:
            self.count[check()] += 1
        except Exception as error:
            kind = KINDS.get(type(error), "tracebacks")
            self.count[kind] += 1
            if len(self.wrong) < SHOWN:
                last = traceback.extract_tb(error.__traceback__)[-1]
                what = f"{type(error).__name__}: {error} ({last.filename}, line {last.lineno})"
                self.wrong.append({"kind": kind, "what": what[-500:], "given": repr(given)[:1000]})


def many(strategy: SearchStrategy[Any], count: int, start: int, note: Callable[[Any], None]) -> None:
    """Have `note` called with `count` values of a strategy."""
    modest = settings(
        max_examples=count,
        deadline=None,
        database=None,
        phases=[Phase.generate],
        suppress_health_check=[HealthCheck.too_slow, HealthCheck.filter_too_much, HealthCheck.data_too_large],
    )
    seed(start)(modest(given(strategy)(note)))()


def run(count: int, start: int) -> dict[str, Any]:
    """Make and check `count` inputs."""
    begin, tally = time.perf_counter(), Tally()
    with tempfile.TemporaryDirectory() as place:
        folder = pathlib.Path(place)
        toml = folder / "fuzzed.toml"
        read = lambda data: "files accepted" if hostile.check_file(data, toml) else "files refused"
        third = count // 3
        many(hostile.files(), count - 2 * third, start, lambda data: tally.note(lambda: read(data), data))
        toml.unlink()
        with hostile.playground(folder), hostile.without_computing() as understood:
            carry_out = lambda line: f"commands {hostile.check_line(line, understood)}"
            many(hostile.lines(), third, start, lambda line: tally.note(lambda: carry_out(line), line.arguments))
    call = lambda given: f"calls {hostile.check_function(*given)}"
    many(hostile.calls(), third, start, lambda given: tally.note(lambda: call(given), given))
    counts = dict.fromkeys(["tracebacks", *KINDS.values()], 0) | dict(sorted(tally.count.items()))
    seconds = round(time.perf_counter() - begin, 1)
    return {"inputs": sum(counts.values()), **counts, "seconds": seconds, "wrong": tally.wrong}


def main() -> None:
    """Run and report."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.fuzz", description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--count", type=int, default=10_000, help="files, command lines and calls in all")
    parser.add_argument("--seed", type=int, default=0, help="another seed makes other ones")
    chosen = parser.parse_args()
    found = run(chosen.count, chosen.seed)
    print(json.dumps(found, indent=2))
    raise SystemExit(1 if found["wrong"] else 0)


if __name__ == "__main__":
    main()
