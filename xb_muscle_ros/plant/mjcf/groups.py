"""Fibres of several models side by side: one batch for each model."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from xb_muscle_ros.models.batch import MuscleBatch
from xb_muscle_ros.models.fibre_file import Fibre
from xb_muscle_ros.models.muscle import Muscle, Outputs
from xb_muscle_ros.plant.plant import Array

_FORCE = Outputs._fields.index("force_f0")
Members = slice | npt.NDArray[np.int64]


def members_of(places: npt.NDArray[np.int64]) -> Members:
    """Places in an array; a slice where they lie side by side, which copies nothing."""
    first, count = int(places[0]), places.size
    return slice(first, first + count) if np.array_equal(places, np.arange(first, first + count)) else places


class _Group:
    """Fibres of one model: their places, states now and before, and outputs now."""

    def __init__(self, fibres: Sequence[Fibre], places: npt.NDArray[np.int64]) -> None:
        self.members = members_of(places)
        self.batch = MuscleBatch(fibres)
        self.batch.warm()
        self.states: Array = np.stack([muscle.rest() for muscle in self.batch.muscles])
        self.spare: Array = np.empty_like(self.states)
        self.table: Array = self.batch.output_table(self.states)


class Groups:
    """Batches of fibres and their states; arrays of shape (fibre,) are in the order of the fibres given."""

    def __init__(self, fibres: Sequence[Fibre]) -> None:
        places: dict[tuple[int, int], list[int]] = {}
        for k, fibre in enumerate(fibres):
            muscle = Muscle(fibre)
            places.setdefault((id(muscle.code), muscle.parameters.size), []).append(k)
        self._groups = [_Group([fibres[k] for k in group], np.array(group)) for group in places.values()]
        self._force: Array = np.empty(len(fibres))

    def settle(self, length_change_l0: Array, calcium_um: Array) -> Array:
        """Settle all fibres; returns their forces, shape (fibre,), F0, which the next call overwrites."""
        settled = [g.batch.settle(length_change_l0[g.members], calcium_um[g.members]) for g in self._groups]
        for group, states in zip(self._groups, settled, strict=True):
            group.states, group.table = states, group.batch.output_table(states)
            self._force[group.members] = group.table[:, _FORCE]
        return self._force

    def advance(self, length_change_l0: Array, calcium_um: Array, dt_s: float) -> Array:
        """One step of all fibres; returns their forces, shape (fibre,), F0, which the next call overwrites.

        Raises:
            UserError, StateViolation: see `MuscleBatch.step`; all states are as they were.
        """
        for group in self._groups:
            length, calcium = length_change_l0[group.members], calcium_um[group.members]
            group.batch.step_into(group.states, length, calcium, dt_s, group.spare, group.table)
        for group in self._groups:
            group.states, group.spare = group.spare, group.states
            self._force[group.members] = group.table[:, _FORCE]
        return self._force

    def outputs(self) -> dict[str, Array]:
        """By name of `Outputs`, each of shape (fibre,)."""
        found = np.empty((len(Outputs._fields), self._force.size))
        for group in self._groups:
            found[:, group.members] = group.batch.output_table(group.states).T
        return dict(zip(Outputs._fields, found, strict=True))
