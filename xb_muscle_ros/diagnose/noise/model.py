"""Noise as it is known: its size and colour in every trial, and draws that carry what stays unknown of both."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from scipy.signal import lfilter

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.fit.noise import extended

Array = npt.NDArray[np.float64]

# Models of a trial's noise from which draws come, and samples until drawn noise forgets how it began.
MEMBERS, _BURN_IN = 24, 400


class Member(NamedTuple):
    """One model of a trial's noise that its window leaves possible.

    Attributes:
        weights: of the autoregression, shape (order,).
        fresh_f0: standard deviation of what is new in a sample, F0.
    """

    weights: Array
    fresh_f0: float


@dataclass(frozen=True)
class TrialNoise:
    """Noise of one trial.

    Attributes:
        trial: name.
        sd_f0: standard deviation, F0.
        colour: correlation at lags 0, 1, ... samples, shape (order + 1,).
        freedom: degrees of freedom with which the size is known, given the colour.
        likeliest: the model of this size and colour.
        members: models to draw from, as probable as each other, from little noise to much.
    """

    trial: str
    sd_f0: float
    colour: Array
    freedom: float
    likeliest: Member
    members: tuple[Member, ...]

    def autocovariance(self, lags: int) -> Array:
        """At lags 0 to `lags` - 1 samples, shape (lags,), F0²."""
        return extended(self.sd_f0**2 * self.colour, lags)

    def draw(self, n: int, picked: npt.NDArray[np.intp] | None, draws: int, random: np.random.Generator) -> Array:
        """Noise of n samples, shape (n, draws), each of the member picked and of a size drawn; None: the likeliest."""
        out = np.empty((draws, n))
        which = np.full(draws, -1) if picked is None else picked % len(self.members)
        for k in np.unique(which):
            share = np.flatnonzero(which == k)
            member = self.likeliest if picked is None else self.members[k]
            fresh = np.full(share.size, member.fresh_f0)
            if picked is not None:
                fresh = fresh * np.sqrt(self.freedom / np.maximum(random.chisquare(self.freedom, share.size), 1e-12))
            white = fresh[:, None] * random.standard_normal((share.size, n + _BURN_IN))
            # Along the last axis, where samples lie side by side: three times as fast.
            out[share] = lfilter([1.0], np.concatenate([[1.0], -member.weights]), white, axis=-1)[:, _BURN_IN:]
        return out.T


@dataclass(frozen=True)
class NoiseModel:
    """Noise of every trial, in the order of the windows it was estimated from."""

    trials: tuple[TrialNoise, ...]

    def of(self, names: Sequence[str]) -> NoiseModel:
        """Noise of some trials, in this order.

        Raises:
            UserError: a trial whose noise was not estimated.
        """
        known = {noise.trial: noise for noise in self.trials}
        for name in names:
            if name not in known:
                raise UserError(f"no noise is known of trial '{name}'; known: {', '.join(known)}; give its window too")
        return NoiseModel(tuple(known[name] for name in names))

    def draw(self, samples: Sequence[int], draws: int, random: np.random.Generator, uncertain: bool = True) -> Array:
        """Noise of this kind.

        Args:
            samples: of each trial.
            draws: how many.
            random: where it comes from.
            uncertain: draw size and colour as well, from what is not known of them.

        Returns:
            Shape (sum of samples, draws), F0, trials one below the other.
        """
        # The same place in the order for all trials: what is wrong with the colour of one is wrong with the others'.
        picked = random.integers(MEMBERS, size=draws) if uncertain else None
        drawn = [noise.draw(n, picked, draws, random) for noise, n in zip(self.trials, samples, strict=True)]
        return np.concatenate([np.empty((0, draws)), *drawn])
