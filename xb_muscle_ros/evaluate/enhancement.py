"""Residual force enhancement of recordings: active stretches beside the isometric trials at their final length."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from xb_muscle_ros.evaluate.bags import Task, file_state, muscles_of_task, stretch_of, trial_of_task
from xb_muscle_ros.evaluate.trials import MEASURED, Facts, Trials
from xb_muscle_ros.scores.enhancement import AFTER_S, Enhancement, Side, enhancement
from xb_muscle_ros.scores.estimate import Missing
from xb_muscle_ros.scores.standard_error import force_noise
from xb_muscle_ros.simulation.offline import simulate_trial
from xb_muscle_ros.trials.bag_reading import TrialBag
from xb_muscle_ros.trials.trial import Trial

Pair = tuple[Facts, Facts]
"""A stretched trial, and the isometric one to set it beside."""
# Calcium that has not fallen below this share of its peak still holds the muscle active.
_STILL_ACTIVE = 0.9
# Muscles activated alike reach the same peak of calcium, within this share, and are as long within this, L0.
_SAME_CALCIUM, _SAME_LENGTH_L0 = 0.02, 0.01


@dataclass(frozen=True)
class EnhancementRow:
    """Residual force enhancement of one pair, measured or by a model, or why there is none.

    Attributes:
        fibre, stretched, isometric: names of the fibre and its trials.
        stretch_l0: size of the stretch, L0.
        of: `MEASURED`, or the parameter set.
        at_s: when forces are compared, in the clock of the stretched trial, s.
        found: the forces.
    """

    fibre: str
    stretched: str
    isometric: str
    stretch_l0: float
    of: str
    at_s: float
    found: Enhancement | Missing

    def as_row(self) -> dict[str, Any]:
        """Entry of ``evaluate.json``."""
        own = {key: value for key, value in vars(self).items() if key != "found"}
        return {**own, **dict.fromkeys(Enhancement._fields), "why": "", **self.found._asdict()}


def enhancement_pairs(trials: Trials) -> list[Pair]:
    """Stretched trials and the isometric ones to set them beside.

    A stretched trial has one stretch and nothing else. Its partner is of the same fibre, isometric throughout at the
    length where the stretch ends, and activated alike: the last such trial before it in the order of the bags, or else
    the first after it.
    """
    shapes = [facts for _, facts in trials.usable() if facts.stretch_l0 is not None or not facts.moves]
    pairs = []
    for k, stretched in enumerate(shapes):
        if stretched.stretch_l0 is not None:
            # Nearest before it first, then those after it.
            partners = [each for each in (*shapes[:k][::-1], *shapes[k + 1 :]) if _matches(stretched, each)]
            pairs += [(stretched, each) for each in partners[:1]]
    return pairs


def _matches(stretched: Facts, other: Facts) -> bool:
    peak = stretched.peak_calcium_um
    activated_alike = abs(peak - other.peak_calcium_um) <= _SAME_CALCIUM * peak
    as_long = abs(stretched.final_length_l0 - other.final_length_l0) <= _SAME_LENGTH_L0
    return not other.moves and stretched.fibre == other.fibre and activated_alike and as_long


def enhancement_task(pair: Pair, shared: Task) -> Task:
    """Task that compares the two trials of a pair.

    Args:
        shared: a task of `bags.tasks`, for all that does not depend on the bag.
    """
    stretched, isometric = pair
    return {
        **{key: value for key, value in shared.items() if key not in ("bag", "path")},
        "fibre": stretched.fibre,
        "stretched": stretched.path,
        "isometric": isometric.path,
        "state": [file_state(Path(each.path)) for each in pair],
        "after_s": AFTER_S,
    }


def evaluate_enhancement(task: Mapping[str, Any]) -> dict[str, Any]:
    """Residual force enhancement of a pair of bags.

    Returns:
        ``at_s``; ``found``: by `MEASURED` and parameter set the fields of `Enhancement`, or ``why`` there is none.
    """
    stretched, isometric = (trial_of_task(TrialBag(Path(task[name])), task)[0] for name in ("stretched", "isometric"))
    # Clocks are set by the begin of activation, where calcium tells it.
    shift = _activated_s(isometric) - _activated_s(stretched)
    at_s = stretch_of(stretched)[1] + task["after_s"]
    active = _active_at(stretched, at_s) and _active_at(isometric, at_s + shift)

    def compare(a: Side, b: Side) -> dict[str, Any]:
        if not active:
            return {"why": f"calcium has fallen, or a trial ended, by {task['after_s']:g} s after the stretch"}
        return enhancement(a, b._replace(time_s=b.time_s - shift), at_s)._asdict()

    pair = (stretched, isometric)
    found = {MEASURED: compare(*(Side(t.force_time_s, t.measured_f0, force_noise(t)) for t in pair))}
    for name, muscle in muscles_of_task(task, stretched.facts.fibre):
        if muscle is not None:
            made = [simulate_trial(muscle, trial, settle_s=task["settle_s"]) for trial in pair]
            sides = zip(made, pair, strict=True)
            found[name] = compare(*(Side(each.time_s, each.force_n / trial.facts.f0_n) for each, trial in sides))
    return {"at_s": at_s, "found": found}


def enhancement_rows(pair: Pair, result: Mapping[str, Any]) -> list[EnhancementRow]:
    """What `evaluate_enhancement` found of a pair, measured and by each model."""
    stretched, isometric = pair
    names = (stretched.fibre, stretched.trial, isometric.trial, stretched.stretch_l0 or 0.0)
    return [
        EnhancementRow(*names, of, result["at_s"], Missing(**each) if "why" in each else Enhancement(**each))
        for of, each in result["found"].items()
    ]


def _activated_s(trial: Trial) -> float:
    """When calcium first rises to half its peak, s; 0 where it is constant."""
    calcium = trial.calcium_um
    if np.ptp(calcium) == 0.0:
        return 0.0
    return float(trial.calcium_time_s[int(np.argmax(calcium >= 0.5 * np.max(calcium)))])


def _active_at(trial: Trial, at_s: float) -> bool:
    now = int(np.searchsorted(trial.calcium_time_s, at_s, side="right")) - 1
    return at_s <= trial.time_s[-1] and now >= 0 and trial.calcium_um[now] >= _STILL_ACTIVE * np.max(trial.calcium_um)
