"""Periodic orbits of forced systems: found, followed, and differentiated where they bifurcate.

| module         | responsibility                                                                     |
|----------------|------------------------------------------------------------------------------------|
| `_lens`        | parameters by name                                                                 |
| `_problem`     | the equations of an orbit and their unknowns                                       |
| `_newton`      | damped Newton as an optimistix solver                                              |
| `_implicit`    | roots with derivatives by the implicit function theorem                            |
| `_orbit`       | periodic orbits and their multipliers                                              |
| `_liouville`   | the determinant that every monodromy matrix must have                              |
| `_singularity` | matrices and test functions that vanish at bifurcations                            |
| `_point`       | bifurcation points                                                                 |
"""

from ._orbit import Orbit as Orbit, periodic_orbit as periodic_orbit
from ._point import BifurcationPoint as BifurcationPoint, bifurcation as bifurcation
