"""Periodic orbits and their bifurcations beside 8 times the steps, and beside the reference.

An orbit is wrong by more than it says where the reference does not come back to its state: the distance, put through
(1 - M)^-1, is how far the true orbit is. A bifurcation is solved again by shooting on the reference's revolutions.
"""

from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np

import jaxcage as jc
from jaxcage.solve import FixedSteps
from tests import reference

from .truth_models import Subject, by_kind, pair


TIMES = 8
SPEEDS = 3
"""Orbits of a model, at most."""
LONGEST = 4
"""Revolutions of an orbit, at most."""
SPAN = 1.25
"""Bifurcations are looked for at speeds up to so many times above and below an orbit's."""
POINTS = 1
"""Bifurcations of a model that are solved again, at most; each takes the reference a minute."""
CERTAIN = 1e-6
"""The reference counts where its integrators agree to this [scale]."""
FLOOR = 1e-8
"""Error that counts as none: of states over the scale, and of speeds, relative."""
WIDEST = 2e-4
"""Relative error of a bifurcation at most, whatever its cause."""


class Beside(NamedTuple):
    """One number or state, by the package and by something finer."""

    what: str
    stated: float
    steps: float
    """Distance to the result by 8 times the steps; NaN where it was not made."""
    reference: float
    """Distance to the reference's; NaN where it does not know."""

    @property
    def off(self) -> bool:
        """Further away than it says."""
        return any(x > self.stated + FLOOR for x in (self.steps, self.reference))

    def __str__(self) -> str:
        return f"{self.what}: stated {self.stated:.1e}, 8 x steps {self.steps:.1e}, reference {self.reference:.1e}"


def found_orbits(subject: Subject, quick: bool) -> Iterator[jc.Orbit]:
    """Orbits to which lanes of the default sweep lead, of each speed one, few of them spread over the speeds."""
    sweep, _ = pair(subject, quick)
    label = sweep["label"].values
    period = np.zeros(label.shape, dtype=int)
    for k in range(1, LONGEST + 1):
        period[label == f"periodic-{k}"] = k
    good = period > 0
    speeds = np.flatnonzero(np.any(good, axis=1))
    for i in speeds[:: max(1, -(-speeds.size // SPEEDS))]:
        j = int(np.argmax(good[i]))
        guess, speed = tuple(sweep["last"].values[i, j].tolist()), float(sweep["speed"][i])
        yield jc.periodic_orbit(subject.model, speed, int(period[i, j]), guess=guess)


def finer(orbit: Any, times: int = TIMES) -> FixedSteps:
    """Method of an orbit or a point, with more steps."""
    assert isinstance(orbit.method, FixedSteps)
    return FixedSteps(orbit.method.solver, times * int(orbit.steps))


def orbit_beside(subject: Subject, orbit: jc.Orbit) -> Beside:
    """An orbit's state [scale], with what is stated of it."""
    field = reference.field(subject.model, float(orbit.speed))
    state, periods = np.asarray(orbit.state), int(orbit.periods)
    inverse = np.linalg.inv(np.eye(state.size) - np.asarray(orbit.monodromy))
    stated = float(orbit.error) * float(np.max(np.sum(np.abs(inverse), axis=1)))
    fine = jc.periodic_orbit(subject.model, orbit.speed, periods, guess=orbit, method=finer(orbit))
    steps = float(np.max(np.abs(np.asarray(fine.state) - state) / field.scale))
    try:
        end = reference.confirmed(field, state, periods)
        away = float(np.max(np.abs(inverse @ ((end.strobe[-1] - state) / field.scale))))
    except (reference.Outside, reference.TooLong):
        end, away = None, np.nan
    known = end is not None and end.spread <= CERTAIN
    name = f"{subject.kind} {subject.name}, period {periods} at {float(orbit.speed) * 30 / np.pi:.1f} rpm"
    return Beside(f"{name}, {int(orbit.steps)} steps", stated, steps, away if known else np.nan)


def edges(subject: Subject, orbit: jc.Orbit) -> list[Any]:
    """Bifurcations near an orbit of period one, those with stability on one side first, the least certain of them.
    There are none where the branch needs more steps than continuation takes: the orbit is counted beside its steps."""
    speed = float(orbit.speed)
    try:
        found = jc.branch(subject.model, orbit, lower=speed / SPAN, upper=speed * SPAN)
    except ValueError as error:
        print(f"  {subject.kind} {subject.name}: {error}", flush=True)
        return []
    shootable = [p for p in found.special if p.kind in ("fold", "period-doubling", "Neimark-Sacker")]
    return sorted(shootable, key=lambda p: (not p.edge, -p.error))


def edge_beside(subject: Subject, point: Any, quick: bool) -> Beside:
    """A bifurcation's speed, relative."""
    fine = jc.bifurcation(subject.model, point.kind, point, method=jc.method("rk4", steps=TIMES * point.steps))
    make = lambda speed: reference.field(subject.model, float(speed))
    try:
        theirs = np.nan if quick else reference.bifurcation(make, point.kind, point.state, point.speed)
    except (RuntimeError, reference.Outside, reference.TooLong, ValueError, ArithmeticError):
        theirs = np.nan
    apart = [float(abs(x / point.speed - 1)) for x in (fine.speed, theirs)]
    name = f"{subject.kind} {subject.name}, {point.kind} at {point.speed_rpm:.4f} rpm, {point.steps} steps"
    return Beside(name, float(point.error / point.speed), *apart)


COLUMNS = ("orbits", "none", "OFF", "largest", "points", "unknown", "OFF", "largest")
HEAD = f"{'':44s}" + "".join(f"{x:>10s}" for x in COLUMNS)


def row(beside: Sequence[Beside], unknown: int) -> str:
    """Numbers of all, of those not known and of those that are off, and the largest distance."""
    apart = np.nanmax([[b.steps, b.reference] for b in beside]) if beside else np.nan
    return f"{len(beside):10d}{unknown:10d}{sum(b.off for b in beside):10d}{apart:10.0e}"


def report(found: Sequence[Subject], quick: bool) -> list[str]:
    """periodic orbits and bifurcations beside 8 times the steps, and beside the reference"""
    every: list[Beside] = []
    wide: list[Beside] = []
    for kind, group in by_kind(found).items():
        print(f"\nOrbits and bifurcations, {kind}\n{HEAD}", flush=True)
        for subject in group:
            orbits = list(found_orbits(subject, quick))
            known = [orbit for orbit in orbits if bool(orbit.converged)]
            states = [orbit_beside(subject, orbit) for orbit in known]
            single = [orbit for orbit in known if int(orbit.periods) == 1]
            points = edges(subject, single[0]) if single else []
            settled = [p for p in points if np.isfinite(p.value)]
            places = [edge_beside(subject, p, quick) for p in settled[:POINTS]]
            text = row(states, len(orbits) - len(known)) + row(places, len(points) - len(settled))
            print(f"{subject.name:44s}{text}", flush=True)
            print(*[f"  {b}" for b in (*states, *places) if b.off or b in places], sep="\n", flush=True)
            every += states + places
            wide += [b for b in places if max(b.steps, b.stated) > WIDEST]
    off = sum(b.off for b in every)
    wrong = [f"{off} orbits or bifurcations are off by more than they say"] if off else []
    return wrong + ([f"{len(wide)} bifurcations are wider than {WIDEST:g}"] if wide else [])
