"""One distribution of every effect over fibres, and what it is worth: evidence lies across fibres.

Each fibre's likelihood of a mechanism's coordinate is taken as normal around its estimate. Alone, each fibre meets the
coordinate's own prior; together they meet a common mean, which has that prior, and a spread of unknown size. The ratio
of the two marginal likelihoods is what replication adds to the evidence of a set.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from scipy.special import logsumexp

Array = npt.NDArray[np.float64]

# Spreads over fibres to average over, in units of the prior's standard deviation: fibres of one muscle resemble each
# other more than the prior knows.
_SPREADS = (0.1, 0.2, 0.4, 0.8)


class Estimate(NamedTuple):
    """A coordinate in one fibre, on the moved scale.

    Attributes:
        value, sd: posterior.
        prior_mean, prior_sd: of its prior.
    """

    value: float
    sd: float
    prior_mean: float
    prior_sd: float

    @property
    def information(self) -> float:
        """Of the data alone."""
        return max(self.sd**-2.0 - self.prior_sd**-2.0, 0.0)

    @property
    def likeliest(self) -> float:
        """Where the data alone would have it; the prior's mean where they know nothing."""
        if self.information <= 0.0:
            return self.prior_mean
        return (self.value * self.sd**-2.0 - self.prior_mean * self.prior_sd**-2.0) / self.information


class Distribution(NamedTuple):
    """Of a coordinate over fibres, on the moved scale.

    Attributes:
        mean, se: of the centre.
        spread: standard deviation over fibres.
    """

    mean: float
    se: float
    spread: float


def replication(estimates: Sequence[Estimate]) -> float:
    """By how much evidence grows where the fibres' coordinates come from one distribution; 0 for one fibre."""
    if len(estimates) < 2:
        return 0.0
    alone = sum(_marginal([e], e.prior_sd, 0.0) for e in estimates)
    sd = estimates[0].prior_sd
    together = [_marginal(estimates, sd, spread * sd) for spread in _SPREADS]
    return float(logsumexp(together) - math.log(len(together)) - alone)


def _marginal(estimates: Sequence[Estimate], sd: float, spread: float) -> float:
    """Logarithm of the marginal likelihood of some fibres whose centre has the prior, but for a constant of the data."""
    total, centre, mean = sd**-2.0, 0.0, estimates[0].prior_mean
    found = -math.log(sd)
    for e in estimates:
        if e.information <= 0.0:
            continue
        variance = 1.0 / e.information + spread**2
        away = e.likeliest - mean
        found += -0.5 * math.log(variance * e.information) - 0.5 * away**2 / variance
        total += 1.0 / variance
        centre += away / variance
    return found - 0.5 * math.log(total) + 0.5 * centre**2 / total


def distribution(estimates: Sequence[Estimate]) -> Distribution:
    """Centre and spread over fibres, averaged over spreads by how well they explain the fibres' estimates."""
    sd, mean = estimates[0].prior_sd, estimates[0].prior_mean
    logs, centres, variances = [], [], []
    for share in _SPREADS:
        spread = share * sd
        logs.append(_marginal(estimates, sd, spread))
        weights = [1.0 / (1.0 / e.information + spread**2) if e.information > 0.0 else 0.0 for e in estimates]
        total = sd**-2.0 + sum(weights)
        centres.append(mean + sum(w * (e.likeliest - mean) for w, e in zip(weights, estimates, strict=True)) / total)
        variances.append(1.0 / total)
    chances = np.exp(np.array(logs) - logsumexp(logs))
    centre = float(chances @ centres)
    variance = float(chances @ (np.array(variances) + (np.array(centres) - centre) ** 2))
    return Distribution(centre, math.sqrt(variance), float(chances @ (np.array(_SPREADS) * sd)))
