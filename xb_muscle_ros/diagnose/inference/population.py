"""One distribution of every effect over fibres, and what it is worth: evidence lies across fibres.

Each fibre's likelihood of a mechanism's coordinate is taken as normal around its estimate. A fit gives an effect a
normal prior around nothing whose width is the largest that it may plausibly have; most effects are smaller, so the
evidence averages over narrower ones. The fibres share a centre, which has that prior, and differ by a spread of
unknown size. What this adds to the evidence of fits that know nothing of each other is `adjustment`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

# Widths of an effect's prior to average over, in units of its own; spreads over fibres, in units of that width: fibres
# of one muscle resemble each other more than the prior knows.
_SCALES, _SPREADS = (0.06, 0.25, 1.0), (0.1, 0.3, 1.0)


class Estimate(NamedTuple):
    """A coordinate in one fibre, on the moved scale.

    Attributes:
        value, sd: posterior.
        prior_mean, prior_sd: of its prior.
        effect: whether it is a mechanism's effect, which is nothing at 0, rather than a shape.
    """

    value: float
    sd: float
    prior_mean: float
    prior_sd: float
    effect: bool

    @property
    def information(self) -> float:
        """Of the data alone."""
        return max(float(self.sd**-2.0 - self.prior_sd**-2.0), 0.0)

    @property
    def likeliest(self) -> float:
        """Where the data alone would have it; the prior's mean where they know nothing."""
        if self.information <= 0.0:
            return self.prior_mean
        return float(self.value * self.sd**-2.0 - self.prior_mean * self.prior_sd**-2.0) / self.information


class Distribution(NamedTuple):
    """Of a coordinate over fibres, on the moved scale.

    Attributes:
        mean, se: of the centre.
        spread: standard deviation over fibres.
    """

    mean: float
    se: float
    spread: float


def adjustment(estimates: Sequence[Estimate]) -> float:
    """By how much the evidence of fits grows; estimates of one coordinate, one for each fibre."""
    alone = sum(_marginal([e], e.prior_sd, 0.0) for e in estimates)
    together = [_marginal(estimates, sd, spread) for sd, spread in _widths(estimates)]
    return float(np.logaddexp.reduce(together) - math.log(len(together)) - alone)


def _widths(estimates: Sequence[Estimate]) -> list[tuple[float, float]]:
    """Width of the centre's prior and spread over fibres, all equally likely before anything is seen."""
    sd = estimates[0].prior_sd
    scales = _SCALES if estimates[0].effect else (1.0,)
    spreads = _SPREADS if len(estimates) > 1 else (0.0,)
    return [(scale * sd, spread * scale * sd) for scale in scales for spread in spreads]


def _marginal(estimates: Sequence[Estimate], sd: float, spread: float) -> float:
    """Logarithm of the marginal likelihood of fibres whose centre has the prior, but for a constant of the data."""
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
    return float(found - 0.5 * math.log(total) + 0.5 * centre**2 / total)


def distribution(estimates: Sequence[Estimate]) -> Distribution:
    """Centre and spread over fibres, averaged over spreads by how well they explain the fibres' estimates."""
    mean = estimates[0].prior_mean
    logs, centres, variances, spreads = [], [], [], []
    for sd, spread in _widths(estimates):
        logs.append(_marginal(estimates, sd, spread))
        weights = [1.0 / (1.0 / e.information + spread**2) if e.information > 0.0 else 0.0 for e in estimates]
        total = sd**-2.0 + sum(weights)
        centres.append(mean + sum(w * (e.likeliest - mean) for w, e in zip(weights, estimates, strict=True)) / total)
        variances.append(1.0 / total)
        spreads.append(spread)
    chances = np.exp(np.array(logs) - np.logaddexp.reduce(logs))
    centre = float(chances @ centres)
    variance = float(chances @ (np.array(variances) + (np.array(centres) - centre) ** 2))
    return Distribution(centre, math.sqrt(variance), float(chances @ np.array(spreads)))
