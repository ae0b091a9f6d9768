"""The study of a case: trials of one fibre as a physiologist would plan them, seven or more."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from xb_muscle_ros.prove.generator.world import SAMPLE_S, Stimulus
from xb_muscle_ros.trials.trial import Array, Phase

Piece = tuple[str, float, float]
"""Name of a phase, duration (s), change of length (L0)."""

TRIALS = 7
LONGEST_S = 2.5
# From so many trials on there is one more level of calcium, and more than one relaxed trial.
_MORE_LEVELS = (10, 15, 23)
_RELAXED_AGAIN = 12


class Planned(NamedTuple):
    """A planned trial.

    Attributes:
        pca: of the bathing solution as its label says.
        length: length change at every sample, 1 ms apart, L0.
        phases: of the protocol; ramps begin and end at samples.
        amplitude_l0: of the conditioning stretch, where there is one.
        recovery_s: between shortening and test stretch, where there are such.
    """

    pca: float
    length: Array
    phases: tuple[Phase, ...]
    amplitude_l0: float | None = None
    recovery_s: float | None = None

    def stimulus(self, shift: float = 0.0, gain: float = 0.0) -> Stimulus:
        """What the fibre is given where pCa is higher than stated by `shift`, and length changes larger by `gain`."""
        return Stimulus((1.0 + gain) * self.length, 10.0 ** (6.0 - self.pca - shift))


def plan(
    random: np.random.Generator, force_of: Callable[[float], float], gentle: bool, trials: int = TRIALS
) -> list[Planned] | None:
    """Trials: relaxed, fully active and at three or more levels between; stretches, ramps and a release.

    Args:
        force_of: isometric force at a pCa, F0.
        gentle: slower and smaller, for a fibre without series spring.
        trials: how many, at least `TRIALS`; the more there are, the more levels of calcium.

    Returns:
        In the order of recording; None where there are no three levels of calcium with 15 to 85 % of the force.
    """
    full = force_of(4.5)
    grid = np.round(np.arange(5.4, 6.85, 0.05), 2)
    between = [float(p) for p in grid if 0.15 * full <= force_of(float(p)) <= 0.85 * full]
    if len(between) < 3:
        return None
    chosen = _spread_over(random, between, 3 + sum(trials >= more for more in _MORE_LEVELS))
    levels = [9.0, 4.5, *chosen]
    again = [*chosen, 4.5] if trials < _RELAXED_AGAIN else [*chosen, 4.5, 9.0]
    while len(levels) < trials:
        levels += [float(p) for p in random.choice(again, min(len(again) // 2, trials - len(levels)), replace=False)]
    kinds: list[str] = []
    while len(kinds) < trials - 2:
        more = ["paper", "paper", "slow", "fast", "release"]
        random.shuffle(more)
        kinds += more
    first = [str(kind) for kind in random.choice(["paper", "slow", "fast"], 2)]
    planned = [_trial(random, kind, pca, gentle) for kind, pca in zip([*first, *kinds], levels, strict=False)]
    return [planned[i] for i in random.permutation(trials)]


def _spread_over(random: np.random.Generator, between: Sequence[float], count: int) -> list[float]:
    """So many levels, or as many as there are: one of each part of the range."""
    parts = np.array_split(np.asarray(between), min(count, len(between)))
    return [float(random.choice(part)) for part in parts]


def _ms(seconds: float) -> float:
    return max(round(seconds / SAMPLE_S), 1) * SAMPLE_S


def _ramp(name: str, change: float, speed: float) -> Piece:
    """A ramp of whole samples; its speed gives way to that."""
    return name, _ms(abs(change) / speed), change


def _trial(random: np.random.Generator, kind: str, pca: float, gentle: bool) -> Planned:
    lead = _ms(random.uniform(0.15, 0.3))
    size = 0.6 if gentle else 1.0
    pieces: list[Piece] = [("isometric", lead, 0.0)]
    amplitude = recovery = None
    if kind == "paper":
        speed = (0.25 if gentle else 0.4545) * random.choice([0.75, 1.0, 1.0, 1.25])
        amplitude = size * float(random.choice([0.0121, 0.02, 0.0383]))
        recovery = _ms(float(random.choice([0.05, 0.1, 0.316, 0.5, 1.0])))
        pieces += [
            _ramp("conditioning_stretch", amplitude, speed),
            _ramp("shortening", -amplitude, speed),
            ("recovery", recovery, 0.0),
            _ramp("test_stretch", 0.0383 * size, speed),
            ("hold", _ms(random.uniform(0.25, 0.6)), 0.0),
        ]
    elif kind == "release":
        drop = size * random.uniform(0.01, 0.04)
        pieces += [
            _ramp("shortening", -drop, float(np.exp(random.uniform(*np.log([0.08, 0.5 if gentle else 1.0]))))),
            ("recovery", _ms(random.uniform(0.3, 0.9)), 0.0),
            _ramp("stretch", drop, float(np.exp(random.uniform(*np.log([0.1, 0.4 if gentle else 1.0]))))),
            ("hold", _ms(random.uniform(0.25, 0.5)), 0.0),
        ]
    else:
        low, high = (0.05, 0.2) if kind == "slow" else (0.2, 0.5 if gentle else 2.0)
        ramp = _ramp("stretch", size * random.uniform(0.02, 0.055), float(np.exp(random.uniform(*np.log([low, high])))))
        pieces += [ramp, ("hold", _ms(min(random.uniform(0.3, 1.5), LONGEST_S - lead - ramp[1])), 0.0)]
    return Planned(pca, *_drawn(pieces), amplitude, recovery)


def _drawn(pieces: Sequence[Piece]) -> tuple[Array, tuple[Phase, ...]]:
    """Length at every sample, and phases."""
    ends = np.concatenate([[0.0], np.cumsum([duration for _, duration, _ in pieces])])
    levels = np.concatenate([[0.0], np.cumsum([change for _, _, change in pieces])])
    corners = np.round(ends / SAMPLE_S).astype(int)
    length = np.interp(np.arange(corners[-1] + 1), corners, levels)
    times = corners * SAMPLE_S
    phases = tuple(
        Phase(name, round(float(start), 6), round(float(end), 6))
        for (name, _, _), start, end in zip(pieces, times[:-1], times[1:], strict=True)
    )
    return length, phases
