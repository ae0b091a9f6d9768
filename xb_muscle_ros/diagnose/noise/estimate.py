"""Noise of every trial of a study from its windows.

Autoregressions, because noise of real force hums at 40 to 80 Hz and hangs together over tens of samples.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt
from scipy.special import ndtri

from xb_muscle_ros.diagnose.noise.model import MEMBERS, Member, NoiseModel, TrialNoise
from xb_muscle_ros.diagnose.noise.posterior import PRIOR_MEAN, most_probable, possible
from xb_muscle_ros.diagnose.noise.regressions import (
    LEAST_SD_F0,
    Part,
    Regressions,
    correlation,
    regressions,
    squares,
)
from xb_muscle_ros.diagnose.noise.windows import LEAST, Window
from xb_muscle_ros.errors import UserError

Array = npt.NDArray[np.float64]

# Other trials' windows bear on a trial's colour as if they had this many samples together at most: colour at pCa 9 is
# not that at pCa 4.5.
_OTHERS = 100
# Sampling steps within this factor of each other have noise of one colour.
_SAME_STEP = 1.2
# SD of log-SD of trials without a window around those with one, where a single one has one.
_SPREAD = 0.7


def noise_model(windows: Sequence[Window]) -> NoiseModel:
    """Noise of every trial of a study, also of those without a window.

    Raises:
        UserError: no window has enough samples, or a force is not finite.
    """
    for window in windows:
        if not np.all(np.isfinite(window.force_f0)):
            raise UserError(f"trial {window.trial}: force of its isometric window is not finite; leave the trial out")
    parts = {w.trial: Part(w) for w in windows if w.force_f0.size >= LEAST}
    if not parts:
        longest = max((w.force_f0.size for w in windows), default=0)
        raise UserError(
            f"no trial holds still for {LEAST} samples of force (the longest isometric window has {longest}), so that "
            "its noise is unknown; give at least one trial with an isometric phase"
        )
    sounding = [p for p in parts.values() if not p.silent]
    start = most_probable(sounding, [1.0] * len(sounding), PRIOR_MEAN) if len(sounding) > 1 else PRIOR_MEAN
    found = {name: _estimated(name, parts, start) for name in parts}
    return NoiseModel(tuple(found.get(w.trial) or _without_window(w, parts, list(found.values())) for w in windows))


def _estimated(name: str, parts: dict[str, Part], start: Array) -> TrialNoise:
    """Noise of a trial with a window, sought from the start for its partial correlations."""
    part = parts[name]
    if part.silent:
        still = Member(np.empty(0), LEAST_SD_F0)
        return TrialNoise(name, LEAST_SD_F0, np.array([1.0, 0.0]), part.freedom, still, (still,))
    others = [p for p in parts.values() if p is not part and not p.silent and _alike(p.step_s, part.step_s)]
    share = min(1.0, _OTHERS / max(sum(p.freedom for p in others), 1.0))
    counted, shares = [part, *others], [1.0, *(share for _ in others)]
    z = most_probable(counted, shares, start)
    found = regressions(z[None])
    likeliest = _members(part, found)[0]
    sd = max(likeliest.fresh_f0 * math.sqrt(float(found.sizes[0, 0])), LEAST_SD_F0)
    members = _members(part, regressions(possible(counted, shares, z)))
    return TrialNoise(name, sd, correlation(found.filters[0]), part.freedom, likeliest, members)


def _members(part: Part, of: Regressions) -> tuple[Member, ...]:
    fresh = np.sqrt(squares([part], of)[0][:, 0] / part.freedom)
    return tuple(Member(-row[-1, -2::-1], float(sd)) for row, sd in zip(of.filters, fresh, strict=True))


def _without_window(window: Window, parts: dict[str, Part], known: Sequence[TrialNoise]) -> TrialNoise:
    """Noise of a trial without a window: as large as that of the others, as far as these agree."""
    log = np.log([noise.sd_f0 for noise in known])
    mean, spread = float(np.mean(log)), float(np.std(log, ddof=1)) if log.size > 1 else _SPREAD
    alike = [noise for noise in known if _alike(parts[noise.trial].step_s, window.step_s)] or list(known)
    like = min(alike, key=lambda noise: abs(math.log(noise.sd_f0) - mean))
    factor = math.exp(mean) / like.sd_f0
    sizes = factor * np.exp(spread * ndtri((np.arange(MEMBERS) + 0.5) / MEMBERS))
    return TrialNoise(
        trial=window.trial,
        sd_f0=math.exp(mean),
        colour=like.colour,
        freedom=like.freedom,
        likeliest=_times(like.likeliest, factor),
        members=tuple(_times(like.members[k % len(like.members)], float(sizes[k])) for k in range(MEMBERS)),
    )


def _times(member: Member, factor: float) -> Member:
    return member._replace(fresh_f0=member.fresh_f0 * factor)


def _alike(step_s: float, other_s: float) -> bool:
    """Whether noise sampled so has one colour; true where a step is unknown."""
    known = step_s > 0.0 and other_s > 0.0
    return not known or abs(math.log(step_s / other_s)) <= math.log(_SAME_STEP)
