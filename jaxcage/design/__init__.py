"""Constants and designs chosen by what they do to the zones.

| module      | responsibility                                                               |
|-------------|------------------------------------------------------------------------------|
| `_unknowns` | constants to be found: bounds, scales, the models that they make              |
| `_measured` | edges from a test rig or a publication                                        |
| `_screen`   | the global stage of identification: chaos where it was measured               |
| `_tracked`  | exact edges as differentiable functions of the unknowns                       |
| `_fit`      | the local stage: least squares on exact edges, what the data do and do not fix |
"""

from ._fit import Combination as Combination, Fit as Fit, FittedEdge as FittedEdge, fit_edges as fit_edges
from ._measured import MeasuredEdge as MeasuredEdge
from ._screen import Candidate as Candidate, screen as screen
from ._tracked import TrackedEdges as TrackedEdges
from ._unknowns import Unknown as Unknown
