"""All that one model is asked in the scene of the leg."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from xb_muscle_ros.plant.leg.body import Body
from xb_muscle_ros.plant.leg.drives import Drive
from xb_muscle_ros.plant.leg.episode import Episode, play
from xb_muscle_ros.plant.leg.stance import Stance
from xb_muscle_ros.plant.leg.sway import Sway
from xb_muscle_ros.plant.translation import RampAndHold

HOLD_S = 1.0
SMALLER = 0.5
"""The smaller platform motion is this share of the larger one in way, speed and acceleration."""
NUDGE = RampAndHold(-1e-7, 1e-3, 0.1)
"""Moves the ground by 0.1 µm, to see what grows from it."""

MakeDrive = Callable[[Body, Stance], Drive]


@dataclass(frozen=True)
class Pair:
    """The same history with and without a push: their difference is the push's, and not what the history did."""

    still: Episode
    pushed: Episode


@dataclass(frozen=True)
class ModelRuns:
    """One model's episodes.

    Attributes:
        hold: without a push, for `HOLD_S`.
        nudged: after `NUDGE`, for as long.
        pushes: without sway: backwards and forwards, smaller and larger.
        pairs: backwards, larger, by sway; without sway first.
    """

    hold: Episode
    nudged: Episode
    pushes: tuple[Episode, ...]
    pairs: tuple[Pair, ...]

    @property
    def model(self) -> str:
        """Name of the parameter set, or ``mujoco``."""
        return self.hold.model

    @property
    def episodes(self) -> tuple[Episode, ...]:
        """All of them, each once."""
        swayed = [episode for pair in self.pairs for episode in (pair.still, pair.pushed)]
        return (self.hold, self.nudged, *self.pushes, *(e for e in swayed if e not in self.pushes))


def pushes(larger: RampAndHold) -> list[RampAndHold]:
    """Backwards and forwards, each smaller and larger."""
    way, speed, rate = abs(larger.displacement_m), larger.speed_m_per_s, larger.acceleration_m_per_s2
    return [
        replace(
            larger,
            displacement_m=sign * share * way,
            speed_m_per_s=share * speed,
            acceleration_m_per_s2=share * rate,
        )
        for sign in (-1.0, 1.0)
        for share in (SMALLER, 1.0)
    ]


def sways(shares: Sequence[float], frequencies_hz: Sequence[float]) -> list[Sway]:
    """No sway, and every share (of soleus L0) above 0 at every frequency."""
    return [Sway(), *(Sway(share, hz) for share in shares if share for hz in frequencies_hz)]


def run_model(
    make: MakeDrive,
    stance: Stance,
    larger: RampAndHold,
    swayed: Sequence[Sway],
    duration_s: float,
    done: Callable[[], None] = lambda: None,
) -> ModelRuns:
    """Play all episodes of a model.

    Args:
        make: takes a fresh body and makes its drive.
        stance: that they start from.
        larger: the larger platform motion; its direction does not matter.
        swayed: sway before the push, none first.
        duration_s: of episodes that are pushed, and of those that they are compared with.
        done: called after each episode.

    Raises:
        UserError: the model cannot hold the stance, or the ankle does not sway so far.
    """
    body = Body()
    drive = make(body, stance)

    def one(platform: RampAndHold | None, sway: Sway, seconds: float) -> Episode:
        episode = play(body, drive, stance, platform, sway, seconds)
        done()
        return episode

    none = Sway()
    hold, nudged = one(None, none, HOLD_S), one(NUDGE, none, HOLD_S)
    pushed = tuple(one(platform, none, duration_s) for platform in pushes(larger))
    backwards = pushed[1]
    pairs = [
        Pair(
            one(None, sway, duration_s),
            one(backwards.platform, sway, duration_s) if sway.fibre_l0 else backwards,
        )
        for sway in swayed
    ]
    return ModelRuns(hold, nudged, pushed, tuple(pairs))


def count(swayed: Sequence[Sway]) -> int:
    """How many episodes `run_model` plays."""
    return 6 + sum(2 if sway.fibre_l0 else 1 for sway in swayed)
