"""Noise of all trials of a study, each from what its recording has to tell of it."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from scipy.special import ndtri

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.scores.noise import ornstein_uhlenbeck as ou
from xb_muscle_ros.scores.noise.differences import LEAST_DIFFERENCES, by_differences
from xb_muscle_ros.scores.noise.estimate import alike, by_regressions
from xb_muscle_ros.scores.noise.model import LEAST_SD_F0, MEMBERS, NoiseModel, Source, TrialNoise
from xb_muscle_ros.scores.noise.pieces import Piece, evenly_sampled, smooth_pieces
from xb_muscle_ros.scores.noise.regressions import Part
from xb_muscle_ros.scores.noise.windows import LEAST, Window, isometric_window
from xb_muscle_ros.scores.steady import steady_part
from xb_muscle_ros.trials.trial import Array, Trial

# Windows with fewer samples together tell less than smooth pieces do.
ENOUGH = 60
# From here on a window's drift may be curved; columns of drift beside its mean.
_CURVED, _WINDOW_WIDTH = 200, 3
# Hum of 40 to 80 Hz is seen where samples are no further apart, s.
_HUM_S = 0.005
# SD of log-SD of trials of unknown noise around those of known noise, where there is a single one.
_SPREAD = 0.7
# Noise grows with force: by its power 0.3 to 0.8 in rat soleus fibres (0.03 to 0.5 % F0 at 0.02 to 1 F0, 1 kHz and
# 6 ms), hardly at all in a cat's soleus. Below the floor, F0, it is the transducer's.
_POWER, _POWER_SD, _FLOOR_F0 = 0.5, 0.3, 0.02
# So many samples of steady force tell at least how much it scatters.
_LEAST_STEADY = 8


def noise_of(trials: Sequence[Trial]) -> NoiseModel:
    """Noise of the trials of a study.

    Of evenly sampled ones from the windows in which the muscle only holds; where these have too few samples, and of
    unevenly sampled ones, from what smooth curves leave of force; of the others from that of those. Where no trial has
    either, from curves through few samples, and failing that from what neighbouring samples do not tell of each other.
    What is not taken from windows is at least what force scatters by before the first change of length: curves through
    few samples take slow noise for force.

    Raises:
        UserError: no trial has enough samples for any of that, or a force is not finite.
    """
    for trial in trials:
        if not np.all(np.isfinite(trial.force_n)):
            raise UserError(f"trial {trial.facts.trial}: force is not finite; leave the trial out")
    even = {t.facts.trial: evenly_sampled(t.force_time_s) for t in trials}
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
    by_name = {t.facts.trial: t for t in trials}
    known = {name: _at_least(noise, steady_scatter_f0(by_name[name])) for name, noise in known.items()}
    steps_s = {t.facts.trial: _step_s(t.force_time_s) if even[t.facts.trial] else math.nan for t in trials}
    return completed(known, steps_s, {t.facts.trial: _level_f0(t) for t in trials})


def steady_scatter_f0(trial: Trial) -> float:
    """Standard deviation of steady force around a straight line, F0; 0 where too little of it is steady."""
    inside = steady_part(trial, trial.force_time_s, trial.measured_f0).inside
    force = trial.measured_f0[inside]
    if force.size < _LEAST_STEADY:
        return 0.0
    drift, _ = np.linalg.qr(np.vander(trial.force_time_s[inside] - trial.force_time_s[inside.start], 2))
    return float(np.linalg.norm(force - drift @ (drift.T @ force)) / math.sqrt(force.size - 2))


def _at_least(noise: TrialNoise, sd_f0: float) -> TrialNoise:
    """Noise that was not taken from a window, of at least this size."""
    if noise.source is Source.WINDOW or noise.sd_f0 >= sd_f0 or noise.sd_f0 <= LEAST_SD_F0:
        return noise
    factor = sd_f0 / noise.sd_f0
    members = tuple(member.times(factor) for member in noise.members)
    return replace(noise, sd_f0=sd_f0, likeliest=noise.likeliest.times(factor), members=members)


def _level_f0(trial: Trial) -> float:
    """Usual force of a trial, F0, where there is any; never below what noise stops falling at."""
    return max(float(np.median(np.abs(trial.measured_f0))) if trial.force_n.size else 0.0, _FLOOR_F0)


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

    Autoregressions where samples come evenly and fast enough for hum to be seen, else an Ornstein-Uhlenbeck process.

    Args:
        even: whether its force is sampled evenly.
    """
    fast = {
        n
        for n, of in pieces.items()
        if of and even[n] and _step_s(of[0].time_s) <= _HUM_S and all(p.time_s.size >= LEAST for p in of)
    }
    width = max((p.drift.shape[1] for n in fast for p in pieces[n]), default=0)
    parts = {n: [Part(_step_s(p.time_s), p.force_f0, p.drift, width) for p in pieces[n]] for n in pieces if n in fast}
    timed = {n: [ou.Part(*p) for p in of] for n, of in pieces.items() if of and n not in fast}
    return by_regressions(parts, Source.CURVE) | {n: ou.of_trial(n, timed, Source.CURVE) for n in timed}


def _step_s(time_s: Array) -> float:
    return float(np.median(np.diff(time_s))) if time_s.size > 1 else math.nan


def completed(
    known: Mapping[str, TrialNoise], steps_s: Mapping[str, float], levels_f0: Mapping[str, float] | None = None
) -> NoiseModel:
    """Noise of all trials, those without any of their own like the others.

    Args:
        known: at least one.
        steps_s: between samples of force of each trial, s; nan where they are uneven or unknown.
        levels_f0: usual force of each trial, F0; None for the same in all.
    """
    levels = levels_f0 or dict.fromkeys(steps_s, 1.0)
    return NoiseModel(tuple(known.get(name) or _like_others(name, steps_s, levels, known) for name in steps_s))


def _like_others(
    name: str, steps_s: Mapping[str, float], levels_f0: Mapping[str, float], known: Mapping[str, TrialNoise]
) -> TrialNoise:
    """Noise of a trial that tells nothing: as large as that of the others at its force, as far as these agree."""
    log = np.log([noise.sd_f0 for noise in known.values()])
    level = np.log([levels_f0[other] for other in known])
    away = math.log(levels_f0[name]) - float(np.mean(level))
    power, power_sd, spread = _power_of_force(log, level)
    mean = max(float(np.mean(log)) + power * away, math.log(LEAST_SD_F0))
    spread = math.hypot(spread, power_sd * away)
    same = [noise for noise in known.values() if alike(steps_s[noise.trial], steps_s[name])] or list(known.values())
    like = min(same, key=lambda noise: abs(math.log(noise.sd_f0) - mean))
    factor = math.exp(mean) / like.sd_f0
    sizes = factor * np.exp(spread * ndtri((np.arange(MEMBERS) + 0.5) / MEMBERS))
    return TrialNoise(
        trial=name,
        source=Source.OTHERS,
        samples=0,
        sd_f0=max(math.exp(mean), LEAST_SD_F0),
        freedom=like.freedom,
        likeliest=like.likeliest.times(factor),
        members=tuple(like.members[k % len(like.members)].times(float(sizes[k])) for k in range(MEMBERS)),
    )


def _power_of_force(log_sd: Array, log_level: Array) -> tuple[float, float, float]:
    """With which power of force noise grows, that power's standard deviation, and the spread around it (of log-SD)."""
    apart, off = log_level - np.mean(log_level), log_sd - np.mean(log_sd)
    spread = max(float(np.std(log_sd, ddof=1)), 1e-3) if log_sd.size > 1 else _SPREAD
    # Data and prior, each by its information.
    information, prior = float(apart @ apart) / spread**2, _POWER_SD**-2
    power = (float(apart @ off) / spread**2 + prior * _POWER) / (information + prior)
    around = float(np.sqrt(np.sum((off - power * apart) ** 2) / (log_sd.size - 1))) if log_sd.size > 1 else _SPREAD
    return power, (information + prior) ** -0.5, around
