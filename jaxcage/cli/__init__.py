"""The `jaxcage` command.

| module      | responsibility                                                              |
|-------------|-----------------------------------------------------------------------------|
| `_main`     | entry point: parse, carry out, exit status                                  |
| `_options`  | commands and their options, without heavy imports                           |
| `_errors`   | bad input in one sentence                                                   |
| `_console`  | progress and warnings on standard error                                     |
| `_report`   | result as tables or as JSON                                                 |
| `_inputs`   | case or TOML file, integration method, output folder                        |
| `_quantities` | options that take a number with a unit                                    |
| `_vary`     | what `--vary NAME=VALUES` says                                              |
| `_label_map` | `jaxcage map --points`                                                     |
| `_sweep`, `_zones`, `_poincare`, `_simulate`, `_statics`, `_impact`, `_report_page`, ... | one command each |
"""

from ._main import main as main
