"""The truth of a case: a fibre with effects, and what it does in a whole study."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from xb_muscle_ros.prove.generator.layout import At
from xb_muscle_ros.prove.generator.world import Acting, Answer, AtRest, Mesh, Stimulus, World, simulate
from xb_muscle_ros.trials.trial import Array

Act = Callable[[Sequence[Stimulus], int], Acting]
Add = Callable[[Stimulus, Answer], Array]


@dataclass(frozen=True)
class Truth:
    """A fibre with effects.

    Attributes:
        world: heads, filaments and series spring.
        acts: what effects make of the input of trial i of a study, each one a factor (recruitment: a term).
        adds: force beside the heads, F0, shape (n,).
    """

    world: World
    acts: tuple[Act, ...] = ()
    adds: tuple[Add, ...] = ()

    def changed(self, changes: dict[At, float], strength: tuple[float, ...] | None = None) -> Truth:
        """With other entries of the loop's vector, and perhaps several half-sarcomeres."""
        world = replace(self.world, changes={**self.world.changes, **changes})
        return replace(self, world=world if strength is None else replace(world, strength=strength))

    def acting(self, act: Act) -> Truth:
        """With one more thing that acts on the input."""
        return replace(self, acts=(*self.acts, act))

    def adding(self, add: Add) -> Truth:
        """With one more element beside the heads."""
        return replace(self, adds=(*self.adds, add))


def trial_force(
    truth: Truth, study: Sequence[Stimulus], i: int, mesh: Mesh | None = None, rest: AtRest | None = None
) -> Array:
    """Force of the fibre in trial i, F0, at every sample; `rest` as `world.simulate` takes it."""
    stimulus = study[i]
    acting = Acting.plain(stimulus.length.size - 1)
    for act in truth.acts:
        more = act(study, i)
        acting = Acting(
            acting.calcium * more.calcium,
            acting.attachment * more.attachment,
            acting.switch_off * more.switch_off,
            acting.recruitment + more.recruitment,
        )
    answer = simulate(truth.world, stimulus, acting, mesh, rest)
    return answer.force + sum((add(stimulus, answer) for add in truth.adds), np.zeros(stimulus.length.size))


def study_forces(truth: Truth, study: Sequence[Stimulus], mesh: Mesh | None = None) -> list[Array]:
    """`trial_force` of every trial."""
    rest: AtRest = {}
    return [trial_force(truth, study, i, mesh, rest) for i in range(len(study))]
