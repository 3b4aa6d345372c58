"""The published results beside ours.

| module         | responsibility                                                        |
|----------------|-----------------------------------------------------------------------|
| `_edges`       | the eighteen published edges beside the edges found                   |
| `_observer`    | zones as a reader sees them on a bifurcation diagram                   |
| `_runs`        | the sweeps and strobe sections that everything else is read from       |
| `_conclusions` | the paper's conclusions, with what was computed and a verdict          |
| `_readings`    | what each ambiguous reading of the paper does to the zones             |
"""

from ._conclusions import Conclusion as Conclusion, conclusions as conclusions
from ._edges import (
    AT_FIRST as AT_FIRST,
    LASTING as LASTING,
    LOSS as LOSS,
    ComparedEdge as ComparedEdge,
    compare_edges as compare_edges,
    summary as summary,
    wide_zones as wide_zones,
    zones_in_range as zones_in_range,
)
from ._observer import OBSERVERS as OBSERVERS, Observer as Observer, marks as marks, observed_zones as observed_zones
from ._readings import READINGS as READINGS, ReadingResult as ReadingResult, try_readings as try_readings
from ._runs import (
    SECTION_RPM as SECTION_RPM,
    Runs as Runs,
    edges_of as edges_of,
    ranges_of as ranges_of,
    run_all as run_all,
)
