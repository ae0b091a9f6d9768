"""Noise as it is known: its scale and autocorrelation in every trial, and draws with what is not known of both."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum
from typing import Protocol

import numpy as np
import numpy.typing as npt

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.trials.trial import Array

# Models of a trial's noise from which draws come.
MEMBERS = 24
# Far finer than any recording; also where no noise was added at all.
LEAST_SD_F0 = 1e-5


class Source(str, Enum):
    """From what the noise of a trial was taken."""

    WINDOW = "window"
    """Its force while it only holds."""
    CURVE = "curve"
    """What smooth curves leave of its force."""
    DIFFERENCES = "differences"
    """What neighbouring samples do not tell of each other."""
    OTHERS = "others"
    """The noise of the other trials."""


class Member(Protocol):
    """One model of a trial's noise that its recording leaves possible."""

    def draw(self, time_s: Array, factor: Array, random: np.random.Generator) -> Array:
        """Noise at some times, shape (draws, n), F0.

        Args:
            time_s: shape (n,), s.
            factor: how many times larger, shape (draws,).
        """

    def variance_of_mean(self, time_s: Array) -> float:
        """Of the mean over samples at some times, times their number, F0²."""

    def at_lags(self, lags_s: Array, step_s: float) -> Array:
        """Autocovariance, F0².

        Args:
            lags_s: shape (n,), from 0 on, s.
            step_s: usual time between samples of the trial, s.
        """

    def times(self, factor: float) -> Member:
        """The same, so much larger."""


@dataclass(frozen=True)
class TrialNoise:
    """Noise of one trial.

    Attributes:
        samples: of force that told of it.
        sd_f0: standard deviation, F0.
        freedom: degrees of freedom with which the size is known, given the autocorrelation.
        likeliest: the model of this size.
        members: models to draw from, as probable as each other, from little noise to much.
    """

    trial: str
    source: Source
    samples: int
    sd_f0: float
    freedom: float
    likeliest: Member
    members: tuple[Member, ...]

    def draw(
        self, time_s: Array, picked: npt.NDArray[np.intp] | None, draws: int, random: np.random.Generator
    ) -> Array:
        """Noise at some times, shape (n, draws), F0.

        Args:
            time_s: shape (n,), s.
            picked: which member, shape (draws,), each with a size that is drawn; None for the likeliest.
        """
        out = np.empty((draws, time_s.size))
        which = np.full(draws, -1) if picked is None else picked % len(self.members)
        for k in np.unique(which):
            share = np.flatnonzero(which == k)
            member = self.likeliest if picked is None else self.members[k]
            factor = np.ones(share.size)
            if picked is not None:
                factor = np.sqrt(self.freedom / np.maximum(random.chisquare(self.freedom, share.size), 1e-12))
            out[share] = member.draw(time_s, factor, random)
        return out.T


@dataclass(frozen=True)
class NoiseModel:
    """Noise of every trial of a study, in their order."""

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

    def draw(self, times_s: Sequence[Array], draws: int, random: np.random.Generator, uncertain: bool = True) -> Array:
        """Noise of this kind.

        Args:
            times_s: of the samples of each trial, s.
            uncertain: draw size and autocorrelation as well, from what is not known of them.

        Returns:
            Shape (samples of all trials, draws), F0, trials one below the other.
        """
        # The same place in the order for all trials: what is wrong with one autocorrelation is wrong with the others.
        picked = random.integers(MEMBERS, size=draws) if uncertain else None
        drawn = [noise.draw(time_s, picked, draws, random) for noise, time_s in zip(self.trials, times_s, strict=True)]
        return np.concatenate([np.empty((0, draws)), *drawn])
