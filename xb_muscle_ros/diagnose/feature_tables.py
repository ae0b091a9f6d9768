"""Tables of SRS and isometric force beside traces: what of them belongs to a study, as data or to be predicted."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType

import numpy as np

from xb_muscle_ros.diagnose.conditions import Condition, condition_of
from xb_muscle_ros.errors import UserError
from xb_muscle_ros.evaluate.srs_table import SrsTable, read_table
from xb_muscle_ros.fit.features import Feature, feature, measured
from xb_muscle_ros.scores.conditions import COMMON_AMPLITUDE_L0
from xb_muscle_ros.trials.trial import Trial

_SAME_PCA = 0.02
# Noise and a zero that was set a little wrong may take isometric force this far below nothing, F0.
_LEAST_FORCE_F0 = -0.1
# Conditions of a table are nominal, those of trials as `nominal` has them.
_SAME_AMPLITUDE_L0, _SAME_RECOVERY = 1e-6, 1e-6


@dataclass(frozen=True, eq=False)
class FeatureTable:
    """What a file of features has on the fibres of a study.

    Attributes:
        data: all fibres of the file.
        features: of each fibre that the file has, in the order of the study; what a fit takes as data. Test stretches
            of a solution in which the fibre had run down are left out.
        cells: of each of these fibres, every cell that was measured, those of run-down fibres as well.
        notes: lines on fibres without features, and on solutions that no trace was recorded in.
        notes_of_fit: lines on what a fit leaves out.
    """

    path: Path
    data: SrsTable
    features: Mapping[str, tuple[Feature, ...]]
    cells: Mapping[str, tuple[Feature, ...]]
    notes: tuple[str, ...]
    notes_of_fit: tuple[str, ...] = ()


def read_features(path: str | Path, trials: Mapping[str, Sequence[Trial]]) -> FeatureTable:
    """Read a table such as ``empirical_srs.json`` for the fibres of a study.

    Args:
        path: JSON with axes ``pCa``, ``recovery_s``, ``amplitude_L0`` and ``fibres``: SRS of test and conditioning
            stretch (F0/L0) and isometric force (F0), [pCa][recovery][amplitude].
        trials: of each fibre of the study, by its name.

    Raises:
        UserError: the file cannot be read, has none of the fibres, or nothing of them in a solution of their traces.
    """
    path = Path(path)
    data = read_table(path, "measured")
    names = [name for name in trials if name in data.fibres]
    if not names:
        of, ours = (", ".join(f"'{name}'" for name in group) for group in (data.fibres, trials))
        raise UserError(
            f"features {path} are of {of}; the trials are of {ours}; give the table of a fibre of the study"
        )
    notes: list[str] = []
    missing = [name for name in trials if name not in names]
    if missing:
        notes.append(f"features {path} have nothing of fibre{'s'[: len(missing) - 1]} {', '.join(missing)}")
    features, notes_of_fit = {}, []
    for name in names:
        lines: list[str] = []
        features[name] = measured(path, name, tell=lines.append)
        notes_of_fit += [f"{name}: {line}" for line in lines]
        _check_force(path, name, data)
    cells = {name: measured_cells(data, name) for name in names}
    _check_solutions(path, features, trials, notes)
    return FeatureTable(
        path, data, MappingProxyType(features), MappingProxyType(cells), tuple(notes), tuple(notes_of_fit)
    )


def _check_force(path: Path, fibre: str, data: SrsTable) -> None:
    """A fibre does not push: isometric force below nothing is of another unit or sign."""
    for pca, force in zip(data.pca.tolist(), data.isometric_f0(fibre).tolist(), strict=True):
        if force < _LEAST_FORCE_F0:
            raise UserError(
                f"features {path}, fibre {fibre}: isometric force at pCa {pca:g} is {force:g} F0; allowed is "
                f"{_LEAST_FORCE_F0:g} F0 and above; check sign and unit"
            )


def _check_solutions(
    path: Path, features: Mapping[str, tuple[Feature, ...]], trials: Mapping[str, Sequence[Trial]], notes: list[str]
) -> None:
    """Features and traces meet in the fibre's solutions: pCa shifts are known of these alone."""
    lines, unmet, any_shared = [], [], False
    for name, own in features.items():
        theirs = sorted({f.pca for f in own})
        ours = sorted({t.facts.pca for t in trials[name] if t.facts.pca is not None})
        apart = [pca for pca in theirs if not any(abs(pca - other) <= _SAME_PCA for other in ours)]
        any_shared |= len(apart) < len(theirs)
        lines.append(f"{name}: features at pCa {_listed(theirs)}, trials at {_listed(ours)}")
        unmet += [f"{name} at pCa {_listed(apart)}"] if apart else []
    if not any_shared:
        raise UserError(
            f"features {path} have no condition in common with the trials ({'; '.join(lines)}); give a table at the "
            "pCa of the trials"
        )
    if unmet:
        notes.append(f"features {path} in solutions of no trial, taken without a pCa shift: {'; '.join(unmet)}")


def _listed(pcas: Sequence[float]) -> str:
    return ", ".join(f"{pca:g}" for pca in pcas) or "changing calcium"


def measured_cells(data: SrsTable, fibre: str) -> tuple[Feature, ...]:
    """Every cell that was measured on a fibre, pCa by pCa: isometric force, conditioning stretch, test stretches.

    Isometric force and conditioning stretch are means over the trials that have them.
    """
    held = data.fibres[fibre]
    isometric, unconditioned = data.isometric_f0(fibre), data.unconditioned(fibre, "conditioning")[0]
    found: list[Feature] = []
    for i, pca in enumerate(data.pca.tolist()):
        for kind, value in (("isometric_force", isometric[i]), ("srs_conditioning", unconditioned[i])):
            if np.isfinite(value):
                found.append(feature(kind, pca, 0.0, 0.0, float(value)))
        for j, k in np.argwhere(np.isfinite(held.test[i])).tolist():
            found.append(
                feature("srs_test", pca, float(data.recovery_s[j]), float(data.amplitude_l0[k]), held.test[i, j, k])
            )
    return tuple(found)


def seen(of: Feature, trials: Sequence[Trial]) -> bool:
    """Whether a trace of these trials has the stretch or the rest that a feature was measured in."""
    return any(_has(condition_of(trial), of) for trial in trials)


def _has(condition: Condition, of: Feature) -> bool:
    if condition.pca is None or abs(condition.pca - of.pca) > _SAME_PCA:
        return False
    if of.kind == "isometric_force":
        return True
    if condition.amplitude_l0 is None:
        return False
    if of.kind == "srs_conditioning":
        # Of a stretch before which nothing happened: a conditioning stretch as large as the paper's, or a test stretch
        # alone.
        return condition.amplitude_l0 in (0.0, COMMON_AMPLITUDE_L0)
    if of.amplitude_l0 == 0.0:
        return condition.amplitude_l0 == 0.0
    same = abs(condition.amplitude_l0 - of.amplitude_l0) <= _SAME_AMPLITUDE_L0
    return same and abs((condition.recovery_s or 0.0) - of.recovery_s) <= _SAME_RECOVERY * of.recovery_s
