"""Largest exponents of the default sweep beside those of 8 times the steps, and beside the reference's growth.

The growth of the same tangent vector from the same settled state is compared revolution by revolution: nothing there
depends on how long one looks.
"""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

import jaxcage as jc
from jaxcage.analysis import failed
from jaxcage.lanes import start_tangents
from tests import reference

from .truth_models import Subject, by_kind, pair


SOFT = {"stiffness_x": 1e7, "stiffness_y": 1e7}
SOFT_RPM, SOFT_EXPONENT = 600.0, -0.321
"""Case 1a on such a support, at which an L-stable method with too few steps had -38.3 once."""
LEAST = 0.01
"""Difference of two exponents that is none."""
SIGMAS = 3.0
REVOLUTIONS = 6
"""Revolutions of the reference."""
SPEEDS = 3
"""Largest number of speeds of a model that are compared with the reference."""
BUDGET = 1e6
"""Evaluations of the reference's field."""


class Beside(NamedTuple):
    """Growth from one settled state, revolution by revolution."""

    rpm: float
    ours: np.ndarray
    theirs: np.ndarray
    stated: float
    """Change of the sum of ours with half as many steps."""

    @property
    def apart(self) -> float:
        """Difference of the mean growths."""
        return float(abs(np.mean(self.ours) - np.mean(self.theirs)))

    @property
    def off(self) -> bool:
        """Further apart than is stated, and than counts."""
        return not self.apart <= max(LEAST, self.stated)


def beside(model: jc.CageModel, rpm: float, state: np.ndarray, method: Any = None) -> Beside | None:
    """The growth from a state by the package and by the reference; None where this does not finish."""
    speed = float(jc.rpm(rpm))
    options = dict(discard=0, revolutions=REVOLUTIONS, blocks=REVOLUTIONS, method=method, confirm=False, horizon=0)
    ours = jc.sweep(model, speed, initial_states=state[None, None], **options)  # pyright: ignore[reportArgumentType]
    if failed(ours)[0, 0]:  # as a start beyond the clearance is
        return None
    along = [float(c) for c in start_tangents(state.size, 1)[0]]
    try:
        theirs = reference.growth(reference.field(model, speed), state, REVOLUTIONS, direction=along, budget=BUDGET)
    except (reference.TooLong, ValueError, ArithmeticError):
        return None
    return Beside(rpm, ours["block_growth"].values[0, 0, :, 0], theirs, float(abs(ours["doubt"].values[0, 0, 0])))


def settled(sweep: xr.Dataset) -> list[tuple[int, int]]:
    """Lanes that are neither chaotic nor lost, one start of a speed, few of them spread over the speeds."""
    calm = ~failed(sweep) & (sweep["label"].values != "chaotic")
    speeds = np.flatnonzero(np.any(calm, axis=1))
    chosen = speeds[:: max(1, -(-speeds.size // SPEEDS))]
    return [(int(i), int(np.argmax(calm[i]))) for i in chosen]


def moved(ours: xr.Dataset, theirs: xr.Dataset) -> tuple[np.ndarray, np.ndarray]:
    """Differences of the exponents of lanes with one label that is not chaos, and which are beyond the error."""
    label = ours["label"].values
    alike = (label == theirs["label"].values) & ~failed(ours) & (label != "chaotic")
    of = lambda name: [sweep[name].values[..., 0][alike] for sweep in (ours, theirs)]
    apart, error = np.abs(np.subtract(*of("exponents"))), np.hypot(*of("standard_error"))
    return apart, apart > np.maximum(SIGMAS * error, LEAST)


def soft() -> list[str]:
    """Case 1a on a soft support: its exponent once was that of the steps."""
    model = jc.replace(jc.case("1a"), **SOFT)
    found = jc.sweep(model, jc.rpm(SOFT_RPM), discard=100, revolutions=100, horizon=0)
    exponents = found["exponents"].values[0, :, 0]
    print(f"\n1a, support of 1e7 N/m, {SOFT_RPM:g} rpm: exponents {exponents.round(4)}, expected {SOFT_EXPONENT}")
    good = np.all(np.abs(exponents - SOFT_EXPONENT) < LEAST)
    return [] if good else [f"1a on the soft support has {exponents}, not {SOFT_EXPONENT}"]


COLUMNS = ("lanes", "beyond", "largest", "states", "OFF", "median", "largest")
HEAD = f"{'':44s}" + "".join(f"{x:>9s}" for x in COLUMNS)


def report(found: Sequence[Subject], quick: bool) -> list[str]:
    """largest exponents beside 8 times the steps, and growth beside the reference"""
    wrong = soft()
    beyond = off = 0
    for kind, group in by_kind(found).items():
        print(f"\nExponents, {kind}: beside 8 times the steps, and beside the reference\n{HEAD}", flush=True)
        for subject in group:
            ours, theirs = pair(subject, quick)
            apart, bad = moved(ours, theirs)
            lanes = [beside(subject.model, float(ours["rpm"][i]), ours["last"].values[i, j]) for i, j in settled(ours)]
            known = [lane for lane in lanes if lane is not None]
            away = [lane.apart for lane in known]
            text = f"{apart.size:9d}{np.sum(bad):9d}{np.max(apart, initial=0.0):9.0e}{len(known):9d}"
            text += f"{sum(lane.off for lane in known):9d}{np.median(away or [np.nan]):9.0e}"
            print(f"{subject.name:44s}{text}{max(away, default=np.nan):9.0e}", flush=True)
            for lane in known:
                if lane.off:
                    print(f"  {lane.rpm:.1f} rpm: {lane.ours.round(4)}, reference {lane.theirs.round(4)}")
            beyond += int(np.sum(bad))
            off += sum(lane.off for lane in known)
    wrong += [f"{beyond} exponents differ from those of 8 times the steps"] if beyond else []
    return wrong + ([f"{off} differ from the reference"] if off else [])
