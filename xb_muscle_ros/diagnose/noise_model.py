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
from itertools import pairwise
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from scipy.signal import lfilter
from scipy.special import ndtri

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.fit.noise import extended
from xb_muscle_ros.trials.phases import initial_isometric
from xb_muscle_ros.trials.trial import Trial

Array = npt.NDArray[np.float64]

# A window has at least this many samples; more than the most tell no more about noise, only about slow force.
_LEAST, _MOST = 20, 1000
# From here on a window's drift may be curved.
_CURVED = 200
# Calcium that moves by less than this share of its range from sample to sample stays as it is.
_CALM = 1e-4
_ORDER = 6
# Other trials' windows bear on a trial's colour as if they had this many samples together at most: colour at pCa 9 is
# not that at pCa 4.5.
_OTHERS = 100
# Far finer than any recording; also where no noise was added at all.
_LEAST_SD_F0 = 1e-5
# Sampling steps within this factor of each other have noise of one colour.
_SAME_STEP = 1.2
# Partial correlations as inverse hyperbolic tangents: how far they go (0.995), and what to expect of force recordings
# (rat soleus fibre 18Dec2017a has lag-1 correlations of 0.91 to 0.98, and hum). White noise overrules it in 50 samples.
_REACH, _PRIOR_SD = 3.0, 0.7
_PRIOR_MEAN = np.array([1.8] + [0.0] * (_ORDER - 1))
# Models of the noise from which draws come, of how many that were tried, and how much wider than a normal posterior
# these were; samples until drawn noise forgets how it began.
_MEMBERS, _TRIED, _WIDER, _BURN_IN = 24, 480, 1.5, 400
# Newton steps at most; most windows take five.
_STEPS = 25
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
    inside = _same_calcium(trial, inside)
    found = slice(max(inside.start, inside.stop - _MOST), inside.stop)
    step_s = float(np.median(np.diff(time_s[found]))) if found.stop - found.start > 1 else math.nan
    return Window(trial.facts.trial, step_s, np.asarray(trial.measured_f0[found]))


def _same_calcium(trial: Trial, inside: slice) -> slice:
    """The longest part of a window in which calcium stays as it is; after a change of calcium, without its first third.

    A stimulated muscle's force comes and goes while its length is held; that is no noise.
    """
    given = trial.calcium_um[np.searchsorted(trial.calcium_time_s, trial.force_time_s[inside], side="right") - 1]
    moving = np.abs(np.diff(given)) > _CALM * np.ptp(trial.calcium_um)
    edges = [0, *(np.flatnonzero(moving) + 1).tolist(), given.size]
    begin, end = max(pairwise(edges), key=lambda part: part[1] - part[0])
    begin += (end - begin) // 3 if begin > 0 else 0
    return slice(inside.start + begin, inside.start + end)


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
    sounding = [p for p in parts.values() if not p.silent]
    start = _most_probable(sounding, [1.0] * len(sounding), _PRIOR_MEAN) if len(sounding) > 1 else _PRIOR_MEAN
    found = {name: _estimated(name, parts, start) for name in parts}
    return NoiseModel(tuple(found.get(w.trial) or _without_window(w, parts, list(found.values())) for w in windows))


class _Part:
    """One window and the drift that it may have."""

    def __init__(self, window: Window) -> None:
        self.step_s = window.step_s
        n = window.force_f0.size
        at = np.linspace(-1.0, 1.0, n)
        drift, _ = np.linalg.qr(np.vander(at, 3 if n >= _CURVED else 2))
        left = window.force_f0 - drift @ (drift.T @ window.force_f0)
        self.silent = float(np.sqrt(np.mean(left**2))) < _LEAST_SD_F0
        self.freedom = float(n - drift.shape[1])
        # Force first, then three columns of drift, the last of them perhaps empty: all are whitened together.
        columns = np.zeros((4, n))
        columns[0], columns[1 : 1 + drift.shape[1]] = left, drift.T
        self.empty = np.diag([0.0, 0.0, 3.0 - drift.shape[1]])
        self.begin = columns[:, :_ORDER]
        # Products of all columns at all lags: what is new in the samples is a sum over them, however long the window.
        lagged = np.stack([columns[:, _ORDER - k : n - k] for k in range(_ORDER + 1)])
        self.products = np.einsum("ict,jdt->ijcd", lagged, lagged, optimize=True).reshape((_ORDER + 1) ** 2, 4, 4)


class _Regressions(NamedTuple):
    """Autoregressions of order 0, 1, ... of partial correlations, shape (many, ...).

    Attributes:
        filters: row k has what is new in sample k, given those before it, shape (many, order + 1, order + 1); the last
            row holds for all later samples.
        sizes: variance of what is new, in units of the last, shape (many, order + 1).
    """

    filters: Array
    sizes: Array


def _regressions(z: Array) -> _Regressions:
    """Of partial correlations tanh(z), shape (many, order), by the recursion of Levinson and Durbin."""
    partial = np.tanh(z)
    filters = np.zeros((z.shape[0], _ORDER + 1, _ORDER + 1))
    filters[:, 0, 0] = 1.0
    for k in range(1, _ORDER + 1):
        last, tanh = filters[:, k - 1, :k], partial[:, k - 1, None]
        filters[:, k, 1 : k + 1] = last
        filters[:, k, :k] -= tanh * last[:, ::-1]
    left = np.cumprod(1.0 - partial**2, axis=1)
    sizes = np.concatenate([np.ones((z.shape[0], 1)), left], axis=1)
    return _Regressions(filters, sizes / sizes[:, -1:])


def _squares(parts: Sequence[_Part], of: _Regressions) -> tuple[Array, Array]:
    """Squares of what is new in the samples, drift taken out, F0², and log-determinants, shape (many, parts)."""
    last = of.filters[:, -1, ::-1]
    pairs = (last[:, :, None] * last[:, None, :]).reshape(last.shape[0], -1)
    products = np.stack([p.products.reshape(-1, 16) for p in parts])
    gram = np.swapaxes(pairs @ products, 0, 1).reshape(-1, len(parts), 4, 4)
    rows = of.filters[:, :_ORDER, :_ORDER] / np.sqrt(of.sizes[:, :_ORDER, None])
    begin = np.stack([p.begin for p in parts]) @ np.swapaxes(rows, -1, -2)[:, None]
    gram = gram + begin @ np.swapaxes(begin, -1, -2)
    drift, across = gram[..., 1:, 1:], gram[..., 1:, :1]
    trace = np.trace(drift, axis1=-1, axis2=-2)[..., None, None]
    drift = drift + 1e-12 * trace * np.eye(3) + np.stack([p.empty for p in parts])
    left = gram[..., 0, 0] - np.sum(across * np.linalg.solve(drift, across), axis=(-1, -2))
    log = np.sum(np.log(of.sizes), axis=1)[:, None] + np.linalg.slogdet(drift)[1]
    return np.maximum(left, 1e-300), log


def _estimated(name: str, parts: dict[str, _Part], start: Array) -> TrialNoise:
    """Noise of a trial with a window, sought from the start for its partial correlations."""
    part = parts[name]
    if part.silent:
        still = Member(np.empty(0), _LEAST_SD_F0)
        return TrialNoise(name, _LEAST_SD_F0, np.array([1.0, 0.0]), part.freedom, still, (still,))
    others = [p for p in parts.values() if p is not part and not p.silent and _alike(p.step_s, part.step_s)]
    share = min(1.0, _OTHERS / max(sum(p.freedom for p in others), 1.0))
    counted, shares = [part, *others], [1.0, *(share for _ in others)]
    z = _most_probable(counted, shares, start)
    found = _regressions(z[None])
    likeliest = _members(part, found)[0]
    sd = max(likeliest.fresh_f0 * math.sqrt(float(found.sizes[0, 0])), _LEAST_SD_F0)
    members = _members(part, _regressions(_possible(counted, shares, z)))
    return TrialNoise(name, sd, _correlation(found.filters[0]), part.freedom, likeliest, members)


def _members(part: _Part, of: _Regressions) -> tuple[Member, ...]:
    fresh = np.sqrt(_squares([part], of)[0][:, 0] / part.freedom)
    return tuple(Member(-row[-1, -2::-1], float(sd)) for row, sd in zip(of.filters, fresh, strict=True))


def _possible(parts: Sequence[_Part], shares: Sequence[float], z: Array) -> Array:
    """Partial correlations that windows leave possible, from little noise to much, shape (members, order).

    Drawn around the most probable and resampled, because persistent noise stays possible for longer than a normal
    distribution would have it.
    """
    normal = _WIDER * np.random.default_rng(0).standard_normal((_TRIED, _ORDER))
    tried = z + normal @ _spread(parts, shares, z).T
    log = -_costs(parts, shares, np.clip(tried, -_REACH, _REACH)) + 0.5 * np.sum(normal**2, axis=1) / _WIDER**2
    weights = np.where(np.all(np.abs(tried) <= _REACH, axis=1), np.exp(log - log.max()), 0.0)
    found = _regressions(np.clip(tried, -_REACH, _REACH))
    # Sorted before drawing at even steps, so that all of the distribution is met.
    order = np.argsort(_squares(parts[:1], found)[0][:, 0] * found.sizes[:, 0])
    steps = (np.arange(_MEMBERS) + 0.5) / _MEMBERS
    total = np.cumsum(weights[order]) / max(float(weights.sum()), 1e-300)
    picked = order[np.minimum(np.searchsorted(total, steps), _TRIED - 1)]
    possible: Array = tried[picked]
    return possible


def _costs(parts: Sequence[_Part], shares: Sequence[float], z: Array) -> Array:
    """Minus the logarithm of the restricted likelihood of windows, each with its own size of noise, and of the prior.

    Args:
        parts: windows.
        shares: what each one's likelihood counts.
        z: partial correlations, inverse hyperbolic tangents, shape (many, order).

    Returns:
        Shape (many,).
    """
    left, log_determinants = _squares(parts, _regressions(z))
    of_parts = 0.5 * (np.array([p.freedom for p in parts]) * np.log(left) + log_determinants)
    costs: Array = of_parts @ np.array(shares) + 0.5 * np.sum((z - _PRIOR_MEAN) ** 2, axis=1) / _PRIOR_SD**2
    return costs


def _most_probable(parts: Sequence[_Part], shares: Sequence[float], start: Array) -> Array:
    """Partial correlations (inverse hyperbolic tangents) at which `_costs` are least, shape (order,).

    Newton's method; downhill also where the costs curve down, and of several lengths of each step the best.
    """
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


def _spread(parts: Sequence[_Part], shares: Sequence[float], z: Array) -> Array:
    """A root of the covariance of partial correlations around the most probable, shape (order, order)."""
    _, values, vectors = _shape(parts, shares, z)
    root: Array = vectors / np.sqrt(np.maximum(values, 1.0 / _PRIOR_SD**2))
    return root


def _shape(parts: Sequence[_Part], shares: Sequence[float], z: Array) -> tuple[Array, Array, Array]:
    """Slope of the costs, and values and vectors of their curvature, by differences."""
    h = 0.02
    signs = np.array([(1, 1), (1, -1), (-1, 1), (-1, -1)], dtype=np.float64)
    moves = signs[:, :, None, None, None] * h * np.eye(_ORDER)[:, None, :]
    corners = moves[:, 0] + np.swapaxes(moves[:, 1], 1, 2)
    costs = _costs(parts, shares, z + corners.reshape(-1, _ORDER)).reshape(4, _ORDER, _ORDER)
    curvature = (costs[0] - costs[1] - costs[2] + costs[3]) / (4.0 * h**2)
    # Along the diagonal both moves are the same: twice the step.
    slope = np.diag(costs[0] - costs[3]) / (4.0 * h)
    values, vectors = np.linalg.eigh(0.5 * (curvature + curvature.T))
    return slope, values, vectors


def _correlation(filters: Array) -> Array:
    """Correlation at lags 0 to the order, from the rows of `_Regressions`."""
    found = [1.0]
    for k in range(1, _ORDER + 1):
        # What is new in sample k has nothing to do with sample 0 (Yule and Walker).
        found.append(-float(filters[k, :k] @ found))
    return np.array(found)


def _without_window(window: Window, parts: dict[str, _Part], known: Sequence[TrialNoise]) -> TrialNoise:
    """Noise of a trial without a window: as large as that of the others, as far as these agree."""
    log = np.log([noise.sd_f0 for noise in known])
    mean, spread = float(np.mean(log)), float(np.std(log, ddof=1)) if log.size > 1 else _SPREAD
    alike = [noise for noise in known if _alike(parts[noise.trial].step_s, window.step_s)] or list(known)
    like = min(alike, key=lambda noise: abs(math.log(noise.sd_f0) - mean))
    factor = math.exp(mean) / like.sd_f0
    sizes = factor * np.exp(spread * ndtri((np.arange(_MEMBERS) + 0.5) / _MEMBERS))
    return TrialNoise(
        trial=window.trial,
        sd_f0=math.exp(mean),
        colour=like.colour,
        freedom=like.freedom,
        likeliest=_times(like.likeliest, factor),
        members=tuple(_times(like.members[k % len(like.members)], float(sizes[k])) for k in range(_MEMBERS)),
    )


def _times(member: Member, factor: float) -> Member:
    return member._replace(fresh_f0=member.fresh_f0 * factor)


def _alike(step_s: float, other_s: float) -> bool:
    """Whether noise sampled so has one colour; true where a step is unknown."""
    known = step_s > 0.0 and other_s > 0.0
    return not known or abs(math.log(step_s / other_s)) <= math.log(_SAME_STEP)
