"""Systems that can be integrated and analysed.

| module       | responsibility                                                                  |
|--------------|---------------------------------------------------------------------------------|
| `protocol`   | the model protocol                                                              |
| `field`      | dy/dtau at one speed, its linearisation, elimination of positions               |
| `cage`       | the cage in its rib: parameters, and forces at one speed                        |
| `cases`      | the paper's six cases as models                                                 |
| `oscillator` | systems from a user's function, of first or second order                        |
| `bearing_model` | the whole bearing: parameters, initial states, magnitudes, ready-made bearings |
| `bearing_states` | its state, and the quantities beside it                                       |
| `bearing_field` | its equations of motion at one shaft speed                                     |
| `bearing_reports` | its quantities, and the forces on every roller along a time history           |
| `contacts`   | its contacts: raceways, pockets, guiding land, oil                              |
| `cage_quantities` | quantities that a cage reports of a time history                           |
"""

from .._arguments import check_layer
from .bearing_field import MOVING as MOVING, BearingAtSpeed as BearingAtSpeed, Passed as Passed
from .bearing_model import (
    WHOLE_BEARINGS as WHOLE_BEARINGS,
    BearingModel as BearingModel,
    Wear as Wear,
    drawn_places as drawn_places,
    rolling_start as rolling_start,
    state_scale as state_scale,
    whole_bearing as whole_bearing,
)
from .bearing_reports import (
    RollerHistory as RollerHistory,
    bearing_orders as bearing_orders,
    roller_history as roller_history,
)
from .bearing_states import (
    BESIDE as BESIDE,
    INTEGRATED as INTEGRATED,
    LEDGER as LEDGER,
    OF_BODIES as OF_BODIES,
    OF_ROLLER as OF_ROLLER,
    WATCHED as WATCHED,
    BearingState as BearingState,
    Bodies as Bodies,
    Rollers as Rollers,
    bodies_of as bodies_of,
    rollers_of as rollers_of,
)
from .cage import FORCES as FORCES, NEEDED as NEEDED, CageModel as CageModel
from .cage_quantities import CageHistory as CageHistory, cage_quantities as cage_quantities
from .cases import case as case
from .contacts import Pockets as Pockets, Raceways as Raceways, Traction as Traction
from .field import (
    AbstractField as AbstractField,
    FirstOrderField as FirstOrderField,
    Linearisation as Linearisation,
    ScaledField as ScaledField,
    divide as divide,
    multiply as multiply,
)
from .oscillator import ForcedOscillator as ForcedOscillator, ForcedSystem as ForcedSystem
from .protocol import (
    ESCAPE as ESCAPE,
    INSTEAD as INSTEAD,
    AbstractForcedSystem as AbstractForcedSystem,
    require_known as require_known,
    require_speeds as require_speeds,
)


check_layer(globals(), "case rolling_start whole_bearing")
