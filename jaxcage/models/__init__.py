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
| `whole`           | the whole bearing: rollers, pockets, cage, guiding land, inner ring              |
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
