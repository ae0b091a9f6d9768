"""The paper's conditions through a peer: one table of SRS as `evaluate` makes of recordings and of our models."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from xb_muscle_ros.bench.peers.conditions import onset_stiffness, path_of
from xb_muscle_ros.bench.peers.matching import Target, activations, fitted
from xb_muscle_ros.bench.peers.muscle import Peer, PeerMuscle
from xb_muscle_ros.errors import UserError, naming
from xb_muscle_ros.evaluate.srs_table import FibreSrs, SrsTable, place
from xb_muscle_ros.scores.conditions import AMPLITUDES_L0, COMMON_AMPLITUDE_L0, CONDITIONS, RECOVERIES_S
from xb_muscle_ros.trials.trial import Array

AMPLITUDES = np.array([0.0, *AMPLITUDES_L0])
RECOVERIES = np.array(RECOVERIES_S)
UNCONDITIONED = "conditioning"
"""What parameters are fitted to: the conditioning stretches of 3.83 % L0, which were measured several times."""


class Simulated(NamedTuple):
    """A peer's SRS.

    Attributes:
        table: of all fibres.
        values: fitted parameters by fibre.
        problems: one line for each trial that could not be integrated, and is left out.
    """

    table: SrsTable
    values: Mapping[str, Mapping[str, float]]
    problems: Sequence[str]


def target_of(data: SrsTable, fibre: str) -> Target:
    """What was measured of a fibre."""
    return Target(data.isometric_f0(fibre), data.unconditioned(fibre, UNCONDITIONED)[0])


def simulate(peer: Peer, data: SrsTable, fibres: Sequence[str], done: Callable[[], None] = lambda: None) -> Simulated:
    """A peer at all conditions and pCa at which a fibre's isometric force was measured; NaN at others.

    Args:
        peer: fitted to each fibre where it has free parameters.
        data: measured SRS.
        fibres: names in it.
        done: called after each fibre.

    Raises:
        UserError: parameters cannot be fitted; names peer and fibre.
    """
    values, held = {}, {}
    problems: list[str] = []
    for name in fibres:
        target = target_of(data, name)
        with naming(f"{peer.title}, fibre {name}"):
            values[name] = fitted(peer, target)
            muscle = peer.take(values[name])
            held[name] = _fibre(muscle, activations(muscle, target), data.pca, name, problems)
        done()
    return Simulated(SrsTable(peer.title, data.pca, RECOVERIES, AMPLITUDES, held), values, problems)


def _fibre(muscle: PeerMuscle, at: Array, pca: Array, name: str, problems: list[str]) -> FibreSrs:
    shape = (at.size, RECOVERIES.size, AMPLITUDES.size)
    test, conditioning, isometric = (np.full(shape, np.nan) for _ in range(3))
    for k in np.flatnonzero(np.isfinite(at)):
        activation = float(at[k])
        isometric[k] = muscle.isometric_f0(activation)
        for condition in CONDITIONS:
            path = path_of(condition)
            try:
                srs = onset_stiffness(path, muscle.force_f0(activation, path))
            except UserError as error:
                where = f"amplitude {condition.amplitude_l0:g} L0, recovery {condition.recovery_s:g} s"
                problems.append(f"fibre {name}, pCa {pca[k]:g}, {where}: {error}")
                continue
            if condition.amplitude_l0 == 0.0:
                # Without a stretch before it, recovery is more of the same rest; the common stretch is the same too.
                test[k, :, 0] = srs
                conditioning[k, :, place(AMPLITUDES, COMMON_AMPLITUDE_L0)] = srs
            else:
                i, j = place(RECOVERIES, condition.recovery_s), place(AMPLITUDES, condition.amplitude_l0)
                test[k, i, j] = srs
    return FibreSrs(test, conditioning, isometric)
