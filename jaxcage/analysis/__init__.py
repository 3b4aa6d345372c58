"""Analysis of forced systems: what a lane does, where zones begin and end, spectra, stability, measures.

| module          | responsibility                                                                       |
|-----------------|--------------------------------------------------------------------------------------|
| `_observe`      | plan of a sweep, and what it sees of a lane                                    |
| `_sweep`        | the result of a sweep                                                                |
| `_labels`       | periodic, chaotic, quasi-periodic, undecided or failed                               |
| `_zones`        | zones and both kinds of edge                                                         |
| `_zero_one`     | the 0-1 test for chaos                                                               |
| `_escapes`      | when lanes left chaos for good                                                       |
| `_transients`   | an attractor or a chaotic transient: mean life with its error, coexisting ends       |
| `_hazard`       | the rate of escapes as it depends on speed and design                                |
| `_spectra`      | amplitude spectra by order of speed                                                  |
| `_equilibrium`  | equilibrium of the cage in its film, dynamic coefficients, whirl threshold           |
| `_bearing_history` | forces and slips of every roller of it, around its circumference; its spectra     |
| `_bearing_measures` | slips, forces, losses, state of the whole bearing                                |
| `_bearing_sweep` | the result of a sweep of the whole bearing                                         |
| `_bearing_zones` | stretches of shaft speed in which its cage does the same                           |
| `_measures`     | whirl ratio, displacement, film, forces, impulse, drag of an orbit                   |
"""

from .._arguments import check_layer
from ._bearing_history import (
    Around as Around,
    BearingHistory as BearingHistory,
    around as around,
    bearing_history as bearing_history,
    bearing_orders as bearing_orders,
    bearing_spectra as bearing_spectra,
    named_lines as named_lines,
    pocket_force_distribution as pocket_force_distribution,
)
from ._bearing_measures import (
    CAGE_STATES as CAGE_STATES,
    BearingMeasures as BearingMeasures,
    bearing_measures as bearing_measures,
    cage_state as cage_state,
    equivalent_synchronous_force as equivalent_synchronous_force,
)
from ._bearing_sweep import (
    AVERAGED as AVERAGED,
    STATISTIC_UNITS as STATISTIC_UNITS,
    BearingRecord as BearingRecord,
    BearingSweep as BearingSweep,
    OfLanes as OfLanes,
    summed_up as summed_up,
)
from ._bearing_zones import BearingZone as BearingZone, bearing_zones as bearing_zones
from ._equilibrium import (
    LARGEST_WHIRLING as LARGEST_WHIRLING,
    Equilibrium as Equilibrium,
    attitude_angle as attitude_angle,
    dimensional as dimensional,
    eccentricity_ratio as eccentricity_ratio,
    equilibrium as equilibrium,
    film_coefficients as film_coefficients,
    film_whirl_speed as film_whirl_speed,
    load_number as load_number,
    stability_chart as stability_chart,
    whirl_threshold as whirl_threshold,
)
from ._escapes import (
    CONFIRM as CONFIRM,
    calm_at_the_end as calm_at_the_end,
    calm_threshold as calm_threshold,
    dips as dips,
    escape_times as escape_times,
)
from ._hazard import Hazard as Hazard, hazard as hazard
from ._labels import (
    CHAOS_THRESHOLD as CHAOS_THRESHOLD,
    CLOSING_TOLERANCE as CLOSING_TOLERANCE,
    LONGEST_PERIOD as LONGEST_PERIOD,
    closing_period as closing_period,
    decay as decay,
    label_lanes as label_lanes,
    on_torus as on_torus,
    scatter as scatter,
    too_few_revolutions as too_few_revolutions,
)
from ._measures import (
    OrbitMeasures as OrbitMeasures,
    cage_forces as cage_forces,
    cage_moments as cage_moments,
    film_drag_power as film_drag_power,
    orbit_measures as orbit_measures,
    relative_state as relative_state,
    winding as winding,
)
from ._observe import Observation as Observation, Plan as Plan, start_tangents as start_tangents
from ._spectra import (
    OrderSpectrum as OrderSpectrum,
    Peak as Peak,
    dominant_orders as dominant_orders,
    order_spectrum as order_spectrum,
    spectrum_of as spectrum_of,
    whirl_spectrum as whirl_spectrum,
)
from ._sweep import LIFE_BLOCK as LIFE_BLOCK, Confirmation as Confirmation, Sweep as Sweep
from ._transients import (
    Comparison as Comparison,
    Share as Share,
    Survival as Survival,
    coexisting as coexisting,
    compare as compare,
    survival as survival,
    when_t0_doubles as when_t0_doubles,
)
from ._zero_one import mean_square_displacement as mean_square_displacement, zero_one as zero_one
from ._zones import (
    Edge as Edge,
    Zone as Zone,
    Zones as Zones,
    closing_width as closing_width,
    lives_in_words as lives_in_words,
    zones as zones,
)


check_layer(
    globals(),
    "around bearing_history bearing_measures cage_forces cage_moments equilibrium film_coefficients film_whirl_speed "
    "orbit_measures order_spectrum stability_chart survival zero_one zones",
)
