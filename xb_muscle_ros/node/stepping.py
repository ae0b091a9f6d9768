"""What both modes share: what they take and answer, and how the fibres of a batch are stepped."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Protocol

import numba
import numpy as np
import numpy.typing as npt

from xb_muscle_ros.models.batch import MuscleBatch
from xb_muscle_ros.models.muscle import Outputs
from xb_muscle_ros.node.names import Indices, front
from xb_muscle_ros.node.rules import Counts, Trouble
from xb_muscle_ros.node.status import Status

Floats = npt.NDArray[np.float64]
Flags = npt.NDArray[np.bool_]

# Stamp (ns), which fibres (None: all, in order), their outputs (fibre, name of `Outputs`), scales (fibre, 2), and what
# `Control.answers` gives.
Emit = Callable[..., None]


class Stepping(Protocol):
    """What takes samples and reports on itself."""

    @property
    def counts(self) -> Counts:
        """What was odd about the input that was taken nevertheless."""

    def take_calcium(self, stamp: int, fibres: Indices, calcium_um: Floats) -> list[Trouble]:
        """Take one stamp (ns), which fibres, their free calcium in µM; returns what was refused."""

    def take_length(self, stamp: int, fibres: Indices, given: Floats, velocity_m_per_s: Floats | None) -> list[Trouble]:
        """Take one stamp (ns), which fibres, their lengths (m) or loads (N), and velocities (m/s) or None."""

    def status(self) -> Status:
        """How it goes."""


def step(batch: MuscleBatch, states: Floats, change_l0: Floats, calcium_um: Floats, dt_s: float) -> Floats:
    """`MuscleBatch.step`; one fibre goes by itself, since spreading over threads costs ten times a fibre's step."""
    if len(batch) > 1:
        return batch.step(states, change_l0, calcium_um, dt_s)
    return batch.muscles[0].step(states[0], float(change_l0[0]), float(calcium_um[0]), dt_s)[None]


def outputs(batch: MuscleBatch, which: Indices | None, states: Sequence[Floats] | Floats) -> Floats:
    """Outputs of some fibres or (None) all at states, shape (fibres, 11), a column for each name of `Outputs`."""
    if which is None and len(batch) > 1:
        return batch.output_table(np.asarray(states))
    muscles = batch.muscles if which is None else [batch.muscles[i] for i in which.tolist()]
    table = np.empty((len(muscles), len(Outputs._fields)))
    for muscle, state, row in zip(muscles, states, table, strict=True):
        muscle.code.outputs(state, muscle.parameters, row)
    return table


def use_threads(batch: MuscleBatch, threads: int) -> None:
    """Let a batch that this thread steps use so many threads, at most one for each core."""
    if len(batch) > 1:
        numba.set_num_threads(min(threads, numba.config.NUMBA_NUM_THREADS))


def stopped(names: Sequence[str], faults: Mapping[int, str]) -> str:
    """Why some fibres stopped; empty where none did."""
    if not faults:
        return ""
    first = min(faults)
    count = "" if len(names) == 1 else f"{len(faults)} of {len(names)} fibres; "
    return f"{count}{front(names, [first])}{faults[first]}"
