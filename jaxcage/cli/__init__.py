"""The `jaxcage` command: each command is a function whose signature and docstring tyro reads.

| module             | responsibility                                                              |
|--------------------|-----------------------------------------------------------------------------|
| `wrapper`          | options, the case, errors, exit status, what every command prints           |
| `options`          | types of options, and the groups that commands share                        |
| `progress`         | progress, warnings and signals, on standard error                           |
| `answer`           | the answer of a command: printed, written to files, as JSON                 |
| `subject`          | a case or a file read into a model, and its speeds                          |
| `values`           | `NAME=VALUES` read into numbers                                             |
| `speed_commands`   | commands that run the model: at one speed, over speed, over anything        |
| `orbit_commands`   | commands about periodic orbits: edges, gradients, maps                      |
| `design_commands`  | commands about designs: better ones, tolerances, unknown values             |
| `case_commands`    | commands about the case itself: file, verdict, statics, report              |

Modules of commands use the library within the functions, so that help and errors of typing answer at once.
"""

from .wrapper import main as main
