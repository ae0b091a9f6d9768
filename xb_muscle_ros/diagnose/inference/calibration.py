"""From evidence to probability: log-odds of averaging over sets, scaled by what they are worth.

Sets are compared by a likelihood that knows neither how wrong the forms of mechanisms are nor how many independent
residuals a trial has. So its log-odds are scaled, by constants from open composites, whose simulator shares no model
with this one (`scripts/fit_calibration.py`; docs/prove.md has what sealed ones made of them).
"""

from __future__ import annotations

import math
from typing import NamedTuple


class Constants(NamedTuple):
    """Log-odds = offset + slope (log-odds of averaging) + size log(contribution / PRACTICAL_F0)."""

    offset: float
    slope: float
    size: float


CONSTANTS = Constants(-1.2, 0.26, 1.6)
"""Of mechanisms."""
ARTEFACTS = Constants(0.0, 0.6, 1.5)
"""Of artefacts, whose forms are known; chosen by hand."""
PRACTICAL_F0 = 0.003
"""A contribution below it is of no use to anyone, F0."""
# Contributions are counted within these factors of it: a large one is no evidence of its own.
_LEAST, _LARGEST = 0.1, 1.0
MOST_LOG_ODDS = 50.0
"""Log-odds of averaging count up to this."""
# Beyond this nothing was ever seen to be surer.
_MOST = 7.0


def calibrated(log_odds: float, contribution_f0: float, constants: Constants = CONSTANTS) -> float:
    """Probability that something is part of the truth.

    Args:
        log_odds: by averaging over sets.
        contribution_f0: root of what it takes off the mean square of the best set without it, F0.
    """
    if math.isinf(log_odds) and log_odds < 0.0:
        return 0.0
    size = min(max(contribution_f0 / PRACTICAL_F0, _LEAST), _LARGEST)
    counted = min(max(log_odds, -MOST_LOG_ODDS), MOST_LOG_ODDS)
    worth = constants.offset + constants.slope * counted + constants.size * math.log(size)
    return 1.0 / (1.0 + math.exp(-min(max(worth, -_MOST), _MOST)))
