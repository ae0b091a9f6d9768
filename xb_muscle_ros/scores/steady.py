"""Where a trial is isometric and its force steady before anything happens to the fibre.

Where calcium stays as it is until the first change of length, as for a permeabilised fibre in its bath, the fibre has
come to rest before the record begins: the first four fifths of the phase count (smoothing leaks the stretch into the
last one). Where force shows that it has not come to rest, the part counts in which it has, and a line says so. Where
calcium changes, as for a stimulated muscle, force first rises. Then only the plateau counts, and a force that has not
settled before the first change of length is none.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from scipy.ndimage import median_filter

from xb_muscle_ros.scores.estimate import samples
from xb_muscle_ros.trials.phases import initial_isometric
from xb_muscle_ros.trials.trial import Array, Phase, Trial

# Calcium that stays within this share of its largest value does not change.
_SAME_CALCIUM = 0.05
# A muscle is active, or rests, from where calcium passes the first share of its peak; it is active down to the other.
_HALF, _STILL_ACTIVE = 0.5, 0.9
# Force has settled while its mean over a tenth of the time since activation, at least one period of hum, stays within
# this share of its largest value around the level of the last third.
_SETTLED, _LEVEL, _SMOOTHED, _SHORTEST_S = 0.03, 1.0 / 3.0, 0.1, 0.02
# ... and never asked to stay closer than this, F0: force at rest has noise too.
_LEAST_F0 = 0.005
# At constant calcium force is taken to move where it leaves its level by so many times what noise does to these means.
# Of fewer samples nothing is said.
_BEYOND_NOISE, _TESTED, _MEANS, _FINE = 5.0, 40, 10, 5
# Samples of the running median of which movements are looked for.
_SPIKE = 5
# Left out before a change of length.
_LEAKED = 0.2
_FEWEST = 3


class Steady(NamedTuple):
    """Where a force is steady before the first change of length.

    Attributes:
        inside: slice of the samples of force; empty where there is no such part.
        why: why there is none, in words; empty where there is one.
        told: what was left out of a part that was taken to be steady; empty where there is nothing to say.
    """

    inside: slice
    why: str = ""
    told: str = ""


def steady_part(trial: Trial, time_s: Array, force_f0: Array) -> Steady:
    """The steady isometric part that a trial begins with.

    Args:
        time_s, force_f0: shape (n,), force, measured or simulated, s and F0.
    """
    phases = trial.facts.phases
    if not phases:
        return _none("the phases of the trial are not known")
    if phases[0].name != "isometric":
        return _none(f"the trial begins with {phases[0].name.replace('_', ' ')}")
    active = _active(trial, phases)
    if active is None:
        inside = initial_isometric(time_s, phases)
        count = inside.stop - inside.start
        if count < _FEWEST:
            return _none(f"{samples(count)} before length changes; 3 are needed")
        return _at_rest(inside, time_s, force_f0)
    begin, end = (int(i) for i in np.searchsorted(time_s, active))
    settled = _settled_from(time_s[begin:end], force_f0[begin:end])
    if settled is None:
        what = "length changes" if len(phases) > 1 else "activation ends"
        return _none(f"force has not settled before {what} at {active[1]:.4g} s")
    begin += settled
    if len(phases) > 1:
        end = begin + round((1.0 - _LEAKED) * (end - begin))
    count = end - begin
    return Steady(slice(begin, end)) if count >= _FEWEST else _none(f"{samples(count)} of steady force; 3 are needed")


def _at_rest(inside: slice, time_s: Array, force_f0: Array) -> Steady:
    """What is steady of a part at constant calcium, nearly always all of it."""
    t = time_s[inside]
    if t.size < _TESTED:
        return Steady(inside)
    # A spike is no movement, and a last sample may be that in which length changes.
    force = median_filter(force_f0[inside], _SPIKE, mode="reflect")
    settled = _settled_from(t, force, _BEYOND_NOISE * _noise_of_means(force))
    if settled == 0:
        return Steady(inside)
    if settled is None:
        return _none(
            f"force has not settled at constant calcium: it {_moved(force)} from {t[0]:.4g} to {t[-1]:.4g} s; record "
            "it for longer"
        )
    return Steady(
        slice(inside.start + settled, inside.stop),
        told=(
            f"force has not settled at first: it {_moved(force[: settled + 1])} up to {t[settled]:.4g} s, which is "
            f"left out, and {_moved(force[settled:])} from there on"
        ),
    )


def _noise_of_means(force: Array) -> float:
    """What noise does to the mean of a tenth of the samples, F0: the fast noise within it, or slower noise if larger.

    A slow rise has next to no part in it: how far a mean is from the line between its neighbours is asked.
    """
    found = []
    for count in (_MEANS, _FINE * _MEANS):
        edges = np.linspace(0, force.size, min(count, force.size) + 1).astype(int)
        means = np.add.reduceat(force, edges[:-1]) / np.diff(edges)
        # The median of a normal distribution's size is 0.6745 of its standard deviation.
        bend = float(np.median(np.abs(np.diff(means, 2)))) / (0.6745 * np.sqrt(6.0))
        found.append(bend / np.sqrt(means.size / _MEANS))
    return float(max(found))


def _moved(force: Array) -> str:
    """How far force goes, by the means of the first and the last tenth."""
    few = max(round(_SMOOTHED * force.size), 1)
    change = float(np.mean(force[-few:]) - np.mean(force[:few]))
    return f"{'rises' if change > 0.0 else 'falls'} by {abs(change):.2g} F0"


def _none(why: str) -> Steady:
    return Steady(slice(0, 0), why)


def _active(trial: Trial, phases: tuple[Phase, ...]) -> tuple[float, float] | None:
    """Begin and end (s) of the last time at one level of calcium in the first phase; None where calcium stays."""
    first = phases[0]
    time_s, calcium = trial.calcium_time_s, trial.calcium_um
    # The value that acts at the begin of the phase, and all that come within it.
    start = max(int(np.searchsorted(time_s, first.start_s, side="right")) - 1, 0)
    stop = int(np.searchsorted(time_s, first.end_s, side="left"))
    time_s, calcium = time_s[start : max(stop, start + 1)], calcium[start : max(stop, start + 1)]
    peak = float(np.max(calcium))
    if np.ptp(calcium) <= _SAME_CALCIUM * peak:
        return None
    high = calcium >= _HALF * peak
    # A trial that never moves is about its tetanus; otherwise what counts is the state in which it is moved.
    wanted = True if len(phases) == 1 else bool(high[-1])
    last = int(np.flatnonzero(high == wanted)[-1])
    if wanted:
        last = int(np.flatnonzero(calcium >= _STILL_ACTIVE * peak)[-1])
    other: npt.NDArray[np.intp] = np.flatnonzero(high[:last] != wanted)
    begin_s = float(time_s[other[-1] + 1]) if other.size else first.start_s
    end_s = float(time_s[last + 1]) if last + 1 < time_s.size and (wanted and not high[-1]) else first.end_s
    return begin_s, end_s


def _settled_from(time_s: Array, force: Array, noise_f0: float = 0.0) -> int | None:
    """First sample from which force stays at its level, within noise of this size at least; None where it does not."""
    n = time_s.size
    if n < _FEWEST:
        return None
    period = _SHORTEST_S * (n - 1) / float(time_s[-1] - time_s[0])
    window = min(max(1, round(max(_SMOOTHED * n, period))), n)
    smooth = np.convolve(force, np.full(window, 1.0 / window), "valid")
    level = float(np.mean(force[-max(round(_LEVEL * n), 1) :]))
    allowed = max(_SETTLED * float(np.max(np.abs(smooth))), _LEAST_F0, noise_f0)
    off = np.flatnonzero(np.abs(smooth - level) > allowed)
    begin = int(off[-1]) + 1 if off.size else 0
    if begin >= smooth.size or n - begin < _FEWEST:
        return None
    # Force that goes on rising passes its mean level too.
    slope = float(np.polyfit(np.linspace(0.0, 1.0, n - begin), force[begin:], 1)[0])
    return begin if abs(slope) <= 2.0 * allowed else None
