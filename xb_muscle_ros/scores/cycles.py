"""Cycles of a length that oscillates: where each begins, and stretches of time in which frequency stays the same."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from scipy.signal import find_peaks

from xb_muscle_ros.trials.trial import Array

# A turn counts if length goes this share of its range before it turns again: noise does not.
_TURN = 0.25
# Cycles belong together if period and range differ by no more than these shares from those of the first of them.
_PERIOD, _RANGE = 0.1, 0.3
_FEWEST = 2
# Two cycles are the same if lengths, at so many places, are apart by no more than this share of the range (root mean
# square).
_COMPARED, _SHAPE = 50, 0.05
# A frequency is sought so often, and to this share.
_STEPS, _CLOSE = 20, 1e-10
# Part of a cycle by which an edge may lie beyond the record.
_EDGE = 0.01


Places = npt.NDArray[np.intp]


class Oscillation(NamedTuple):
    """Consecutive cycles of one frequency and amplitude.

    Attributes:
        start_s: begin of each cycle and end of the last, where length rises through its middle, or where it falls
            through it if more cycles are whole in that way, shape (cycles + 1,), s.
        frequency_hz: that of the sinusoid that fits length best over the cycles.
    """

    start_s: Array
    frequency_hz: float

    @property
    def cycles(self) -> int:
        """How many there are."""
        return int(self.start_s.size) - 1


def turns(length_l0: Array) -> tuple[Places, Places]:
    """Samples of the shortest and of the longest lengths, one in turn with the other, shape (k,) each, as numbers."""
    least = _TURN * float(np.ptp(length_l0)) if length_l0.size else 0.0
    if least == 0.0:
        return np.empty(0, dtype=np.intp), np.empty(0, dtype=np.intp)
    # The ends of a record are no turns: how far length would have gone is not known.
    high, low = (find_peaks(sign * length_l0, prominence=least)[0] for sign in (1.0, -1.0))
    return low, high


def rises(time_s: Array, length_l0: Array) -> tuple[Array, Array]:
    """Where length rises through the middle between a shortest and the next longest length.

    Args:
        time_s, length_l0: shape (n,), s and L0.

    Returns:
        times, shape (k,), s, and how far it rises, shape (k,), L0.
    """
    low, high = turns(length_l0)
    times, by = [], []
    for begin, after in zip(low, np.searchsorted(high, low, side="right"), strict=True):
        if after == high.size or np.any((low > begin) & (low < high[after])):
            continue
        end = high[after]
        middle = 0.5 * (length_l0[begin] + length_l0[end])
        k = begin + int(np.argmax(length_l0[begin : end + 1] >= middle))
        share = (middle - length_l0[k - 1]) / (length_l0[k] - length_l0[k - 1])
        times.append(float(time_s[k - 1] + share * (time_s[k] - time_s[k - 1])))
        by.append(float(length_l0[end] - length_l0[begin]))
    return np.array(times), np.array(by)


def oscillations(time_s: Array, length_l0: Array) -> list[Oscillation]:
    """Stretches of at least two cycles of the same frequency and amplitude, in order of time.

    Args:
        time_s, length_l0: shape (n,), s and L0; amplitudes below a quarter of the largest are not seen.
    """
    # Length that first falls has as many whole cycles from fall to fall as one that first rises from rise to rise.
    ways = [_from_rises(time_s, sign * length_l0) for sign in (1.0, -1.0)]
    return max(ways, key=lambda found: sum(one.cycles for one in found))


def _from_rises(time_s: Array, length_l0: Array) -> list[Oscillation]:
    """Those of which each cycle begins with a rise."""
    times, by = rises(time_s, length_l0)
    if times.size == 1:
        return _about(time_s, length_l0, float(times[0]), float(by[0]))
    periods = np.diff(times)
    found, k = [], 0
    while k < periods.size:
        # A cycle ends where length rises as far as at its begin.
        end = k
        while end < periods.size and _alike(periods[end], periods[k], _PERIOD) and _alike(by[end + 1], by[k], _RANGE):
            end += 1
        starts = _extended(time_s, length_l0, times[k : end + 1], float(by[k])) if end > k else times[k : end + 1]
        if starts.size > _FEWEST:
            found.append(Oscillation(starts, best_frequency(time_s, length_l0, starts)))
        k = max(end, k + 1)
    return found


def _about(time_s: Array, length_l0: Array, rise_s: float, by_l0: float) -> list[Oscillation]:
    """The two cycles about the only rise of a record, between still lengths; their period is that of the turns."""
    low, high = (time_s[each] for each in turns(length_l0))
    if low.size != _FEWEST or high.size != _FEWEST or not _alike(np.ptp(low), np.ptp(high), _PERIOD):
        return []
    period_s = 0.5 * float(np.ptp(low) + np.ptp(high))
    # Samples tell turns less closely than a sinusoid through both cycles does.
    period_s = 1.0 / best_frequency(time_s, length_l0, rise_s + period_s * np.array([-1.0, 0.0, 1.0]))
    start_s = _extended(time_s, length_l0, rise_s + period_s * np.array([0.0, 1.0]), by_l0)
    return [Oscillation(start_s, 1.0 / period_s)] if start_s.size == _FEWEST + 1 and start_s[1] == rise_s else []


def _extended(time_s: Array, length_l0: Array, start_s: Array, by_l0: float) -> Array:
    """The same with a cycle more at either end, where length goes as in the next: a record's first or last one.

    Such a cycle has no shortest length before it, or no longest one after it, because length stood still.
    """
    period = float(start_s[-1] - start_s[0]) / (start_s.size - 1)
    shares = np.linspace(0.0, 1.0, _COMPARED)
    for side, beside_s in ((-1, start_s[0]), (1, start_s[-2])):
        edge_s = start_s[0] - period if side < 0 else start_s[-1] + period
        # Edges are known to a small part of a cycle; a record may end where its last one does.
        within_s = float(np.clip(edge_s, time_s[0], time_s[-1]))
        if abs(within_s - edge_s) > _EDGE * period:
            continue
        edge_s = within_s
        begin_s = min(edge_s, edge_s - side * period)
        one, other = (np.interp(begin + period * shares, time_s, length_l0) for begin in (begin_s, beside_s))
        if float(np.sqrt(np.mean((one - other) ** 2))) < _SHAPE * by_l0:
            start_s = np.insert(start_s, 0 if side < 0 else start_s.size, edge_s)
    return start_s


def _alike(one: float, other: float, share: float) -> bool:
    return abs(one / other - 1.0) < share


def best_frequency(time_s: Array, length_l0: Array, start_s: Array) -> float:
    """Frequency (Hz) of the sinusoid that fits length best between the first and the last of `start_s`."""
    inside = (time_s >= start_s[0]) & (time_s <= start_s[-1])
    t, x = time_s[inside] - start_s[0], length_l0[inside]
    cycles = start_s.size - 1
    about = cycles / float(start_s[-1] - start_s[0])
    found = about
    # Gauss and Newton; the ends are known to a small part of a cycle.
    for _ in range(_STEPS):
        design = sinusoid_columns(t, found, 1)
        cosine, sine = np.linalg.lstsq(design, x, rcond=None)[0][:2]
        turn = 2.0 * np.pi * t * (sine * design[:, 0] - cosine * design[:, 1])
        step = float(np.linalg.lstsq(np.column_stack([design, turn]), x, rcond=None)[0][-1])
        found = float(np.clip(found + step, about * (1.0 - 0.2 / cycles), about * (1.0 + 0.2 / cycles)))
        if abs(step) < _CLOSE * about:
            break
    return found


def sinusoid_columns(time_s: Array, frequency_hz: float, harmonics: int) -> Array:
    """Cosine and sine of each harmonic, a level and a line, shape (n, 2·harmonics + 2)."""
    angle = 2.0 * np.pi * frequency_hz * time_s
    waves = [wave(k * angle) for k in range(1, harmonics + 1) for wave in (np.cos, np.sin)]
    line = (time_s - time_s[0]) / max(float(time_s[-1] - time_s[0]), np.finfo(float).tiny) - 0.5
    return np.column_stack([*waves, np.ones(time_s.size), line])
