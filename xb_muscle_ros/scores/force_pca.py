"""Isometric force against pCa: Hill's equation fitted by least squares."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.optimize import OptimizeWarning, curve_fit

from xb_muscle_ros.scores.estimate import Missing
from xb_muscle_ros.trials.trial import Array

_FEWEST = 5
# Where the fit may look: pCa50 of skinned muscle lies within; a slope beyond 30 is a step between two neighbours.
# A pCa50 this near to the first or last level, as a share of their range, is where the search ends.
_NEAR_END = 0.01
_STEEPEST = 30.0


class ForcePca(NamedTuple):
    """F = passive + (maximal - passive)/(1 + 10^(n_hill·(pCa - pca50))).

    Attributes:
        pca50: pCa of half the active force.
        n_hill: Hill coefficient.
        passive_f0, maximal_f0: the levels between which force rises, F0.
        pca50_se, n_hill_se: standard errors; None where the points leave none.
        rmsd_f0: of the points from the curve, F0.
        points: levels of pCa fitted.
    """

    pca50: float
    n_hill: float
    passive_f0: float
    maximal_f0: float
    pca50_se: float | None
    n_hill_se: float | None
    rmsd_f0: float
    points: int


def hill_curve(pca: Array, pca50: float, n_hill: float, passive_f0: float, maximal_f0: float) -> Array:
    """Hill's equation (F0) at pCa values, shape (n,)."""
    return passive_f0 + (maximal_f0 - passive_f0) / (1.0 + 10.0 ** (n_hill * (pca - pca50)))


def fit_force_pca(pca: Array, force_f0: Array) -> ForcePca | Missing:
    """Fit Hill's equation.

    Args:
        pca, force_f0: shape (n,), one point for each pCa, force in F0; NaN is left out.

    Returns:
        nothing for fewer than 5 levels of pCa, where force does not rise through half its range between them, or where
        no curve with a slope below 30 fits.
    """
    known = np.isfinite(pca) & np.isfinite(force_f0)
    x, y = np.asarray(pca)[known], np.asarray(force_f0)[known]
    levels = np.unique(x).size
    if levels < _FEWEST:
        return Missing(f"isometric force is known at {levels} levels of pCa; {_FEWEST} are needed")
    if np.ptp(y) == 0.0:
        return Missing("isometric force is the same at all pCa")
    half = 0.5 * (float(np.min(y)) + float(np.max(y)))
    above, below = x[y >= half], x[y < half]
    start = (0.5 * (float(np.max(above)) + float(np.min(below))), 4.0, float(np.min(y)), float(np.max(y)))
    lower = (float(np.min(x)), 0.1, -0.5, 0.0)
    upper = (float(np.max(x)), _STEEPEST, float(np.max(y)), 2.0 * float(np.max(y)))
    try:
        found, covariance = curve_fit(
            hill_curve, x, y, p0=np.clip(start, lower, upper), bounds=(lower, upper), xtol=1e-12, ftol=1e-12
        )
    except (RuntimeError, ValueError, OptimizeWarning):
        return Missing("no curve could be fitted")
    room = _NEAR_END * (float(np.max(x)) - float(np.min(x)))
    within = np.min(x) + room < found[0] < np.max(x) - room
    if not 0.1 < found[1] < 0.999 * _STEEPEST or not within or found[3] <= found[2]:
        return Missing(
            f"the curve that fits best, pCa50 {found[0]:.3g} with a Hill coefficient of {found[1]:.3g}, lies beyond "
            f"the levels of pCa or is as steep as {_STEEPEST:g}"
        )
    errors = np.sqrt(np.diag(covariance))
    se = [float(e) if np.isfinite(e) and x.size > len(found) else None for e in errors[:2]]
    rmsd = float(np.sqrt(np.mean((hill_curve(x, *found) - y) ** 2)))
    pca50, n_hill, passive, maximal = (float(f) for f in found)
    return ForcePca(pca50, n_hill, passive, maximal, se[0], se[1], rmsd, int(x.size))
