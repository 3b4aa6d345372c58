"""Stated probabilities of calm over a range of speed, against simulated bearings whose true values are known."""

import re
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest
from scipy.stats import binom

import jaxcage as jc
from jaxcage.analysis import failed, restless
from jaxcage.design import RANGE_SPEEDS, Chance, ensemble, range_chance
from jaxcage.files import own_rpm, read_bearing, template
from jaxcage.solve import native


IMPACTS = {
    "synchronous": """kind = "synchronous"
amplitude = "121.3 (5 .. 300) N"
exponent = "1.483 (1 .. 2)"
""",
    "from_bearing": """kind = "from_bearing"
approach_ratio = "3 (2 .. 4)"
unmatched = "2 (1 .. 3)"
""",
}
"""Impacts of a given amplitude, and those that follow from the bearing, more of them than in a new file."""
PLANTED = 4
"""Bearings planted in the ranges of one file."""
DESIGNS = {
    "NU2310": ((10000, 26000), 'cage_mass = "0.25 kg"'),
    "NU1014": (
        (16000, 26000),
        """guidance_gap = "0.25 mm +- 0.05 mm"; eccentricity = "G6.3 at 12000 rpm shaft"; cage_mass = "0.15 kg";
        land_width = "2 mm"; grade = 32; temperature = "55 degC" """,
    ),
    "NU208": (
        (10000, 26000),
        """guidance_gap = "0.3 mm +- 0.05 mm"; eccentricity = "G40 at 9000 rpm shaft"; cage_mass = "0.09 kg";
        grade = 68; damping = "1 (0.3 .. 3) N s/m"; amplitude = "200 (100 .. 300) N" """,
    ),
    "NU312": (
        (6000, 20000),
        """guidance_gap = "0.5 mm +- 0.1 mm"; eccentricity = "G16 at 5600 rpm shaft"; cage_mass = "0.4 kg";
        land_width = "2 mm"; grade = 100; amplitude = "200 (100 .. 600) N" """,
    ),
    "NU205": (
        (10000, 30000),
        """guidance_gap = "0.25 mm +- 0.05 mm"; cage_mass = "0.04 kg"; land_width = "1 mm"; grade = 46;
        amplitude = "30 (10 .. 100) N" """,
    ),
}
"""Range of the shaft's speed [rpm], and lines of the short template that differ, by designation."""


class Statements(NamedTuple):
    """The probability that a file states for its range, and True for each planted bearing that is calm in truth."""

    chance: Chance
    calm: np.ndarray


def written(folder: Path, kind: str, designation: str, lines: str) -> Path:
    """The short template with other lines and impacts of a kind; an amplitude goes with synchronous ones only."""
    text = template("cage", short=True).partition("[impact]")[0] + "[impact]\n" + IMPACTS[kind]
    for line in (f'designation = "{designation}"', *map(str.strip, lines.split(";"))):
        key = line.partition(" ")[0]
        text, found = re.subn(rf"(?m)^(# )?{key} = .*$", line, text)
        assert found or key == "amplitude", key
    path = folder / f"{designation}.toml"
    path.write_text(text)
    return path


def statements(path: Path, shaft: tuple[float, float], rng: np.random.Generator) -> Statements:
    """Return what `check` states of a file, and the motion of bearings from its ranges: twice as many speeds, three
    initial states, three times as many revolutions, and a hundredth of the tolerance."""
    file = read_bearing(str(path))
    ends = [jc.rpm(own_rpm(file.model, speed, "shaft")) for speed in shaft]
    drawn = ensemble(file.model, file.unknowns, np.linspace(*ends, RANGE_SPEEDS))
    chance = range_chance(drawn, drawn.rpm[0], drawn.rpm[-1])[0]
    bearings = []
    for row in rng.random((PLANTED, len(file.unknowns))):
        values = {name: float(u.range.at(x)) for u, x in zip(file.unknowns, row, strict=True) for name in u.names}
        bearings.append(jc.replace(file.model, **values))
    fine = {"initial_states": 3, "discard": 300, "revolutions": 300, "blocks": 20, "method": native(1e-8, error=1e-4)}
    found = jc.sweep(bearings, np.linspace(*ends, 2 * RANGE_SPEEDS - 1), **fine)
    assert not failed(found).any()
    return Statements(chance, ~restless(found).any(axis=-1))


@pytest.mark.slow
@pytest.mark.parametrize("kind", IMPACTS)
def test_stated_probabilities_come_true(tmp_path: Path, kind: str):
    """The number of planted bearings that are calm is the sum of the stated probabilities, within twice its error: that
    of the planted bearings and that of the 64 draws behind each statement. Decided verdicts are not wrong more often
    than in one of twenty cases, and the Brier score is that of honest probabilities within twice its error."""
    rng = np.random.default_rng(59)
    path = lambda name: written(tmp_path, kind, name, DESIGNS[name][1])
    all_ = {name: statements(path(name), at, rng) for name, (at, _) in DESIGNS.items()}
    for name, (chance, calm) in all_.items():
        print(f"{name}: {chance.share:.1%} calm stated, {chance.state}; {calm.sum()} of {PLANTED} calm")
    share, draws = (np.array([getattr(s.chance, of) for s in all_.values()]) for of in ("share", "draws"))
    calm = np.array([s.calm for s in all_.values()])
    spread = share * (1 - share)
    error = np.sqrt(np.sum(PLANTED * spread + PLANTED**2 * spread / draws))
    brier, honest = np.mean((calm - share[:, None]) ** 2), float(np.mean(spread))
    brier_error = np.sqrt(np.mean(spread * (1 - 2 * share) ** 2) / calm.size)
    right = {"calm": calm, "rattles": ~calm}
    decided = [right[s.chance.state][i] for i, s in enumerate(all_.values()) if s.chance.state in right]
    wrong = int(np.sum(~np.array(decided, dtype=bool)))
    print(f"{calm.sum()} calm of {PLANTED * share.sum():.1f} ± {error:.1f} stated")
    print(
        f"Brier {brier:.3f}, honest {honest:.3f} ± {brier_error:.3f}; {wrong} of {np.size(decided)} decided are wrong"
    )
    assert abs(calm.sum() - PLANTED * share.sum()) <= 2 * error
    assert abs(brier - honest) <= 2 * brier_error
    assert binom.sf(wrong - 1, np.size(decided), 0.05) > 0.025
    assert np.sum((share > 0.2) & (share < 0.8)) >= 3
