"""Leave one calcium level out: all six models fitted to rat soleus fibre 18Dec2017a, beside the released sets.

For each model and each of five pCa the other four are fitted, with and without measurement artefacts, and the one
left out is predicted. Priors come from the sets of the other fibres; the fibre's own given set, which was fitted to all
of its pCa, is the start and the rival. Prints a Markdown table.
"""

from __future__ import annotations

import argparse
from dataclasses import replace
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np

from xb_muscle_ros.files import write_json
from xb_muscle_ros.fit.calibration import calibrated_force
from xb_muscle_ros.fit.coordinates import fault_coordinates, parameter_coordinates, population_choices
from xb_muscle_ros.fit.data import FitTrial, fit_trials
from xb_muscle_ros.fit.features import F0_ANCHOR
from xb_muscle_ros.fit.problem import Problem
from xb_muscle_ros.fit.run import Settings, fit
from xb_muscle_ros.models.fibre_file import load_fibre
from xb_muscle_ros.trials.bags import find_bags, read_trial
from xb_muscle_ros.work import Options, run

FIBRE = "18Dec2017a"
OTHERS = ("13Dec2017a", "13Dec2017b", "14Dec2017b", "18Dec2017b", "19Dec2017a", "7Aug2018a")
MODELS = ("hill", "hill_se", "2state", "2state_coop", "3state_coop", "4state_coop")
FAULTS = ("pca_shift", "force_offset")


def case(task: dict[str, Any]) -> dict[str, Any]:
    """One model, one pCa left out; RMSD of the fitted and of the given set, F0."""
    model = task["model"]
    given = load_fibre(FIBRE, model)
    start = replace(given, values=MappingProxyType({**given.values, "smoothing": 0.0}))
    trials = [FitTrial.from_json(row) for row in task["trials"]]
    training = [t for t in trials if not t.held_out]
    names, solutions = [t.name for t in training], [t.solution for t in training]
    choices = population_choices([load_fibre(name, model) for name in OTHERS], {})
    coordinates = parameter_coordinates(start, None, (), {}, choices)
    coordinates += fault_coordinates(task["faults"], names, solutions, {})
    problem = Problem(start, tuple(trials), coordinates, {}, (F0_ANCHOR,))
    found = fit(problem, Settings(starts=3, level=None), Options(processes=0, quiet=True))
    # Each is calibrated with a shift of the solution left out, fitted beside the parameters or not.
    shift = fault_coordinates(["pca_shift"], names, solutions, {})
    more = () if task["faults"] else shift
    shifting = replace(problem, coordinates=(*problem.coordinates, *more))
    as_given = Problem(given, tuple(trials), shift, {})
    return {
        "fitted": _errors(shifting, np.concatenate([found.best.z, np.zeros(len(more))]), trials),
        "given": _errors(as_given, as_given.start, trials),
        "source": given.source,
    }


def _errors(problem: Problem, z: Any, trials: list[FitTrial]) -> dict[str, float]:
    """Root mean square over trials: training, held out, and held out with the pCa shift of its isometric force."""

    def rmsd(force: Any, trial: FitTrial) -> float:
        return float(np.sqrt(np.mean((force - trial.measured_f0) ** 2)))

    train = [rmsd(problem.predicted(z, [t])[0], t) for t in trials if not t.held_out]
    held = next(t for t in trials if t.held_out)
    return {
        "training": float(np.sqrt(np.mean(np.square(train)))),
        "held_out": rmsd(problem.predicted(z, [held])[0], held),
        "calibrated": rmsd(calibrated_force(problem, z, held).force_f0, held),
    }


def main(folder: Path, out: Path | None, journal: Path | None) -> None:
    """Run all cases and print the table."""
    trials = [t for t in map(read_trial, find_bags([str(folder)])) if t.facts.recovery_s is not None]
    pcas = [t.facts.pca for t in trials]
    tasks = [
        {"model": model, "faults": list(faults), "trials": [t.to_json() for t in fit_trials(trials, held)]}
        for model in MODELS
        for faults in ((), FAULTS)
        for held in [[t.facts.pca == pca for t in trials] for pca in pcas]
    ]
    rows = run(case, tasks, Options(journal=journal, label="fits"))
    made: list[dict[str, Any]] = [
        {"model": task["model"], "faults": task["faults"], "pca": pcas[i % len(pcas)], **row}
        for i, (task, row) in enumerate(zip(tasks, rows, strict=True))
    ]
    if out is not None:
        write_json(out, made)
    heads = ["model", "set", *(f"pCa {pca:g}" for pca in pcas), "all", "training"]
    print("| " + " | ".join(heads) + " |\n|" + "---|" * len(heads))
    for model in MODELS:
        mine = [row for row in made if row["model"] == model]
        plain, faulty = [r for r in mine if not r["faults"]], [r for r in mine if r["faults"]]
        for label, chosen, which, key in (
            ("given", plain, "given", "held_out"),
            ("given, calibrated", plain, "given", "calibrated"),
            ("fitted", plain, "fitted", "held_out"),
            ("fitted, calibrated", plain, "fitted", "calibrated"),
            ("fitted with artefacts, calibrated", faulty, "fitted", "calibrated"),
        ):
            held = [row[which][key] for row in chosen]
            train = [row[which]["training"] for row in chosen]
            cells = [*held, float(np.sqrt(np.mean(np.square(held)))), float(np.sqrt(np.mean(np.square(train))))]
            print("| " + " | ".join([model, label, *(f"{100.0 * cell:.2f}" for cell in cells)]) + " |")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path, help="bags of the fibre's stretch-shortening-stretch recordings")
    parser.add_argument("--out", type=Path)
    parser.add_argument("--journal", type=Path)
    given = parser.parse_args()
    main(given.folder, given.out, given.journal)
