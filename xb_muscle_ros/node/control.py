"""What drives the fibres of a node: their lengths, or the loads that they bear."""

from __future__ import annotations

import abc
from collections.abc import Sequence
from typing import Any

import numpy as np

from xb_muscle_ros.models.batch import MuscleBatch
from xb_muscle_ros.models.clamping import clamp
from xb_muscle_ros.models.muscle import Muscle
from xb_muscle_ros.node.rules import (
    LENGTH_CHANGE_L0,
    LOAD_F0,
    Refusal,
    impossible_length,
    impossible_load,
    length_change_l0,
    load_f0,
)
from xb_muscle_ros.node.stepping import Floats, step

# Calcium (µM) and duration (s) of the step by which the clamp is compiled before it is needed.
_WARM_UM, _WARM_S = 1.0, 1e-4


class Control(abc.ABC):
    """What a message asks of a fibre, which is called its goal, and how the fibre comes to it.

    Attributes:
        name: as the parameter ``control`` has it.
        topic: below ``muscle/``; also what the quantity is called.
        unit: which of a fibre's constants the message is relative to: 0: L0 (m), 1: F0 (N).
        allowed: least and most of a goal.
    """

    name: str
    topic: str
    unit: int
    allowed: tuple[float, float]

    @abc.abstractmethod
    def goal(self, given: Any, unit: Any) -> Any:
        """Goal of what a message gives, for one value or an array of them."""

    @abc.abstractmethod
    def impossible(self, given: float, unit: float) -> Refusal:
        """The refusal of what leads to a goal that is not allowed."""

    @abc.abstractmethod
    def settle(self, muscle: Muscle, goal: float, calcium_um: float) -> Floats:
        """State that a fibre begins with, shape (n,).

        Raises:
            UserError, StateViolation: see `Muscle.settle`.
        """

    @abc.abstractmethod
    def step(self, muscle: Muscle, state: Floats, goal: float, calcium_um: float, dt_s: float) -> Floats:
        """State `dt_s` later at the goal, shape (n,).

        Raises:
            UserError, StateViolation: see `Muscle.step` and `clamp`.
        """

    def step_all(self, batch: MuscleBatch, states: Floats, goals: Floats, calcium_um: Floats, dt_s: float) -> Floats:
        """The same for all fibres, shape (fibres, n)."""
        each = zip(batch.muscles, states, goals.tolist(), calcium_um.tolist(), strict=True)
        return np.stack([self.step(muscle, state, goal, calcium, dt_s) for muscle, state, goal, calcium in each])

    @abc.abstractmethod
    def still(self, states: Floats) -> Floats:
        """Goals at which fibres keep the lengths that they have, shape (fibres,)."""

    def answers(self, states: Sequence[Floats] | Floats) -> tuple[Floats, ...]:
        """What is answered beside force and moments: nothing, or length changes (L0), shape (fibres,)."""
        return ()

    @abc.abstractmethod
    def warm(self, batch: MuscleBatch) -> None:
        """Compile what ticks need."""


class ByLength(Control):
    """Length in, force out: a fibre settles at its first length, and moves linearly from one to the next."""

    name, topic, unit, allowed = "length", "length", 0, LENGTH_CHANGE_L0

    def goal(self, given: Any, unit: Any) -> Any:
        """Length change, L0."""
        return length_change_l0(given, unit)

    def impossible(self, given: float, unit: float) -> Refusal:
        """See `impossible_length`."""
        return impossible_length(given, unit)

    def settle(self, muscle: Muscle, goal: float, calcium_um: float) -> Floats:
        """At rest at the length."""
        return muscle.settle(goal, calcium_um)

    def step(self, muscle: Muscle, state: Floats, goal: float, calcium_um: float, dt_s: float) -> Floats:
        """`Muscle.step`."""
        return muscle.step(state, goal, calcium_um, dt_s)

    def step_all(self, batch: MuscleBatch, states: Floats, goals: Floats, calcium_um: Floats, dt_s: float) -> Floats:
        """Many fibres in one call."""
        return step(batch, states, goals, calcium_um, dt_s)

    def still(self, states: Floats) -> Floats:
        """Their length changes."""
        return states[:, -3]

    def warm(self, batch: MuscleBatch) -> None:
        """One fibre goes by itself, and is warm; no tick of many shall wait for a compiler."""
        if len(batch) > 1:
            batch.warm()


class ByForce(Control):
    """Load in, length out (force clamp): a fibre settles at L0, and bears each load from its message on.

    A goal that is NaN stands for the length that the fibre has.
    """

    name, topic, unit, allowed = "force", "load", 1, LOAD_F0

    def goal(self, given: Any, unit: Any) -> Any:
        """Load, F0."""
        return load_f0(given, unit)

    def impossible(self, given: float, unit: float) -> Refusal:
        """See `impossible_load`."""
        return impossible_load(given, unit)

    def settle(self, muscle: Muscle, goal: float, calcium_um: float) -> Floats:
        """At rest at L0, whatever the load: it acts from the next step on, as in `clamp_run`."""
        return muscle.settle(0.0, calcium_um)

    def step(self, muscle: Muscle, state: Floats, goal: float, calcium_um: float, dt_s: float) -> Floats:
        """`clamp`: to the length at which the fibre bears the load."""
        if goal != goal:
            return muscle.step(state, float(state[-3]), calcium_um, dt_s)
        return clamp(muscle, state, goal, calcium_um, dt_s)

    def still(self, states: Floats) -> Floats:
        """NaN each."""
        return np.full(len(states), np.nan)

    def answers(self, states: Sequence[Floats] | Floats) -> tuple[Floats, ...]:
        """The length changes at which they bear the load."""
        return (np.array([state[-3] for state in states]),)

    def warm(self, batch: MuscleBatch) -> None:
        """One step under a load of each fibre."""
        if len(batch) > 1:
            batch.warm()
        for muscle in {muscle.code: muscle for muscle in batch.muscles}.values():
            state = muscle.settle(0.0, _WARM_UM)
            self.step(muscle, state, muscle.outputs(state).force_f0, _WARM_UM, _WARM_S)


CONTROLS: dict[str, Control] = {control.name: control for control in (ByLength(), ByForce())}
"""By the values of the parameter ``control``."""
LENGTH = CONTROLS["length"]
