"""Labels of the default sweep beside those of 8 times the steps: no speed is chaotic for one and calm for the other.

But for transients: where chaos ends after a time that is as long as a lane is followed, which lanes are still chaotic
is chance. Such a speed is explained if many perturbed initial states leave chaos at the same rate by both, and some
have left by then and some have not.
"""

from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np
from scipy.stats import fisher_exact

import jaxcage as jc
from jaxcage.analysis import LIFE_BLOCK, Survival, failed, survival

from .truth_models import Subject, by_kind, fine, pair


STARTS = 2
"""A speed is chaotic if as many initial states are."""
PERTURBED = 36
"""Starts from which the escape rate is measured, where two labels differ."""
SPREAD = 0.02
"""Their distance from the model's own initial state [scale]."""
SETTLED, LENGTH = 60, 600
"""Revolutions after which escapes count, and those of a default sweep."""
EXPLAINED = 0.05
"""Largest share of the speeds that may be explained so."""


THREE_SIGMA = 0.0027
SHARES = (0.01, 0.99)
"""Share of lanes left between which a mean life is measured and not merely bounded."""


def same_rate(first: Survival, second: Survival) -> float:
    """Probability of escapes at least as unequal if both runs have one escape rate (Fisher's exact test)."""
    if not first.chaotic or not second.chaotic:
        return 0.0
    table: Any = [[s.escapes, round(s.survived / s.block)] for s in (first, second)]
    return float(fisher_exact(table)[1])  # pyright: ignore[reportArgumentType]


class Doubted(NamedTuple):
    """A speed that is chaotic by one of the two alone."""

    subject: Subject
    speed: float
    """[rad/s]."""
    spurious: bool
    """Chaotic by the default; else by the finer steps."""
    rates: tuple[Survival, Survival]
    """Escapes of perturbed initial states by both."""

    @property
    def explained(self) -> bool:
        """A transient of one rate, seen while some lanes have left it."""
        resolved = all(SHARES[0] <= each.remaining <= SHARES[1] for each in self.rates)
        return resolved and same_rate(*self.rates) >= THREE_SIGMA

    def __str__(self) -> str:
        what = "spurious" if self.spurious else "missed"
        why = "explained" if self.explained else "NOT explained"
        text = "\n    ".join(map(str, self.rates))
        return f"{self.subject.kind} {self.subject.name}, {self.speed * 30 / np.pi:.1f} rpm, {what}, {why}:\n    {text}"


def perturbed(subject: Subject, speed: float) -> np.ndarray:
    """States about the model's own initial states in turn, shape (1, initial states, dimension)."""
    own = np.array([[float(c) for c in y] for y in subject.model.initial_states(speed)])
    scale = np.array([float(c) for c in subject.model.scale(speed)])
    drawn = np.random.default_rng(subject.seed).normal(scale=SPREAD, size=(PERTURBED, own.shape[1]))
    return (np.resize(own, drawn.shape) + drawn * scale)[None]


def escapes(subject: Subject, speed: float, method: Any = None) -> Any:
    """`Survival` of perturbed initial states to the length of a default sweep."""
    length = LENGTH - SETTLED
    options = dict(discard=SETTLED, revolutions=length, blocks=length // LIFE_BLOCK, confirm=False, horizon=LENGTH + 1)
    found = jc.sweep(subject.model, speed, initial_states=perturbed(subject, speed), method=method, **options)  # pyright: ignore
    times = np.maximum(found["escape"].values.ravel() - SETTLED, 0.0)
    return survival(times, length, block=LIFE_BLOCK)


def doubted(subject: Subject, quick: bool) -> Iterator[Doubted]:
    """Speeds that are chaotic by one of the two alone."""
    count = [np.sum(s["label"].values == "chaotic", axis=1) for s in pair(subject, quick)]
    for spurious, (here, there) in ((True, count), (False, count[::-1])):
        for i in np.flatnonzero((here >= STARTS) & (there == 0)):
            speed = float(subject.grid(count[0].size)[i])
            rates = escapes(subject, speed), escapes(subject, speed, fine())
            yield Doubted(subject, speed, spurious, rates)


HEAD = f"{'':44s}" + "".join(
    f"{x:>10s}" for x in ("speeds", "lanes", "chaotic", "by 8x", "differ", "inacc.", "failed", "doubted", "explained")
)


def report(found: Sequence[Subject], quick: bool) -> list[str]:
    """labels of default sweeps beside those by 8 times the steps"""
    every: list[Doubted] = []
    speeds = 0
    for kind, group in by_kind(found).items():
        print(f"\nLabels, {kind}\n{HEAD}", flush=True)
        for subject in group:
            ours, theirs = pair(subject, quick)
            new = list(doubted(subject, quick))
            labels = [s["label"].values for s in (ours, theirs)]
            chaos = [int(np.sum(label == "chaotic")) for label in labels]
            beside = [int(np.sum(labels[0] == name)) for name in ("inaccurate", "failed")]
            differ = int(np.sum((labels[0] != labels[1]) & ~failed(ours) & ~failed(theirs)))
            row = (
                ours.sizes["speed"],
                labels[0].size,
                *chaos,
                differ,
                *beside,
                len(new),
                sum(d.explained for d in new),
            )
            print(f"{subject.name:44s}" + "".join(f"{x:10d}" for x in row), flush=True)
            every += new
            speeds += ours.sizes["speed"]
    print(*every, sep="\n")
    bad = [d for d in every if not d.explained]
    spurious = sum(d.spurious for d in bad)
    wrong = [f"{spurious} spurious and {len(bad) - spurious} missed speeds"] if bad else []
    if len(every) - len(bad) > EXPLAINED * speeds:
        wrong.append(f"{len(every) - len(bad)} of {speeds} speeds had to be explained")
    return wrong
