"""One recording through all models: what a worker does with a bag, and what it says of it."""

from __future__ import annotations

import functools
import hashlib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.evaluate.checks import check_trial, pca_of
from xb_muscle_ros.models.fibre_file import base_set, fibre_folders, find_fibre_file, load_fibre
from xb_muscle_ros.models.muscle import Muscle
from xb_muscle_ros.replay.offline import simulate_trial
from xb_muscle_ros.scores.enhancement import AFTER_S, Side, enhancement
from xb_muscle_ros.scores.estimate import Missing
from xb_muscle_ros.scores.readout import read_off
from xb_muscle_ros.scores.redevelopment import redevelopment, restretch_end, still_until
from xb_muscle_ros.scores.rmsd import force_rmsd, short_windows, windows
from xb_muscle_ros.scores.standard_error import NO_NOISE_KNOWN, ForceNoise, force_noise
from xb_muscle_ros.trials.bag_files import METADATA
from xb_muscle_ros.trials.bags import read_trial
from xb_muscle_ros.trials.trial import Array, Trial

Task = dict[str, Any]
Found = dict[str, Any]
# Where an isometric trial and a stretched one are at the same length.
SAME_LENGTH_L0 = 0.01
_LEAST_STRETCH_L0 = 0.01
# Calcium that has not fallen below this share of its peak still holds the muscle active.
_STILL_ACTIVE = 0.9


def tasks(
    bags: Sequence[Path],
    fibres: Mapping[str, Path] | None,
    models: Sequence[str] | None,
    method: str | None,
    settle_s: float | None = None,
    measured_only: bool = False,
) -> list[Task]:
    """One task for each bag.

    Args:
        bags: folders or ``.mcap`` files.
        fibres: fibre files by the fibre's name; None: a bag's fibre name selects the package's fibre file.
        models: parameter sets; None: all that the fibre file has.
        method: see `load_fibre`.
        settle_s: see `simulate_trial`.
        measured_only: no model at all.
    """
    files = None if fibres is None else {name: str(path.absolute()) for name, path in fibres.items()}
    shared = {
        "fibres": files,
        # Names of files say nothing about what is in them, and results are kept by their task.
        "fibre_files": _digest(fibres.values() if fibres is not None else _all_fibre_files()),
        "models": None if models is None else list(models),
        "method": method,
        "settle_s": settle_s,
        "measured_only": measured_only,
    }
    # Workers may stand in another folder; messages name bags as the user did.
    return [{"bag": str(bag), "path": str(bag.absolute()), "state": _file_state(bag), **shared} for bag in bags]


def evaluate_bag(task: Mapping[str, Any]) -> Found:
    """Read a bag, check it, and compare each model with it.

    Returns:
        ``bag``; then either ``problem``: one line, or ``warnings``, ``trial`` (facts), ``measured`` and ``models``:
        what `answer` says of each force, models with ``rmsd_f0`` as well; ``missing``: models without parameter set.
    """
    found: Found = {"bag": task["bag"]}
    try:
        trial = read_trial(Path(task["path"]))
        check_trial(trial, task["bag"])
        found |= {
            "warnings": [line.replace(task["path"], task["bag"]) for line in trial.warnings],
            "trial": {"path": task["path"], **_facts(trial)},
            "measured": _measured(trial),
            "models": {},
            "missing": [],
        }
        if task["measured_only"]:
            return found
        path = _fibre_path(task["fibres"], trial.facts.fibre)
        for name in task["models"] or _available(str(path), task["fibre_files"]):
            muscle = _muscle(str(path), name, task["method"], task["fibre_files"])
            if muscle is None:
                found["missing"].append(name)
            else:
                found["models"][name] = _compared(trial, muscle, task["settle_s"])
    except UserError as error:
        text = str(error).replace(task["path"], task["bag"])
        return {"bag": task["bag"], "problem": text if task["bag"] in text else f"bag {task['bag']}: {text}"}
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


def enhancement_task(stretched: Found, isometric: Found, shared: Task) -> Task:
    """Task that compares an active stretch with the isometric trial at its final length.

    Args:
        stretched, isometric: what `evaluate_bag` found of the trials, its ``trial``.
        shared: a task of `tasks`, for all that does not depend on the bag.
    """
    shared = {key: value for key, value in shared.items() if key not in ("bag", "path", "state")}
    states = [_file_state(Path(each["path"])) for each in (stretched, isometric)]
    return {
        **shared,
        "stretched": stretched["path"],
        "isometric": isometric["path"],
        "state": states,
        "after_s": AFTER_S,
    }


def evaluate_enhancement(task: Mapping[str, Any]) -> Found:
    """Residual force enhancement of a pair of bags, measured and by each model; ``why`` where it cannot be had."""
    stretched, isometric = read_trial(Path(task["stretched"])), read_trial(Path(task["isometric"]))
    end_s = _stretch(stretched)[1]
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
    path = _fibre_path(task["fibres"], stretched.facts.fibre)
    for name in task["models"] or _available(str(path), task["fibre_files"]):
        muscle = _muscle(str(path), name, task["method"], task["fibre_files"])
        if muscle is not None:
            a, b = (simulate_trial(muscle, trial, settle_s=task["settle_s"]) for trial in (stretched, isometric))
            f0 = stretched.facts.f0_n, isometric.facts.f0_n
            found["models"][name] = compare(Side(a.time_s, a.force_n / f0[0]), Side(b.time_s, b.force_n / f0[1]))
    return found


def _compared(trial: Trial, muscle: Muscle, settle_s: float | None) -> Found:
    simulated = simulate_trial(muscle, trial, settle_s=settle_s)
    force = simulated.force_n / trial.facts.f0_n
    at_measured = np.interp(trial.force_time_s, simulated.time_s, force)
    found = answer(trial, simulated.time_s, force)
    if found["k_tr"] is not None:
        found["k_tr"]["se_per_s"] = None  # no noise
    found["rmsd_f0"] = {
        name: force_rmsd(trial.force_time_s, at_measured, trial.measured_f0, window)
        for name, window in windows(trial).items()
    }
    return found


def _facts(trial: Trial) -> Found:
    """What grouping and pairing of trials need to know."""
    facts = trial.facts
    stretch = _stretch(trial)
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


def _stretch(trial: Trial) -> tuple[float | None, float]:
    """Size (L0) and end (s) of the one stretch of a trial that has nothing else; size is None for other trials."""
    moving = [p for p in trial.facts.phases if "stretch" in p.name or p.name in ("shortening", "release")]
    if len(moving) != 1 or "stretch" not in moving[0].name:
        return None, float(trial.time_s[-1])
    at = np.interp([moving[0].start_s, moving[0].end_s], trial.time_s, trial.length_change_l0)
    size = float(at[1] - at[0])
    return (size if size >= _LEAST_STRETCH_L0 else None), moving[0].end_s


def _activated_s(trial: Trial) -> float:
    """When calcium first rises to half its peak, s; 0 where it is constant."""
    calcium = trial.calcium_um
    if np.ptp(calcium) == 0.0:
        return 0.0
    return float(trial.calcium_time_s[int(np.argmax(calcium >= 0.5 * np.max(calcium)))])


def _active_at(trial: Trial, at_s: float) -> bool:
    now = int(np.searchsorted(trial.calcium_time_s, at_s, side="right")) - 1
    return at_s <= trial.time_s[-1] and now >= 0 and trial.calcium_um[now] >= _STILL_ACTIVE * np.max(trial.calcium_um)


def _fibre_path(fibres: Mapping[str, str] | None, name: str) -> Path:
    if fibres is None:
        return find_fibre_file(name)
    if name not in fibres:
        raise UserError(
            f"the bag's fibre is '{name}', the fibre files given are of {', '.join(fibres)}; give its file too"
        )
    return Path(fibres[name])


@functools.lru_cache(maxsize=64)
def _muscle(path: str, model: str, method: str | None, digest: str) -> Muscle | None:
    """The fibre ready to step; None where its file has no set for the model."""
    if not {model, base_set(model)} & set(_available(path, digest)):
        return None
    return Muscle(load_fibre(path, model, method))


@functools.lru_cache(maxsize=64)
def _available(path: str, digest: str) -> tuple[str, ...]:
    """Sets of a fibre file; kept for as long as no fibre file changes."""
    return load_fibre(path).available_models


def _file_state(bag: Path) -> str:
    """What changes when a bag does: sizes and times of its files."""
    files = [bag] if bag.is_file() else sorted([*bag.glob("*.mcap"), *bag.glob(METADATA)])
    stats = [(file.name, file.stat()) for file in files]
    return " ".join(f"{name}:{stat.st_size}:{stat.st_mtime_ns}" for name, stat in stats)


def _all_fibre_files() -> list[Path]:
    return sorted(file for folder in fibre_folders() for file in folder.glob("*.yaml"))


def _digest(files: Any) -> str:
    digest = hashlib.sha256()
    for file in files:
        digest.update(Path(file).read_bytes())
    return digest.hexdigest()[:16]


def _content(trial: Trial) -> str:
    """Equal for recordings that hold the same samples."""
    digest = hashlib.sha256()
    for array in (trial.time_s, trial.length_m, trial.calcium_um, trial.force_time_s, trial.force_n):
        digest.update(array.tobytes())
        digest.update(b"|")
    return digest.hexdigest()[:16]
