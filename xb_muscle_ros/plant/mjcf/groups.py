"""Fibres of several models side by side: one batch for each model."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from xb_muscle_ros.models.batch import MuscleBatch
from xb_muscle_ros.models.fibre_file import Fibre
from xb_muscle_ros.models.muscle import Muscle, Outputs
from xb_muscle_ros.plant.plant import Array

_FORCE = Outputs._fields.index("force_f0")


class Groups:
    """Batches of fibres and their states; arrays of shape (fibre,) are in the order of the fibres given."""

    def __init__(self, fibres: Sequence[Fibre]) -> None:
        members: dict[tuple[int, int], list[int]] = {}
        for k, fibre in enumerate(fibres):
            muscle = Muscle(fibre)
            members.setdefault((id(muscle.code), muscle.parameters.size), []).append(k)
        self._count = len(fibres)
        self._members = [np.array(group) for group in members.values()]
        self._batches = [MuscleBatch([fibres[k] for k in group]) for group in members.values()]
        self._states = [np.stack([muscle.rest() for muscle in batch.muscles]) for batch in self._batches]

    def settle(self, length_change_l0: Array, calcium_um: Array) -> Array:
        """Settle all fibres; returns their forces, shape (fibre,), F0."""
        self._states = [
            batch.settle(length_change_l0[group], calcium_um[group])
            for batch, group in zip(self._batches, self._members, strict=True)
        ]
        return self._column(_FORCE)

    def advance(self, length_change_l0: Array, calcium_um: Array, dt_s: float) -> Array:
        """One step of all fibres; returns their forces, shape (fibre,), F0."""
        self._states = [
            batch.step(states, length_change_l0[group], calcium_um[group], dt_s)
            for batch, states, group in zip(self._batches, self._states, self._members, strict=True)
        ]
        return self._column(_FORCE)

    def outputs(self) -> dict[str, Array]:
        """By name of `Outputs`, each of shape (fibre,)."""
        return {name: self._column(i) for i, name in enumerate(Outputs._fields)}

    def _column(self, column: int) -> Array:
        found = np.empty(self._count)
        for batch, states, group in zip(self._batches, self._states, self._members, strict=True):
            found[group] = batch.output_table(states)[:, column]
        return found
