"""How large differences between model and data are, and over how many samples one goes on into the next.

A residual of a muscle's force is anything but white: its samples resemble each other over tens of milliseconds, so that
a trial of 400 samples tells as much as ten independent ones would. Intervals that forget it are several times too
narrow.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from scipy.signal import lfilter

from xb_muscle_ros.scores.noise.autocovariance import (
    ORDER,
    autocovariance,
    covariance_of_sums,
    extended,
    sample_autocovariance,
    yule_walker,
)

Array = npt.NDArray[np.float64]

# Rounds of correcting for what the fit took, draws in each, and samples until a drawn noise forgets how it began.
_ROUNDS, _DRAWS, _BURN_IN = 3, 60, 600
# Far finer than any sampling of the noise matters; also where no noise was added at all.
_LEAST_SD_F0 = 1e-5


class Scale(NamedTuple):
    """Size of one standard deviation of the differences.

    Attributes:
        force_sd_f0: root-mean-square of a sample's difference, F0.
        correlation_samples: samples that tell as much as one independent one.
    """

    force_sd_f0: float
    correlation_samples: float


# Before anything is known: 1 % F0, and ten independent samples in a trial of 400.
FIRST = Scale(0.01, 40.0)


def _stable(sample: Array) -> bool:
    """Whether there is noise with this autocovariance that does not grow."""
    roots = np.roots(np.concatenate([[1.0], -yule_walker(sample)]))
    return bool(np.all(np.abs(roots) < 1.0))


def noise_autocovariances(residuals: Sequence[Array], left: Callable[[Array], Array]) -> list[Array]:
    """Autocovariance of the noise of each trial, shape (samples,) each, from what a fit left of it.

    A fit takes the noise that looks like its parameters' doing out of the residuals: most of the slow part, which is
    what makes slow parameters uncertain. What it would have taken from noise of the autocovariance supposed is found
    by drawing such noise and fitting it (linearly), and is given back. Trials share the colour of noise, not its size.

    Args:
        residuals: of each trial.
        left: what fitting leaves of noise: (samples of all trials, draws) -> the same shape.
    """
    if not residuals:
        return []
    order = min([ORDER, *(r.size // 10 for r in residuals)])
    found = np.array([sample_autocovariance(r, order) for r in residuals])
    if not np.any(found[:, 0] > 0.0):
        return [np.zeros(r.size) for r in residuals]
    colour, sizes = _colour(found), found[:, 0].copy()
    supposed = colour.copy()
    ends = np.cumsum([0, *(r.size for r in residuals)])
    for _ in range(_ROUNDS):
        random = np.random.default_rng(0)
        drawn = [_drawn(size * supposed, r.size, random) for size, r in zip(sizes, residuals, strict=True)]
        kept = left(np.concatenate(drawn, axis=0))
        again = np.array(
            [
                np.mean(sample_autocovariance(kept[begin:end].T, order), axis=0)
                for begin, end in itertools.pairwise(ends)
            ]
        )
        sizes = sizes * np.clip(found[:, 0] / np.maximum(again[:, 0], 1e-300), 0.5, 2.0)
        change = colour - _colour(again)
        steps = (supposed + share * change for share in (1.0, 0.5, 0.25))
        supposed = next((step for step in steps if _stable(step)), supposed)
    return [extended(size * supposed, r.size) for size, r in zip(sizes, residuals, strict=True)]


def _colour(autocovariances: Array) -> Array:
    """Correlation at each lag that trials share, shape (order + 1,)."""
    total: Array = autocovariances.sum(axis=0) / max(float(autocovariances[:, 0].sum()), 1e-300)
    return total


def _drawn(sample: Array, n: int, random: np.random.Generator) -> Array:
    """Noise of an autocovariance, shape (n, draws)."""
    if sample[0] <= 0.0:
        return np.zeros((n, _DRAWS))
    weights = yule_walker(sample)
    fresh = max(float(sample[0] - weights @ sample[1:]), 0.0) ** 0.5
    white = fresh * random.normal(size=(n + _BURN_IN, _DRAWS))
    noise: Array = lfilter([1.0], np.concatenate([[1.0], -weights]), white, axis=0)[_BURN_IN:]
    return noise


def scale_of(residuals: Sequence[Array], moved: float) -> Scale:
    """Scale of the differences that a fit left.

    Args:
        residuals: of each trial, F0.
        moved: how many coordinates the fit had to make them small; those that priors hold count for less than one.
    """
    total = sum(float(r @ r) for r in residuals)
    samples = sum(r.size for r in residuals)
    lengths = []
    for r in residuals:
        gamma = autocovariance(r, r.size)
        if gamma[0] > 0.0:
            # Sum of correlations within a trial, each lag as often as it occurs in it.
            share = 1.0 - np.arange(r.size) / r.size
            length = 2.0 * float(share @ gamma) / float(gamma[0]) - 1.0
            lengths.append((min(max(length, 1.0), 0.5 * r.size), float(r @ r)))
    if not lengths:
        return Scale(_LEAST_SD_F0, 1.0)
    # Trials with large residuals say how they hang together.
    correlation = float(np.average([x for x, _ in lengths], weights=[w for _, w in lengths]))
    independent = samples / correlation
    # What fitting took away; never more than it can have taken with a few independent samples left.
    left = max(1.0 - moved / independent, 0.1)
    return Scale(max(float(np.sqrt(total / samples / left)), _LEAST_SD_F0), correlation)


def score_covariance(slopes: Sequence[Array], noise: Sequence[Array], p: int) -> Array:
    """Covariance of the sum of slope times noise over samples, shape (coordinates, coordinates).

    Args:
        slopes: of each trial, shape (samples, coordinates).
        noise: autocovariance of each trial's noise, shape (samples,).
        p: number of coordinates.
    """
    total = np.zeros((p, p))
    for j, gamma in zip(slopes, noise, strict=True):
        total += covariance_of_sums(j, gamma)
    return total
