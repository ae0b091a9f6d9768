"""Features that a fibre's model predicts, and how far relative SRS is from the measured over sets of conditions."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from xb_muscle_ros.evaluate.srs_scores import READINGS, relative_at_conditions
from xb_muscle_ros.evaluate.srs_table import FibreSrs, SrsTable, place
from xb_muscle_ros.fit.features import Feature, simulated
from xb_muscle_ros.models.fibre_file import Fibre
from xb_muscle_ros.models.muscle import Muscle
from xb_muscle_ros.scores.conditions import COMMON_AMPLITUDE_L0, CONDITIONS, Condition, sets
from xb_muscle_ros.scores.relative import rmsd

Array = npt.NDArray[np.float64]


class RelativeRmsd(NamedTuple):
    """Root-mean-square difference of relative SRS, predicted and measured.

    Attributes:
        rmsd: by set of conditions (``large``, ``small``, ``all`` reductions of SRS); None where nothing was measured.
        conditions: how many of each set were compared.
    """

    rmsd: Mapping[str, float | None]
    conditions: Mapping[str, int]


def predicted(fibre: Fibre, features: Sequence[Feature], shifts: Mapping[float, float] | None = None) -> Array:
    """What a fibre's model says of features, shape (features,), F0 and F0/L0.

    Args:
        fibre: parameters.
        features: at any conditions.
        shifts: pCa shift of the solution, by stated pCa; none where absent.

    Raises:
        UserError: see `fit.features.simulated`.
    """
    return simulated(Muscle(fibre), features, shifts)


def as_table(
    label: str, like: SrsTable, features: Mapping[str, Sequence[Feature]], values: Mapping[str, Array]
) -> SrsTable:
    """Predictions of several fibres on the axes of a table; NaN where a fibre has no feature.

    Args:
        label: of the table.
        like: whose axes are taken; every feature lies on them.
        features: of each fibre.
        values: what was predicted of them.
    """
    shape = (like.pca.size, like.recovery_s.size, like.amplitude_l0.size)
    held = {}
    for name, own in features.items():
        test, conditioning, isometric = (np.full(shape, np.nan) for _ in range(3))
        for f, value in zip(own, values[name].tolist(), strict=True):
            i = place(like.pca, f.pca)
            j, k = place(like.recovery_s, f.recovery_s), place(like.amplitude_l0, f.amplitude_l0)
            if f.kind == "isometric_force":
                isometric[i] = value
            elif f.kind == "srs_conditioning":
                conditioning[i, :, place(like.amplitude_l0, COMMON_AMPLITUDE_L0)] = value
            else:
                test[i, j, k] = value
        held[name] = FibreSrs(test, conditioning, isometric)
    return SrsTable(label, like.pca, like.recovery_s, like.amplitude_l0, held)


def relative_srs_rmsd(
    model: SrsTable, data: SrsTable, concealed: Sequence[Condition] | None = None
) -> dict[str, RelativeRmsd]:
    """How far the mean relative SRS is from the measured, by the readings of docs/evaluate.md.

    Args:
        model: see `as_table`.
        data: measured.
        concealed: conditions (amplitude, recovery) that count; None for all 21.

    Returns:
        by reading, ``text`` and ``released``.
    """
    counted = np.array([concealed is None or condition in concealed for condition in CONDITIONS])
    found = {}
    for name, reading in READINGS.items():
        ours = relative_at_conditions(model, reading, data).centre
        theirs = relative_at_conditions(data, reading, data).centre
        each = {key: rmsd(ours, theirs, mask & counted) for key, mask in sets(reading.large).items()}
        found[name] = RelativeRmsd(
            {key: each_set.value for key, each_set in each.items()},
            {key: each_set.n for key, each_set in each.items()},
        )
    return found
