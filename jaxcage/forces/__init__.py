"""Force laws on the cage: pure functions of arrays, and modules that hold their parameters.

| module       | responsibility                                                                        |
|--------------|---------------------------------------------------------------------------------------|
| `law`        | base classes of laws, the motion they depend on, the clearance of the guide           |
| `film`       | short-bearing oil film of the rib lands, three film models, (25)-(28)                 |
| `contact`    | line contact of the lands, with restitution                                           |
| `support`    | springs, cubic stiffness, damping and cross-coupling, (16), (20); rigid or elastic rib |
| `impact`     | roller-bar impact oscillator (14); synchronous impacts (15) or roller by roller       |
| `pulse`      | Fourier integrals of the force of one impact                                          |
| `inertia`    | weight, and centrifugal force of the cage's mass centre                               |
| `elementary` | regularised elementary functions                                                      |

Frame: x to the right, y up, rotation positive counter-clockwise; forces act on the cage.
"""

from .._parameters import choice as choice, count as count, parameter as parameter
from .contact import (
    ContactForce as ContactForce,
    LandContact as LandContact,
    contact_force as contact_force,
    restitution_damping as restitution_damping,
)
from .elementary import (
    cos_sin as cos_sin,
    inverse_root as inverse_root,
    power_10_9 as power_10_9,
    smooth_norm as smooth_norm,
    smooth_plus as smooth_plus,
)
from .film import (
    FilmForce as FilmForce,
    FilmModel as FilmModel,
    RibFilm as RibFilm,
    arc_centre as arc_centre,
    film_drive as film_drive,
    film_resistance as film_resistance,
    film_scale as film_scale,
    half_circle_resistance as half_circle_resistance,
)
from .impact import (
    BarPulse as BarPulse,
    ImpactFromBearing as ImpactFromBearing,
    PocketImpact as PocketImpact,
    RollerPassImpact as RollerPassImpact,
    SynchronousForce as SynchronousForce,
    SynchronousImpact as SynchronousImpact,
    approach_speed as approach_speed,
    bar_pulse as bar_pulse,
    impact_history as impact_history,
    pulse_spectrum as pulse_spectrum,
    pulse_train as pulse_train,
)
from .inertia import (
    UnbalanceForce as UnbalanceForce,
    UnbalanceReading as UnbalanceReading,
    WeightForce as WeightForce,
    effective_eccentricity as effective_eccentricity,
)
from .law import (
    AbstractForce as AbstractForce,
    AbstractForcing as AbstractForcing,
    AbstractLaw as AbstractLaw,
    Force as Force,
    Land as Land,
    Motion as Motion,
)
from .support import ElasticRib as ElasticRib, RigidRib as RigidRib, Support as Support


LAWS: tuple[type[AbstractLaw], ...] = (
    *(RibFilm, LandContact, Support),
    *(SynchronousImpact, ImpactFromBearing, RollerPassImpact),
)
"""Built-in laws of a cage and its configuration file, in the order in which forces are listed and added."""
