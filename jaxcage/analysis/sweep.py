"""Results of a sweep by speed: fraction of chaotic lanes, mean life of chaos, lanes without a certain label."""

import collections
import json

import numpy as np
import xarray as xr
from jaxtyping import Bool, Float, Shaped

from .._errors import ArgumentError
from ..solve import OUTCOMES
from .labels import motion_size, revolutions_to_decide
from .survival import Survival, survival


SMALL = 1e-3
"""Size of the motion, in units of the scale, below which it is reported as too small for the scale."""
FEWEST_REVOLUTIONS = 20
"""Smallest number of revolutions for a usable standard error of an exponent: with fewer, one error bar in forty is
three times too small (256 lanes of Ueda's oscillator)."""
LIFE_BLOCK = 30
"""Resolution of the times of escapes from chaos [revolutions]."""
UNKNOWN = ("failed", "inaccurate", "pending")
"""Labels of lanes without a usable result."""


def failed(found: xr.Dataset) -> Bool[np.ndarray, "*lanes"]:
    """True for lanes without a usable result: they failed, are inaccurate, or have not been run."""
    return np.isin(found["label"].values, UNKNOWN)


def length(found: xr.Dataset) -> str:
    """Text with the numbers of revolutions discarded, observed and, for chaos, at most."""
    lasting = f", chaos continued to {found.attrs['horizon']}" if found.attrs["horizon"] else ""
    return f"{found.attrs['discard']} + {found.attrs['revolutions']} revolutions{lasting}"


def resolution_rpm(found: xr.Dataset) -> float:
    """Largest distance between neighbouring speeds [rpm]; infinite for a single speed."""
    rpm = found["rpm"].values
    return float(np.max(np.diff(rpm))) if rpm.size > 1 else float("inf")


def restless(found: xr.Dataset) -> Bool[np.ndarray, "*speeds"]:
    """True for speeds at which at least one lane is, or was while observed, chaotic."""
    return np.asarray(np.isin(found["label"].values, ("chaotic", "transient")).any(axis=-1))


def survival_at(found: xr.Dataset, i: int) -> Survival:
    """Survival of chaos at the i-th speed, from all lanes at that speed and at its two neighbours.

    **Raises:** `ValueError` if lanes were not followed to a horizon.
    """
    if "escape" not in found:
        raise ArgumentError("horizon", said="of the sweep must be given for this, but lanes were not followed.")
    begin = found.attrs["discard"] + found.attrs["revolutions"] % LIFE_BLOCK  # of whole blocks
    times = found["escape"].values[max(i - 1, 0) : i + 2].ravel() - begin
    return survival(np.maximum(times, 0.0), found.attrs["horizon"] - begin, block=LIFE_BLOCK)


def lasting(found: xr.Dataset) -> Bool[np.ndarray, " speeds"]:
    """True for speeds with chaos whose mean life, if lanes were followed to a horizon, is at least the horizon."""
    chaotic = restless(found)
    if "escape" not in found:
        return chaotic
    horizon = found.attrs["horizon"]
    return np.array([c and survival_at(found, i).mean_life >= horizon for i, c in enumerate(chaotic)], dtype=bool)


def chaotic_share(found: xr.Dataset) -> Float[np.ndarray, " speeds"]:
    """Fraction of the finished lanes at each speed that are chaotic while observed; NaN where every lane failed."""
    finished = np.sum(~failed(found), axis=1)
    chaotic = np.sum(np.isin(found["label"].values, ("chaotic", "transient")), axis=1)
    return np.where(finished > 0, chaotic / np.maximum(finished, 1), np.nan)


def too_short(found: xr.Dataset) -> Bool[np.ndarray, "*lanes"]:
    """True for lanes that are undecided, or labelled by an exponent with too few revolutions for its standard error."""
    if not found.sizes["exponent"] or "strobe" not in found:
        return np.zeros(found["label"].shape, dtype=bool)
    label = found["label"].values
    by_exponent = np.isin(label, ("quasi-periodic", "chaotic"))
    return (label == "undecided") | (by_exponent & (found.attrs["revolutions"] < FEWEST_REVOLUTIONS))


def to_decide(found: xr.Dataset) -> Float[np.ndarray, "*lanes"]:
    """Estimated revolutions that must be observed to label each undecided lane; infinite if unknown, 0 for others."""
    needed = np.zeros(found["label"].shape)
    if not found.sizes["exponent"] or "strobe" not in found:
        return needed
    observed = max(found.attrs["revolutions"], found.attrs["horizon"] - found.attrs["discard"])
    names = ("strobe", "scale", "exponents", "standard_error")
    strobe, scale, exponents, errors = (found[name].values for name in names)
    for i in zip(*np.nonzero(found["label"].values == "undecided"), strict=True):
        needed[i] = revolutions_to_decide(strobe[i], scale[i], float(exponents[i][0]), float(errors[i][0]), observed)
    return needed


def cure(found: xr.Dataset) -> str:
    """End of a sentence with the revolutions that would decide undecided lanes; empty without an estimate."""
    needed = to_decide(found)
    some = needed[(needed > 0) & np.isfinite(needed)]
    return f": about {np.max(some):.2g} observed revolutions would decide {some.size} of them" if some.size else ""


def small(found: xr.Dataset) -> Bool[np.ndarray, "*lanes"]:
    """True for lanes whose motion is below a thousandth of the model's scale, which is then too large."""
    if "strobe" not in found:
        return np.zeros(found["label"].shape, dtype=bool)
    return motion_size(found["strobe"].values, found["scale"].values) < SMALL


def outcomes(found: xr.Dataset) -> dict[str, int]:
    """Number of lanes that did not succeed, by outcome."""
    counts = collections.Counter(found["outcome"].values.ravel().tolist())
    return {name: counts[name] for name in OUTCOMES[1:] if counts[name]}


def summary(found: xr.Dataset) -> str:
    """Summarise a sweep in a few lines of text: lanes by label, uncertain labels, failures, accuracy.

    **Arguments:** result of `sweep` or `label_map`. **Raises:** `ValueError` for another data set.
    """
    if "confirmed" not in found.attrs:
        raise ArgumentError("found", said="must be the result of `jaxcage.sweep` or `jaxcage.label_map`.")
    labels: Shaped[np.ndarray, "*lanes"] = found["label"].values
    sizes = ", ".join(f"{n} {axis}{'s' * (n != 1)}" for axis, n in zip(found["label"].dims, labels.shape))
    rpm = found["rpm"].values
    lines = [
        f"{sizes}, {rpm.min():.0f} to {rpm.max():.0f} rpm, {length(found)}",
        *(f"  {count:6d} {label}" for label, count in sorted(collections.Counter(labels.ravel().tolist()).items())),
    ]
    peak, error = found["peak"].values, found["error"].values[~failed(found)]
    if over := int(np.sum(peak > 1)):
        lines.append(f"  {over:6d} lanes went beyond eps = 1, at most to {np.nanmax(peak):.3f}")
    if short := int(np.sum(too_short(found))):
        lines.append(f"  {short:6d} lanes have no certain label{cure(found)}")
    if tiny := int(np.sum(small(found))):
        lines.append(f"  {tiny:6d} lanes move by less than {SMALL:g} of the scale: choose a smaller `scale`")
    lines += [f"  {n:6d} lanes failed: {name}" for name, n in outcomes(found).items()]
    for lanes, changed, moved in json.loads(found.attrs["confirmed"]):
        exponents = f", {moved} exponents moved" if moved else ""
        lines.append(f"  confirmed by finer steps: {changed} of {lanes} labels changed{exponents}")
    if error.size:
        lines.append(f"  error of a revolution: at most {np.max(error):.0e} of the scale")
    return "\n".join(lines)
