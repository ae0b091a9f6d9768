"""One recording through all models: what a worker does with a bag, and what it says of it."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.evaluate.checks import check_trial
from xb_muscle_ros.evaluate.fibre_cache import all_fibre_files, available_sets, digest_of, fibre_of_file, muscle_of
from xb_muscle_ros.evaluate.sets import NoFibreFile, file_serving
from xb_muscle_ros.models.muscle import Muscle
from xb_muscle_ros.scores.conditions import nominal
from xb_muscle_ros.scores.estimate import Missing
from xb_muscle_ros.scores.readout import read_off
from xb_muscle_ros.scores.redevelopment import redevelopment, restretch_end, still_until
from xb_muscle_ros.scores.rmsd import force_rmsd, short_windows, windows
from xb_muscle_ros.scores.standard_error import NO_NOISE_KNOWN, ForceNoise, force_noise
from xb_muscle_ros.simulation.offline import pushing, simulate_trial
from xb_muscle_ros.trials.bag_files import METADATA
from xb_muscle_ros.trials.bag_reading import TrialBag
from xb_muscle_ros.trials.completing import CONDITIONING_FOUND, Known, pca_of
from xb_muscle_ros.trials.study import left_out, trial_of_bag
from xb_muscle_ros.trials.trial import Array, Trial

Task = dict[str, Any]
Found = dict[str, Any]
# Where an isometric trial and a stretched one are at the same length.
SAME_LENGTH_L0 = 0.01
_LEAST_STRETCH_L0 = 0.01


def tasks(
    bags: Sequence[Path],
    fibres: Mapping[str, Path] | None,
    models: Sequence[str] | None,
    method: str | None,
    settle_s: float | None = None,
    measured_only: bool = False,
    known: Known | None = None,
    only: str | None = None,
) -> list[Task]:
    """One task for each bag.

    Args:
        bags: folders or ``.mcap`` files.
        fibres: fibre files by the fibre's name; None: a bag's fibre name selects the package's fibre file.
        models: parameter sets; None: all that the fibre file has.
        method: see `load_fibre`.
        settle_s: see `simulate_trial`.
        measured_only: no model at all.
        known: what is known of L0 and F0 beside bags and fibre files.
        only: take trials of this fibre and no other.
    """
    files = None if fibres is None else {name: str(path.absolute()) for name, path in fibres.items()}
    shared = {
        "fibres": files,
        # Names of files say nothing about what is in them, and results are kept by their task.
        "fibre_files": digest_of(fibres.values() if fibres is not None else all_fibre_files()),
        "models": None if models is None else list(models),
        "method": method,
        "settle_s": settle_s,
        "measured_only": measured_only,
        "known": asdict(known or Known()),
        "trials_of": only,
    }
    # Workers may stand in another folder; messages name bags as the user did.
    return [{"bag": str(bag), "path": str(bag.absolute()), "state": file_state(bag), **shared} for bag in bags]


def tasks_of_fibres(task: Mapping[str, Any], found: Mapping[str, Any]) -> tuple[list[Task], str | None]:
    """Tasks for a bag of several fibres, one for each trial that is taken, and a line on those that are not.

    Args:
        task: of the bag.
        found: what `evaluate_bag` said of it.
    """
    fibres, file = found["several"], task["fibres"]
    if task["trials_of"] is not None:
        taken = [name for name in fibres if name == task["trials_of"]]
    elif file is not None:
        taken = [name for name in fibres if name in file]
    elif task["measured_only"]:
        taken = fibres
    else:
        known = {path.stem for path in all_fibre_files()}
        taken = [name for name in fibres if name in known]
    taken = taken or fibres  # each is refused by its name
    others = [name for name in fibres if name not in taken]
    line = left_out("', '".join(taken), others) if others else None
    return [{**task, "fibre": name} for name in taken], line


def evaluate_bag(task: Mapping[str, Any]) -> Found:
    """Read a bag, check it, and compare each model with it.

    Returns:
        ``bag``; then ``several``: the fibres of a bag that has more than one, where the task does not choose; or
        ``problem``: one line, and ``unserved``: its fibre, where no file serves that; or ``warnings``, ``trial``
        (facts), ``measured`` and ``models``: what `answer` says of each force, models with ``rmsd_f0`` and ``pushes``
        (a line or None) as well; ``missing``: models without parameter set; ``notes``: lines on facts that are not the
        bag's own.
    """
    label = f"{task['bag']}, fibre {task['fibre']}" if "fibre" in task else task["bag"]
    found: Found = {"bag": label}
    try:
        bag = TrialBag(Path(task["path"]))
        if len(bag.fibres) > 1 and "fibre" not in task:
            return {**found, "several": bag.fibres}
        trial, notes = trial_of_task(bag, task)
        facts = _facts(trial)
        if CONDITIONING_FOUND in notes:
            facts["amplitude_l0"], facts["recovery_s"] = nominal(facts["amplitude_l0"], facts["recovery_s"])
        check_trial(trial, task["bag"])
        found |= {
            "notes": notes,
            "warnings": [line.replace(task["path"], task["bag"]) for line in trial.warnings],
            "trial": {"path": task["path"], **facts},
            "measured": _measured(trial),
            "models": {},
            "missing": [],
        }
        if task["measured_only"]:
            return found
        path = file_serving(task["fibres"], trial.facts.fibre)
        for name in task["models"] or available_sets(str(path), task["fibre_files"]):
            muscle = muscle_of(str(path), name, task["method"], task["fibre_files"])
            if muscle is None:
                found["missing"].append(name)
            else:
                found["models"][name] = _compared(trial, muscle, name, task["settle_s"])
    except UserError as error:
        text = str(error).replace(task["path"], task["bag"])
        unserved = {"unserved": error.fibre} if isinstance(error, NoFibreFile) else {}
        problem = text if task["bag"] in text else f"bag {task['bag']}: {text}"
        return {"bag": label, "problem": problem, **unserved}
    return found


def answer(trial: Trial, time_s: Array, force_f0: Array, noise: ForceNoise | None = None) -> Found:
    """What a force, measured or simulated, shows: SRS (F0/L0), isometric force (F0) and k_tr (1/s).

    Args:
        trial: lengths, phases, calcium.
        time_s, force_f0: shape (n,), s and F0.
        noise: of the force; None where it is simulated or its noise not known.

    Returns:
        values by name, None where there is none; standard errors under ``<name>_se``; ``why``: what is missing that
        could be expected, and why, by name.
    """
    found: Found = {"why": {}}
    for name, each in read_off(trial, time_s, force_f0, noise).items():
        found[name], found[f"{name}_se"] = each.value, each.se
        if each.why:
            found["why"][name] = each.why
    restretched = restretch_end(trial.time_s, trial.length_change_l0)
    found["k_tr"] = None
    if restretched is not None and np.ptp(trial.calcium_um) > 0.0:
        found["why"]["k_tr"] = "calcium changes, so that force does not redevelop alone"
    elif restretched is not None:
        until = still_until(trial.time_s, trial.length_change_l0, restretched)
        rate = redevelopment(time_s, force_f0, restretched, until, noise)
        if isinstance(rate, Missing):
            found["why"]["k_tr"] = rate.why
        else:
            found["k_tr"] = {"k_per_s": rate.k_per_s, "se_per_s": rate.se_per_s}
    return found


def _measured(trial: Trial) -> Found:
    noise = force_noise(trial)
    found = answer(trial, trial.force_time_s, trial.measured_f0, noise)
    found["why"] |= {f"rmsd_{name}": why for name, why in short_windows(trial).items()}
    if noise is None:
        found["why"]["standard errors"] = NO_NOISE_KNOWN
    return found


def trial_of_task(bag: TrialBag, task: Mapping[str, Any]) -> tuple[Trial, tuple[str, ...]]:
    """The trial of a task, complete, and lines on facts that are not the bag's own."""
    fibre, only = task.get("fibre"), task["trials_of"]
    alone = len(bag.fibres) == 1
    name = bag.fibres[0] if fibre is None or alone else str(fibre)
    told = (bag.named or name) if alone else name
    if only is not None and only not in (name, told):
        raise UserError(f"the bag's fibre is '{told}'; --trials-of takes those of '{only}' alone")
    known = Known(**task["known"])
    if not task["measured_only"]:
        path = file_serving(task["fibres"], told)
        known = known.of_file(fibre_of_file(str(path), task["fibre_files"]))
    return trial_of_bag(bag, name, known, task["bag"] if "bag" in task else str(bag.path))


def _compared(trial: Trial, muscle: Muscle, name: str, settle_s: float | None) -> Found:
    simulated = simulate_trial(muscle, trial, settle_s=settle_s)
    force = simulated.force_n / trial.facts.f0_n
    at_measured = np.interp(trial.force_time_s, simulated.time_s, force)
    found = answer(trial, simulated.time_s, force)
    if found["k_tr"] is not None:
        found["k_tr"]["se_per_s"] = None  # no noise
    found["pushes"] = pushing(trial, simulated, name)
    found["rmsd_f0"] = {
        name: force_rmsd(trial.force_time_s, at_measured, trial.measured_f0, window)
        for name, window in windows(trial).items()
    }
    return found


def _facts(trial: Trial) -> Found:
    """What grouping and pairing of trials need to know."""
    facts = trial.facts
    stretch = stretch_of(trial)
    return {
        "fibre": facts.fibre,
        "trial": facts.trial,
        "pca": pca_of(trial),
        "amplitude_l0": facts.amplitude_l0,
        "recovery_s": facts.recovery_s,
        "peak_calcium_um": float(np.max(trial.calcium_um)),
        "final_length_l0": float(trial.length_change_l0[-1]),
        "stretch_l0": stretch[0],
        "moves": bool(np.ptp(trial.length_change_l0) > _LEAST_STRETCH_L0),
        "content": _content(trial),
    }


def stretch_of(trial: Trial) -> tuple[float | None, float]:
    """Size (L0) and end (s) of the one stretch of a trial that has nothing else; size is None for other trials."""
    moving = [p for p in trial.facts.phases if "stretch" in p.name or p.name in ("shortening", "release")]
    if len(moving) != 1 or "stretch" not in moving[0].name:
        return None, float(trial.time_s[-1])
    at = np.interp([moving[0].start_s, moving[0].end_s], trial.time_s, trial.length_change_l0)
    size = float(at[1] - at[0])
    return (size if size >= _LEAST_STRETCH_L0 else None), moving[0].end_s


def file_state(bag: Path) -> str:
    """What changes when a bag does: sizes and times of its files."""
    files = [bag] if bag.is_file() else sorted([*bag.glob("*.mcap"), *bag.glob(METADATA)])
    stats = [(file.name, file.stat()) for file in files]
    return " ".join(f"{name}:{stat.st_size}:{stat.st_mtime_ns}" for name, stat in stats)


def _content(trial: Trial) -> str:
    """Equal for recordings that hold the same samples."""
    digest = hashlib.sha256()
    for array in (trial.time_s, trial.length_m, trial.calcium_um, trial.force_time_s, trial.force_n):
        digest.update(array.tobytes())
        digest.update(b"|")
    return digest.hexdigest()[:16]
