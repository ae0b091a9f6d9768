"""Hum: lines in the spectrum of force, sharper than any autoregression.

An autoregression that is to follow a strong line of the mains or of a motor loses sight of the slow noise beside it,
which is what makes means uncertain. So lines are found and separated, and their autocovariance A²/2 cos(2 pi f t) added
to that of the rest. A line that is sampled too slowly shows at another frequency; its autocovariance at the samples is
the same.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.ndimage import median_filter

from xb_muscle_ros.trials.trial import Array

# Lines that are looked for at most, and periods of each that a record has at least.
_MOST, _PERIODS = 6, 3.0
# A line stands out from the spectrum beside it by this factor: among 500 frequencies by chance once in some thousand
# recordings.
_STANDS_OUT = 20.0
# The spectrum beside a line, in units of its resolution, where the line itself has its zeros.
_BESIDE = (-4.0, -3.0, -2.0, 2.0, 3.0, 4.0)
# Points of the spectrum for each unit of resolution, and units around a point that are its surroundings.
_FINE, _AROUND = 4, 16


class Line(NamedTuple):
    """One line.

    Attributes:
        frequency_hz: of the line as sampled, Hz.
        power_f0: mean square of it, F0².
    """

    frequency_hz: float
    power_f0: float

    def autocovariance(self, lags_s: Array) -> Array:
        """At lags (s), F0², shape (n,)."""
        out: Array = self.power_f0 * np.cos(2.0 * np.pi * self.frequency_hz * lags_s)
        return out


def hum(step_s: float, force_f0: Array) -> tuple[tuple[Line, ...], Array]:
    """Lines in a force, the most outstanding first, and the force without them.

    Args:
        step_s: between samples, s.
        force_f0: shape (n,), F0.
    """
    time_s = step_s * np.arange(force_f0.size)
    span_s = step_s * force_f0.size
    lines: list[Line] = []
    rest = np.array(force_f0)
    while len(lines) < _MOST:
        frequency = _most_outstanding(time_s, rest, span_s)
        if frequency is None or not _stands_out(time_s, rest, span_s, frequency):
            break
        wave = sine_in(time_s, rest, frequency)
        lines.append(Line(frequency, float(np.mean(wave**2))))
        rest = rest - wave
    return tuple(lines), rest


def line_near(step_s: float, force: Array, frequency_hz: float, within_hz: float) -> float:
    """The frequency (Hz) of the strongest line around one, finer than the record's resolution; that one if none stands.

    Args:
        step_s: between samples, s.
        force: shape (n,).
        within_hz: how far around it is looked, Hz.
    """
    frequencies, power = _spectrum(step_s * np.arange(force.size), force, step_s * force.size)
    inside = np.flatnonzero(np.abs(frequencies - frequency_hz) <= within_hz)
    inside = inside[(inside > 0) & (inside < power.size - 1)]
    if not inside.size:
        return frequency_hz
    i = int(inside[np.argmax(power[inside])])
    below, top, above = np.log(np.maximum(power[i - 1 : i + 2], 1e-300))
    if not top > max(below, above):  # a slope of what lies beside
        return frequency_hz
    return float(frequencies[i] + 0.5 * (below - above) / (below - 2.0 * top + above) * frequencies[1])


def _spectrum(time_s: Array, force: Array, span_s: float) -> tuple[Array, Array]:
    """Frequencies (Hz) and power of a force without its drift, several points for each unit of resolution."""
    still = force - np.polyval(np.polyfit(time_s, force, 1), time_s)
    power: Array = np.square(np.abs(np.fft.rfft(np.hanning(force.size) * still, _FINE * force.size)))
    frequencies: Array = np.arange(float(power.size)) / (_FINE * span_s)
    return frequencies, power


def _most_outstanding(time_s: Array, force: Array, span_s: float) -> float | None:
    """Frequency that stands out from its surroundings most, Hz; None where force has none."""
    n = time_s.size
    frequencies, power = _spectrum(time_s, force, span_s)
    level = median_filter(power, _FINE * _AROUND + 1, mode="nearest")
    counted = (frequencies * span_s >= _PERIODS) & (level > 0.0)
    if not np.any(counted):
        return None
    rough = float(frequencies[int(np.argmax(np.where(counted, power / np.where(counted, level, 1.0), 0.0)))])
    for width in (0.5, 0.1, 0.02):
        near = np.minimum(rough + np.linspace(-width, width, 9) / span_s, 0.5 * n / span_s)
        rough = float(max(near, key=lambda f: _power(time_s, force, float(f))))
    return rough


def _stands_out(time_s: Array, force: Array, span_s: float, frequency_hz: float) -> bool:
    beside = [frequency_hz + k / span_s for k in _BESIDE]
    beside = [f for f in beside if 0.5 / span_s < f < 0.5 * time_s.size / span_s]
    if len(beside) < 2:
        return False
    # Noise has a steep spectrum: a straight line in logarithms between its neighbours.
    power = np.log([max(_power(time_s, force, f), 1e-300) for f in beside])
    level = np.polyval(np.polyfit(np.log(np.array(beside) / frequency_hz), power, 1), 0.0)
    return _power(time_s, force, frequency_hz) > _STANDS_OUT * float(np.exp(level))


def _power(time_s: Array, force: Array, frequency_hz: float) -> float:
    return float(np.mean(sine_in(time_s, force, frequency_hz) ** 2))


def sine_in(time_s: Array, force: Array, frequency_hz: float) -> Array:
    """The sine of a frequency (Hz) in a force that may drift, by least squares, shape (n,)."""
    turn = 2.0 * np.pi * frequency_hz * time_s
    columns = np.column_stack([np.cos(turn), np.sin(turn), np.ones(time_s.size), time_s])
    found, *_ = np.linalg.lstsq(columns, force, rcond=None)
    wave: Array = columns[:, :2] @ found[:2]
    return wave
