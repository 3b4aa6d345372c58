"""The names that `jaxcage` offers, by layer; the layers hold the rest. Loaded when the first of them is asked for."""

from . import (
    analysis as analysis,
    bearing as bearing,
    design as design,
    files as files,
    forces as forces,
    lanes as lanes,
    models as models,
    orbits as orbits,
    show as show,
    solve as solve,
)
from ._arguments import enable_x64 as enable_x64
from ._parameters import parameter_info as parameter_info, parameters as parameters, replace as replace
from .analysis import (
    measures as measures,
    stretches as stretches,
    summary as summary,
    zones as zones,
)
from .bearing import Bearing as Bearing, Lubricant as Lubricant
from .design import Requirements as Requirements, Tolerance as Tolerance, design_for as design_for
from .lanes import (
    label_map as label_map,
    open_study as open_study,
    rpm as rpm,
    study as study,
    sweep as sweep,
)
from .models import (
    BearingModel as BearingModel,
    CageModel as CageModel,
    ForcedOscillator as ForcedOscillator,
    ForcedSystem as ForcedSystem,
    case as case,
    whole_bearing as whole_bearing,
)
from .orbits import (
    Branch as Branch,
    Orbit as Orbit,
    Point as Point,
    bifurcation as bifurcation,
    branch as branch,
    curve as curve,
    periodic_orbit as periodic_orbit,
    sensitivity as sensitivity,
    synchronous_orbits as synchronous_orbits,
    unstable_ranges as unstable_ranges,
)
from .solve import (
    Trajectory as Trajectory,
    method as method,
    native as native,
    ramp as ramp,
    simulate as simulate,
    strobe_map as strobe_map,
)
