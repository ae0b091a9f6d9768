"""A sample that fibres in lockstep are to be stepped to, and which of them cannot be."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np

from xb_muscle_ros.models.batch import MuscleBatch
from xb_muscle_ros.node.control import Control
from xb_muscle_ros.node.names import Indices
from xb_muscle_ros.node.rules import Refusal
from xb_muscle_ros.node.stepping import Flags, Floats

# Of one fibre a number, which costs less than an array of one; of many an array, shape (fibres,).
Numbers = Any
# Shape (fibres, n).
States = Sequence[Floats] | Floats


def numbers(values: Floats) -> Numbers:
    """Values, shape (fibres,), as a timeline takes them."""
    return float(values[0]) if values.size == 1 else values


def number(values: Numbers, place: int) -> float:
    """The value in a place."""
    return values if isinstance(values, float) else float(values[place])


class Divided(Exception):
    """A sample that some fibres of a timeline can take, and some cannot.

    Attributes:
        good: who can, shape (fibres,).
        refused: why each of the others cannot, by its place.
    """

    def __init__(self, good: Flags, refused: dict[int, Refusal]) -> None:
        super().__init__()
        self.good = good
        self.refused = refused


class Plan(NamedTuple):
    """A sample that can be integrated.

    Attributes:
        stamp, asked: of the sample, and until when calcium was asked for, ns.
        goal, calcium_um: to step to (length change, L0, or load, F0), and with.
        states: to step from, shape (fibres, n); None: settle.
        dt_s: from the last sample; 0 where there is none.
    """

    stamp: int
    asked: int
    goal: Numbers
    calcium_um: Numbers
    states: States | None
    dt_s: float

    def picked(self, which: Indices) -> Plan:
        """The same for fibres in some places."""
        goal, calcium = (numbers(np.atleast_1d(values)[which]) for values in (self.goal, self.calcium_um))
        states = None if self.states is None else np.asarray(self.states)[which]
        return self._replace(goal=goal, calcium_um=calcium, states=states)

    def step(self, batch: MuscleBatch, fibre: int, place: int, control: Control) -> Floats:
        """State at its end, shape (n,), of a fibre of the batch that is in this place here.

        Raises:
            UserError, StateViolation: see `Control`.
        """
        muscle, goal, calcium = batch.muscles[fibre], number(self.goal, place), number(self.calcium_um, place)
        if self.states is None:
            return control.settle(muscle, goal, calcium)
        return control.step(muscle, self.states[place], goal, calcium, self.dt_s)


def let_pass(good: Any, refusal: Callable[..., Refusal], *values: Numbers) -> None:
    """Go on where all is good.

    Args:
        good: whether the fibre can take its sample, or whether each can.
        refusal: made of a fibre's values where it cannot.
        values: of the one fibre, or of each.

    Raises:
        Refusal: of the one.
        Divided: of many.
    """
    if isinstance(good, bool):
        if not good:
            raise refusal(*values)
    elif not good.all():
        bad = np.flatnonzero(~good).tolist()
        raise Divided(good, {k: refusal(*(float(each[k]) for each in values)) for k in bad})
