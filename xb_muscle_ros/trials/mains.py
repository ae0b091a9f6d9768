"""Hum of the mains in a recording: told, and on request taken out of length and force by one filter without a phase."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.signal import iirnotch, sosfiltfilt, tf2sos

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.trials.hum import hum, line_near, sine_in
from xb_muscle_ros.trials.phases import initial_isometric
from xb_muscle_ros.trials.trial import Array, Trial

MAINS_HZ = (50.0, 60.0)
# The mains keep their frequency to this, Hz; a short record shows it no better than one over its length.
_NEAR_HZ = 1.0
# Hum with an amplitude below this is within what any recording has, F0.
LEAST_F0 = 1e-3
# A line in length is told from this amplitude on, L0, where it is so many times that of frequencies beside it, in units
# of the record's resolution.
_LEAST_L0, _STANDS_OUT, _BESIDE = 1e-5, 4.0, (-4.0, -3.0, -2.0, 2.0, 3.0, 4.0)
# Of a longer part the last so many samples are looked at.
_MOST, _LEAST = 4000, 60
# Width of a notch between the frequencies that lose half of their power in one pass, Hz: the mains wander by 0.1 Hz.
WIDTH_HZ = 2.0
# Samples are even where no step differs from the usual one by more than this share.
_EVEN = 0.02
# A record is at least so many times as long as the filter remembers.
_LONG = 3.0
_HIGHEST_HZ = 1000.0
# The frequency of hum is sought in so many samples in the middle of a record at most.
_MOST_SOUGHT = 1 << 18


def hum_of_mains(time_s: Array, force_f0: Array, without_hz: Sequence[float] = ()) -> tuple[float, float] | None:
    """Frequency (Hz) and amplitude (F0) of hum of 50 or 60 Hz in a force that holds still; None where there is none.

    Args:
        time_s, force_f0: shape (n,), evenly sampled, s and F0.
        without_hz: notches that were made; what rings within them is no hum.
    """
    t, force = time_s[-_MOST:], force_f0[-_MOST:]
    if t.size < _LEAST:
        return None
    step_s = float(t[-1] - t[0]) / (t.size - 1)
    near = max(_NEAR_HZ, 0.5 / float(t[-1] - t[0]))
    lines, _ = hum(step_s, force)
    for line in lines:
        if any(abs(hz - line.frequency_hz) <= 0.5 * WIDTH_HZ for hz in without_hz):
            continue
        mains = min(MAINS_HZ, key=lambda hz: abs(hz - line.frequency_hz))
        amplitude = float(np.sqrt(2.0 * line.power_f0))
        if abs(mains - line.frequency_hz) <= near and amplitude >= LEAST_F0:
            return line.frequency_hz, amplitude
    return None


def hum_line(trial: Trial, without_hz: Sequence[float] = ()) -> str:
    """One line on the hum in a trial's force, and in its length, before length changes; empty where force has none.

    Args:
        without_hz: notches that were made already.
    """
    isometric = initial_isometric(trial.force_time_s, trial.facts.phases)
    inside = slice(max(isometric.stop - _MOST, 0), isometric.stop)
    time_s = trial.force_time_s[inside]
    if time_s.size < _LEAST or not _even(time_s):
        return ""
    found = hum_of_mains(time_s, trial.force_n[inside] / trial.facts.f0_n, without_hz)
    # A notch needs even samples everywhere.
    if found is None or not _even(trial.force_time_s):
        return ""
    line = f"force has hum of {found[0]:.1f} Hz with an amplitude of {100.0 * found[1]:.2g} % F0"
    times = (("length", trial.time_s), ("force", trial.force_time_s))
    fault = next((fault for what, t in times if (fault := _fault(what, t, found[0]))), "")
    if fault:
        return f"{line}; {fault}, so --notch of import cannot take it out"
    notches = " ".join(f"{round(hz, 1):g}" for hz in (*without_hz, found[0]))
    length_l0 = _line_of_length(trial, found[0])
    if not length_l0:
        return f"{line}; --notch {notches} of import takes it out of length and force"
    return (
        f"{line}, and length has {100.0 * length_l0:.2g} % L0 at this frequency; --notch {notches} of import takes out "
        "both: right for hum of both, wrong for an oscillation of length that was meant"
    )


def _line_of_length(trial: Trial, hz: float) -> float:
    """Amplitude (L0) of a line in length at a frequency before the first change; 0 where there is none."""
    isometric = initial_isometric(trial.time_s, trial.facts.phases)
    inside = slice(max(isometric.stop - _MOST, 0), isometric.stop)
    time_s, length = trial.time_s[inside], trial.length_change_l0[inside]
    if time_s.size < _LEAST or np.ptp(length) == 0.0:
        return 0.0
    amplitude = float(np.sqrt(2.0 * np.mean(sine_in(time_s, length, hz) ** 2)))
    span_s = float(time_s[-1] - time_s[0])
    beside = [hz + k / span_s for k in _BESIDE]
    level = float(np.sqrt(2.0 * np.mean([np.mean(sine_in(time_s, length, each) ** 2) for each in beside])))
    return amplitude if amplitude >= max(_LEAST_L0, _STANDS_OUT * level) else 0.0


class Notch(NamedTuple):
    """Frequencies that are taken out of length and force: both go through the same filter, forwards and backwards.

    Each notch is 2 Hz wide (half power), lies where force has most within that width, and shifts nothing in time; a
    corner of length rings at its frequency, in force as in length.

    Attributes:
        asked_hz: frequencies as asked for, Hz.
        laid_hz: where the notches lie, Hz.
    """

    asked_hz: tuple[float, ...] = ()
    laid_hz: tuple[float, ...] = ()

    def without(self, what: str, time_s: Array, values: Array) -> Array:
        """Values without the frequencies, shape (n,).

        Args:
            what: their name, for messages.
            time_s, values: shape (n,), s and any unit.

        Raises:
            UserError: samples are not even or too few, or a frequency is none that they show.
        """
        if not (self.laid_hz and values.size):
            return values
        return _filtered(what, time_s, values, self.laid_hz)

    @property
    def note(self) -> str:
        """What was done, for a trial's source; empty where nothing was."""
        if not self.laid_hz:
            return ""
        asked, laid = (", ".join(f"{hz:.4g}" for hz in each) for each in self)
        told = f"notch at {asked} Hz, {WIDTH_HZ:g} Hz wide, on length and force"
        return told + f" (laid at {laid} Hz)" * (laid != asked)


def laid_notch(frequencies_hz: Sequence[float], force_time_s: Array, force: Array) -> Notch:
    """A notch at each of some frequencies (Hz), where force (shape (n,), any unit; may be empty) has most near it."""
    return Notch(tuple(frequencies_hz), tuple(_found(force_time_s, force, hz) for hz in frequencies_hz))


def check_frequencies(frequencies_hz: Sequence[float], what: str) -> None:
    """Make sure that a notch can be asked for.

    Raises:
        UserError: a frequency is out of range.
    """
    for hz in frequencies_hz:
        if not 1.0 <= hz <= _HIGHEST_HZ:
            raise UserError(f"{what} is {hz:g} Hz; allowed is 1 to {_HIGHEST_HZ:g}, for example 50")


def _found(force_time_s: Array, force: Array, hz: float) -> float:
    """Where hum lies within a notch: mains of 50 Hz may have 49.8."""
    middle = slice(max((force.size - _MOST_SOUGHT) // 2, 0), (force.size + _MOST_SOUGHT) // 2)
    time_s = force_time_s[middle]
    if time_s.size < _LEAST or not _even(time_s):
        return hz
    return line_near(float(time_s[-1] - time_s[0]) / (time_s.size - 1), force[middle], hz, 0.5 * WIDTH_HZ)


def _fault(what: str, time_s: Array, hz: float) -> str:
    """Why samples at these times take no notch; empty where they do."""
    if time_s.size < 2 or not _even(time_s):
        return f"{what} is not sampled evenly, which a notch needs"
    span_s = float(time_s[-1] - time_s[0])
    if span_s < _LONG / WIDTH_HZ:
        return f"{what} lasts {span_s:.3g} s, and a notch of {WIDTH_HZ:g} Hz needs {_LONG / WIDTH_HZ:g} s"
    rate_hz = (time_s.size - 1) / span_s
    if hz >= 0.5 * rate_hz:
        needed = f"more than {2.0 * hz:.4g} samples per second"
        return f"a notch at {hz:.4g} Hz needs {needed}; {what} has {rate_hz:.4g}"
    return ""


def _filtered(what: str, time_s: Array, values: Array, frequencies_hz: Sequence[float]) -> Array:
    fault = next((fault for hz in frequencies_hz if (fault := _fault(what, time_s, hz))), "")
    if fault:
        raise UserError(f"{fault}; leave --notch out")
    rate_hz = (time_s.size - 1) / float(time_s[-1] - time_s[0])
    level = float(np.mean(values))
    out = values - level
    for hz in frequencies_hz:
        sections = tf2sos(*iirnotch(hz, hz / WIDTH_HZ, rate_hz))
        # What is the same all the time goes first: at the ends, where the filter begins, it would stay.
        out = out - sine_in(time_s, out, hz)
        # Mirrored for as long as the filter remembers.
        out = sosfiltfilt(sections, out, padlen=min(int(rate_hz / WIDTH_HZ), out.size - 1))
    return np.asarray(out + level)


def _even(time_s: Array) -> bool:
    steps = np.diff(time_s)
    return bool(np.all(np.abs(steps - np.median(steps)) <= _EVEN * np.median(steps)))
