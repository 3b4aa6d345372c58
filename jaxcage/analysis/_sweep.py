"""The result of a sweep: what every lane did, with its outcome and error bars."""

import collections
import dataclasses
from typing import Any

import numpy as np
from jaxtyping import Float, Int, Shaped

from .._notebook import notebook_html
from ..integrate import OUTCOMES
from ._labels import closing_period, label_lanes, too_few_revolutions


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
    """Code of how each lane ended: its place in `jaxcage.OUTCOMES`."""
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
    persist: int = 0
    """Revolutions that chaos had to outlast, discarded of the lanes that looked chaotic; 0 if that was not asked."""
    settings: dict[str, Any] = dataclasses.field(default_factory=dict)
    """How it was computed: method, versions, configuration."""

    @property
    def length(self) -> str:
        """How long lanes were run, in words."""
        lasting = f", chaos that outlasts {self.persist}" if self.persist else ""
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
        blocks = self.block_growth.shape[2]
        if blocks < 2:
            return np.full(self.exponents.shape, np.inf)
        return np.hypot(np.std(self.block_growth, axis=2, ddof=1) / np.sqrt(blocks), self.doubt)

    @property
    def failed(self) -> Shaped[np.ndarray, "speeds starts"]:
        """Lanes whose integration did not finish."""
        return self.outcome != 0

    @property
    def label(self) -> Shaped[np.ndarray, "speeds starts"]:
        """What each lane does: `periodic-k`, `chaotic`, `quasi-periodic`, `undecided` or `failed`."""
        period = closing_period(self.strobe, self.scale[:, None, :])
        if self.exponents.shape[-1] == 0:
            unknown = np.full(period.shape, np.nan)
            return label_lanes(self.failed, period, unknown, unknown)
        return label_lanes(self.failed, period, self.exponents[..., 0], self.standard_error[..., 0])

    @property
    def too_short(self) -> Shaped[np.ndarray, "speeds starts"]:
        """Lanes whose label rests on too few revolutions for the error bar of its exponent."""
        if self.exponents.shape[-1] == 0:
            return np.zeros(self.outcome.shape, dtype=bool)
        return too_few_revolutions(self.label, self.exponents[..., 0], self.standard_error[..., 0], self.revolutions)

    @property
    def chaotic_share(self) -> Float[np.ndarray, " speeds"]:
        """Share of the finished starts that are chaotic; NaN where every start failed."""
        finished = np.sum(~self.failed, axis=1)
        chaotic = np.sum(self.label == "chaotic", axis=1)
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
            lines.append(f"  {short:6d} labels rest on too few revolutions: their exponents are too uncertain")
        lines += [f"  {n:6d} lanes failed: {OUTCOMES[code]}" for code, n in sorted(codes.items())]
        return "\n".join(lines)

    _repr_html_ = notebook_html
