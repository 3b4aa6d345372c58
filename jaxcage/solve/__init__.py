"""Integration of many lanes in machine code: the law traced in JAX, the loop over steps in LLVM.

| module   | responsibility                                                              |
|----------|-----------------------------------------------------------------------------|
| `ir`     | a traced scalar function as LLVM IR on vectors of lanes                     |
| `loop`   | the integration loop: step control, strobe states, growth of tangents       |
| `machine`| tracing a system, compiling, keeping and calling its code                   |
| `method` | the method of sweeps, and what serves where machine code does not           |
"""

from .ir import UnknownOperation as UnknownOperation
from .loop import FINISHED as FINISHED, NOT_FINITE as NOT_FINITE, OUTSIDE as OUTSIDE
from .machine import FIRST_STEP as FIRST_STEP, Engine as Engine, March as March
from .method import NativeSteps as NativeSteps, native as native, refined as refined
