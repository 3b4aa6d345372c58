"""Everything shown, made again by one command: `python -m benchmarks.remake`.

| module | responsible for |
|---|---|
| `_shown` | the one table of what is shown: where it stands and what makes it |
| `_excerpts` | how the output of commands becomes a block of a page |
| `_runs` | commands run and kept under `out/remade`, so that a second run goes on where the first stopped |
| `_record` | `jaxcage` with its JSON document written beside its tables |
| `_stamps` | blocks of pages and notebooks, and the stamps under them |
| `__main__` | the command |
"""
