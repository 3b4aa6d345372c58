"""`python -m benchmarks.trends [--quick]`: slip against experiments and makers' rules, as `benchmarks/trends.md`.

NU2310 as `jaxcage init --model bearing` writes it: drag, rolling resistance and traction depend on the oil and its
temperature. Runs begin with pure rolling, and half of their revolutions is left out. The slip is the mean of the second
half of the rest; its error is the change from the first half to the second, so that a slip that still grows is
uncertain. A cage below a twentieth of its speed has a slip of at least 95 %. Loads at 2 % slip are found by bisection.
"""

import argparse
import pathlib
import tomllib
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

import jaxcage as jc
from benchmarks.common import made_with, markdown
from jaxcage.files import model_from, template


PAGE = pathlib.Path(__file__).with_suffix(".md")
SPEED = 6700.0
"""Reference speed of the bearing, of the shaft [rpm]."""
LIGHT = 300.0
"""Load at which the slip is compared [N]."""
SKIDDING = 0.02
"""Slip at which a bearing begins to skid."""
LIGHTEST, HEAVIEST = 800.0, 3200.0
"""Loads [N] between which it is sought."""
NEAR = 1.25
"""Factor within which ratios of loads agree."""
POLYMER = {"cage_mass": 0.16, "cage_inertia": 0.16, "pocket_stiffness": 0.065}
"""A cage of PA66 with a quarter of glass fibre over the same one of brass: 1.32 over 8.4 g/cm^3, 6.5 over 100 GPa."""
STALLED = 0.95
"""Least slip of a cage that is too slow to be followed."""
KELLER = "Guo, Keller, Tribol. Int. 148 (2020) 106347"
HARRIS = "preload as a cure: Harris, ASLE Trans. 9 (1966) 229"
SKF = "SKF, Rolling bearings (2018), page 509"


class Trend(NamedTuple):
    """A trend, what is known of it, and what the model makes of it."""

    what: str
    expected: str
    source: str
    found: str
    verdict: str


def bearing(**changed: float) -> jc.BearingModel:
    """The bearing with parameters changed."""
    return jc.replace(model_from(tomllib.loads(template("bearing"))), **changed)


def slip(model: jc.BearingModel, rpm: float, revolutions: int) -> tuple[float, float]:
    """Slip of the cage and its error; half of the revolutions are left out."""
    speed = jc.rpm(rpm)
    run = jc.simulate(model, speed, revolutions=revolutions // 2, discard=revolutions // 2, samples=32)
    if run.outcome == "outside":
        return STALLED, 0.0
    if run.outcome not in ("successful", "inaccurate"):
        raise RuntimeError(f"{rpm:g} rpm, {float(model.load):g} N: {run.outcome}")
    middle = len(run.time) // 2
    turns = np.array([run.angle[middle] - run.angle[0], run.angle[-1] - run.angle[middle]])
    rates = turns / np.array([run.time[middle] - run.time[0], run.time[-1] - run.time[middle]])
    before, after = 1 - rates / float(model.rolling_cage_speed(speed))
    return float(after), abs(float(after - before))


def series(name: str, values: Sequence[float], revolutions: int) -> list[tuple[float, float]]:
    """Slip and error at `LIGHT` for values of a parameter."""
    found = []
    for value in values:
        found.append(slip(bearing(**{"load": LIGHT, name: value}), SPEED, revolutions))
        print(f"  {name} {value:g}: slip {found[-1][0]:.4f} +- {found[-1][1]:.4f}", flush=True)
    return found


def verdict(sign: int, found: Sequence[tuple[float, float]]) -> str:
    """Compare slips that should rise (`sign` 1) or fall (-1) from each value to the next, by twice their errors."""
    rise = [sign * (b - a) for (a, _), (b, _) in zip(found[:-1], found[1:], strict=True)]
    error = [2 * float(np.hypot(a, b)) for (_, a), (_, b) in zip(found[:-1], found[1:], strict=True)]
    if any(r < -e for r, e in zip(rise, error, strict=True)):
        return "disagree"
    return "agree" if all(r > e for r, e in zip(rise, error, strict=True)) else "undecided"


class Bracket(NamedTuple):
    """A load between two ends [N]."""

    low: float
    high: float

    def __str__(self) -> str:
        return f"{self.low:.0f} to {self.high:.0f} N"

    def over(self, other: "Bracket") -> tuple[float, float]:
        """Lowest and highest ratio to another load."""
        return self.low / other.high, self.high / other.low


def load_at_skidding(rpm: float, revolutions: int, steps: int, **changed: float) -> Bracket:
    """Load at which the slip passes `SKIDDING`, by bisection of its logarithm."""
    low, high = LIGHTEST, HEAVIEST
    for _ in range(steps):
        middle = float(np.sqrt(low * high))
        skids = slip(bearing(load=middle, **changed), rpm, revolutions)[0] > SKIDDING
        low, high = (middle, high) if skids else (low, middle)
    print(f"  load at {SKIDDING:.0%} slip, {rpm:g} rpm: {low:.0f} to {high:.0f} N", flush=True)
    return Bracket(low, high)


def ratio_trend(what: str, one: Bracket, other: Bracket, expected: float) -> Trend:
    """The ratio of two loads against SKF's rule, within a factor `NEAR`."""
    low, high = one.over(other)
    away = np.log(np.array([low, high]) / expected) / np.log(NEAR)
    found = "agree" if np.all(abs(away) < 1) else "disagree" if min(away) > 1 or max(away) < -1 else "undecided"
    words = f"{low:.2f} to {high:.2f} ({one} over {other})"
    return Trend(what, f"{expected:.2f}, within {NEAR - 1:.0%}", SKF, words, found)


def trends(revolutions: int, steps: int, few: bool) -> list[Trend]:
    """All trends."""
    one, two = (load_at_skidding(rpm, revolutions, steps) for rpm in (SPEED, 2 * SPEED))
    known = {name: float(value) for name, value in jc.parameters(bearing()).items()}
    light = load_at_skidding(SPEED, revolutions, steps, **{n: share * known[n] for n, share in POLYMER.items()})
    usual, brass = jc.bearing.listed("NU2310").minimum_loads(SPEED)
    fits = "agree" if usual / 2 < one.low and one.high < 2 * brass else "disagree"
    load = f"load at {SKIDDING:.0%} slip"
    expected = f"{usual:.0f} to {brass:.0f} N, within a factor of 2"
    rows = [Trend(f"{load}, {SPEED:.0f} rpm", expected, SKF, str(one), fits)]
    rows.append(ratio_trend(f"{load}, twice the speed over that", two, one, 1.4))
    rows.append(ratio_trend(f"{load}, cage of brass over polymer", one, light, brass / usual))
    asked = {
        ("oil temperature [°C]", "temperature", "falls", KELLER): ((20.0, 40.0, 80.0), 273.15, 1.0),
        ("radial clearance [µm]", "radial_clearance", "rises", HARRIS): ((-10.0, 0.0, 20.0, 60.0), 0.0, 1e-6),
        ("share of oil [%]", "oil_share", "rises", "centre drag is proportional"): ((0.3, 1.5, 5.0), 0.0, 1e-2),
    }
    for (what, name, way, source), (shown, offset, unit) in asked.items():
        values = shown[:: len(shown) - 1] if few else shown
        longer = revolutions * (2 if name == "oil_share" else 1)
        found = series(name, [offset + unit * value for value in values], longer)
        row = ", ".join(f"{v:g}: {100 * s:.3g} ± {100 * e:.1g} %" for v, (s, e) in zip(values, found, strict=True))
        rows.append(Trend(f"slip over {what}", way, source, row, verdict(1 if way == "rises" else -1, found)))
    return rows


def page(rows: Sequence[Trend], revolutions: int) -> str:
    """The page in Markdown."""
    about = (__doc__ or "").split("\n\n", 1)[1].strip()
    usual = f"The shaft turns at {SPEED:g} rpm under {LIGHT:g} N unless a row says otherwise"
    length = f"runs have {revolutions} revolutions, over the share of oil twice as many"
    text = f"# Trends of slip\n\n{about}\n\n{usual}; {length}.\n\n"
    table = markdown(["trend", "expected", "source", "found", "verdict"], rows).replace("---:", "---")
    return f"{text}{table}\n\n{made_with()}\n"


def main() -> None:
    """Compute all trends and write the page; `--quick` prints the ends of each trend from shorter runs."""
    parser = argparse.ArgumentParser(description=main.__doc__)
    parser.add_argument("--quick", action="store_true")
    quick = parser.parse_args().quick
    jc.enable_x64()
    revolutions = 40 if quick else 60
    text = page(trends(revolutions, 3 if quick else 6, quick), revolutions)
    print(text)
    if not quick:
        PAGE.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
