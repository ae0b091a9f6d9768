"""Akaike's information criterion for least squares."""

from __future__ import annotations

import math


def aic(residual_sum_of_squares: float, observations: int, fitted_parameters: int) -> float | None:
    """2k + m·ln(RSS/m): lower is better, and only differences at the same observations mean anything.

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
