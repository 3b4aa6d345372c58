"""Make again what the pages show: `python -m benchmarks.remake [NAME ...] [--list] [--force]`.

A name is that of a block, or of a page: readme, edges, speed.md. Output is kept under `out/remade`, and a
command that ended well with the package as it is does not run again. What changed is printed.
"""

import argparse
import difflib
import pathlib
import shutil
import sys
from collections.abc import Sequence

from ._runs import ROOT, Run, fingerprint, folder_of, kept, run
from ._shown import SHOWN, Shown
from ._stamps import mark, read, stamp, state, write


Outcomes = dict[str, Run | None]
"""What came of each command in this session."""


def arguments(words: Sequence[str] | None, table: Sequence[Shown]) -> argparse.Namespace:
    """What the command line says."""
    about = (__doc__ or "").split("\n\n")
    parser = argparse.ArgumentParser(prog="python -m benchmarks.remake", description=about[0], epilog=about[1])
    parser.add_argument("names", nargs="*", metavar="NAME", help="blocks or pages, everything if left out")
    parser.add_argument("--list", action="store_true", help="what there is, whether it is fresh, and its commands")
    parser.add_argument("--force", action="store_true", help="run what was run before, too")
    parser.add_argument("--mark", action="store_true", help="run nothing, only say under each block how old it is")
    parser.add_argument("--read", action="store_true", help="numbers put in by hand are those of the latest run")
    given = parser.parse_args(words)
    unknown = [name for name in given.names if not any(s.answers_to(name) for s in table)]
    if unknown:
        parser.error(f"nothing is called {', '.join(unknown)}: --list shows the names")
    given.chosen = [s for s in table if not given.names or any(map(s.answers_to, given.names))]
    return given


def obtain(commands: Sequence[str], done: Outcomes, table: Sequence[Shown], force: bool, root: pathlib.Path) -> bool:
    """Run those commands that have not been run; whether all ended well."""
    for command in commands:
        if command in done:
            continue
        found = None if force else kept(command, fingerprint(root), root)
        if found is None:
            print(f"running {command}", flush=True)
            in_place = {name for s in table if command in s.commands for name in s.in_place}
            found = run(command, sorted(in_place), root)
            said = f"{found.record['seconds']} s" if found else f"failed: see {folder_of(command, root)}"
            print(f"  {said}", flush=True)
        done[command] = found
    return all(done[command] for command in commands)


def make(shown: Shown, runs: Sequence[Run], root: pathlib.Path) -> list[str]:
    """Put what the commands made into the page; the lines that changed."""
    before, _ = read(shown, root)
    for name, left in shown.files.items():
        shutil.copy(runs[0].folder / (left or pathlib.Path(name).name), root / name)
    after = shown.excerpt(runs) if shown.excerpt else before
    write(shown, after, stamp(shown, after, runs[0], root), fingerprint(root), root)
    if shown.page.endswith(".ipynb"):
        return []
    changes = difflib.unified_diff(before.splitlines(), after.splitlines(), lineterm="", n=0)
    return [line for line in changes if not line.startswith(("---", "+++", "@@"))]


def remake(chosen: Sequence[Shown], table: Sequence[Shown], force: bool, root: pathlib.Path) -> int:
    """Make what is not fresh; how many failed."""
    done: Outcomes = {}
    failed = 0
    for shown in chosen:
        if not force and state(shown, fingerprint(root), root) == "fresh":
            print(f"{shown.name}: fresh")
            continue
        if not obtain(shown.commands, done, table, force, root):
            print(f"{shown.name}: left as it was")
            failed += 1
            continue
        if shown.by_hand:
            print(f"{shown.name}: read {folder_of(shown.commands[0], root)}, correct {shown.page}, then --read it")
            continue
        try:
            changed = make(shown, [r for c in shown.commands if (r := done[c])], root)
        except (ValueError, KeyError, IndexError, OSError) as error:
            print(f"{shown.name}: left as it was, for the output is not what was expected ({error!r})")
            failed += 1
            continue
        print(f"{shown.name}: made", *changed, sep="\n  ", flush=True)
    return failed


def accept(chosen: Sequence[Shown], root: pathlib.Path) -> None:
    """Stamp numbers that were put in by hand with the latest run of their command."""
    tree = fingerprint(root)
    for shown in (s for s in chosen if s.by_hand):
        found = kept(shown.commands[0], tree, root)
        if found is None:
            print(f"{shown.name}: {shown.commands[0]} has not been run with the package as it is")
            continue
        content, _ = read(shown, root)
        write(shown, content, stamp(shown, content, found, root), tree, root)


def show(chosen: Sequence[Shown], root: pathlib.Path) -> None:
    """What there is."""
    tree = fingerprint(root)
    width = max(len(s.name) for s in chosen)
    for s in chosen:
        more = f" and {len(s.commands) - 1} more" if len(s.commands) > 1 else ""
        print(f"{s.name:<{width}}  {state(s, tree, root):<15}  {s.page:<24}  {s.commands[0]}{more}")


def main(words: Sequence[str] | None = None, table: Sequence[Shown] = SHOWN, root: pathlib.Path = ROOT) -> int:
    """Carry the command out."""
    given = arguments(words, table)
    if given.list:
        show(given.chosen, root)
        return 0
    if given.read:
        accept(given.chosen, root)
        return 0
    failed = 0 if given.mark else remake(given.chosen, table, given.force, root)
    for shown in table:
        mark(shown, fingerprint(root), root)
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
