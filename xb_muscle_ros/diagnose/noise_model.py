"""Noise of a study's recordings, from the times at which the muscle only holds: its size and colour, and draws of it.

Autoregressions, because noise of real force hums at 40 to 80 Hz and hangs together over tens of samples. They are
fitted by restricted likelihood, which leaves out what a drift of the window could have done, and which, other than
sample correlations, is hardly biased when a window of 80 samples holds a few independent ones (Cooper and Thompson,
Biometrika 64 (1977) 625-628). Draws carry what stays unknown of size and colour.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from scipy.optimize import minimize
from scipy.signal import lfilter

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.fit.noise import extended
from xb_muscle_ros.trials.phases import initial_isometric
from xb_muscle_ros.trials.trial import Trial

Array = npt.NDArray[np.float64]

# A window has at least this many samples; more than the most tell no more about noise, only about slow force.
_LEAST, _MOST = 20, 1000
# From here on a window's drift may be curved.
_CURVED = 200
_ORDER = 6
# Other trials' windows bear on a trial's colour as if they had this many samples together at most: colour at pCa 9 is
# not that at pCa 4.5.
_OTHERS = 100
# Far finer than any recording; also where no noise was added at all.
_LEAST_SD_F0 = 1e-5
# Sampling steps within this factor of each other have noise of one colour.
_SAME_STEP = 1.2
# Partial correlations as inverse hyperbolic tangents: how far they go (0.995), and a prior that only tames them.
_REACH, _PRIOR_SD = 3.0, 2.0
# Models of the noise from which draws come, and samples until drawn noise forgets how it began.
_MEMBERS, _BURN_IN = 24, 400
# SD of log-SD of trials without a window around those with one, where a single one has one.
_SPREAD = 0.7


class Window(NamedTuple):
    """Force while the muscle only holds.

    Attributes:
        trial: name.
        step_s: between samples, s.
        force_f0: shape (n,), evenly sampled, F0; empty where the trial has no such time.
    """

    trial: str
    step_s: float
    force_f0: Array


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
        members: models to draw from, as probable as each other; the most probable one first.
    """

    trial: str
    sd_f0: float
    colour: Array
    freedom: float
    members: tuple[Member, ...]

    def autocovariance(self, lags: int) -> Array:
        """At lags 0 to `lags` - 1 samples, shape (lags,), F0²."""
        return extended(self.sd_f0**2 * self.colour, lags)

    def draw(self, n: int, picked: npt.NDArray[np.intp] | None, draws: int, random: np.random.Generator) -> Array:
        """Noise of n samples, shape (n, draws), each of the member picked and of a size drawn; None: the likeliest."""
        out = np.empty((draws, n))
        which = np.zeros(draws, dtype=np.intp) if picked is None else picked % len(self.members)
        for k in np.unique(which):
            share = np.flatnonzero(which == k)
            member = self.members[k]
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
        # The same member for all trials: see `noise_model`.
        picked = random.integers(_MEMBERS, size=draws) if uncertain else None
        drawn = [noise.draw(n, picked, draws, random) for noise, n in zip(self.trials, samples, strict=True)]
        return np.concatenate([np.empty((0, draws)), *drawn])


def isometric_window(trial: Trial) -> Window:
    """The measured force of a trial before its first length change, or where it has none, late in its longest pause.

    A pause is a recovery or hold, late its last third, by when what the length change did has mostly passed.
    """
    time_s = trial.force_time_s
    inside = initial_isometric(time_s, trial.facts.phases)
    if inside.stop - inside.start < _LEAST:
        pauses = [p for p in trial.facts.phases if p.name in ("isometric", "recovery", "hold")]
        longest = max(pauses, key=lambda p: p.end_s - p.start_s, default=None)
        if longest is not None:
            begin_s = longest.end_s - (longest.end_s - longest.start_s) / 3.0
            begin, end = np.searchsorted(time_s, [begin_s, longest.end_s])
            inside = slice(int(begin), int(end))
    found = slice(max(inside.start, inside.stop - _MOST), inside.stop)
    step_s = float(np.median(np.diff(time_s[found]))) if found.stop - found.start > 1 else math.nan
    return Window(trial.facts.trial, step_s, np.asarray(trial.measured_f0[found]))


def noise_model(windows: Sequence[Window]) -> NoiseModel:
    """Noise of every trial of a study, also of those without a window.

    Raises:
        UserError: no window has enough samples, or a force is not finite.
    """
    for window in windows:
        if not np.all(np.isfinite(window.force_f0)):
            raise UserError(f"trial {window.trial}: force of its isometric window is not finite; leave the trial out")
    parts = {w.trial: _Part(w) for w in windows if w.force_f0.size >= _LEAST}
    if not parts:
        longest = max((w.force_f0.size for w in windows), default=0)
        raise UserError(
            f"no trial holds still for {_LEAST} samples of force (the longest isometric window has {longest}), so that "
            "its noise is unknown; give at least one trial with an isometric phase"
        )
    # The same for all trials: what is wrong with the colour of one is wrong with that of the others.
    normal = np.random.default_rng(0).standard_normal((_MEMBERS, _ORDER))
    normal[0] = 0.0
    sounding = [p for p in parts.values() if not p.silent]
    begin = np.zeros(_ORDER)
    begin[0] = 1.0
    start = _most_probable(sounding, [1.0] * len(sounding), begin) if len(sounding) > 1 else begin
    found = {name: _estimated(name, parts, start, normal) for name in parts}
    return NoiseModel(tuple(found.get(w.trial) or _without_window(w, parts, list(found.values())) for w in windows))


class _Part:
    """One window and the drift that it may have."""

    def __init__(self, window: Window) -> None:
        self.step_s = window.step_s
        n = window.force_f0.size
        at = np.linspace(-1.0, 1.0, n)
        drift, _ = np.linalg.qr(np.vander(at, 3 if n >= _CURVED else 2))
        left = window.force_f0 - drift @ (drift.T @ window.force_f0)
        # Force first, then the drift: all are whitened together.
        columns = np.column_stack([left, drift]).T
        self.begin = columns[:, :_ORDER]
        # Products of all columns at all lags: what is new in the samples is a sum over them, however long the window.
        lagged = np.stack([columns[:, _ORDER - k : n - k] for k in range(_ORDER + 1)])
        self.products = np.einsum("ict,jdt->cdij", lagged, lagged, optimize=True)
        self.silent = float(np.sqrt(np.mean(left**2))) < _LEAST_SD_F0
        self.freedom = float(n - drift.shape[1])

    def squares(self, filters: Sequence[Array], sizes: Array) -> tuple[float, float]:
        """Sum of squares of what is new in the samples, drift taken out, F0², and the log-determinants.

        Args:
            filters: weights of the autoregressions of order 0, 1, ...
            sizes: variance of what is new under each, in units of the last one's, same length.
        """
        last = np.concatenate([[1.0], -filters[-1]])
        begin = np.column_stack(
            [
                (self.begin[:, k] - self.begin[:, :k][:, ::-1] @ filters[k]) / math.sqrt(sizes[k])
                for k in range(_ORDER)
            ]
        )
        gram = self.products @ last @ last + begin @ begin.T
        drift, across = gram[1:, 1:], gram[1:, 0]
        drift = drift + 1e-12 * np.trace(drift) * np.eye(drift.shape[0])
        left = float(gram[0, 0] - across @ np.linalg.solve(drift, across))
        return max(left, 1e-300), float(np.sum(np.log(sizes[:_ORDER])) + np.linalg.slogdet(drift)[1])


def _filters(z: Array) -> tuple[list[Array], Array]:
    """Autoregressions of order 0, 1, ... of partial correlations tanh(z), and the variance of what is new in each.

    The recursion of Levinson and Durbin; variances in units of the last one's.
    """
    filters, sizes = [np.empty(0)], [1.0]
    for partial in np.tanh(z):
        last = filters[-1]
        filters.append(np.append(last - partial * last[::-1], partial))
        sizes.append(sizes[-1] * (1.0 - partial**2))
    return filters, np.array(sizes) / sizes[-1]


def _estimated(name: str, parts: dict[str, _Part], start: Array, normal: Array) -> TrialNoise:
    """Noise of a trial with a window, sought from the start for its partial correlations."""
    part = parts[name]
    if part.silent:
        still = Member(np.empty(0), _LEAST_SD_F0)
        return TrialNoise(name, _LEAST_SD_F0, np.ones(1), part.freedom, (still,))
    others = [p for p in parts.values() if p is not part and not p.silent and _alike(p.step_s, part.step_s)]
    share = min(1.0, _OTHERS / max(sum(p.freedom for p in others), 1.0))
    counted, shares = [part, *others], [1.0, *(share for _ in others)]
    z = _most_probable(counted, shares, start)
    spread = _spread(counted, shares, z)
    members = []
    for step in normal:
        filters, sizes = _filters(np.clip(z + spread @ step, -_REACH, _REACH))
        left, _ = part.squares(filters, sizes)
        members.append(Member(filters[-1], math.sqrt(left / part.freedom)))
    filters, sizes = _filters(z)
    sd = max(members[0].fresh_f0 * math.sqrt(float(sizes[0])), _LEAST_SD_F0)
    return TrialNoise(name, sd, _correlation(filters), part.freedom, tuple(members))


def _cost(parts: Sequence[_Part], shares: Sequence[float], z: Array) -> float:
    """Minus the logarithm of the restricted likelihood of windows, each with its own size of noise, and of the prior.

    Args:
        parts: windows.
        shares: what each one's likelihood counts.
        z: partial correlations, inverse hyperbolic tangents.
    """
    filters, sizes = _filters(z)
    total = 0.5 * float(z @ z) / _PRIOR_SD**2
    for part, share in zip(parts, shares, strict=True):
        left, log_determinant = part.squares(filters, sizes)
        total += share * 0.5 * (part.freedom * math.log(left) + log_determinant)
    return total


def _most_probable(parts: Sequence[_Part], shares: Sequence[float], start: Array) -> Array:
    """Partial correlations (inverse hyperbolic tangents) at which `_cost` is least, shape (order,)."""
    bounds = [(-_REACH, _REACH)] * _ORDER
    found = minimize(
        lambda z: _cost(parts, shares, z), start, method="L-BFGS-B", bounds=bounds, options={"ftol": 1e-7}
    )
    return np.asarray(found.x)


def _spread(parts: Sequence[_Part], shares: Sequence[float], z: Array) -> Array:
    """A root of the covariance of partial correlations around the most probable, shape (order, order)."""
    step = 0.05
    moves = step * np.eye(_ORDER)
    curvature = np.zeros((_ORDER, _ORDER))
    for i in range(_ORDER):
        for j in range(i + 1):
            corners = [_cost(parts, shares, z + a * moves[i] + b * moves[j]) * a * b for a in (1, -1) for b in (1, -1)]
            curvature[i, j] = curvature[j, i] = sum(corners) / (4.0 * step**2)
    values, vectors = np.linalg.eigh(curvature)
    root: Array = vectors / np.sqrt(np.maximum(values, 1.0 / _PRIOR_SD**2))
    return root


def _correlation(filters: Sequence[Array]) -> Array:
    """Correlation at lags 0 to the order, from autoregressions of order 0, 1, ..."""
    found = [1.0]
    for k in range(1, len(filters)):
        # The last weight of order k is what lag k has beyond what order k - 1 predicts of it.
        before = np.array(found)
        new = 1.0 - float(filters[k - 1] @ before[1:]) if k > 1 else 1.0
        expected = float(filters[k - 1] @ before[1:][::-1]) if k > 1 else 0.0
        found.append(expected + float(filters[k][-1]) * new)
    return np.array(found)


def _without_window(window: Window, parts: dict[str, _Part], known: Sequence[TrialNoise]) -> TrialNoise:
    """Noise of a trial without a window: as large as that of the others, as far as these agree."""
    log = np.log([noise.sd_f0 for noise in known])
    mean, spread = float(np.mean(log)), float(np.std(log, ddof=1)) if log.size > 1 else _SPREAD
    alike = [noise for noise in known if _alike(parts[noise.trial].step_s, window.step_s)] or list(known)
    like = min(alike, key=lambda noise: abs(math.log(noise.sd_f0) - mean))
    factor = math.exp(mean) / like.sd_f0
    sizes = np.exp(spread * np.random.default_rng(1).standard_normal(_MEMBERS)) * factor
    sizes[0] = factor
    members = [like.members[k % len(like.members)] for k in range(_MEMBERS)]
    scaled = tuple(m._replace(fresh_f0=m.fresh_f0 * float(size)) for m, size in zip(members, sizes, strict=True))
    return TrialNoise(window.trial, math.exp(mean), like.colour, like.freedom, scaled)


def _alike(step_s: float, other_s: float) -> bool:
    """Whether noise sampled so has one colour; true where a step is unknown."""
    known = step_s > 0.0 and other_s > 0.0
    return not known or abs(math.log(step_s / other_s)) <= math.log(_SAME_STEP)
