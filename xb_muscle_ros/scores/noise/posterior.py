"""What parts of recordings tell of partial correlations: the most probable ones, and others that stay possible."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from xb_muscle_ros.scores.noise.model import MEMBERS
from xb_muscle_ros.scores.noise.regressions import ORDER, Part, regressions, squares
from xb_muscle_ros.trials.trial import Array

# Partial correlations as inverse hyperbolic tangents: how far they go (0.995), and what to expect of force recordings
# (rat soleus fibre 18Dec2017a at 1 kHz has lag-1 correlations of 0.91 to 0.98, and hum: noise that decays within 18 ms,
# and so the less from sample to sample the longer these are apart). White noise overrules it in 50 samples.
_REACH, _PRIOR_SD = 3.0, 0.7
_PRIOR_TAU_S, _PRIOR_MOST = 0.0183, 2.5
# Models that are tried for those from which draws come, and how much wider than a normal posterior they lie.
_TRIED, _WIDER = 480, 1.5
# Other trials' parts bear on a trial's autocorrelation as if they had this many samples together at most: that at pCa 9
# is not that at pCa 4.5.
_OTHERS = 100
# Newton steps at most; most studies take five.
_STEPS = 25
# Costs that differ by less are those of one minimum.
_SAME_COST = 1e-2


def prior_mean(step_s: float) -> Array:
    """Partial correlations (inverse hyperbolic tangents) to expect of samples a step (s) apart, shape (order,)."""
    first = np.arctanh(np.exp(-step_s / _PRIOR_TAU_S)) if step_s > 0.0 else _PRIOR_MOST
    return np.array([min(float(first), _PRIOR_MOST)] + [0.0] * (ORDER - 1))


def most_probable(parts: Sequence[Part], shares: Sequence[float], start: Array) -> Array:
    """Partial correlations (inverse hyperbolic tangents) at which `_costs` are least, shape (order,).

    White noise that is sampled fast, sought from where persistent noise is expected, may end in a hollow of the costs
    that is not the lowest: it is sought from no correlation as well.
    """
    found = [_descended(parts, shares, begin) for begin in (start, np.zeros(ORDER))]
    costs = _costs(parts, shares, np.array(found))
    return found[1] if costs[1] < costs[0] - _SAME_COST else found[0]


def _descended(parts: Sequence[Part], shares: Sequence[float], start: Array) -> Array:
    """Newton's method; downhill also where the costs curve down, and of several lengths of each step the best."""
    z = start
    lengths = np.array([0.0, 0.01, 0.1, 0.3, 0.6, 1.0, 1.5])[:, None]
    for _ in range(_STEPS):
        slope, values, vectors = _shape(parts, shares, z)
        step = -vectors @ ((vectors.T @ slope) / np.maximum(np.abs(values), 1.0))
        points = np.clip(z + lengths * np.clip(step, -1.0, 1.0), -_REACH, _REACH)
        costs = _costs(parts, shares, points)
        best = int(np.argmin(costs))
        z = points[best]
        if costs[0] - costs[best] < 1e-5:
            break
    return z


def possible(parts: Sequence[Part], shares: Sequence[float], z: Array, own: int) -> Array:
    """Partial correlations that parts leave possible, from little noise to much, shape (members, order).

    Drawn around the most probable and resampled, because persistent noise stays possible for longer than a normal
    distribution would have it.

    Args:
        parts: those of the trial first.
        shares: what each one's likelihood counts.
        z: the most probable, shape (order,).
        own: how many are the trial's.
    """
    normal = _WIDER * np.random.default_rng(0).standard_normal((_TRIED, ORDER))
    tried = z + normal @ _spread(parts, shares, z).T
    log = -_costs(parts, shares, np.clip(tried, -_REACH, _REACH)) + 0.5 * np.sum(normal**2, axis=1) / _WIDER**2
    weights = np.where(np.all(np.abs(tried) <= _REACH, axis=1), np.exp(log - log.max()), 0.0)
    found = regressions(np.clip(tried, -_REACH, _REACH))
    return tried[spread_over(np.sum(squares(parts[:own], found)[0], axis=1) * found.sizes[:, 0], weights)]


def spread_over(sizes: Array, weights: Array) -> npt.NDArray[np.intp]:
    """Which models of noise stand for all that were weighed, from little noise to much, shape (members,).

    Sorted before drawing at even steps, so that all of the distribution is met.
    """
    order = np.argsort(sizes)
    steps = (np.arange(MEMBERS) + 0.5) / MEMBERS
    total = np.cumsum(weights[order]) / max(float(weights.sum()), 1e-300)
    picked: npt.NDArray[np.intp] = order[np.minimum(np.searchsorted(total, steps), sizes.size - 1)]
    return picked


def share_of_others(freedom: float) -> float:
    """What each of the other trials' parts counts beside a trial's own, of so many degrees of freedom together."""
    return min(1.0, _OTHERS / max(freedom, 1.0))


def _costs(parts: Sequence[Part], shares: Sequence[float], z: Array) -> Array:
    """Minus the logarithm of the restricted likelihood of parts, each with its own size of noise, and of the prior.

    Args:
        parts: of all trials, the prior is that of the first one's sampling.
        shares: what each one's likelihood counts.
        z: partial correlations, inverse hyperbolic tangents, shape (many, order).

    Returns:
        Shape (many,).
    """
    innovations, log_determinants = squares(parts, regressions(z))
    of_parts = 0.5 * (np.array([p.freedom for p in parts]) * np.log(innovations) + log_determinants)
    costs: Array = (
        of_parts @ np.array(shares) + 0.5 * np.sum((z - prior_mean(parts[0].step_s)) ** 2, axis=1) / _PRIOR_SD**2
    )
    return costs


def _spread(parts: Sequence[Part], shares: Sequence[float], z: Array) -> Array:
    """A root of the covariance of partial correlations around the most probable, shape (order, order)."""
    _, values, vectors = _shape(parts, shares, z)
    root: Array = vectors / np.sqrt(np.maximum(values, 1.0 / _PRIOR_SD**2))
    return root


def _shape(parts: Sequence[Part], shares: Sequence[float], z: Array) -> tuple[Array, Array, Array]:
    """Slope of the costs, and values and vectors of their curvature, by differences."""
    h = 0.02
    signs = np.array([(1, 1), (1, -1), (-1, 1), (-1, -1)], dtype=np.float64)
    moves = signs[:, :, None, None, None] * h * np.eye(ORDER)[:, None, :]
    corners = moves[:, 0] + np.swapaxes(moves[:, 1], 1, 2)
    costs = _costs(parts, shares, z + corners.reshape(-1, ORDER)).reshape(4, ORDER, ORDER)
    curvature = (costs[0] - costs[1] - costs[2] + costs[3]) / (4.0 * h**2)
    # Along the diagonal both moves are the same: twice the step.
    slope = np.diag(costs[0] - costs[3]) / (4.0 * h)
    values, vectors = np.linalg.eigh(0.5 * (curvature + curvature.T))
    return slope, values, vectors
