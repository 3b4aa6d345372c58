"""Force laws on the cage: pure functions of arrays, one law per file, and modules that hold their parameters.

| module             | responsibility                                                              |
|--------------------|-----------------------------------------------------------------------------|
| `_film`            | short-bearing oil film of the rib lands, three film models, (25)-(28)       |
| `_contact`         | line contact of the lands, with restitution                                 |
| `_support`         | springs, cubic stiffness, damping and cross-coupling, (16), (20)            |
| `_rib`             | rigid or elastic rib                                                        |
| `_unbalance`       | centrifugal force of the cage's mass centre                                 |
| `_gravity`         | weight                                                                      |
| `_pocket_impact`   | roller-bar impact oscillator (14) and its force history                     |
| `_impact_forcing`  | impacts on the cage: synchronous (15) or roller by roller                   |
| `_smooth`          | regularised elementary functions                                            |

Frame: x to the right, y up, rotation positive counter-clockwise; forces act on the cage.
"""

from ._contact import (
    contact_force as contact_force,
    LandContact as LandContact,
    restitution_damping as restitution_damping,
)
from ._film import (
    film_drive as film_drive,
    film_pressure as film_pressure,
    film_resistance as film_resistance,
    film_scale as film_scale,
    FilmModel as FilmModel,
    full_resistance as full_resistance,
    half_circle_resistance as half_circle_resistance,
    fixed_half_resistance as fixed_half_resistance,
    RibFilm as RibFilm,
    short_film_force as short_film_force,
    supply_force as supply_force,
)
from ._gravity import weight as weight
from ._impact_forcing import (
    pulse_spectrum as pulse_spectrum,
    pulse_train as pulse_train,
    pulse_train_force as pulse_train_force,
    PulseTrain as PulseTrain,
    RollerPassImpact as RollerPassImpact,
    synchronous_amplitude as synchronous_amplitude,
    synchronous_force as synchronous_force,
    SynchronousImpact as SynchronousImpact,
)
from ._pocket_impact import (
    approach_speed as approach_speed,
    impact_history as impact_history,
    impact_time_scale as impact_time_scale,
    ImpactHistory as ImpactHistory,
    PocketImpact as PocketImpact,
)
from ._rib import ElasticRib as ElasticRib, rib_force as rib_force, RigidRib as RigidRib
from ._smooth import power_10_9 as power_10_9, smooth_norm as smooth_norm, smooth_plus as smooth_plus
from ._support import (
    Cross as Cross,
    cross_force as cross_force,
    Cubic as Cubic,
    cubic_stiffness as cubic_stiffness,
    spring_force as spring_force,
    Support as Support,
)
from ._unbalance import (
    effective_eccentricity as effective_eccentricity,
    unbalance_force as unbalance_force,
    UnbalanceReading as UnbalanceReading,
)
