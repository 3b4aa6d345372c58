"""`python -m benchmarks.bearing_trends`: what the literature says of cages, asked of the whole bearing NU2310.

`threshold` looks for the load below which the bearing skids: loads from rolling and from slipping starts, and whether
the slip has settled. `trends` takes eleven statements, an input at four values each and at several loads and speeds,
and says yes, no or undecided by twice the standard error of block means. Both say at what size they ran:
`--starts 3 --discard 100 --revolutions 200` is the full one.
"""

import argparse
import dataclasses
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

import jaxcage as jc
from jaxcage.models.whole import rolling_start


SHAFT = 10000.0
"""Shaft speed of the threshold [rpm]."""
LOADS = (100.0, 150.0, 200.0, 250.0, 300.0, 400.0, 600.0, 1000.0, 4450.0)
SKIDS, ROLLS = 0.05, 0.02
"""Slips above and below which a bearing skids, and rolls."""
SLIPPING = 0.85
"""Cage speed of the slipping start over that of rolling."""
BLOCKS = 10
Condition = tuple[float, float]
"""Load [N] and shaft speed [rpm]."""


@dataclasses.dataclass(frozen=True)
class Seen:
    """Means of blocks of an indicator at one value of an input, from all starts."""

    blocks: np.ndarray

    @property
    def mean(self) -> float:
        """Over starts and blocks."""
        return float(np.mean(self.blocks))

    @property
    def error(self) -> float:
        """Standard error, from the scatter of blocks of all starts; NaN of a single number."""
        if self.blocks.size < 2:
            return float("nan")
        return float(np.std(self.blocks, ddof=1) / np.sqrt(self.blocks.size))

    @property
    def drifts(self) -> bool:
        """Whether the two halves of the run differ by more than twice the error of their difference."""
        half = self.blocks.shape[1] // 2
        if half < 2:
            return False
        first, second = self.blocks[:, :half], self.blocks[:, half:]
        apart = np.hypot(*(np.std(x, ddof=1) / np.sqrt(x.size) for x in (first, second)))
        return abs(np.mean(second) - np.mean(first)) > 2 * apart


Indicator = Callable[[jc.BearingSweep], np.ndarray]


def mean_of(name: str) -> Indicator:
    """Block means, one row per start."""
    return lambda found: found.block_means[name][0]


def scatter_of_slip(found: jc.BearingSweep) -> np.ndarray:
    """How far the slip of each block is from the mean of its start: how unsteady the slip is."""
    slip = found.block_means["cage_slip"][0]
    return np.abs(slip - slip.mean(axis=1, keepdims=True))


def one_of_each_start(name: str) -> Indicator:
    """A quantity that is known of a whole run only: its error is from the scatter of the starts."""
    return lambda found: getattr(found, name)[0][:, None]


@dataclasses.dataclass(frozen=True)
class Statement:
    """What is said of an input: how an indicator goes between two of its four values."""

    words: str
    inputs: Sequence[dict[str, float]]
    indicator: Indicator
    unit: str
    sign: int
    conditions: Sequence[Condition]
    ends: tuple[int, int] = (0, -1)


USUAL: tuple[Condition, ...] = ((4450.0, 10000.0), (300.0, 10000.0), (4450.0, 20000.0))
LIGHT: tuple[Condition, ...] = ((200.0, 10000.0), (300.0, 10000.0))
CLEARANCES = [{"pocket_clearance": 1e-3 * x} for x in (0.15, 0.3, 0.6, 1.2)]
FRICTIONS = [{"pocket_friction": x} for x in (0.01, 0.05, 0.1, 0.2)]
DAMPINGS = [{"pocket_damping": x} for x in (0.1, 0.3, 1.0, 3.0)]
FALLS = [{"limit": x} for x in (0.049, 0.036, 0.024, 0.012)]
WIDE: list[dict[str, float]] = [{"guidance_gap": 0.9e-3, "eccentricity": 1e-6 * x} for x in (5.0, 23.0, 60.0, 120.0)]
BALANCES = [{"eccentricity": 1e-6 * x} for x in (5.0, 23.0, 60.0, 120.0)]
SLIP, CHAOS, SUM = mean_of("cage_slip"), mean_of("exponent"), mean_of("pocket_force_mean_sum_N")
LAND, LARGEST = mean_of("land_power_W"), one_of_each_start("pocket_force_max_N")
STATEMENTS = (
    Statement("some extra pocket clearance calms the cage", CLEARANCES, CHAOS, "exponent", -1, USUAL, (0, 1)),
    Statement("more pocket clearance gives slip", CLEARANCES, SLIP, "slip", 1, USUAL, (1, 3)),
    Statement("a traction curve that falls more makes slip unsteady", FALLS, scatter_of_slip, "scatter", 1, LIGHT),
    Statement("more pocket friction destabilises", FRICTIONS, CHAOS, "exponent", 1, USUAL),
    Statement("pocket lubrication (damping) lowers mean forces", DAMPINGS, SUM, "N", -1, USUAL),
    Statement("pocket lubrication (damping) lowers largest forces", DAMPINGS, LARGEST, "N", -1, USUAL),
    Statement("more unbalance makes the orbit more regular", BALANCES, CHAOS, "exponent", -1, ((4450.0, 20000.0),)),
    Statement("more unbalance wears the land more", BALANCES, LAND, "W", 1, ((4450.0, 20000.0),)),
    Statement("the same, gap 0.9 mm: more regular", WIDE, CHAOS, "exponent", -1, ((4450.0, 10000.0),)),
    Statement("the same, gap 0.9 mm: wears more", WIDE, LAND, "W", 1, ((4450.0, 10000.0),)),
)
RATIOS, GAPS = (0.4, 0.8, 1.2, 1.6), (0.3e-3, 0.6e-3)
"""Pocket clearance over guidance gap, and gaps [m], for the statement that their ratio governs."""


def seen(found: Sequence[jc.BearingSweep], indicator: Indicator) -> list[Seen]:
    """An indicator of every run; of one that is known once for each start, the scatter of the starts."""
    return [Seen(indicator(each)) for each in found]


def verdict(first: Seen, last: Seen, sign: int) -> str:
    """Whether the change goes the way of `sign`, by twice its standard error."""
    change, error = sign * (last.mean - first.mean), np.hypot(first.error, last.error)
    if not np.isfinite(change):
        return "failed"
    if not np.isfinite(error):
        return "undecided, one start"
    said = "yes" if change > 2 * error else "no" if change < -2 * error else "undecided"
    return said + (", drifts" if first.drifts or last.drifts else "")


def trends(starts: int, discard: int, revolutions: int) -> None:
    """Run every design that a statement needs once, and print a table of verdicts."""
    model = jc.whole_bearing("nu2310")
    wanted: dict[float, list[tuple[float, tuple[tuple[str, float], ...]]]] = {}
    for each in STATEMENTS:
        for load, rpm in each.conditions:
            for inputs in each.inputs:
                wanted.setdefault(rpm, []).append((load, tuple(inputs.items())))
    for gap in GAPS:
        for ratio in RATIOS:
            wanted[SHAFT].append((4450.0, (("guidance_gap", gap), ("pocket_clearance", ratio * gap))))
    ran: dict[tuple[float, float, tuple[tuple[str, float], ...]], jc.BearingSweep] = {}
    for rpm, designs in wanted.items():
        distinct = list(dict.fromkeys(designs))
        models = [jc.replace(model, load=load, **dict(inputs)) for load, inputs in distinct]
        length: dict[str, Any] = dict(starts=starts, discard=discard, revolutions=revolutions, blocks=BLOCKS)
        found = jc.sweep_bearings(models, np.array([jc.rpm(rpm)]), **length)
        ran |= {(load, rpm, inputs): sweep for (load, inputs), sweep in zip(distinct, found, strict=True)}

    rows: list[tuple[str, ...]] = [("statement", "load, shaft", "from", "to", "in", "verdict")]
    for each in STATEMENTS:
        for load, rpm in each.conditions:
            all_four = seen([ran[load, rpm, tuple(inputs.items())] for inputs in each.inputs], each.indicator)
            first, last = (all_four[i] for i in each.ends)
            where = f"{load:.0f} N, {rpm:.0f} rpm"
            rows.append((each.words, where, shown(first), shown(last), each.unit, verdict(first, last, each.sign)))
    of = lambda gap: [
        ran[4450.0, SHAFT, (("guidance_gap", gap), ("pocket_clearance", ratio * gap))] for ratio in RATIOS
    ]
    for name, unit in (("cage_slip", "slip"), ("exponent", "exponent")):
        small, large = (seen(of(gap), mean_of(name)) for gap in GAPS)
        rows.append(governed(small, large, unit))
    print(f"Trends: {starts} starts, {discard} revolutions left out, {revolutions} observed in {BLOCKS} blocks")
    table(rows)
    lanes = [sweep for sweep in ran.values()]
    failed = sum(int(sweep.failed.sum()) for sweep in lanes)
    inexact = sum(int((sweep.outcome == "inaccurate").sum()) for sweep in lanes)
    print(f"Lanes: {len(lanes) * starts}, failed {failed}, inaccurate {inexact}")


def governed(small: list[Seen], large: list[Seen], unit: str) -> tuple[str, ...]:
    """Whether gaps of equal ratio differ less than ratios do: mean squares of differences, less their errors' share."""
    between = np.mean([(a.mean - b.mean) ** 2 - a.error**2 - b.error**2 for a, b in zip(small, large, strict=True)])
    spread = [(a.mean - b.mean) ** 2 - a.error**2 - b.error**2 for x in (small, large) for a, b in pairs(x)]
    said = "failed" if not np.isfinite(between) else "yes" if 2 * between < np.mean(spread) else "no"
    size = lambda x: f"{np.sqrt(max(float(x), 0.0)):.3g}"
    words = "the ratio of pocket to guide clearance governs"
    return words, "4450 N, 10000 rpm", f"gaps {size(between)}", f"ratios {size(np.mean(spread))}", unit, said


def pairs(x: list[Seen]) -> list[tuple[Seen, Seen]]:
    """All pairs."""
    return [(a, b) for i, a in enumerate(x) for b in x[i + 1 :]]


def threshold(discard: int, revolutions: int) -> None:
    """Slip over the load, from a rolling and from a slipping start; where it passes 5 % and 2 %."""
    model, speed = jc.whole_bearing("nu2310"), float(jc.rpm(SHAFT))
    begin = [rolling_start(jc.replace(model, load=300.0), speed, turning=turning) for turning in (1.0, SLIPPING)]
    models = [jc.replace(model, load=load) for load in LOADS]
    length: dict[str, Any] = dict(starts=begin, discard=discard, revolutions=revolutions, blocks=BLOCKS, exponents=0)
    found = jc.sweep_bearings(models, np.array([speed]), **length)
    print(f"Slip at {SHAFT:.0f} rpm of the shaft, {discard} revolutions left out, {revolutions} observed")
    rows: list[tuple[str, ...]] = [("load [N]", "from rolling", "from slipping", "state", "verdict")]
    slips = []
    for load, sweep in zip(LOADS, found, strict=True):
        slip = sweep.block_means["cage_slip"][0]
        each = [Seen(row[None]) for row in slip]
        slips.append([x.mean for x in each])
        words = [f"{100 * x.mean:.2f} ± {100 * x.error:.2f} %{' drifts' if x.drifts else ''}" for x in each]
        rows.append((f"{load:.0f}", *words, str(sweep.state[0, 0]), skidding(each)))
    table(rows)
    for name, column in (("rolling", 0), ("slipping", 1)):
        loads = {level: crossing(np.array(slips)[:, column], level) for level in (SKIDS, ROLLS)}
        print(f"From {name}: slip passes 5 % at {loads[SKIDS]} and 2 % at {loads[ROLLS]}")


def skidding(each: Sequence[Seen]) -> str:
    """What a load does, from either start."""
    said = {"skids" if x.mean > SKIDS else "rolls" if x.mean < ROLLS else "between" for x in each}
    return " or ".join(sorted(said)) if all(np.isfinite(x.mean) for x in each) else "failed"


def crossing(slips: np.ndarray, level: float) -> str:
    """The load at which the slip passes a level, between neighbouring loads by the logarithms of both."""
    for i in range(len(LOADS) - 1, 0, -1):
        if slips[i] < level <= slips[i - 1]:
            share = np.log(level / slips[i]) / np.log(slips[i - 1] / slips[i])
            return f"{np.exp(np.log(LOADS[i]) + share * np.log(LOADS[i - 1] / LOADS[i])):.0f} N"
    return "no load"


def shown(x: Seen) -> str:
    """A mean with its error."""
    return f"{x.mean:.3g}" + (f" ± {x.error:.1g}" if np.isfinite(x.error) else "")


def table(rows: Sequence[Sequence[str]]) -> None:
    """Columns of one width."""
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    for row in rows:
        print("  ".join(f"{cell:<{width}}" for cell, width in zip(row, widths, strict=True)).rstrip())


def main() -> None:
    """Read the options and run."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", choices=("threshold", "trends"))
    parser.add_argument("--starts", type=int, default=3, choices=(1, 2, 3))
    parser.add_argument("--discard", type=int, default=100)
    parser.add_argument("--revolutions", type=int, default=200, help=f"a multiple of {BLOCKS}")
    given = parser.parse_args()
    if given.discard < 0 or given.revolutions < BLOCKS or given.revolutions % BLOCKS:
        parser.error(f"--revolutions must be a multiple of {BLOCKS} above 0, and --discard at least 0.")
    jc.enable_x64()
    if given.what == "trends":
        trends(given.starts, given.discard, given.revolutions)
    else:
        threshold(given.discard, given.revolutions)


if __name__ == "__main__":
    main()
