"""AUTO-07p: its Debian package (`apt-get install auto-07p gfortran`) on our equations, in a folder of its own."""

import os
import pathlib
import resource
import shutil
import subprocess
from typing import Any

import numpy as np


LIBRARY = pathlib.Path("/usr/lib/auto-07p/lib")
KINDS = {5: "fold", 6: "branch-point", 7: "period-doubling", 8: "Neimark-Sacker"}
"""Kinds of special points of orbits, by the numbers that AUTO gives them."""
CONSTANTS = """dat='start'
NDIM={dimension}, IPS=2, IRS=0, ILP=1, ICP=[1, 11]
NTST={intervals}, NCOL=4, IAD=3, ISP=2, ISW=1, IPLT=0
NMX=4000, NPR=0, MXBF=0, IID=2, ITMX=9, ITNW=7, NWTN=3, JAC=0
EPSL=1e-9, EPSU=1e-9, EPSS=1e-8
DS={step}, DSMIN=1e-6, DSMAX={longest}, IADS=1
THL={{11: 0.0}}
RL0=0.0, RL1=10.0, A0=-1e9, A1=1e9
UZSTOP={{1: {end!r}}}
"""


def missing() -> str | None:
    """Why it cannot take part."""
    if not LIBRARY.joinpath("libauto_c.a").exists():
        return "not installed"
    return None if shutil.which("cc") and shutil.which("gfortran") else "no compiler"


def spent() -> float:
    """Processor seconds of all processes that this one started and that have ended."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def build(folder: pathlib.Path, law: str) -> float:
    """Compile and link the equations. **Returns:** processor seconds."""
    began = spent()
    one = ["cc", "-O2", f'-DLAW="{law}"', "-c", "auto_equations.c"]
    objects = [str(p) for p in sorted(LIBRARY.glob("*.o"))]
    two = ["gfortran", "-fopenmp", "auto_equations.o", *objects, f"-L{LIBRARY}", "-lauto_c", "-o", "auto.exe"]
    for command in (one, two):
        subprocess.run(command, cwd=folder, check=True, capture_output=True)
    return spent() - began


def run(
    folder: pathlib.Path, orbit: np.ndarray, end: float, intervals: int, longest: float = 0.05
) -> tuple[dict[str, Any], float]:
    """Follow the branch from `orbit`, rows of phase, state, cosine and sine, to `end` (speed over the first).

    **Returns:** numbers of points and special points (kind, speed over the first), and processor seconds.
    """
    np.savetxt(folder / "start.dat", orbit, fmt="%.16e")
    step = 0.1 * longest * (1 if end > 1 else -1)
    settings = {"dimension": orbit.shape[1] - 1, "intervals": intervals, "step": step, "longest": longest, "end": end}
    folder.joinpath("fort.2").write_text(CONSTANTS.format(**settings))
    began = spent()
    one_core = {**os.environ, "OMP_NUM_THREADS": "1"}
    subprocess.run(["./auto.exe"], cwd=folder, check=True, capture_output=True, env=one_core)
    return read(folder.joinpath("fort.7").read_text()), spent() - began


def read(diagram: str) -> dict[str, Any]:
    """Points and special points of AUTO's bifurcation diagram: rows of branch, point, type, label, parameter."""
    rows = [line.split()[:5] for line in diagram.splitlines()]
    rows = [row for row in rows if row and row[0] != "0"]
    special = [[KINDS[abs(int(r[2])) % 10], float(r[4])] for r in rows if abs(int(r[2])) % 10 in KINDS]
    return {"points": len(rows), "special": special}
