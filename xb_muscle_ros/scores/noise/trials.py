"""Noise of all trials of a study, each from what its recording has to tell of it."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np
import numpy.typing as npt
from scipy.special import ndtri

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.scores.noise.differences import LEAST_DIFFERENCES, by_differences
from xb_muscle_ros.scores.noise.estimate import alike, by_regressions
from xb_muscle_ros.scores.noise.memories import Timed, by_memories
from xb_muscle_ros.scores.noise.model import MEMBERS, NoiseModel, Source, TrialNoise
from xb_muscle_ros.scores.noise.pieces import Piece, curves, evenly_sampled, smooth_pieces
from xb_muscle_ros.scores.noise.regressions import Part
from xb_muscle_ros.scores.noise.windows import LEAST, Window, isometric_window
from xb_muscle_ros.trials.trial import Trial

Array = npt.NDArray[np.float64]

# Windows with fewer samples together tell less than smooth pieces do.
ENOUGH = 60
# From here on a window's drift may be curved; columns of drift beside its mean.
_CURVED, _WINDOW_WIDTH = 200, 3
# Hum of 40 to 80 Hz is seen where samples are no further apart, s.
_HUM_S = 0.005
# SD of log-SD of trials of unknown noise around those of known noise, where there is a single one.
_SPREAD = 0.7


def noise_of(trials: Sequence[Trial]) -> NoiseModel:
    """Noise of the trials of a study.

    Of evenly sampled ones from the windows in which the muscle only holds; where these have too few samples, and of
    unevenly sampled ones, from what smooth curves leave of force; of the others from that of those. Where no trial has
    either, from curves through few samples, and failing that from what neighbouring samples do not tell of each other.

    Raises:
        UserError: no trial has enough samples for any of that, or a force is not finite.
    """
    for trial in trials:
        if not np.all(np.isfinite(trial.force_n)):
            raise UserError(f"trial {trial.facts.trial}: force is not finite; leave the trial out")
    even = {t.facts.trial: evenly_sampled(t) for t in trials}
    known = by_windows([isometric_window(t) for t in trials if even[t.facts.trial]])
    enough = sum(noise.samples for noise in known.values()) >= ENOUGH
    by_pieces = [t for t in trials if not (enough and even[t.facts.trial])]
    known |= by_curves({t.facts.trial: smooth_pieces(t) for t in by_pieces}, even)
    known = known or by_curves({t.facts.trial: smooth_pieces(t, short=True) for t in trials}, even)
    known = known or by_differences(trials)
    if not known:
        longest = max((t.force_time_s.size for t in trials), default=0)
        raise UserError(
            f"no trial has more than {longest} samples of force, so that noise is unknown; at least "
            f"{LEAST_DIFFERENCES} in one trial are needed"
        )
    steps_s = {t.facts.trial: _step_s(t.force_time_s) if even[t.facts.trial] else math.nan for t in trials}
    return completed(known, steps_s)


def by_windows(windows: Sequence[Window]) -> dict[str, TrialNoise]:
    """Noise of trials whose windows are long enough."""
    parts = {}
    for w in windows:
        n = w.force_f0.size
        if n >= LEAST:
            drift, _ = np.linalg.qr(np.vander(np.linspace(-1.0, 1.0, n), 3 if n >= _CURVED else 2))
            parts[w.trial] = [Part(w.step_s, w.force_f0, drift, _WINDOW_WIDTH)]
    return by_regressions(parts, Source.WINDOW)


def by_curves(pieces: Mapping[str, Sequence[Piece]], even: Mapping[str, bool]) -> dict[str, TrialNoise]:
    """Noise of trials that have smooth pieces, from what these leave.

    Autoregressions where samples come evenly and fast enough for hum to be seen, else memories that fade in time.

    Args:
        pieces: of each trial.
        even: whether its force is sampled evenly.
    """
    drifts = {name: [(p, curves(p.time_s)) for p in of] for name, of in pieces.items() if of}
    fast = {
        n: of
        for n, of in drifts.items()
        if even[n] and _step_s(of[0][0].time_s) <= _HUM_S and all(p.time_s.size >= LEAST for p, _ in of)
    }
    width = max((drift.shape[1] for of in fast.values() for _, drift in of), default=0)
    parts = {n: [Part(_step_s(p.time_s), p.force_f0, drift, width) for p, drift in of] for n, of in fast.items()}
    timed = {n: [Timed(p.time_s, p.force_f0, drift) for p, drift in of] for n, of in drifts.items() if n not in fast}
    return by_regressions(parts, Source.CURVE) | by_memories(timed, Source.CURVE)


def _step_s(time_s: Array) -> float:
    return float(np.median(np.diff(time_s))) if time_s.size > 1 else math.nan


def completed(known: Mapping[str, TrialNoise], steps_s: Mapping[str, float]) -> NoiseModel:
    """Noise of all trials, those without any of their own like the others.

    Args:
        known: at least one.
        steps_s: between samples of force of each trial, s; nan where they are uneven or unknown.
    """
    return NoiseModel(tuple(known.get(name) or _like_others(name, steps_s, known) for name in steps_s))


def _like_others(name: str, steps_s: Mapping[str, float], known: Mapping[str, TrialNoise]) -> TrialNoise:
    """Noise of a trial that tells nothing: as large as that of the others, as far as these agree."""
    log = np.log([noise.sd_f0 for noise in known.values()])
    mean, spread = float(np.mean(log)), float(np.std(log, ddof=1)) if log.size > 1 else _SPREAD
    same = [noise for noise in known.values() if alike(steps_s[noise.trial], steps_s[name])] or list(known.values())
    like = min(same, key=lambda noise: abs(math.log(noise.sd_f0) - mean))
    factor = math.exp(mean) / like.sd_f0
    sizes = factor * np.exp(spread * ndtri((np.arange(MEMBERS) + 0.5) / MEMBERS))
    return TrialNoise(
        trial=name,
        source=Source.OTHERS,
        samples=0,
        sd_f0=math.exp(mean),
        freedom=like.freedom,
        likeliest=like.likeliest.times(factor),
        members=tuple(like.members[k % len(like.members)].times(float(sizes[k])) for k in range(MEMBERS)),
    )
