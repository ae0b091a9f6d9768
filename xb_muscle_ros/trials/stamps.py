"""Stamps of samples, whole nanoseconds that increase, and the rules for where they do not or samples are missing."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from xb_muscle_ros.trials.trial import Array

Stamps = npt.NDArray[np.int64]

# A step this many times as long as those around it has lost samples.
GAP_STEPS = 5.0
_AROUND = 5


def to_ns(time_s: Array) -> Stamps:
    """Times in s to stamps in ns, nearest; exact for stamps read with `to_s` up to 26 days."""
    scaled = np.asarray(np.multiply(time_s, 1e9, dtype=np.float64))
    stamps: Stamps = np.rint(scaled, out=scaled).astype(np.int64)
    return stamps


def to_s(stamps_ns: Stamps) -> Array:
    """Stamps in ns to the nearest times in s."""
    return stamps_ns / np.float64(1e9)


def not_after(stamps_ns: Stamps) -> npt.NDArray[np.intp]:
    """Places of stamps that do not come after the one before: time went back, or a stamp comes twice."""
    return np.flatnonzero(stamps_ns[1:] <= stamps_ns[:-1]) + 1


class Gap(NamedTuple):
    """Samples are missing.

    Attributes:
        start_s, end_s: the samples on either side, s.
        usual_s: steps around it, s.
        of: how many gaps there are; this is the largest.
    """

    start_s: float
    end_s: float
    usual_s: float
    of: int


def largest_gap(time_s: Array, least_s: float = 0.0) -> Gap | None:
    """The largest gap between samples; None where there is none.

    A step counts by the median of ten around it, because some records are sampled more and more slowly.

    Args:
        time_s: shape (n,), increasing, s.
        least_s: shorter steps are no gaps, s.
    """
    steps = np.diff(time_s)
    if steps.size < 3:  # with fewer than two others there is nothing to compare with
        return None
    found: list[tuple[float, int, float]] = []
    for i in np.flatnonzero(steps > max(GAP_STEPS * float(np.quantile(steps, 0.1)), least_s)).tolist():
        first = max(i - _AROUND, 0)
        usual = float(np.median(np.delete(steps[first : i + _AROUND + 1], i - first)))
        if steps[i] > GAP_STEPS * usual:
            found.append((float(steps[i]), -i, usual))
    if not found:
        return None
    _, place, usual = max(found)
    return Gap(float(time_s[-place]), float(time_s[1 - place]), usual, len(found))
