"""The published results beside ours.

| module         | responsibility                                                        |
|----------------|-----------------------------------------------------------------------|
| `_edges`       | the eighteen published edges beside the edges found                   |
| `_runs`        | the sweeps and strobe sections that everything else is read from       |
| `_conclusions` | the paper's conclusions, with what was computed and a verdict          |
| `_readings`    | what each ambiguous reading of the paper does to the zones             |
| `_figures`     | its figures 5, 7, 8 and 9                                              |
"""

from ._conclusions import Conclusion as Conclusion, conclusions as conclusions
from ._edges import ComparedEdge as ComparedEdge, compare_edges as compare_edges, zones_in_range as zones_in_range
from ._figures import paper_figures as paper_figures
from ._readings import READINGS as READINGS, ReadingResult as ReadingResult, try_readings as try_readings
from ._runs import Runs as Runs, run_all as run_all
