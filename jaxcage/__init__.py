"""Differentiable dynamics of rolling-bearing cages.

| layer        | responsibility                                                                      |
|--------------|-------------------------------------------------------------------------------------|
| `bearing`    | geometry, materials, lubricant, kinematics, statics, catalogue, published cases     |
| `forces`     | rib film, land contact, pocket impact, support, unbalance, gravity: one law a file  |
| `models`     | the forced-system protocol, the cage in its rib                                     |
| `integrate`  | stiff solvers as diffrax solvers, time histories, the strobe map                    |
| `analysis`   | strobe sections, exponents, labels, zones, spectra, stability, measures             |
| `sweeps`     | lanes in chunks on all cores; sweeps over speed; run-up and run-down                |
| `orbits`    | periodic orbits, branches, bifurcation points and their derivatives                 |
| `design`    | constants identified from edges; objectives, optimisation, tolerances               |
| `validation` | numbers beside printed ones, closed forms and other programs                       |
| `io`, `plotting` | TOML in, xarray and zarr out, units at the door; figures                        |
| `studies`    | sweeps over any parameters, stored as they go; adaptive maps                        |
| `report`     | tables of what was found; one HTML page about a design                              |
| `cli`        | the `jaxcage` command                                                               |

SI units inside, always; y points up and rotation is positive counter-clockwise.
"""

import os as _os


# XLA's loader reports every program kept on disk as an error on processors for which it has tuning flags of its own.
# What really goes wrong is raised as an exception. JAX itself sets the variable to 1, also for the processes that a
# script starts; whoever wants XLA's log sets it to 0.
if _os.environ.get("TF_CPP_MIN_LOG_LEVEL", "1") == "1":
    _os.environ["TF_CPP_MIN_LOG_LEVEL"] = "3"

from ._cache import keep_compiled_programs as keep_compiled_programs
from ._checks import enable_x64 as enable_x64
from ._parameters import (
    parameter_info as parameter_info,
    parameters as parameters,
    replace as replace,
)
from .analysis import (
    Edge as Edge,
    Equilibrium as Equilibrium,
    OrbitMeasures as OrbitMeasures,
    Survival as Survival,
    Sweep as Sweep,
    Waterfall as Waterfall,
    Zone as Zone,
    Zones as Zones,
    cage_forces as cage_forces,
    dominant_orders as dominant_orders,
    equilibrium as equilibrium,
    film_coefficients as film_coefficients,
    film_whirl_speed as film_whirl_speed,
    orbit_measures as orbit_measures,
    order_spectrum as order_spectrum,
    stability_chart as stability_chart,
    survival as survival,
    waterfall as waterfall,
    zero_one as zero_one,
    zones as zones,
)
from .bearing import (
    PUBLISHED_CASES as PUBLISHED_CASES,
    Bearing as Bearing,
    Lubricant as Lubricant,
    cage_mass as cage_mass,
    load_distribution as load_distribution,
    nu2310 as nu2310,
    published_case as published_case,
    static_cage_displacement as static_cage_displacement,
    vg as vg,
)
from .design import (
    AbstractObjective as AbstractObjective,
    Candidate as Candidate,
    ChaosMeasure as ChaosMeasure,
    DesignSpace as DesignSpace,
    EdgeClearance as EdgeClearance,
    EdgeSum as EdgeSum,
    Fit as Fit,
    FollowedEdges as FollowedEdges,
    Measured as Measured,
    MeasuredEdge as MeasuredEdge,
    Optimised as Optimised,
    Optimum as Optimum,
    Price as Price,
    Robust as Robust,
    Smooth as Smooth,
    StabilityMargin as StabilityMargin,
    TrackedEdges as TrackedEdges,
    Unknown as Unknown,
    chaotic_share as chaotic_share,
    chaotic_width as chaotic_width,
    cost as cost,
    fit_edges as fit_edges,
    global_sensitivity as global_sensitivity,
    optimise as optimise,
    pareto_front as pareto_front,
    rayleigh as rayleigh,
    regular_motion as regular_motion,
    screen as screen,
    tolerance_budget as tolerance_budget,
    uniform as uniform,
    zone_width as zone_width,
)
from .forces import (
    ElasticRib as ElasticRib,
    LandContact as LandContact,
    PocketImpact as PocketImpact,
    RibFilm as RibFilm,
    RigidRib as RigidRib,
    RollerPassImpact as RollerPassImpact,
    Support as Support,
    SynchronousImpact as SynchronousImpact,
)
from .integrate import (
    OUTCOMES as OUTCOMES,
    RESULTS as RESULTS,
    AbstractMethod as AbstractMethod,
    AdaptiveSteps as AdaptiveSteps,
    FixedSteps as FixedSteps,
    NewmarkBeta as NewmarkBeta,
    Rodas3 as Rodas3,
    Rodas4 as Rodas4,
    StrobeMap as StrobeMap,
    Trajectory as Trajectory,
    controlled as controlled,
    method as method,
    ramp as ramp,
    simulate as simulate,
    strobe_map as strobe_map,
)
from .models import (
    AbstractForcedSystem as AbstractForcedSystem,
    CageModel as CageModel,
    ForcedOscillator as ForcedOscillator,
    ForcedSystem as ForcedSystem,
    case as case,
    dimensionless_groups as dimensionless_groups,
)
from .orbits import (
    BifurcationPoint as BifurcationPoint,
    Branch as Branch,
    Cascade as Cascade,
    Curve as Curve,
    Located as Located,
    LossZones as LossZones,
    Orbit as Orbit,
    Sensitivity as Sensitivity,
    SpecialPoint as SpecialPoint,
    Steps as Steps,
    SynchronousOrbits as SynchronousOrbits,
    bifurcation as bifurcation,
    branch as branch,
    branches as branches,
    cascade as cascade,
    coexisting_orbits as coexisting_orbits,
    curve as curve,
    doubled_branch as doubled_branch,
    explain as explain,
    leading_multiplier as leading_multiplier,
    loss_zones as loss_zones,
    periodic_orbit as periodic_orbit,
    sensitivities as sensitivities,
    sensitivity as sensitivity,
    synchronous_orbits as synchronous_orbits,
)
from .studies import (
    Between as Between,
    LabelMap as LabelMap,
    Tolerance as Tolerance,
    label_map as label_map,
    open_study as open_study,
    study as study,
)
from .sweeps import (
    Hysteresis as Hysteresis,
    monodromy as monodromy,
    rpm as rpm,
    run_up_down as run_up_down,
    run_up_down_designs as run_up_down_designs,
    sweep as sweep,
    sweep_designs as sweep_designs,
)


__version__ = "0.1.0"
