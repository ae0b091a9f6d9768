"""The activation stage: stimulation of a whole muscle becomes free calcium.

Recordings of whole muscles tell when the nerve or the muscle was stimulated, not the calcium between the filaments.
This stage makes one of the other by first-order calcium dynamics (Hatze 1981, p. 31 ff.), with stimulation off or on,

    dCa/dt = (Ca_tetanus - Ca) / tau_rise     while stimulated,
    dCa/dt = (Ca_rest - Ca) / tau_decay       otherwise,

solved exactly. Single pulses of a tetanus are not told apart, and force does not act back on calcium.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.trials.trial import Array

Interval = tuple[float, float]
"""Begin and end of stimulation, s."""

# Calcium is kept where it changed by this fraction of itself.
KEPT_CHANGE = 1e-3
# A drop of force is the largest fall within this time, s ...
DROP_WINDOW_S = 0.3
# ... and begins where force falls faster than this fraction of its steepest fall.
DROP_BEGIN = 0.1
SMOOTHING_S = 0.05
# A tetanus that ends loses at least this fraction of the range of force within the window.
SMALLEST_DROP = 0.2


@dataclass(frozen=True)
class CalciumTransient:
    """First-order rise to a tetanic level and decay to rest.

    Attributes:
        rest_um, tetanus_um: free calcium without stimulation and in a long tetanus, µM.
        rise_s, decay_s: time constants with and without stimulation, s.

    Raises:
        UserError: a value is not positive and finite, or rest is not below the tetanus.
    """

    rest_um: float
    tetanus_um: float
    rise_s: float
    decay_s: float

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            if not (np.isfinite(value) and value > 0.0):
                raise UserError(f"activation: {name} is {value:g}; allowed are numbers above 0")
        if self.rest_um >= self.tetanus_um:
            raise UserError(
                f"activation: rest is {self.rest_um:g} µM; it has to be below tetanus, {self.tetanus_um:g} µM"
            )

    def at(self, time_s: Array, stimulated: Sequence[Interval]) -> Array:
        """Free calcium, µM, shape (n,), at rest before the first stimulation.

        Args:
            time_s: shape (n,), increasing, s.
            stimulated: intervals in order of time that do not overlap.
        """
        calcium = np.full(np.shape(time_s), self.rest_um)
        level = self.rest_um
        next_on_s = [on_s for on_s, _ in stimulated[1:]] + [np.inf]
        for (on_s, off_s), again_s in zip(stimulated, next_on_s, strict=False):
            rising = (self.tetanus_um, self.rise_s, on_s, off_s)
            for goal, constant_s, begin_s, end_s in (rising, (self.rest_um, self.decay_s, off_s, again_s)):
                inside = (time_s >= begin_s) & (time_s < end_s)
                calcium[inside] = self._towards(goal, level, time_s[inside] - begin_s, constant_s)
                level = float(self._towards(goal, level, np.array(end_s - begin_s), constant_s))
        return calcium

    def samples(self, time_s: Array, stimulated: Sequence[Interval]) -> tuple[Array, Array]:
        """Calcium (s, µM) at the first of the times and wherever it has changed by `KEPT_CHANGE` since."""
        calcium = self.at(time_s, stimulated)
        kept = [0]
        for i, value in enumerate(calcium.tolist()):
            if abs(value - calcium[kept[-1]]) > KEPT_CHANGE * calcium[kept[-1]]:
                kept.append(i)
        return time_s[kept], calcium[kept]

    @staticmethod
    def _towards(goal: float, start: float, after_s: Array, time_constant_s: float) -> Array:
        change: Array = goal + (start - goal) * np.exp(-after_s / time_constant_s)
        return change


def stimulated_intervals(time_s: Array, signal: Array, threshold: float, pulse_gap_s: float) -> tuple[Interval, ...]:
    """Intervals of stimulation in a record of it.

    Args:
        time_s: shape (n,), increasing, s.
        signal: shape (n,), pulses or a level, in any unit.
        threshold: above it there is stimulation, in the unit of the signal.
        pulse_gap_s: pulses no further apart belong to one tetanus, s.
    """
    on = np.concatenate(([False], signal > threshold, [False]))
    begins, ends = np.flatnonzero(~on[:-1] & on[1:]), np.flatnonzero(on[:-1] & ~on[1:])
    intervals: list[Interval] = []
    for begin, end in zip(begins, ends, strict=True):
        start_s, stop_s = float(time_s[begin]), float(time_s[min(end, time_s.size - 1)])
        if intervals and start_s - intervals[-1][1] <= pulse_gap_s:
            start_s = intervals.pop()[0]
        intervals.append((start_s, stop_s))
    return tuple(intervals)


def force_drop(time_s: Array, force: Array, after_s: float) -> float | None:
    """Time at which a tetanus ends by its force: where the largest fall begins, s; None where there is no such fall.

    Muscle force begins to fall some 10 ms after the last pulse, so stimulation ended a little earlier.

    Args:
        time_s: shape (n,), increasing, s.
        force: shape (n,), in any unit.
        after_s: the tetanus has not ended before, s.
    """
    step_s = float(np.median(np.diff(time_s)))
    smooth = _moving_mean(force, max(1, round(SMOOTHING_S / step_s)))
    window = max(1, round(DROP_WINDOW_S / step_s))
    if time_s.size <= window + 2:
        return None
    fall = np.where(time_s[:-window] >= after_s, smooth[:-window] - smooth[window:], -np.inf)
    largest = int(np.argmax(fall))
    if fall[largest] < SMALLEST_DROP * float(np.ptp(smooth)):
        return None
    slope = np.gradient(smooth, time_s)
    steepest = largest + int(np.argmin(slope[largest : largest + window + 1]))
    before = np.flatnonzero(slope[:steepest] > DROP_BEGIN * slope[steepest])
    return float(time_s[before[-1] + 1 if before.size else steepest])


def _moving_mean(values: Array, samples: int) -> Array:
    """Mean over a window, centred; at the ends over what there is of it."""
    kernel = np.ones(samples)
    total = np.convolve(values, kernel, "same")
    return total / np.convolve(np.ones(values.size), kernel, "same")
