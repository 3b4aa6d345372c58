"""The names that `jaxcage` offers, by layer; the layers hold the rest. Loaded when the first of them is asked for."""

from . import (
    analysis as analysis,
    bearing as bearing,
    design as design,
    forces as forces,
    models as models,
    orbits as orbits,
    solve as solve,
    studies as studies,
    sweeps as sweeps,
)
from ._checks import enable_x64 as enable_x64
from ._parameters import parameter_info as parameter_info, parameters as parameters, replace as replace
from .analysis import (
    BearingSweep as BearingSweep,
    Sweep as Sweep,
    Zones as Zones,
    bearing_measures as bearing_measures,
    equilibrium as equilibrium,
    orbit_measures as orbit_measures,
    survival as survival,
    zones as zones,
)
from .bearing import Bearing as Bearing, Lubricant as Lubricant
from .design import DesignSpace as DesignSpace, optimise as optimise
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
    loss_zones as loss_zones,
    periodic_orbit as periodic_orbit,
    sensitivity as sensitivity,
    synchronous_orbits as synchronous_orbits,
)
from .solve import (
    Trajectory as Trajectory,
    bearing_over_time as bearing_over_time,
    method as method,
    native as native,
    ramp as ramp,
    simulate as simulate,
    strobe_map as strobe_map,
)
from .studies import label_map as label_map, open_study as open_study, study as study
from .sweeps import (
    rpm as rpm,
    run_up_down as run_up_down,
    sweep as sweep,
    sweep_bearing as sweep_bearing,
    sweep_bearings as sweep_bearings,
    sweep_designs as sweep_designs,
)
