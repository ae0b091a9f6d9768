"""What is read off isometric contractions of stimulated muscle: times of a twitch, fusion of a train of pulses."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from xb_muscle_ros.scores.estimate import Estimate, Missing, quotient, rounded
from xb_muscle_ros.scores.local import FEWEST, Extreme, crossing, extreme, is_sure, local, narrowest, steepest, widths
from xb_muscle_ros.scores.standard_error import ForceNoise
from xb_muscle_ros.trials.trial import Array

# Force that rises by less than this over that before the pulse is no contraction, F0.
SMALLEST_F0 = 1e-4
# Parabolas through a measured force are at most as wide as shares of the time to the peak for the peak and for the
# rise, of half relaxation for the fall and for a peak that is sharp, and of the time between two pulses, where it is at
# most so many s.
_PEAK, _RISE, _FALL, _SHARP = 0.35, 0.1, 0.2, 0.5
_RIPPLE, _RIPPLE_S = 0.05, 0.01
# Five samples tell what lasts twice as long as they do.
_COARSE = 0.5
_NOT_HALF = "force does not fall to half of its peak within the record"


class Twitch(NamedTuple):
    """Of one contraction.

    Attributes:
        rest_f0: force before the pulse, F0.
        peak_f0: largest force above that, F0.
        to_peak_s: from the pulse to the peak, s.
        half_relaxation_s: from the peak until half of the rise is lost, s; without a value where it is not within the
            record.
        rise_per_s, fall_per_s: steepest rise and fall over the peak, 1/s; no fall where force still falls faster where
            the record ends.
    """

    rest_f0: Estimate
    peak_f0: Estimate
    to_peak_s: Estimate
    half_relaxation_s: Estimate
    rise_per_s: Estimate
    fall_per_s: Estimate


class Ripple(NamedTuple):
    """Of the last response of a train.

    Attributes:
        peak_f0: largest force above rest, F0.
        fusion: force between the last two peaks over that of the last, above rest; 1: fused.
    """

    peak_f0: Estimate
    fusion: Estimate


def twitch(time_s: Array, force_f0: Array, pulse_s: float, noise: ForceNoise | None = None) -> Twitch | Missing:
    """Times of a twitch, by parabolas through five samples, or more where force is noisy.

    Args:
        time_s, force_f0: shape (n,), s and F0.
        pulse_s: when the muscle is stimulated, s.
        noise: of a measured force.

    Returns:
        nothing where there are too few samples, or force hardly rises.
    """
    after = time_s >= pulse_s - 5e-10
    if np.count_nonzero(after) < FEWEST:
        return Missing(f"there are fewer than {FEWEST} samples after the pulse at {pulse_s:g} s")
    rest = level_before(time_s, force_f0, pulse_s, noise)
    assert rest.value is not None
    t, force = time_s[after] - pulse_s, force_f0[after] - rest.value
    top = int(np.argmax(force))
    if force[top] < SMALLEST_F0:
        return Missing(f"force rises by {force[top]:.3g} F0 after the pulse; {SMALLEST_F0:g} are needed")
    if top <= 1:
        return Missing("the largest force comes with the pulse; an artefact of stimulation has to be cut out")
    five_s = 4.0 * float(np.median(np.diff(t)))
    if five_s > _COARSE * float(t[top]):
        return Missing(f"five samples last {1e3 * five_s:.3g} ms, more than half of the time to the peak")
    if top >= t.size - 2:
        return _unended(rest, t)
    widest_s = min(_PEAK * float(t[top]), _SHARP * _until_half(t, force, top))
    reach_s = max(_PEAK * float(t[top]), 2.0 * float(np.max(np.diff(t))))
    around = max(0.0, t[top] - reach_s), min(float(t[-1]), t[top] + reach_s)
    found = _peak(t, force, around, widest_s, noise)
    peak, to_peak = found.value.value, found.at_s.value
    assert peak is not None
    assert to_peak is not None
    if to_peak >= float(t[-1]) - 0.5 * five_s:
        return _unended(rest, t)
    rise = narrowest(lambda width_s: (steepest(t, force, (0.0, to_peak), width_s, 1.0, noise).value,), _RISE * to_peak)[
        0
    ]
    half = _half_relaxation(t, force, found, noise)
    if five_s > _COARSE * (half.value or np.inf):
        half = Estimate(None, why=f"five samples last {1e3 * five_s:.3g} ms, more than half of it")
    fall = _steepest_fall(t, force, to_peak, _FALL * (half.value or float(t[-1]) - to_peak), noise)
    over = Estimate(peak, found.value.se)
    return Twitch(
        rest,
        Estimate(peak, None if noise is None else rounded(np.hypot(found.value.se or 0.0, rest.se or 0.0))),
        found.at_s,
        half,
        quotient(rise, over),
        quotient(fall, over),
    )


def _until_half(t: Array, force: Array, top: int) -> float:
    """Time from the largest sample to the first that is at half of it, s; infinite where there is none."""
    fallen = np.flatnonzero(force[top:] <= 0.5 * force[top])
    return float(t[top + fallen[0]] - t[top]) if fallen.size else np.inf


def _steepest_fall(t: Array, force: Array, to_peak_s: float, most_s: float, noise: ForceNoise | None) -> Estimate:
    """The steepest fall after the peak, F0/s, positive; none where force falls ever faster until the record ends."""
    last_s = float(t[-1])

    def seen(width_s: float) -> tuple[Estimate]:
        found = steepest(t, force, (to_peak_s, last_s), width_s, -1.0, noise)
        at_s = found.at_s.value
        # Beyond this a parabola has samples on one side alone.
        if at_s is None or at_s > last_s - max(0.5 * width_s, 0.5 * FEWEST * float(t[-1] - t[-2])):
            why = f"force falls fastest where the record ends, {1e3 * (last_s - to_peak_s):.3g} ms after the peak"
            return (Estimate(None, why=why),)
        return (found.value,)

    found = narrowest(seen, most_s)[0]
    return found if found.value is None else Estimate(-found.value, found.se)


def _unended(rest: Estimate, t: Array) -> Twitch:
    """Of a contraction whose record ends before force falls."""
    none = Estimate(None, why=f"force still rises where the record ends, {1e3 * t[-1]:.3g} ms after the pulse")
    return Twitch(rest, none, none, none, none, none)


def level_before(time_s: Array, force_f0: Array, pulse_s: float, noise: ForceNoise | None = None) -> Estimate:
    """Mean force up to a pulse, F0; that of the first sample where there is none before."""
    before = time_s <= pulse_s + 5e-10
    inside = before if np.any(before) else np.arange(time_s.size) == 0
    return Estimate(float(np.mean(force_f0[inside])), None if noise is None else noise.of_mean(time_s[inside]))


def _peak(t: Array, force: Array, around: tuple[float, float], most_s: float, noise: ForceNoise | None) -> Extreme:
    """The peak by the narrowest parabolas by which height and time are sure; the widest tells how it is curved."""
    widest = extreme(t, force, around, most_s, 1.0, noise)
    height, at_s = widest.value.value, widest.at_s.value
    assert height is not None
    assert at_s is not None
    curvature = abs(local(t, force, at_s, most_s).curvature)
    for width_s in widths(most_s):
        here = local(t, force, at_s, width_s)
        of_value = Estimate(height, here.error(np.array([1.0, 0.0, 0.0]), noise))
        of_slope = Estimate(curvature * at_s, here.error(np.array([0.0, 1.0, 0.0]), noise))
        if is_sure(of_value) and is_sure(of_slope):
            return extreme(t, force, around, width_s, 1.0, noise)
    return widest


def _half_relaxation(t: Array, force: Array, top: Extreme, noise: ForceNoise | None) -> Estimate:
    """Time from the peak until parabolas are at half of it, s."""
    peak, to_peak_s = top.value.value, top.at_s.value
    assert peak is not None
    assert to_peak_s is not None
    level = Estimate(0.5 * peak, None if noise is None else 0.5 * (top.value.se or 0.0))
    found = crossing(t, force, level, to_peak_s, _FALL, noise)
    if found.value is None:
        return Estimate(None, why=_NOT_HALF)
    se = None if found.se is None else rounded(float(np.hypot(found.se, top.at_s.se or 0.0)))
    return Estimate(found.value - to_peak_s, se)


def largest(time_s: Array, force_f0: Array, rest_f0: float, noise: ForceNoise | None = None) -> Estimate:
    """The largest force above rest of a whole record, F0, by parabolas of 10 ms at most."""
    if time_s.size < FEWEST:
        return Estimate(None, why=f"a parabola through force needs {FEWEST} samples")
    force, ends = force_f0 - rest_f0, (float(time_s[0]), float(time_s[-1]))
    widest_s = min(_RIPPLE_S, _SHARP * _until_half(time_s, force, int(np.argmax(force))))
    return narrowest(lambda width_s: (extreme(time_s, force, ends, width_s, 1.0, noise).value,), widest_s)[0]


def ripple(
    time_s: Array, force_f0: Array, rest_f0: float, last_pulses_s: tuple[float, float], noise: ForceNoise | None = None
) -> Ripple | Missing:
    """How far the last two responses of a train are fused (Celichowski and Grottel 1995).

    Args:
        time_s, force_f0: shape (n,), s and F0.
        rest_f0: force without stimulation, F0.
        last_pulses_s: times of the last two pulses, s.
        noise: of a measured force.

    Returns:
        nothing where there are too few samples between the pulses.
    """
    begin_s, end_s = last_pulses_s
    interval_s = end_s - begin_s
    # Each response peaks later than its pulse, a fused one perhaps after the next pulse would have come.
    between = (time_s >= begin_s) & (time_s < end_s)
    last = (time_s >= end_s) & (time_s < end_s + 2.0 * interval_s)
    if np.count_nonzero(between) < FEWEST or np.count_nonzero(last) < FEWEST:
        return Missing(f"there are fewer than {FEWEST} samples between two pulses")
    force, last_s = force_f0 - rest_f0, float(time_s[last][-1])
    if int(np.argmax(force[last])) >= np.count_nonzero(last) - 1 and last_s >= float(time_s[-1]):
        return Missing("force still rises where the record ends")
    if float(np.max(force[last])) < SMALLEST_F0:
        return Missing(f"force rises by {float(np.max(force[last])):.3g} F0; {SMALLEST_F0:g} are needed")

    def seen(width_s: float) -> Ripple:
        found = extreme(time_s, force, (end_s, last_s), width_s, 1.0, noise)
        top_s = found.at_s.value
        assert top_s is not None
        # The peak before the last, and the lowest force from there on.
        earlier = max(float(time_s[0]), top_s - 1.5 * interval_s), top_s - 0.5 * interval_s
        before = extreme(time_s, force, earlier, width_s, 1.0, noise).at_s.value
        assert before is not None
        lowest = extreme(time_s, force, (before, top_s), width_s, -1.0, noise).value
        return Ripple(found.value, quotient(lowest, found.value))

    sharp_s = _SHARP * _until_half(time_s, force, int(np.flatnonzero(last)[np.argmax(force[last])]))
    # Force may fall to rest between two pulses.
    return narrowest(seen, min(_RIPPLE * interval_s, _RIPPLE_S, sharp_s), 0.1)
