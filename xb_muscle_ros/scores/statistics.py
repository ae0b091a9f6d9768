"""Statistics of models: Akaike's information criterion, and paired t-tests corrected after Bonferroni."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.stats import ttest_rel

ALPHA = 0.05


class Paired(NamedTuple):
    """One comparison of two models over the same fibres.

    Attributes:
        n: fibres that both models have a value for.
        difference: mean of second - first, in the unit of the values.
        sd: standard deviation of the differences (n - 1); None for fewer than 2 fibres.
        t, p: Student's t and two-sided p; None for fewer than 2 fibres or where all differences are equal.
    """

    n: int
    difference: float | None
    sd: float | None
    t: float | None
    p: float | None


def paired_t(first: Sequence[float], second: Sequence[float]) -> Paired:
    """Compare the fibres' values under two models.

    Args:
        first, second: one value for each fibre, same order; NaN where a fibre has none.
    """
    a, b = np.asarray(first, dtype=np.float64), np.asarray(second, dtype=np.float64)
    both = np.isfinite(a) & np.isfinite(b)
    a, b = a[both], b[both]
    n = int(a.size)
    difference = float(np.mean(b - a)) if n else None
    if n < 2:
        return Paired(n, difference, None, None, None)
    sd = float(np.std(b - a, ddof=1))
    # Where the differences vary by rounding only, t would be rounding noise.
    if sd <= 1e-12 * float(np.max(np.abs([a, b]))):
        return Paired(n, difference, sd, None, None)
    result = ttest_rel(b, a)
    return Paired(n, difference, sd, float(result.statistic), float(result.pvalue))


def bonferroni_threshold(comparisons: int) -> float:
    """Largest p that is significant when so many comparisons are made: 0.05/15 = 0.0033 in van der Zee et al. 2026."""
    return ALPHA / max(1, comparisons)


def aic(residual_sum_of_squares: float, observations: int, fitted_parameters: int) -> float | None:
    """Akaike's information criterion for least squares, 2k + m·ln(RSS/m).

    Lower is better, and only differences at the same observations mean anything.

    Args:
        residual_sum_of_squares: RSS over the observations, in the square of their unit.
        observations: m; 84 conditions in van der Zee et al. 2026.
        fitted_parameters: k.

    Returns:
        None where nothing is left to explain (RSS of 0), or where there are no more observations than what was fitted:
        parameters and the variance.
    """
    if observations <= fitted_parameters + 1 or not residual_sum_of_squares > 0.0:
        return None
    return 2.0 * fitted_parameters + observations * math.log(residual_sum_of_squares / observations)
