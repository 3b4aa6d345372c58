"""Systems that can be integrated and analysed.

| module            | responsibility                                                                  |
|-------------------|---------------------------------------------------------------------------------|
| `_system`         | the forced-system protocol; wrappers for a user's function, first or second order |
| `_field`          | dy/dtau at one speed, its linearisation, elimination of positions                |
| `_cage`           | the cage in its rib: parameters                                                  |
| `_cage_at_speed`  | the cage in its rib: forces at one speed                                         |
| `_door`           | refusal of traced arguments and of speeds that no cage has                       |
| `_cases`          | the paper's six cases as models                                                  |
| `_constants`      | what the paper leaves out, in sets                                               |
| `_printed`        | a model as people read it                                                        |
| `_user_law`       | what goes wrong in a law of the user's, in a sentence                            |
| `whole`           | the whole bearing: parameters, starts, magnitudes, ready-made bearings           |
| `whole_states`    | its state, and the quantities beside it                                          |
| `whole_field`     | its equations of motion at one shaft speed                                       |
| `contacts`        | its contacts: raceways, pockets, guiding land, oil                               |
"""

from .._arguments import check_layer
from ._cage import CageModel as CageModel
from ._cage_at_speed import FORCES as FORCES, CageAtSpeed as CageAtSpeed
from ._cases import case as case
from ._constants import CONSTANTS as CONSTANTS, Constants as Constants
from ._door import (
    FASTEST as FASTEST,
    INSTEAD as INSTEAD,
    fastest_speed as fastest_speed,
    require_known as require_known,
    require_speeds as require_speeds,
)
from ._field import (
    AbstractField as AbstractField,
    AbstractLinearisation as AbstractLinearisation,
    FirstOrderField as FirstOrderField,
    ScaledField as ScaledField,
    SecondOrderField as SecondOrderField,
    divide as divide,
    multiply as multiply,
)
from ._system import (
    ESCAPE as ESCAPE,
    AbstractForcedSystem as AbstractForcedSystem,
    ForcedOscillator as ForcedOscillator,
    ForcedSystem as ForcedSystem,
)
from .contacts import (
    Pockets as Pockets,
    Raceways as Raceways,
    RollerDrag as RollerDrag,
    Traction as Traction,
    bar_stiffness as bar_stiffness,
)
from .whole import (
    CAGE_STARTS as CAGE_STARTS,
    WHOLE_BEARINGS as WHOLE_BEARINGS,
    BearingModel as BearingModel,
    BearingOverTime as BearingOverTime,
    CagePlace as CagePlace,
    InnerRing as InnerRing,
    Wear as Wear,
    drawn_places as drawn_places,
    rolling_start as rolling_start,
    slowness as slowness,
    state_scale as state_scale,
    whole_bearing as whole_bearing,
)
from .whole_field import MOVING as MOVING, BearingAtSpeed as BearingAtSpeed, Passed as Passed
from .whole_states import (
    BESIDE as BESIDE,
    INTEGRATED as INTEGRATED,
    LEDGER as LEDGER,
    MEANS as MEANS,
    OF_BODIES as OF_BODIES,
    OF_ROLLER as OF_ROLLER,
    WATCHED as WATCHED,
    BearingState as BearingState,
    Bodies as Bodies,
    Rates as Rates,
    Rollers as Rollers,
    bodies_of as bodies_of,
    rollers_of as rollers_of,
)


check_layer(
    globals(),
    "case fastest_speed rolling_start whole_bearing",
)
