"""`jaxcage` with its JSON document beside its tables: `python -m benchmarks.remake._record FILE sweep 1a`."""

import json
import pathlib
import sys

from jaxcage.cli import _main
from jaxcage.cli._show import Report, plain


def main() -> int:
    """Carry the command out and write what `--json` would print to a file too."""
    file, *arguments = sys.argv[1:]
    sys.argv = ["jaxcage", *arguments]
    shown = _main._print

    def both(report: Report, as_json: bool) -> None:
        pathlib.Path(file).write_text(json.dumps(plain(report.document), indent=2, allow_nan=False), encoding="utf-8")
        shown(report, as_json)

    _main._print = both
    return _main.main()


if __name__ == "__main__":
    sys.exit(main())
