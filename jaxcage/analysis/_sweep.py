"""The result of a sweep: what every lane did, with its outcome and error bars."""

import collections
import dataclasses
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int, Shaped

from .._errors import ArgumentError
from .._notebook import notebook_html
from ..solve import OUTCOMES
from ._labels import label_lanes, motion_size, revolutions_to_decide, scatter, too_few_revolutions
from ._transients import Survival, survival


SMALL = 1e-3
"""Size of the motion, in units of the scale, below which it is reported."""
LIFE_BLOCK = 30
"""Revolutions within which an escape from chaos is known."""


class Confirmation(NamedTuple):
    """What became of the lanes that were run again with finer steps."""

    lanes: int
    changed: int
    """Lanes whose label is another one."""
    moved: int
    """Lanes of the same label whose exponent differs by more than its error."""

    def __str__(self) -> str:
        moved = f", {self.moved} exponents moved" if self.moved else ""
        return f"{self.changed} of {self.lanes} labels changed{moved}"


@dataclasses.dataclass(frozen=True)
class Sweep:
    """Lanes of a sweep over speed, from several starts.

    A failed lane is NaN in its own place, has an outcome other than 0 and the label `failed`.
    """

    speed: Float[np.ndarray, " speeds"]
    """Speed [rad/s], ascending."""
    strobe: Float[np.ndarray, "speeds starts keep dim"]
    """The last strobe states of each lane, in SI units."""
    last: Float[np.ndarray, "speeds starts dim"]
    """State at the end of the run."""
    block_growth: Float[np.ndarray, "speeds starts blocks exponents"]
    """Mean logarithmic growth per revolution of each block of revolutions."""
    peak: Float[np.ndarray, "speeds starts"]
    """Largest excursion while observed: for a cage the largest eps, flagged above 1 (overlap of the surfaces)."""
    outcome: Int[np.ndarray, "speeds starts"]
    """Code of how each lane ended: its place in `jaxcage.solve.OUTCOMES`."""
    error: Float[np.ndarray, "speeds starts"]
    """Largest error of a revolution, by halving its steps, in units of `scale` (for a cage: clearances)."""
    doubt: Float[np.ndarray, "speeds starts exponents"]
    """How much the exponents would change with half as many steps."""
    scale: Float[np.ndarray, "speeds dim"]
    """Characteristic magnitude of each state component."""
    discard: int
    """Revolutions run before anything was recorded."""
    revolutions: int
    """Revolutions observed."""
    escape: Float[np.ndarray, "speeds starts"] | None = None
    """Revolutions of the whole run after which a lane stays calm: infinity for one that is chaotic at the horizon, NaN
    for a failure. None if lanes were not followed."""
    horizon: int = 0
    """Revolutions to which chaotic lanes were followed; 0 if they were not."""
    confirmed: tuple[Confirmation, ...] = ()
    """What became of labels that were confirmed by steps at most half as long, then a quarter."""
    settings: dict[str, Any] = dataclasses.field(default_factory=dict)
    """How it was computed: method, versions, configuration."""

    @property
    def length(self) -> str:
        """How long lanes were run, in words."""
        lasting = f", chaos followed to {self.horizon}" if self.horizon else ""
        return f"{self.discard} + {self.revolutions} revolutions{lasting}"

    @property
    def rpm(self) -> Float[np.ndarray, " speeds"]:
        """Speed in revolutions per minute."""
        return self.speed * 30 / np.pi

    @property
    def resolution_rpm(self) -> float:
        """Largest distance between neighbouring speeds, in rpm; infinite for a single speed."""
        return float(np.max(np.diff(self.rpm))) if self.speed.size > 1 else float("inf")

    @property
    def exponents(self) -> Float[np.ndarray, "speeds starts exponents"]:
        """Lyapunov exponents per revolution, the largest first; times speed/(2 pi) they are per second."""
        return np.mean(self.block_growth, axis=2)

    @property
    def standard_error(self) -> Float[np.ndarray, "speeds starts exponents"]:
        """Standard error of the exponents from the scatter of the blocks, and what the steps add to it."""
        return np.hypot(scatter(self.block_growth, axis=2), self.doubt)

    @property
    def failed(self) -> Shaped[np.ndarray, "speeds starts"]:
        """Lanes whose integration did not finish."""
        return self.outcome != 0

    @property
    def observed_label(self) -> Shaped[np.ndarray, "speeds starts"]:
        """What each lane does while observed: `periodic-k`, `chaotic`, `quasi-periodic`, `undecided`, `failed` or
        `inaccurate`."""
        growth = self.exponents.shape[-1] > 0
        unknown = np.full(self.outcome.shape, np.nan)
        exponent, error = (self.exponents[..., 0], self.standard_error[..., 0]) if growth else (unknown, unknown)
        return label_lanes(self.outcome, self.strobe, self.scale[:, None, :], exponent, error)

    @property
    def label(self) -> Shaped[np.ndarray, "speeds starts"]:
        """What each lane does; `transient` where it is chaotic while observed, and calm at the horizon."""
        label = self.observed_label
        if self.escape is not None:
            label[(label == "chaotic") & np.isfinite(self.escape)] = "transient"
        return label

    def survival(self, i: int) -> Survival:
        """How long chaos lasts at the i-th speed, from all lanes there and at the speeds next to it.

        **Raises:** `ValueError` where lanes were not followed.
        """
        if self.escape is None:
            raise ArgumentError("horizon", said="of the sweep must be given for this, but lanes were not followed.")
        begin = self.discard + self.revolutions % LIFE_BLOCK  # of whole blocks
        times = self.escape[max(i - 1, 0) : i + 2].ravel() - begin
        return survival(np.maximum(times, 0.0), self.horizon - begin, block=LIFE_BLOCK)

    @property
    def restless(self) -> Bool[np.ndarray, " speeds"]:
        """Speeds at which some lane is or was chaotic while observed."""
        return np.any(np.isin(self.label, ("chaotic", "transient")), axis=1)

    @property
    def lasting(self) -> Bool[np.ndarray, " speeds"]:
        """Speeds at which chaos lasts: by its mean life beyond the horizon, if lanes were followed to one."""
        if self.escape is None:
            return self.restless
        lasts = [c and self.survival(i).mean_life >= self.horizon for i, c in enumerate(self.restless)]
        return np.array(lasts, dtype=bool)

    @property
    def too_short(self) -> Shaped[np.ndarray, "speeds starts"]:
        """Lanes that are undecided, or labelled by an exponent of too few revolutions for its error bar."""
        if self.exponents.shape[-1] == 0:
            return np.zeros(self.outcome.shape, dtype=bool)
        return too_few_revolutions(self.label, self.revolutions)

    @property
    def revolutions_to_decide(self) -> Float[np.ndarray, "speeds starts"]:
        """Estimate of the revolutions to be observed until each undecided lane has a label; infinite where there is no
        estimate, 0 for the other lanes."""
        needed, observed = np.zeros(self.outcome.shape), max(self.revolutions, self.horizon - self.discard)
        for i, j in zip(*np.nonzero((self.label == "undecided") & (self.exponents.shape[-1] > 0)), strict=True):
            lane = float(self.exponents[i, j, 0]), float(self.standard_error[i, j, 0]), observed
            needed[i, j] = revolutions_to_decide(self.strobe[i, j], self.scale[i], *lane)
        return needed

    @property
    def cure(self) -> str:
        """How undecided lanes get a label, as the end of a sentence; empty without an estimate."""
        needed = self.revolutions_to_decide
        some = needed[(needed > 0) & np.isfinite(needed)]
        return f": about {np.max(some):.2g} observed revolutions would decide {some.size} of them" if some.size else ""

    @property
    def small(self) -> Bool[np.ndarray, "speeds starts"]:
        """Lanes whose motion is below a thousandth of the system's scale: the scale does not fit it."""
        return motion_size(self.strobe, self.scale[:, None, :]) < SMALL

    @property
    def chaotic_share(self) -> Float[np.ndarray, " speeds"]:
        """Share of the finished starts that are chaotic while observed; NaN where every start failed."""
        finished = np.sum(~self.failed, axis=1)
        chaotic = np.sum(np.isin(self.label, ("chaotic", "transient")), axis=1)
        return np.where(finished > 0, chaotic / np.maximum(finished, 1), np.nan)

    def __str__(self) -> str:
        speeds, starts = self.outcome.shape
        counts = collections.Counter(self.label.ravel().tolist())
        lines = [
            f"Sweep of {speeds} speeds x {starts} starts, {self.rpm.min():.0f} to {self.rpm.max():.0f} rpm, "
            + self.length,
            *(f"  {count:6d} {label}" for label, count in sorted(counts.items())),
        ]
        codes = collections.Counter(self.outcome[self.failed].tolist())
        over = int(np.sum(self.peak > 1))
        if over:
            lines.append(f"  {over:6d} lanes went beyond eps = 1, at most to {np.nanmax(self.peak):.3f}")
        short = int(np.sum(self.too_short))
        if short:
            lines.append(f"  {short:6d} lanes have no certain label{self.cure}")
        if small := int(np.sum(self.small)):
            lines.append(f"  {small:6d} lanes move by less than {SMALL:g} of the scale: choose a smaller `scale`")
        lines += [f"  {n:6d} lanes failed: {OUTCOMES[code]}" for code, n in sorted(codes.items())]
        lines += [f"  confirmed by finer steps: {each}" for each in self.confirmed]
        finished = self.error[~self.failed]
        if finished.size:
            lines.append(f"  error of a revolution: at most {np.max(finished):.0e} of the scale")
        return "\n".join(lines)

    _repr_html_ = notebook_html
