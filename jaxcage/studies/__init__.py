"""Studies: sweeps too large for one sitting, stored as they go.

| module      | responsibility                                                                |
|-------------|-------------------------------------------------------------------------------|
| `_vary`     | how a parameter is sampled                                                    |
| `_plan`     | what is varied, lanes and chunks                                              |
| `_stored`   | what a store must know of a study                                             |
| `_study`    | what is computed of a cage's lane, the same bits anywhere                     |
| `_whole_study` | what is computed of a whole bearing's                                      |
| `_store`    | the zarr folder, whole at any time                                            |
| `_run`      | runs what a store lacks, in this process                                      |
| `_dask`     | or on dask.distributed                                                        |
| `_identify` | ranges narrowed by what was measured                                           |
| `_ensemble` | chances of chaos of a cage that is known within ranges only                   |
| `_label_map` | labels and exponents over two parameters of a system                         |
"""

from .._arguments import check_layer
from .._sobol import sobol as sobol
from ._ensemble import (
    ENSEMBLE_SPEEDS as ENSEMBLE_SPEEDS,
    REVOLUTIONS as REVOLUTIONS,
    Band as Band,
    Clue as Clue,
    Ensemble as Ensemble,
    binomial_interval as binomial_interval,
    chaotic_shares as chaotic_shares,
    draw as draw,
    ensemble as ensemble,
    verdict_of as verdict_of,
)
from ._identify import Narrowed as Narrowed, identify as identify, misses as misses, narrow as narrow
from ._label_map import KINDS as KINDS, LabelMap as LabelMap, kinds as kinds, label_map as label_map
from ._plan import Plan as Plan
from ._run import run_study as run_study, study as study
from ._store import (
    DamagedStore as DamagedStore,
    OtherStudy as OtherStudy,
    Store as Store,
    check_study as check_study,
    label_names as label_names,
    open_study as open_study,
)
from ._stored import PENDING as PENDING, SPEED as SPEED, AbstractStudy as AbstractStudy
from ._study import (
    LABELS as LABELS,
    OIL as OIL,
    Study as Study,
    too_short as too_short,
    with_values as with_values,
)
from ._vary import Between as Between, Spread as Spread, Tolerance as Tolerance
from ._whole_study import WHOLE_TOLERANCE as WHOLE_TOLERANCE, BearingStudy as BearingStudy


check_layer(
    globals(),
    "check_study label_map open_study study",
)
