"""One recording through all models: what a worker does with a bag, and what it says of it."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.evaluate.checks import check_trial, moving
from xb_muscle_ros.evaluate.fibre_cache import all_fibre_files, available_sets, digest_of, fibre_of_file, muscle_of
from xb_muscle_ros.evaluate.request import Request
from xb_muscle_ros.evaluate.sets import NoFibreFile, file_serving
from xb_muscle_ros.evaluate.trials import MEASURED, Evaluated, Facts
from xb_muscle_ros.models.muscle import Muscle
from xb_muscle_ros.scores.conditions import CONDITIONS, nominal
from xb_muscle_ros.scores.estimate import Estimate
from xb_muscle_ros.scores.readout import read_off
from xb_muscle_ros.scores.redevelopment import K_TR, redevelopment_rate
from xb_muscle_ros.scores.rmsd import force_rmsds, short_windows
from xb_muscle_ros.scores.standard_error import NO_NOISE_KNOWN, ForceNoise, force_noise
from xb_muscle_ros.simulation.offline import pushing, simulate_trial
from xb_muscle_ros.trials.bag_files import METADATA
from xb_muscle_ros.trials.bag_reading import TrialBag
from xb_muscle_ros.trials.completing import CONDITIONING_FOUND, Known, pca_of
from xb_muscle_ros.trials.study import left_out, trial_of_bag
from xb_muscle_ros.trials.trial import Array, Trial
from xb_muscle_ros.work.plain import to_plain

Task = dict[str, Any]
_LEAST_STRETCH_L0 = 0.01


def tasks(request: Request, bags: Sequence[Path], fibres: Mapping[str, Path] | None) -> list[Task]:
    """One task for each bag.

    Args:
        bags: folders or ``.mcap`` files.
        fibres: fibre files by the fibre's name; None: a bag's fibre name selects the package's fibre file.
    """
    shared = {
        "fibres": None if fibres is None else {name: str(path.absolute()) for name, path in fibres.items()},
        # Names of files say nothing about what is in them, and results are kept by their task.
        "fibre_files": digest_of(fibres.values() if fibres is not None else all_fibre_files()),
        "models": None if request.models is None else list(request.models),
        "method": request.method,
        "settle_s": request.settle_s,
        "measured_only": request.measured_only,
        "known": to_plain(request.known),
        "trials_of": request.only,
    }
    # Workers may stand in another folder; messages name bags as the user did.
    return [{"bag": str(bag), "path": str(bag.absolute()), "state": file_state(bag), **shared} for bag in bags]


def tasks_of_fibres(task: Mapping[str, Any], fibres: Sequence[str]) -> tuple[list[Task], str | None]:
    """Tasks for a bag of several fibres, one for each trial that is taken, and a line on those that are not."""
    taken = list(fibres)
    if task["trials_of"] is not None:
        taken = [name for name in fibres if name == task["trials_of"]]
    elif task["fibres"] is not None or not task["measured_only"]:
        known = task["fibres"] if task["fibres"] is not None else {path.stem for path in all_fibre_files()}
        taken = [name for name in fibres if name in known]
    taken = taken or list(fibres)  # each is refused by its name
    others = [name for name in fibres if name not in taken]
    line = left_out("', '".join(taken), others) if others else None
    return [{**task, "fibre": name} for name in taken], line


def evaluate_bag(task: Mapping[str, Any]) -> dict[str, Any]:
    """Read a bag, check it, and compare each model with it; gives an `Evaluated` as plain data."""
    label = f"{task['bag']}, fibre {task['fibre']}" if "fibre" in task else task["bag"]
    try:
        found = _evaluated(task, label)
    except UserError as error:
        text = str(error).replace(task["path"], task["bag"])
        problem = text if task["bag"] in text else f"bag {task['bag']}: {text}"
        found = Evaluated(label, problem=problem, unserved=error.fibre if isinstance(error, NoFibreFile) else "")
    return to_plain(found)


def _evaluated(task: Mapping[str, Any], label: str) -> Evaluated:
    bag = TrialBag(Path(task["path"]))
    if len(bag.fibres) > 1 and "fibre" not in task:
        return Evaluated(label, several=bag.fibres)
    trial, notes = trial_of_task(bag, task)
    facts = _facts(trial, task["path"], CONDITIONING_FOUND in notes)
    check_trial(trial, task["bag"])
    scores = {MEASURED: _measured(trial)}
    pushes, missing = {}, []
    for name, muscle in muscles_of_task(task, trial.facts.fibre):
        if muscle is None:
            missing.append(name)
            continue
        simulated = simulate_trial(muscle, trial, settle_s=task["settle_s"])
        force = simulated.force_n / trial.facts.f0_n
        rmsd = force_rmsds(trial, simulated.time_s, force)
        scores[name] = {f"rmsd_{window}": Estimate(value) for window, value in rmsd.items()}
        # Simulated forces have no noise, and so no standard error.
        scores[name] |= {key: each._replace(se=None) for key, each in answer(trial, simulated.time_s, force).items()}
        if line := pushing(trial, simulated, name):
            pushes[name] = line
    warnings = [line.replace(task["path"], task["bag"]) for line in trial.warnings]
    return Evaluated(label, (), "", "", facts, scores, pushes, missing, warnings, notes)


def muscles_of_task(task: Mapping[str, Any], fibre: str) -> Iterator[tuple[str, Muscle | None]]:
    """Each model of a task with the muscle that serves a fibre's trials; None where the file has no such set."""
    if task["measured_only"]:
        return
    path, digest = str(file_serving(task["fibres"], fibre)), task["fibre_files"]
    for name in task["models"] or available_sets(path, digest):
        yield name, muscle_of(path, name, task["method"], digest)


def answer(trial: Trial, time_s: Array, force_f0: Array, noise: ForceNoise | None = None) -> dict[str, Estimate]:
    """What a force, measured or simulated, shows: SRS (F0/L0), isometric force (F0) and k_tr (1/s).

    Args:
        trial: lengths, phases, calcium.
        time_s, force_f0: shape (n,), s and F0.
        noise: of the force; None where it is simulated or its noise not known.
    """
    return {**read_off(trial, time_s, force_f0, noise), K_TR: redevelopment_rate(trial, time_s, force_f0, noise)}


def _measured(trial: Trial) -> dict[str, Estimate]:
    noise = force_noise(trial)
    found = answer(trial, trial.force_time_s, trial.measured_f0, noise)
    found |= {f"rmsd_{name}": Estimate(None, why=why) for name, why in short_windows(trial).items()}
    return found if noise is not None else {**found, "standard errors": Estimate(None, why=NO_NOISE_KNOWN)}


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


def _facts(trial: Trial, path: str, conditioning_found: bool) -> Facts:
    amplitude_l0, recovery_s = trial.facts.amplitude_l0, trial.facts.recovery_s
    if conditioning_found:
        amplitude_l0, recovery_s = nominal(amplitude_l0, recovery_s)
    if amplitude_l0 == 0.0 and recovery_s is None:
        recovery_s = CONDITIONS[0].recovery_s
    return Facts(
        path,
        trial.facts.fibre,
        trial.facts.trial,
        pca_of(trial),
        amplitude_l0,
        recovery_s,
        peak_calcium_um=float(np.max(trial.calcium_um)),
        final_length_l0=float(trial.length_change_l0[-1]),
        stretch_l0=stretch_of(trial)[0],
        moves=bool(np.ptp(trial.length_change_l0) > _LEAST_STRETCH_L0),
        content=_content(trial),
    )


def stretch_of(trial: Trial) -> tuple[float | None, float]:
    """Size (L0) and end (s) of the one stretch of a trial that has nothing else; size is None for other trials."""
    phases = moving(trial)
    if len(phases) != 1 or "stretch" not in phases[0].name:
        return None, float(trial.time_s[-1])
    at = np.interp([phases[0].start_s, phases[0].end_s], trial.time_s, trial.length_change_l0)
    size = float(at[1] - at[0])
    return (size if size >= _LEAST_STRETCH_L0 else None), phases[0].end_s


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
