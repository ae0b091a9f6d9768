"""Residual force enhancement: one task for each active stretch and the isometric trial at its final length."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from xb_muscle_ros.evaluate.bags import Found, Task, file_state, stretch_of, trial_of_task
from xb_muscle_ros.evaluate.fibre_cache import available_sets, muscle_of
from xb_muscle_ros.evaluate.sets import file_serving
from xb_muscle_ros.scores.enhancement import AFTER_S, Side, enhancement
from xb_muscle_ros.scores.standard_error import force_noise
from xb_muscle_ros.simulation.offline import simulate_trial
from xb_muscle_ros.trials.bag_reading import TrialBag
from xb_muscle_ros.trials.trial import Trial

# Calcium that has not fallen below this share of its peak still holds the muscle active.
_STILL_ACTIVE = 0.9


def enhancement_task(stretched: Found, isometric: Found, shared: Task) -> Task:
    """Task that compares an active stretch with the isometric trial at its final length.

    Args:
        stretched, isometric: what `evaluate_bag` found of the trials, its ``trial``.
        shared: a task of `tasks`, for all that does not depend on the bag.
    """
    shared = {key: value for key, value in shared.items() if key not in ("bag", "path", "state")}
    states = [file_state(Path(each["path"])) for each in (stretched, isometric)]
    return {
        **shared,
        "fibre": stretched["fibre"],
        "stretched": stretched["path"],
        "isometric": isometric["path"],
        "state": states,
        "after_s": AFTER_S,
    }


def evaluate_enhancement(task: Mapping[str, Any]) -> Found:
    """Residual force enhancement of a pair of bags, measured and by each model; ``why`` where it cannot be had."""
    stretched, isometric = (trial_of_task(TrialBag(Path(task[name])), task)[0] for name in ("stretched", "isometric"))
    end_s = stretch_of(stretched)[1]
    # Clocks are set by the begin of activation, where calcium tells it.
    shift = _activated_s(isometric) - _activated_s(stretched)
    at_s = end_s + task["after_s"]
    found: Found = {"at_s": at_s, "models": {}}
    active = _active_at(stretched, at_s) and _active_at(isometric, at_s + shift)

    def compare(a: Side, b: Side) -> Found:
        if not active:
            return {"why": f"calcium has fallen, or a trial ended, by {task['after_s']:g} s after the stretch"}
        return enhancement(a, b._replace(time_s=b.time_s - shift), at_s)._asdict()

    found["measured"] = compare(
        *(Side(trial.force_time_s, trial.measured_f0, force_noise(trial)) for trial in (stretched, isometric))
    )
    if task["measured_only"]:
        return found
    path = file_serving(task["fibres"], stretched.facts.fibre)
    for name in task["models"] or available_sets(str(path), task["fibre_files"]):
        muscle = muscle_of(str(path), name, task["method"], task["fibre_files"])
        if muscle is not None:
            a, b = (simulate_trial(muscle, trial, settle_s=task["settle_s"]) for trial in (stretched, isometric))
            f0 = stretched.facts.f0_n, isometric.facts.f0_n
            found["models"][name] = compare(Side(a.time_s, a.force_n / f0[0]), Side(b.time_s, b.force_n / f0[1]))
    return found


def _activated_s(trial: Trial) -> float:
    """When calcium first rises to half its peak, s; 0 where it is constant."""
    calcium = trial.calcium_um
    if np.ptp(calcium) == 0.0:
        return 0.0
    return float(trial.calcium_time_s[int(np.argmax(calcium >= 0.5 * np.max(calcium)))])


def _active_at(trial: Trial, at_s: float) -> bool:
    now = int(np.searchsorted(trial.calcium_time_s, at_s, side="right")) - 1
    return at_s <= trial.time_s[-1] and now >= 0 and trial.calcium_um[now] >= _STILL_ACTIVE * np.max(trial.calcium_um)
