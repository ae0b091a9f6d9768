"""Noise of evenly sampled trials from parts of them.

Autoregressions, because noise of real force hums at 40 to 80 Hz and hangs together over tens of samples.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np

from xb_muscle_ros.scores.noise.members import SILENCE, Regression
from xb_muscle_ros.scores.noise.model import LEAST_SD_F0, Source, TrialNoise
from xb_muscle_ros.scores.noise.posterior import most_probable, possible, prior_mean, share_of_others
from xb_muscle_ros.scores.noise.regressions import ORDER, Part, Regressions, correlation, regressions, squares
from xb_muscle_ros.trials.trial import Array

# Sampling steps within this factor of each other have noise of one autocorrelation.
_SAME_STEP = 1.2


def by_regressions(parts: Mapping[str, Sequence[Part]], source: Source) -> dict[str, TrialNoise]:
    """Noise of trials, each of at least one part."""
    sounding = [p for own in parts.values() for p in own if not p.silent]
    if not sounding:
        return {name: _of_trial(name, parts, np.zeros(ORDER), source) for name in parts}
    start = prior_mean(sounding[0].step_s)
    if len(sounding) > 1:
        start = most_probable(sounding, [1.0] * len(sounding), start)
    return {name: _of_trial(name, parts, start, source) for name in parts}


def _of_trial(name: str, parts: Mapping[str, Sequence[Part]], start: Array, source: Source) -> TrialNoise:
    """Noise of a trial, sought from the start for its partial correlations."""
    own = [p for p in parts[name] if not p.silent]
    samples, freedom = (int(sum(p.samples for p in parts[name])), sum(p.freedom for p in own or parts[name]))
    if not own:
        return TrialNoise(name, source, samples, LEAST_SD_F0, freedom, SILENCE, (SILENCE,))
    others = [
        p for key, of in parts.items() if key != name for p in of if not p.silent and alike(p.step_s, own[0].step_s)
    ]
    share = share_of_others(sum(p.freedom for p in others))
    counted, shares = [*own, *others], [1.0 for _ in own] + [share for _ in others]
    z = most_probable(counted, shares, start)
    (likeliest,) = _members(own, regressions(z[None]))
    members = _members(own, regressions(possible(counted, shares, z, len(own))))
    return TrialNoise(name, source, samples, likeliest.sd_f0, freedom, likeliest, members)


def _members(own: Sequence[Part], of: Regressions) -> tuple[Regression, ...]:
    """Autoregressions of the size that a trial's parts have with them."""
    fresh = np.sqrt(np.sum(squares(own, of)[0], axis=1) / sum(p.freedom for p in own))
    return tuple(
        Regression(
            weights=-filters[-1, -2::-1],
            innovation_sd_f0=float(sd),
            sd_f0=max(float(sd) * math.sqrt(float(sizes[0])), LEAST_SD_F0),
            autocorrelation=correlation(filters),
        )
        for filters, sizes, sd in zip(of.filters, of.sizes, fresh, strict=True)
    )


def alike(step_s: float, other_s: float) -> bool:
    """Whether noise sampled so has one autocorrelation; true where a step is unknown."""
    known = step_s > 0.0 and other_s > 0.0
    return not known or abs(math.log(step_s / other_s)) <= math.log(_SAME_STEP)
