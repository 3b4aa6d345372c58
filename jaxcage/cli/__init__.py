"""The `jaxcage` command: what each command takes, computes and prints.

| module      | responsibility                                                              |
|-------------|-----------------------------------------------------------------------------|
| `_main`     | the runner: options, errors, exit status, what is said after every command  |
| `_options`  | commands, their options, and which go together, without heavy imports       |
| `_readers`  | texts of the command line to numbers, counts and names                      |
| `_vary`     | what `--vary NAME=VALUES` says                                              |
| `_job`      | model, method and output folder that the options ask for; files written     |
| `_console`  | progress and warnings on standard error                                     |
| `_show`     | result as tables or as JSON                                                 |
| `_bearing`  | `init`, `statics`, `impact`                                                 |
| `_one_speed` | `simulate`, `poincare`                                                     |
| `_whole`     | `simulate` of a whole bearing                                              |
| `_whole_sweep` | `sweep` of a whole bearing                                              |
| `_sweep`    | `sweep`, `zones`                                                            |
| `_orbits`   | `bifurcations`, `gradient`                                                  |
| `_lasting`  | `gradient --lasting`                                                        |
| `_map`, `_label_map` | `map`, `map --points`                                              |
| `_design`   | `design`, `sensitivity`                                                     |
| `_study`, `_page`, `_reproduce` | `study`, `report`, `reproduce`                    |

A command is its options, a function that computes with a `Job` and returns a `Report`, and a line in
`_options.COMMANDS`. One that takes a whole bearing too has a function for that, and a line in `WHOLE_COMMANDS`. Tables
and documents are made in `jaxcage.report`, for scripts as well.
"""

from ._main import main as main
