"""Systems that can be integrated and analysed.

| module       | responsibility                                                                  |
|--------------|---------------------------------------------------------------------------------|
| `system`     | the forced-system protocol                                                      |
| `field`      | dy/dtau at one speed, its linearisation, elimination of positions               |
| `cage`       | the cage in its rib: parameters, and forces at one speed                        |
| `cases`      | the paper's six cases as models, constants that it does not print               |
| `oscillator` | systems from a user's function, of first or second order                        |
| `whole`      | the whole bearing: rollers, pockets, cage, guiding land, inner ring             |
"""

from .._arguments import check_layer
from .cage import (
    FASTEST as FASTEST,
    FORCES as FORCES,
    NEEDED as NEEDED,
    CageAtSpeed as CageAtSpeed,
    CageModel as CageModel,
    fastest_speed as fastest_speed,
    require_speeds as require_speeds,
)
from .cases import CONSTANTS as CONSTANTS, Constants as Constants, case as case
from .field import (
    AbstractField as AbstractField,
    AbstractLinearisation as AbstractLinearisation,
    FirstOrderField as FirstOrderField,
    ScaledField as ScaledField,
    SecondOrderField as SecondOrderField,
    divide as divide,
    multiply as multiply,
)
from .oscillator import ForcedOscillator as ForcedOscillator, ForcedSystem as ForcedSystem
from .system import (
    ESCAPE as ESCAPE,
    INSTEAD as INSTEAD,
    AbstractForcedSystem as AbstractForcedSystem,
    require_known as require_known,
)
from .whole import (
    BearingModel as BearingModel,
    BearingState as BearingState,
    rolling_start as rolling_start,
    whole_bearing as whole_bearing,
)


check_layer(
    globals(),
    "case fastest_speed rolling_start whole_bearing",
)
