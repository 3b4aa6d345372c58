"""`jaxcage validate`: our numbers beside independent ones, on the screen and as VALIDATION.md."""

import time
from typing import Any

from ..io import replacing
from ..validation import TOPICS, Comparison, page
from ._console import progress_in_stages
from ._errors import UsageError
from ._inputs import output_folder
from ._options import ValidateOptions
from ._report import Report, Table


NAME = "VALIDATION.md"


def run(options: ValidateOptions) -> Report:
    """Carry out `jaxcage validate`."""
    chosen = options.topics.replace(",", " ").split() if options.topics else list(TOPICS)
    unknown = [t for t in chosen if t not in TOPICS]
    if unknown or not chosen:
        given = unknown[0] if unknown else options.topics
        raise UsageError(f"Option --topics must be made of {', '.join(TOPICS)}, but '{given}' was given.")
    folder = output_folder(options)
    began = time.perf_counter()
    found: dict[str, list[Comparison]] = {}
    with progress_in_stages("validate") as bar:
        for i, topic in enumerate(chosen):
            if bar is not None:
                bar(topic, i, len(chosen))
            found[topic] = TOPICS[topic]()
    command = "jaxcage validate" + (f' --topics "{options.topics}"' if options.topics else "")
    with replacing(folder / NAME) as temporary:
        temporary.write_text(page(found, f"Made by `{command}`."), encoding="utf-8")
    failed = [c for rows in found.values() for c in rows if not c.passed]
    count = sum(map(len, found.values()))
    document: dict[str, Any] = {
        "comparisons": [_document(topic, c) for topic, rows in found.items() for c in rows],
        "passed": count - len(failed),
        "failed": len(failed),
        "page": str(folder / NAME),
        "seconds": round(time.perf_counter() - began, 1),
    }
    notes = [
        f"{document['passed']} of {count} comparisons pass",
        f"Page: {document['page']}",
        f"Time: {document['seconds']} s",
    ]
    failure = f"{len(failed)} of {count} comparisons fail, the first of them: {failed[0].what}." if failed else ""
    return Report(document, [_table(topic, rows) for topic, rows in found.items()], notes, failure)


def _document(topic: str, c: Comparison) -> dict[str, Any]:
    return {"topic": topic, **vars(c), "difference": c.difference, "passed": c.passed}


def _table(topic: str, rows: list[Comparison]) -> Table:
    cells = [
        (
            c.what,
            f"{c.theirs:.9g}",
            f"{c.ours:.9g}",
            f"{c.difference:+.1e}",
            f"{c.tolerance:.1e}",
            "pass" if c.passed else "FAILS",
        )
        for c in rows
    ]
    return Table(topic.capitalize(), ("what", "theirs", "ours", "difference", "tolerance", ""), cells)
