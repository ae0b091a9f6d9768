"""Noise of trials in which nothing runs smoothly for long enough: what neighbouring samples do not tell of each other.

Each sample is predicted by the cubic through its four neighbours (Gasser, Sroka and Jennen-Steinmetz, Biometrika 73
(1986) 625-633, with two). Half of the samples lie where force bends little, so the median of the residual is the
noise's. It shows only what is fast: how much slower noise there is beside it is taken from measured fibres, and drawn.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from xb_muscle_ros.scores.noise.members import SILENCE, OrnsteinUhlenbeck
from xb_muscle_ros.scores.noise.model import LEAST_SD_F0, MEMBERS, Source, TrialNoise
from xb_muscle_ros.trials.trial import Array, Trial

LEAST_DIFFERENCES = 10
"""Samples of force that a trial needs."""
# Noise of rat soleus fibre 18Dec2017a at 1 kHz has a lag-1 correlation of 0.91 to 0.98: it decays within 10 to 50 ms.
_TAUS_S = (0.0074, 0.02, 0.054)
_SHARES = (0.0, 0.5, 0.9)
_NORMAL_MEDIAN = 0.6745
_SIDE = 2


def by_differences(trials: Sequence[Trial]) -> dict[str, TrialNoise]:
    """Noise of trials with enough samples."""
    return {t.facts.trial: _of_trial(t) for t in trials if t.force_time_s.size >= LEAST_DIFFERENCES}


def _of_trial(trial: Trial) -> TrialNoise:
    time_s, force = trial.force_time_s, trial.measured_f0
    name, samples = trial.facts.trial, int(force.size)
    rows, weights = _neighbours(time_s)
    residual = np.sum(weights * force[rows], axis=1)
    size = float(np.median(np.abs(residual))) / _NORMAL_MEDIAN
    freedom = max(0.5 * residual.size, 2.0)
    if size < LEAST_SD_F0:
        return TrialNoise(name, Source.DIFFERENCES, samples, LEAST_SD_F0, freedom, SILENCE, (SILENCE,))
    lags = np.abs(time_s[rows][:, :, None] - time_s[rows][:, None, :])
    found = []
    for tau_s in _TAUS_S:
        for share in _SHARES:
            correlation = share * np.exp(-lags / tau_s) + (1.0 - share) * (lags == 0.0)
            # Variance of the residual of noise of variance 1.
            unit = np.einsum("ki,kij,kj->k", weights, correlation, weights)
            found.append(OrnsteinUhlenbeck(size / float(np.sqrt(np.median(unit))), share, tau_s))
    found.sort(key=lambda member: member.sd_f0)
    members = tuple(found[k * len(found) // MEMBERS] for k in range(MEMBERS))
    middle = found[len(found) // 2]
    return TrialNoise(name, Source.DIFFERENCES, samples, middle.sd_f0, freedom, middle, members)


def _neighbours(time_s: Array) -> tuple[npt.NDArray[np.intp], Array]:
    """Places of samples with their neighbours, and weights that take a cubic out; shape (n - 4, 5) both."""
    rows = np.arange(time_s.size - 2 * _SIDE)[:, None] + np.arange(2 * _SIDE + 1)
    around = [k for k in range(2 * _SIDE + 1) if k != _SIDE]
    weights = np.zeros(rows.shape)
    weights[:, _SIDE] = 1.0
    at = time_s[rows]
    for k in around:
        others = [j for j in around if j != k]
        above = np.prod(at[:, [_SIDE]] - at[:, others], axis=1)
        weights[:, k] = -above / np.prod(at[:, [k]] - at[:, others], axis=1)
    return rows, weights
