"""Labels of trajectories, zones of a sweep, survival of chaos, spectra, and measures of a motion.

| module        | responsibility                                                                       |
|---------------|--------------------------------------------------------------------------------------|
| `labels`      | periodic, chaotic, quasi-periodic, undecided or failed; the motion of a cage's centre |
| `survival`    | times at which lanes left chaos; its mean life; escape rate by speed and design       |
| `sweep`       | results of a sweep at each speed                                                     |
| `zones`       | zones and both kinds of edge; stretches of speed with the same labels                |
| `spectra`     | amplitude spectra by order of speed                                                  |
| `rollers`     | rollers of a whole bearing around its circumference; spectra with named lines        |
| `measures`    | whirl ratio, displacement, film, forces, impulse, drag of a motion                   |
| `loads`       | loads of the guiding land, size and whirl of the motion, after a sweep               |
"""

from .._arguments import check_layer
from .labels import (
    CHAOS_THRESHOLD as CHAOS_THRESHOLD,
    CLOSING_TOLERANCE as CLOSING_TOLERANCE,
    LABELS as LABELS,
    LONGEST_PERIOD as LONGEST_PERIOD,
    closing_period as closing_period,
    decay as decay,
    label_lanes as label_lanes,
    motion_label as motion_label,
    on_torus as on_torus,
    scatter as scatter,
)
from .loads import LAND_LOADS as LAND_LOADS, land_loads as land_loads, land_reading as land_reading, motions as motions
from .measures import (
    ONE_ROLLER as ONE_ROLLER,
    Measured as Measured,
    Measures as Measures,
    cage_forces as cage_forces,
    largest_forces as largest_forces,
    measures as measures,
)
from .rollers import (
    RollerHistory as RollerHistory,
    around as around,
    bearing_spectra as bearing_spectra,
    named_lines as named_lines,
    pocket_force_distribution as pocket_force_distribution,
)
from .spectra import (
    OrderSpectrum as OrderSpectrum,
    Peak as Peak,
    dominant_orders as dominant_orders,
    spectrum_of as spectrum_of,
)
from .survival import (
    CONFIRM as CONFIRM,
    Hazard as Hazard,
    Survival as Survival,
    calm_at_the_end as calm_at_the_end,
    calm_threshold as calm_threshold,
    escape_times as escape_times,
    hazard as hazard,
    survival as survival,
)
from .sweep import (
    LIFE_BLOCK as LIFE_BLOCK,
    chaotic_share as chaotic_share,
    cure as cure,
    failed as failed,
    lasting as lasting,
    length as length,
    outcomes as outcomes,
    resolution_rpm as resolution_rpm,
    restless as restless,
    small as small,
    summary as summary,
    survival_at as survival_at,
    to_decide as to_decide,
    too_short as too_short,
)
from .zones import (
    Edge as Edge,
    Stretch as Stretch,
    Zone as Zone,
    Zones as Zones,
    closing_width as closing_width,
    lives_in_words as lives_in_words,
    runs as runs,
    stretches as stretches,
    zones as zones,
)


check_layer(globals(), "around cage_forces measures stretches summary survival zones")
