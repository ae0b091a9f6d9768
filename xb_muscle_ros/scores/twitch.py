"""What is read off isometric contractions of stimulated muscle: times of a twitch, fusion of a train of pulses."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from xb_muscle_ros.scores.estimate import Missing
from xb_muscle_ros.trials.trial import Array

# Force that rises by less than this over that before the pulse is no contraction, F0.
SMALLEST_F0 = 1e-4
_FEWEST = 5


class Twitch(NamedTuple):
    """Of one contraction.

    Attributes:
        rest_f0: force before the pulse, F0.
        peak_f0: largest force above that, F0.
        to_peak_s: from the pulse to the peak, s.
        half_relaxation_s: from the peak until half of the rise is lost, s; None where it is not within the record.
        rise_per_s, fall_per_s: steepest rise and fall over the peak, 1/s.
    """

    rest_f0: float
    peak_f0: float
    to_peak_s: float
    half_relaxation_s: float | None
    rise_per_s: float
    fall_per_s: float


class Ripple(NamedTuple):
    """Of the last response of a train.

    Attributes:
        peak_f0: largest force above rest, F0.
        fusion: force between the last two peaks over that of the last, above rest; 1: fused.
    """

    peak_f0: float
    fusion: float


def twitch(time_s: Array, force_f0: Array, pulse_s: float) -> Twitch | Missing:
    """Times of a twitch.

    Args:
        time_s, force_f0: shape (n,), s and F0; what the noise does to a single sample, it does to the peak.
        pulse_s: when the muscle is stimulated, s.

    Returns:
        nothing where there are too few samples, or force hardly rises.
    """
    before, after = time_s <= pulse_s + 5e-10, time_s >= pulse_s - 5e-10
    if np.count_nonzero(after) < _FEWEST:
        return Missing(f"there are fewer than {_FEWEST} samples after the pulse at {pulse_s:g} s")
    rest = float(np.mean(force_f0[before])) if np.any(before) else float(force_f0[0])
    t, force = time_s[after] - pulse_s, force_f0[after] - rest
    top = int(np.argmax(force))
    peak = float(force[top])
    if peak < SMALLEST_F0 or top == 0:
        return Missing(f"force rises by {peak:.3g} F0 after the pulse; {SMALLEST_F0:g} are needed")
    rates = np.diff(force) / np.diff(t)
    fallen = np.flatnonzero(force[top:] <= 0.5 * peak)
    half = None
    if fallen.size:
        k = top + int(fallen[0])
        share = (force[k - 1] - 0.5 * peak) / (force[k - 1] - force[k])
        half = float(t[k - 1] + share * (t[k] - t[k - 1]) - t[top])
    return Twitch(rest, peak, float(t[top]), half, float(np.max(rates)) / peak, -float(np.min(rates)) / peak)


def ripple(time_s: Array, force_f0: Array, rest_f0: float, last_pulses_s: tuple[float, float]) -> Ripple | Missing:
    """How far the last two responses of a train are fused (Celichowski and Grottel 1995).

    Args:
        time_s, force_f0: shape (n,), s and F0.
        rest_f0: force without stimulation, F0.
        last_pulses_s: times of the last two pulses, s.

    Returns:
        nothing where there are too few samples between the pulses.
    """
    begin_s, end_s = last_pulses_s
    interval_s = end_s - begin_s
    # Each response peaks later than its pulse, a fused one perhaps after the next pulse would have come.
    between = (time_s >= begin_s) & (time_s < end_s)
    last = (time_s >= end_s) & (time_s < end_s + 2.0 * interval_s)
    if np.count_nonzero(between) < _FEWEST or np.count_nonzero(last) < _FEWEST:
        return Missing(f"there are fewer than {_FEWEST} samples between two pulses")
    force = force_f0 - rest_f0
    top = int(np.flatnonzero(last)[np.argmax(force[last])])
    peak = float(force[top])
    if peak < SMALLEST_F0:
        return Missing(f"force rises by {peak:.3g} F0; {SMALLEST_F0:g} are needed")
    # The peak before the last, and the lowest force from there on.
    earlier = (time_s >= time_s[top] - 1.5 * interval_s) & (time_s <= time_s[top] - 0.5 * interval_s)
    first = (
        int(np.flatnonzero(earlier)[np.argmax(force[earlier])]) if np.any(earlier) else int(np.flatnonzero(between)[0])
    )
    return Ripple(peak, float(np.min(force[first : top + 1])) / peak)
