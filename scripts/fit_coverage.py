"""Fit made data again and again: held-out error, and how often intervals hold the truth.

Each case takes the released set of one of seven fibres, changes every fitted parameter by a random factor (SD 15 %),
lets it make trials (distribution method or Gaussian form) with noise like the real one, and fits either form from the
released set. With --errors ordinary errors of the measurement, drawn from their priors, are in all trials, and are
fitted beside the parameters (fitted) or not (ignored).
"""

from __future__ import annotations

import argparse
import time
from dataclasses import replace
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np

from xb_muscle_ros.files import write_json
from xb_muscle_ros.fit.coordinates import FITTED, Choice, fault_coordinates, parameter_coordinates
from xb_muscle_ros.fit.data import fit_trials
from xb_muscle_ros.fit.problem import Problem
from xb_muscle_ros.fit.report import as_json
from xb_muscle_ros.fit.run import Settings, fit
from xb_muscle_ros.measurement.artefacts import ARTEFACTS, ORDINARY, Scope
from xb_muscle_ros.models.fibre_file import load_fibre
from xb_muscle_ros.models.muscle import Muscle
from xb_muscle_ros.simulation.made import made
from xb_muscle_ros.trials.protocol import StretchShortenStretch
from xb_muscle_ros.trials.trial import Trial
from xb_muscle_ros.work import Options, run

FIBRES = ("13Dec2017a", "13Dec2017b", "14Dec2017b", "18Dec2017a", "18Dec2017b", "19Dec2017a", "7Aug2018a")
PCAS = (4.5, 6.1, 6.2, 6.3, 6.4, 6.6)
# The paper's two protocols for the fit; others are held out.
TRAINING = ((0.0383, 0.1), (0.0, 0.001))
HELD_OUT = ((0.0383, 0.001), (0.0121, 0.316), (0.0682, 0.01))
CHANGE = 0.15
# By the grid the truth is made more finely than it is fitted (200 bins, the default, one step per sample).
FITTED_GRID = {"bins": 200.0, "strain_range": 15.0, "regrid": 1.0}
TRUE_GRID = {**FITTED_GRID, "bins": 301.0}
TRUE_SUBSTEPS = 4


def case(task: dict[str, Any]) -> dict[str, Any]:
    """One made fibre, fitted; errors and intervals."""
    random = np.random.default_rng(task["seed"])
    released = load_fibre(FIBRES[task["seed"] % len(FIBRES)])
    values = {**released.values, "smoothing": task["smoothing"] * released.values["smoothing"]}
    start = replace(released, values=MappingProxyType(values))
    names = [n for n in FITTED if n in values]
    true = {**values, **{n: values[n] * float(np.exp(CHANGE * random.normal())) for n in names}}
    if task["truth"] != "gaussian":
        true |= TRUE_GRID
    if task["method"] != "gaussian":
        start = replace(start, method=task["method"], values=MappingProxyType({**values, **FITTED_GRID}))
    truth = replace(start, values=MappingProxyType(true), method=task["truth"])
    muscle = Muscle(truth)
    trials, held = [], []
    substeps = 1 if task["truth"] == "gaussian" else TRUE_SUBSTEPS
    for protocols, out in ((TRAINING, False), (HELD_OUT, True)):
        for amplitude, recovery in protocols:
            for pca in task["pcas"]:
                given = StretchShortenStretch(amplitude, recovery).trial("made", pca)
                trials.append(made(muscle, given, random, substeps=substeps))
                held.append(out)
    if task["errors"]:
        trials = _with_errors(trials, muscle, random, substeps)
    # Nothing but the data may say where the truth lies: no priors.
    choices = {n: Choice(prior_sd=float("inf")) for n in names}
    prepared = fit_trials(trials, held)
    coordinates = parameter_coordinates(start, None, (), {}, choices)
    if task["errors"] == "fitted":
        seen = [t for t in prepared if not t.held_out]
        coordinates += fault_coordinates(ORDINARY, [t.name for t in seen], [t.solution for t in seen], {})
    problem = Problem(start, prepared, coordinates, {})
    settings = Settings(starts=1, level=0.95 if task["intervals"] else None)
    begin = time.perf_counter()
    fitted = fit(problem, settings, Options(processes=0, quiet=True))
    seconds = time.perf_counter() - begin
    found = as_json(fitted, {})
    rows = [
        {
            "name": row["name"],
            "true": true[row["name"]],
            "value": row["value"],
            "interval": row.get("interval"),
            "held": row["interval"][0] <= true[row["name"]] <= row["interval"][1],
            "closed": row.get("interval_closed"),
        }
        for row in found["parameters"]
        if row["group"] is None
    ]
    clean = [made(muscle, t, random, 0.0, substeps).measured_f0 for t, h in zip(trials, held, strict=True) if h]
    # The model's own error: at the stated calcium, as the clean force is.
    own = np.where([c.group is None for c in problem.coordinates], fitted.best.z, 0.0)
    force = [f for f, t in zip(problem.predicted(own), problem.trials, strict=True) if t.held_out]
    inside = [np.isin(t.time_s, p.force_time_s) for t, p in _pairs(trials, problem) if p.held_out]
    errors = [float(np.sqrt(np.mean((a - b[i]) ** 2))) for a, b, i in zip(force, clean, inside, strict=True)]
    return {
        "fibre": start.name,
        "train_rmsd_f0": found["train_rmsd_f0"],
        "heldout_rmsd_f0": found["heldout_rmsd_f0"],
        "heldout_error_f0": float(np.sqrt(np.mean(np.square(errors)))),
        "parameters": rows,
        "mismatch_f0": fitted.mismatch_f0,
        "seconds": seconds,
        "warnings": found["warnings"],
    }


def _with_errors(trials: list[Trial], muscle: Muscle, random: np.random.Generator, substeps: int) -> list[Trial]:
    """The trials made anew, with ordinary errors of the measurement drawn from their priors."""
    study = {n: ARTEFACTS[n].sd * random.normal() for n in ORDINARY if ARTEFACTS[n].scope is Scope.STUDY}
    shifts = {t.facts.pca: ARTEFACTS["pca_shift"].sd * random.normal() for t in trials}
    anew = []
    for order, trial in enumerate(trials):
        given = replace(trial, force_time_s=np.empty(0), force_n=np.empty(0))
        # How much has run down depends on the order, which a single trial does not know.
        errors = {**study, "run_down": 0.0, "pca_shift": shifts[trial.facts.pca]}
        found = made(muscle, given, random, substeps=substeps, **errors)
        left = (1.0 - study["run_down"]) ** order
        offset = ARTEFACTS["force_offset"].sd * random.normal()
        anew.append(replace(found, force_n=left * found.force_n + offset * found.facts.f0_n))
    return anew


def _pairs(trials: list[Any], problem: Problem) -> Any:
    return zip(trials, problem.trials, strict=True)


def main(cases: int, shared: dict[str, Any], out: Path, journal: Path | None) -> None:
    """Run the cases and print what came of them."""
    tasks = [{"seed": seed, **shared} for seed in range(cases)]
    done = run(case, tasks, Options(journal=journal, label="cases"))
    write_json(out, done)
    held = np.array([c["heldout_rmsd_f0"] for c in done])
    error = np.array([c["heldout_error_f0"] for c in done])
    print(f"{cases} cases, made by {shared['truth']}, fitted by {shared['method']}")
    print(f"held-out RMSD, noise included: median {100 * np.median(held):.3f} %, largest {100 * held.max():.3f} % F0")
    print(
        f"held-out error, noise left out: median {100 * np.median(error):.3f} %, largest {100 * error.max():.3f} % F0"
    )
    seconds = np.array([c["seconds"] for c in done])
    print(f"seconds per fit, one process: median {np.median(seconds):.1f}, most {seconds.max():.1f}")
    if not (shared["intervals"] or shared["errors"]):
        return
    total, inside = 0, 0
    for name in dict.fromkeys(row["name"] for c in done for row in c["parameters"]):
        rows = [row for c in done for row in c["parameters"] if row["name"] == name]
        n = sum(row["held"] for row in rows)
        total, inside = total + len(rows), inside + n
        width = np.median([row["interval"][1] / row["interval"][0] for row in rows])
        off = np.median([abs(row["value"] / row["true"] - 1.0) for row in rows])
        how_often = f"95 % interval holds the truth in {n} of {len(rows)}"
        print(f"  {name:6s} {how_often}; median width x{width:.3f}, error {100 * off:.2f} %")
    print(f"all: {100.0 * inside / total:.1f} % of {total} intervals")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cases", type=int, default=50)
    parser.add_argument("--truth", choices=("gaussian", "characteristics"), default="gaussian")
    parser.add_argument("--method", choices=("gaussian", "characteristics"), default="gaussian", help="of the fit")
    parser.add_argument("--pca", nargs="+", type=float, default=list(PCAS))
    parser.add_argument("--smooth", action="store_true", help="truth and fit with the released sets' smoothing")
    parser.add_argument(
        "--no-intervals", action="store_true", help="no profiles; with --errors intervals are those of the curvature"
    )
    parser.add_argument(
        "--errors", choices=("fitted", "ignored"), help="ordinary errors of the measurement in all trials"
    )
    parser.add_argument("--out", type=Path, default=Path("out/coverage.json"))
    parser.add_argument("--journal", type=Path)
    given = parser.parse_args()
    chosen = {"truth": given.truth, "method": given.method, "pcas": given.pca, "intervals": not given.no_intervals}
    chosen |= {"smoothing": float(given.smooth), "errors": given.errors}
    main(given.cases, chosen, given.out, given.journal)
