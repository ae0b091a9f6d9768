"""Spike-ins: real recordings with the force added that an effect of known size would have added."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from xb_muscle_ros import fast_yaml
from xb_muscle_ros.errors import UserError
from xb_muscle_ros.files import write_text
from xb_muscle_ros.prove.generator.artefacts import Artefacts
from xb_muscle_ros.prove.generator.case import trial_name, usual
from xb_muscle_ros.prove.generator.mix import Spec, spikes
from xb_muscle_ros.prove.generator.nuisances import residual_beside_nuisances
from xb_muscle_ros.prove.generator.refit import Refit
from xb_muscle_ros.prove.generator.single import conceal, facts
from xb_muscle_ros.prove.generator.study import Planned
from xb_muscle_ros.prove.generator.world import MODELS, SAMPLE_S, World
from xb_muscle_ros.prove.make import SEALED, case_name, make_room, seal
from xb_muscle_ros.trials.bags import find_bags, read_trial, write_trial
from xb_muscle_ros.trials.trial import Trial
from xb_muscle_ros.work import JsonValue, Options, stream

_ABOUT = f"Real recordings; to most of them the force was added that a concealed effect would have added. {SEALED}"


def spike(
    bags: Sequence[Path],
    fiber: Path,
    out: Path,
    cases: int,
    seed: int,
    key: Path,
    options: Options,
    overwrite: bool = False,
) -> str:
    """Make spike-ins of a recorded study; one case in five is left as it was recorded.

    Args:
        bags: trials of one fibre, with measured force and constant calcium.
        fiber: file with the set of the fibre around which the effects are computed; goes with every case.
        out, cases, seed, key, options, overwrite: see `make.make`.

    Returns:
        SHA-256 of the key.

    Raises:
        UserError: a bag or the file cannot be used, the folder holds a benchmark, or the key lies in it.
    """
    make_room(out, key, overwrite)
    world = _world(fiber)
    paths = [str(path) for path in find_bags(bags)]
    specs = spikes(cases, seed, world.model)
    tasks = [
        {
            "bags": paths, "fiber": str(fiber), "seed": seed, "number": i + 1, "spec": list(spec),
            "out": str(out / "cases" / case_name(i + 1)),
        }
        for i, spec in enumerate(specs)
    ]  # fmt: skip
    found: dict[int, Any] = dict(stream(_spike_one, tasks, options))
    return seal(out, key, seed, [found[i] for i in range(len(tasks))], _ABOUT, "as in the fibre file")


def _spike_one(task: Mapping[str, Any]) -> dict[str, JsonValue]:
    kind, labels, sizes, model, *_ = task["spec"]
    spec, fiber, folder = Spec(kind, tuple(labels), tuple(sizes), model), Path(task["fiber"]), Path(task["out"])
    trials = [read_trial(Path(path)) for path in task["bags"]]
    study, base = [_planned(trial) for trial in trials], _world(fiber)
    random = np.random.default_rng([int(task["seed"]), int(task["number"])])
    refit = Refit(base, [planned.stimulus() for planned in study])
    concealed, forces, refitted = conceal(spec, usual(spec, random), base, study, Artefacts(), refit)
    beside = residual_beside_nuisances(base, study, refit, refitted)
    for i, (trial, force, plain) in enumerate(zip(trials, forces, refit.plain(), strict=True)):
        added = force - plain if concealed else np.zeros(force.size)
        _write(folder / "bags" / trial_name(i), trial_name(i), trial, added)
    write_text(folder / "fibre.yaml", fiber.read_text(encoding="utf-8"))
    return {
        "case": folder.name,
        "kind": spec.kind if concealed else "untouched",
        "labels": list(spec.labels),
        "model": spec.model,
        "noise_rms_f0": None,
        **facts(spec, study, concealed, refitted, beside),
    }


def _planned(trial: Trial) -> Planned:
    """The recording's input, sampled every millisecond from its first sample on.

    Raises:
        UserError: force was not measured, or calcium changes.
    """
    name = trial.facts.trial
    if not trial.force_n.size:
        raise UserError(f"trial {name} has no measured force to add to; give recordings with force")
    if np.ptp(trial.calcium_um) > 1e-9 * np.max(trial.calcium_um):
        raise UserError(f"trial {name}: calcium changes; give trials of one bathing solution each")
    start = float(trial.time_s[0])
    time_s = np.arange(start, trial.time_s[-1], SAMPLE_S)
    length = np.interp(time_s, trial.time_s, trial.length_change_l0)
    phases = tuple(replace(p, start_s=p.start_s - start, end_s=p.end_s - start) for p in trial.facts.phases)
    return Planned(6.0 - float(np.log10(trial.calcium_um[0])), length, phases)


def _write(bag: Path, name: str, trial: Trial, added: np.ndarray[Any, np.dtype[np.float64]]) -> None:
    time_s = trial.time_s[0] + np.arange(added.size) * SAMPLE_S
    force = trial.force_n + trial.facts.f0_n * np.interp(trial.force_time_s, time_s, added)
    bag.parent.mkdir(parents=True, exist_ok=True)
    write_trial(bag, replace(trial, facts=replace(trial.facts, trial=name), force_n=force))


def _world(fiber: Path) -> World:
    """The plain fibre of a file's chosen set.

    Raises:
        UserError: the file is no fibre file, or its model is none of the generator's.
    """
    try:
        inner = fast_yaml.load(fiber.read_text(encoding="utf-8"))["/**"]["ros__parameters"]
        model, values = str(inner["model"]), {k: float(v) for k, v in inner["models"][inner["model"]].items()}
    except (OSError, ValueError, KeyError, TypeError, yaml.YAMLError) as error:
        raise UserError(f"fibre file {fiber} cannot be read ({error}); give the path of a fibre file") from error
    if model.removesuffix("_rigid") not in MODELS:
        raise UserError(f"fibre file {fiber}: model {model} cannot be spiked; allowed are {', '.join(MODELS)}")
    return World(model, {"kpe": 0.0, "Fpe0": 0.0, **values})
