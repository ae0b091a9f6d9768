"""F0 of a preparation: the isometric force of its trial at full activation, in the same folder."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.trials.readers.assembly import trial_of
from xb_muscle_ros.trials.readers.base import Pending, Reader
from xb_muscle_ros.trials.readers.description import ImportMapping
from xb_muscle_ros.trials.readers.force import Force, isometric_force
from xb_muscle_ros.trials.readers.units import Quantity

_SAME_PCA = 1e-6


class FoundF0(NamedTuple):
    """F0, and where it comes from, in words."""

    f0: Quantity
    note: str


def isometric_f0(folder: Path, suffix: str, reader: Reader, mapping: ImportMapping, pca: float) -> FoundF0 | None:
    """F0 of the preparation whose files a folder holds; None where no file tells it.

    Args:
        folder: of the preparation.
        suffix: ending of its files.
        reader: reads them.
        mapping: of them; its F0 is not used.
        pca: of the trial looked for. Where several have it, the largest force counts: a fibre runs down.
    """
    assert mapping.force is not None  # the mapping was checked
    told = replace(mapping, f0=None, f0_at_pca=None)
    best: tuple[float, str] | None = None
    for file in sorted(folder.iterdir()):
        if file.suffix.lower() != suffix or not file.is_file():
            continue
        force = _force(file, reader, told, pca)
        if force is not None and (best is None or force > best[0]):
            best = (force, file.name)
    if best is None or best[0] <= 0.0:
        return None
    note = f", the initial isometric force at pCa {pca:g} in {best[1]}"
    return FoundF0(Quantity(best[0], mapping.force.unit.kind), note)


def _force(file: Path, reader: Reader, mapping: ImportMapping, pca: float) -> float | None:
    """Largest initial isometric force of a file's trials at a pCa; None where none has it or can be read."""
    best: float | None = None
    try:
        found = reader.pca(file, mapping)
        if found is not None and abs(found - pca) > _SAME_PCA:
            return None
        for pending in reader.trials(file, mapping):
            force = _force_of(pending, file, mapping, pca)
            best = force if best is None or (force is not None and force > best) else best
    except UserError:  # a broken neighbour is told when its turn comes
        return best
    return best


def _force_of(pending: Pending, file: Path, mapping: ImportMapping, pca: float) -> float | None:
    try:
        trial = trial_of(pending.read(), mapping, file, isometric_scaling=False)
    except UserError:
        return None
    if trial.facts.pca is None or abs(trial.facts.pca - pca) > _SAME_PCA:
        return None
    return isometric_force(Force(trial.force_time_s, trial.force_n), trial.facts.phases)
