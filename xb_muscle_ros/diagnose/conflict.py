"""Whether parts of a study want parameters that conflict: what would be gone if each part had its own, to first order.

A mismatch between the parts goes, whatever makes it; one within the trials, in how force follows length, stays.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from xb_muscle_ros.diagnose.cells import Residual
from xb_muscle_ros.diagnose.linear_fit import LinearFit
from xb_muscle_ros.scores.noise.model import NoiseModel

Array = npt.NDArray[np.float64]


class Conflict(NamedTuple):
    """One way of parting a study.

    Attributes:
        between: what the parts differ in: `solutions` (pCa), `protocols` (order of phases) or `trials`.
        parts: how many.
        gone: share of the mismatch's mean square beyond noise that goes if each part has its own coordinates.
        furthest: that any coordinate moves for it, in its moved scale (1: a factor of e for most parameters).
    """

    between: str
    parts: int
    gone: float
    furthest: float


def conflicts(residuals: Sequence[Residual], fit: LinearFit, noise: NoiseModel) -> list[Conflict]:
    """All ways of parting that make two parts or more; none where there is only noise.

    Args:
        residuals: of all trials, after the fit of all.
        fit: its normal equations, samples in the order of the residuals.
        noise: of the trials; others may be among them.
    """
    sizes = [r.time_s.size for r in residuals]
    values = np.concatenate([r.value_f0 for r in residuals])[:, None]
    of_noise = sum(n * of.sd_f0**2 for n, of in zip(sizes, noise.of([r.trial for r in residuals]).trials, strict=True))
    excess = float(np.sum(values**2)) - of_noise
    if excess <= 0.0:
        return []
    found: list[Conflict] = []
    for between, marks in _partings(residuals).items():
        names = list(dict.fromkeys(marks))
        # Where every part is a single trial, that is what parts are.
        if len(names) < 2 or (len(names) == len(residuals) and between != "trials"):
            continue
        left, furthest, of_sample = 0.0, 0.0, np.repeat([names.index(mark) for mark in marks], sizes)
        for part in range(len(names)):
            inside = of_sample == part
            own = LinearFit(fit.slopes[inside], fit.weights[inside], fit.prior)
            left += float(np.sum(own.left(values[inside]) ** 2))
            furthest = max(furthest, float(np.max(np.abs(own.moved(values[inside])), initial=0.0)))
        found.append(Conflict(between, len(names), 1.0 - max(left - of_noise, 0.0) / excess, furthest))
    return found


def _partings(residuals: Sequence[Residual]) -> dict[str, list[str]]:
    """Name of the part that each trial belongs to, by what the parts differ in."""
    return {
        "solutions": ["changing" if r.pca is None else f"{r.pca:g}" for r in residuals],
        "protocols": ["/".join(p.name for p in r.phases) for r in residuals],
        "trials": [r.trial for r in residuals],
    }
