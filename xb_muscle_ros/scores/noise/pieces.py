"""Where a recording that never only holds shows its noise: pieces in which force runs smoothly.

While length stands still or moves at a constant rate, force goes over from one course into another: a muscle near a
steady state relaxes as a mix of exponentials, and a mix of few whose times are evenly spaced in the logarithm comes as
near as one likes to any relaxation between them, a power law included (Beylkin and Monzon, Applied and Computational
Harmonic Analysis 19 (2005) 17-48). These and a cubic are taken out of each piece, by restricted likelihood, so that
what they take from the noise is known and given back. What they cannot follow counts as noise, rather too much of it
than too little; noise as slow as they are is not seen (scripts/noise_coverage.py measures both).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from xb_muscle_ros.scores.noise.windows import LEAST, MOST, same_calcium
from xb_muscle_ros.trials.corners import SMALLEST_RAMP, SMALLEST_STRAIN
from xb_muscle_ros.trials.trial import Array, Phase, Trial

# Share of a phase's samples that is left out at either end: corners are rounded, and what is fastest comes first.
_ENDS = 0.1
# Times of neighbouring exponentials are this factor apart; the longest is a piece's duration over it.
_APART = 4.0
_DEGREE = 3
# A piece has this many samples for each column that is taken out of it at least. Where no trial of a study has such
# pieces, shorter ones have to do: of so many samples, and so many more than columns.
_FOR_EACH = 2
_SHORT, _SPARE = 8, 3
# Sampled evenly: this share of steps is within this factor of the median one.
_EVENLY, _STEP = 0.9, 2.0


class Piece(NamedTuple):
    """Force while length stands still or moves at a constant rate.

    Attributes:
        time_s: shape (n,), increasing, s.
        force_f0: shape (n,), F0.
        drift: what force may do there beside noise, orthonormal, shape (n, columns).
    """

    time_s: Array
    force_f0: Array
    drift: Array


def evenly_sampled(time_s: Array) -> bool:
    """Whether samples are a step apart, jitter and gaps aside."""
    steps = np.diff(time_s)
    if not steps.size:
        return True
    usual = float(np.median(steps))
    alike = (steps > usual / _STEP) & (steps < usual * _STEP)
    return float(np.mean(alike)) >= _EVENLY


def smooth_pieces(trial: Trial, short: bool = False) -> list[Piece]:
    """The pieces of a trial in which length stands still; where there is none, those in which it moves steadily.

    Force that is being stretched out of a muscle yields, which no exponential follows as well as it does a recovery.

    Args:
        trial: of any sampling.
        short: take pieces of few samples as well.
    """
    still: list[Piece] = []
    moving: list[Piece] = []
    for phase in trial.facts.phases or (Phase("whole", float(trial.time_s[0]), float(trial.time_s[-1])),):
        inside = _samples(trial, phase)
        time_s = trial.force_time_s[inside]
        if time_s.size < (_SHORT if short else LEAST):
            continue
        drift = curves(time_s)
        columns = drift.shape[1]
        if time_s.size < (columns + _SPARE if short else _FOR_EACH * (1 + columns)):
            continue
        travel_l0 = _steady_travel_l0(trial, float(time_s[0]), float(time_s[-1]))
        if travel_l0 is not None:
            group = still if abs(travel_l0) <= _tolerance_l0(trial) else moving
            group.append(Piece(time_s, np.asarray(trial.measured_f0[inside]), drift))
    return still or moving


def _samples(trial: Trial, phase: Phase) -> slice:
    """Samples of a phase, without its ends, while calcium stays as it is."""
    begin, end = np.searchsorted(trial.force_time_s, [phase.start_s, phase.end_s])
    if begin == end:
        return slice(0, 0)
    inside = same_calcium(trial, slice(int(begin), int(end)))
    cut = int(np.ceil(_ENDS * (inside.stop - inside.start)))
    return slice(max(inside.start + cut, inside.stop - cut - MOST), inside.stop - cut)


def _tolerance_l0(trial: Trial) -> float:
    """Changes of length that are none, L0."""
    return max(SMALLEST_RAMP * float(np.ptp(trial.length_change_l0)), SMALLEST_STRAIN)


def _steady_travel_l0(trial: Trial, start_s: float, end_s: float) -> float | None:
    """Travel of length between two times, L0; None where it is off a straight line."""
    first, last = np.searchsorted(trial.time_s, [start_s, end_s])
    time_s, length = trial.time_s[first : last + 1], trial.length_change_l0[first : last + 1]
    if time_s.size < 3:
        return None
    rate, level = np.polyfit(time_s - time_s[0], length, 1)
    off = length - level - rate * (time_s - time_s[0])
    return float(rate * (end_s - start_s)) if np.sqrt(np.mean(off**2)) <= _tolerance_l0(trial) else None


def curves(time_s: Array) -> Array:
    """What force may do in a piece: an orthonormal cubic and exponentials since its begin, shape (n, columns).

    The fastest exponential decays within a usual step of the first ones.
    """
    since_s = time_s - time_s[0]
    span_s, step_s = float(since_s[-1]), float(np.median(np.diff(time_s[:LEAST])))
    count = max(int(np.log(span_s / step_s) / np.log(_APART)), 0)
    decaying = np.exp(-since_s[:, None] / (span_s / _APART ** np.arange(1, count + 1)))
    columns = np.concatenate([np.vander(2.0 * since_s / span_s - 1.0, _DEGREE + 1), decaying], axis=1)
    directions, sizes, _ = np.linalg.svd(columns / np.linalg.norm(columns, axis=0), full_matrices=False)
    out: Array = directions[:, sizes > 1e-8 * sizes[0]]
    return out
