"""Analysis of forced systems."""

from ._labels import closing_period as closing_period, label_lanes as label_lanes
from ._observe import Observation as Observation, observe as observe, Plan as Plan
from ._sweep import Sweep as Sweep
from ._zones import Edge as Edge, Zone as Zone, Zones as Zones, zones as zones
