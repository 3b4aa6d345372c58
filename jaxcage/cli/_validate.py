"""`jaxcage validate`: our numbers beside independent ones, on the screen and as VALIDATION.md."""

from .._errors import InputError
from ..report import Table
from ..validation import TOPICS, Comparison, page
from ._job import Job
from ._options import ValidateOptions
from ._show import Report


NAME = "VALIDATION.md"
COLUMNS = {
    "what": "{.what}",
    "theirs": "{.theirs:.9g}",
    "ours": "{.ours:.9g}",
    "difference": "{.difference:+.1e}",
    "tolerance": "{.tolerance:.1e}",
    "": lambda c: "pass" if c.passed else "FAILS",
}


def validate(job: Job[ValidateOptions]) -> Report:
    """Carry out `jaxcage validate`."""
    options = job.options
    topics = options.topics.replace(",", " ").split() if options.topics else list(TOPICS)
    wrong = [t for t in topics if t not in TOPICS] or ([] if topics else [options.topics])
    if wrong:
        raise InputError(f"Option --topics must be made of {', '.join(TOPICS)}, but '{wrong[0]}' was given.")
    found: dict[str, list[Comparison]] = {}
    with job.computing() as say:
        for i, topic in enumerate(topics):
            say(topic, i, len(topics))
            found[topic] = TOPICS[topic]()
    command = "jaxcage validate" + (f' --topics "{options.topics}"' if options.topics else "")
    job.text(page(found, f"Made by `{command}`."), job.folder / NAME, "page")
    failed = [c for rows in found.values() for c in rows if not c.passed]
    count = sum(map(len, found.values()))
    document = {
        "comparisons": [
            {"topic": topic, **vars(c), "difference": c.difference, "passed": c.passed}
            for topic, rows in found.items()
            for c in rows
        ],
        "passed": count - len(failed),
        "failed": len(failed),
    }
    failure = f"{len(failed)} of {count} comparisons fail, the first of them: {failed[0].what}." if failed else ""
    tables = [Table.of(topic.capitalize(), COLUMNS, rows) for topic, rows in found.items()]
    return Report(document, tables, [f"{count - len(failed)} of {count} comparisons pass"], failure)
