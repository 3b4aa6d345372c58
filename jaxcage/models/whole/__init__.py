"""The whole bearing: rollers, pockets, cage, guiding land, inner ring.

| module        | responsibility                                                              |
|---------------|-----------------------------------------------------------------------------|
| `_model`      | parameters; Archard's law for the cage                                      |
| `_traction`   | Gupta's traction law, odd and smooth                                        |
| `_raceway`    | line contacts with damping, and the energy they store                       |
| `_pockets`    | bars of the cage under rollers, dry friction, stiffness of a bar            |
| `_drag`       | drag and churning                                                           |
| `_contacts`   | every contact of the rollers, one set of numbers for both bodies            |
| `_guide`      | film and contact of the guiding land, on cage and ring                      |
| `_state`      | state, what is integrated beside it                                         |
| `_field`      | equations of motion at one shaft speed                                      |
| `_energy`     | energy, angular momentum                                                    |
| `_starts`     | states to start from, magnitudes                                            |
| `_catalogue`  | ready-made bearings with their sources                                      |
"""

from ._catalogue import WHOLE_BEARINGS as WHOLE_BEARINGS, whole_bearing as whole_bearing
from ._drag import RollerDrag as RollerDrag
from ._energy import (
    cage_angular_momentum as cage_angular_momentum,
    kinetic_energy as kinetic_energy,
    potential_energy as potential_energy,
)
from ._field import MOVING as MOVING, BearingAtSpeed as BearingAtSpeed, Passed as Passed
from ._model import BearingModel as BearingModel, InnerRing as InnerRing, Wear as Wear
from ._pockets import Pockets as Pockets, bar_stiffness as bar_stiffness
from ._raceway import Raceways as Raceways
from ._starts import (
    CAGE_STARTS as CAGE_STARTS,
    CagePlace as CagePlace,
    drawn_places as drawn_places,
    rolling_start as rolling_start,
    state_scale as state_scale,
)
from ._state import (
    LEDGER as LEDGER,
    MEANS as MEANS,
    PEAKS as PEAKS,
    BearingState as BearingState,
    Bodies as Bodies,
    Rates as Rates,
    Rollers as Rollers,
)
from ._traction import Traction as Traction, TractionCurve as TractionCurve
