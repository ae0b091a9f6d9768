"""What an answer predicts outside the study: forces that no muscle bears are reported before anyone relies on it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from xb_muscle_ros.diagnose.result import OfTrial
from xb_muscle_ros.diagnose.words import joined, percent
from xb_muscle_ros.errors import UserError
from xb_muscle_ros.fit.data import FitTrial
from xb_muscle_ros.models.fibre_file import Fibre
from xb_muscle_ros.models.muscle import Muscle
from xb_muscle_ros.simulation.offline import outputs
from xb_muscle_ros.trials.trial import Array

# Beyond these a force is absurd, F0: passive, active, and a push.
_PASSIVE_F0, _ACTIVE_F0, _PUSH_F0 = 0.5, 3.0, -0.05
# Less than this beyond the base's is not the answer's doing, F0.
_MORE_F0 = 0.1
_PASSIVE_PCA = 9.0
# A left-out trial that the answer predicts worse by more than this says that it does not hold everywhere, F0.
_WORSE_F0 = 0.01


def warnings(fibre: Fibre, base: Fibre, trials: Sequence[FitTrial]) -> list[str]:
    """Lines on absurd forces of an answer, of which the fitted base has less.

    They are passive at the longest length of the study, and active at twice its speeds.
    """
    found = []
    longest = max(trials, key=lambda t: float(np.max(t.length_l0)))
    calcium = np.full(longest.time_s.size, 10.0 ** (6.0 - _PASSIVE_PCA))
    length = float(np.max(longest.length_l0))
    forces = [_force(f, longest, longest.length_l0, calcium, 1.0) for f in (fibre, base)]
    words = f"passive (pCa {_PASSIVE_PCA:g}) at the study's longest length, {length:+.3g} L0"
    found += _judged(fibre.name, words, forces, _PASSIVE_F0)
    fastest = max(trials, key=lambda t: float(np.max(np.abs(np.diff(t.length_l0) / t.dt_s), initial=0.0)))
    calcium = np.full(fastest.time_s.size, max(float(np.max(t.calcium_um)) for t in trials))
    forces = [_force(f, fastest, fastest.length_l0, calcium, 0.5) for f in (fibre, base)]
    found += _judged(fibre.name, f"trial {fastest.name} at twice its speed and the highest calcium", forces, _ACTIVE_F0)
    return found


def worse_left_out(rows: Sequence[OfTrial]) -> list[str]:
    """A line for each fibre with trials that the answer, fitted without them, predicts worse than the base does."""
    found: dict[str, list[str]] = {}
    for row in rows:
        before, after = row.heldout_before_f0, row.heldout_after_f0
        # Where the base predicts a trial it was left out: what has no number then has no solution.
        if before is not None and (after is None or after > before + _WORSE_F0):
            change = "no solution" if after is None else f"{percent(after)} for {percent(before)} % F0"
            found.setdefault(row.fibre, []).append(f"{row.trial} ({change})")
    return [
        f"fibre {fibre}: the answer predicts trial{'s' * (len(trials) > 1)} {joined(trials)} worse than the base "
        "does where they are left out of the fit; do not rely on it in movements like that"
        for fibre, trials in found.items()
    ]


def _force(fibre: Fibre, trial: FitTrial, length: Array, calcium: Array, slower: float) -> Array | None:
    """Force with times stretched by a factor, F0; None where the model has no solution."""
    try:
        return outputs(Muscle(fibre), trial.dt_s * slower, length, calcium)["force_f0"]
    except UserError:
        return None


def _judged(name: str, words: str, forces: Sequence[Array | None], most_f0: float) -> list[str]:
    own, base = forces
    if own is None:
        if base is None:
            return []
        return [f"fibre {name}: the answer has no solution {words}, where the base has one; do not use it there"]
    top, bottom = float(np.max(own)), float(np.min(own))
    if base is not None:
        base_top, base_bottom = float(np.max(base)), float(np.min(base))
    else:
        base_top, base_bottom = 0.0, 0.0
    if top > most_f0 and top > base_top + _MORE_F0:
        return [
            f"fibre {name}: the answer predicts up to {percent(top)} % F0 {words} (the base {percent(base_top)}): more "
            "than a fibre bears; do not use it there"
        ]
    if bottom < _PUSH_F0 and bottom < base_bottom + _PUSH_F0:
        return [
            f"fibre {name}: the answer pushes with {percent(-bottom)} % F0 {words} (the base {percent(base_bottom)}); "
            "do not use it there"
        ]
    return []
