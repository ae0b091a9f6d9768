"""Diagnose real recordings: what differs, what explains it, and how well that predicts trials that were concealed.

For each case (see `recorded_cases`) the recordings are imported, a base model is fitted to the trials that are shown,
these are diagnosed, and the concealed ones are predicted by the base, by the answer and by every rival that was fitted.
A case that is done is kept; fits of one that was interrupted are taken from its journal. Numbers go to
<out>/<case>/predictions.json beside what `xb_muscle diagnose` writes, figures to --images, all of it
to --page.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from recorded_cases import CASES, Case, chosen
from recorded_figures import write_figure
from recorded_page import write_page

from xb_muscle_ros.diagnose.closure import by_distribution
from xb_muscle_ros.diagnose.mismatch import simulated
from xb_muscle_ros.diagnose.outcome import Outcome, write
from xb_muscle_ros.diagnose.plain import as_json
from xb_muscle_ros.diagnose.refit import heldout_force
from xb_muscle_ros.diagnose.run import diagnose
from xb_muscle_ros.diagnose.search import QUICK, Effort, penalised
from xb_muscle_ros.diagnose.study import Study
from xb_muscle_ros.distribution.gaussian import Gaussian
from xb_muscle_ros.errors import UserError
from xb_muscle_ros.files import replaced, write_text
from xb_muscle_ros.fit.coordinates import parameter_coordinates
from xb_muscle_ros.fit.data import fit_trials
from xb_muscle_ros.fit.problem import Problem
from xb_muscle_ros.fit.run import Settings, fit
from xb_muscle_ros.models.fibre_file import Fibre
from xb_muscle_ros.trials.bags import find_bags, read_trial
from xb_muscle_ros.trials.importing import Failed, import_recordings
from xb_muscle_ros.trials.readers.mapping import load_mapping
from xb_muscle_ros.trials.readers.settings import ImportSettings
from xb_muscle_ros.trials.trial import Trial
from xb_muscle_ros.work import Options

Array = npt.NDArray[np.float64]

_MAPPINGS = Path(__file__).parent / "datasets"
# Rivals whose predictions of concealed trials are kept.
_RIVALS = 6


def main() -> int:
    """Run the cases that were asked for."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("cases", nargs="*", type=_case, metavar="CASE", help=f"of {', '.join(CASES)}; default: all")
    parser.add_argument("--recordings", type=Path, nargs="+", default=[Path("../shared/data/recordings")])
    parser.add_argument("--out", type=Path, default=Path("out/recordings"))
    parser.add_argument("--images", type=Path, default=Path("docs/images"))
    parser.add_argument("--page", type=Path, default=Path("docs/recordings.md"))
    parser.add_argument("--quick", action="store_true", help="look less hard")
    parser.add_argument("--again", action="store_true", help="also cases that are done")
    given = parser.parse_args()
    for case in given.cases or CASES.values():
        folder = given.out / case.key
        try:
            if given.again or not (folder / "predictions.json").exists():
                run_case(case, given.recordings, folder, given.quick)
        except UserError as error:
            print(f"{case.key}: {error}", file=sys.stderr)
            continue
        print(write_figure(folder, given.images / f"recorded_{case.key}.png"))
    done = [
        (c.key, c.about, given.out / c.key) for c in CASES.values() if (given.out / c.key / "predictions.json").exists()
    ]
    write_text(given.page, write_page(done, os.path.relpath(given.images, given.page.parent)))
    print(given.page)
    return 0


def _case(key: str) -> Case:
    """A case by its key; argparse's own choices do not allow for none."""
    if key not in CASES:
        raise argparse.ArgumentTypeError(f"'{key}' is no case; known: {', '.join(CASES)}")
    return CASES[key]


def run_case(case: Case, recordings: Sequence[Path], folder: Path, quick: bool) -> None:
    """Import, fit, diagnose and predict.

    Raises:
        UserError: recordings are absent or cannot be read.
    """
    trials = [case.prepare(t) for t in imported(case, recordings, folder / "bags")]
    shown = chosen(trials, case.shown)
    if len(shown) < 3:
        raise UserError(f"{len(shown)} of the trials that are to be diagnosed are among the recordings; needed are 3")
    options = Options(journal=folder / "journal.jsonl")
    base = case.start(shown)
    if case.prefit:
        base = fitted(base, shown, options, starts=3 if quick else 6)
    outcome = diagnose(shown, base, QUICK if quick else Effort(), 1, options)
    write(folder, outcome, as_json(outcome, quick))
    concealed = {name: chosen(trials, patterns) for name, patterns in case.concealed.items()}
    rows, arrays = predictions(outcome, concealed)
    with replaced(folder / "predictions.npz") as temporary, temporary.open("wb") as file:
        np.savez_compressed(file, **arrays)  # type: ignore[arg-type]
    found = {
        "case": case.key,
        "shown": [t.facts.trial for t in shown],
        "answer": outcome.shown.explanation.label,
        "best_found": outcome.search.final.explanation.label,
        "start": dict(base.values),
        "concealed": rows,
    }
    write_text(folder / "predictions.json", json.dumps(found, indent=1) + "\n")


def imported(case: Case, recordings: Sequence[Path], bags: Path) -> list[Trial]:
    """Trials of a case, through bags."""
    for name, pattern in case.imports:
        files = sorted(file for folder in recordings for file in folder.glob(pattern))
        if not files:
            raise UserError(f"no {pattern} in {', '.join(map(str, recordings))}; name the folder with --recordings")
        path = _MAPPINGS / f"{name}.yaml"
        settings = ImportSettings(load_mapping(path), f"mapping {path}")
        for event in import_recordings(files, settings, bags):
            if isinstance(event, Failed):
                raise UserError(event.why)
    return [read_trial(bag) for bag in find_bags([bags])]


def fitted(fibre: Fibre, trials: Sequence[Trial], options: Options, starts: int) -> Fibre:
    """The fibre with the base model's parameters fitted to trials from several starts."""
    coordinates = parameter_coordinates(fibre, None, (), {}, {})
    problem = Problem(fibre, fit_trials(trials, [False] * len(trials), whole=True), coordinates, {})
    return problem.fibre_at(fit(problem, Settings(starts=starts, level=None), options).best.z)


def predictions(outcome: Outcome, concealed: dict[str, list[Trial]]) -> tuple[list[dict[str, Any]], dict[str, Array]]:
    """How well fits to the shown trials predict each concealed one, and forces of base and best explanation.

    What a trial's own measurement may be off by is estimated from its force before anything moves.
    """
    search = outcome.search
    ordered = sorted(search.fits.values(), key=penalised)
    fits = {f.explanation.label: f for f in [search.base, outcome.shown, search.final, *ordered[:_RIVALS]]}
    every = [t for group in concealed.values() for t in group]
    unseen = fit_trials(every, [False] * len(every), whole=True)
    # By the distribution itself: the Gaussian form's error is known where the base was fitted, not elsewhere.
    fibre = outcome.study.fibre
    study = Study(by_distribution(fibre) if fibre.method == Gaussian.name else fibre, unseen)
    groups = [name for name, group in concealed.items() for _ in group]
    rows: list[dict[str, Any]] = []
    arrays: dict[str, Array] = {}
    for key, f in (("before", search.base), ("after", search.final)):
        for k, force in enumerate(simulated(outcome.study, f)):
            arrays[f"s{k}_{key}_f0"] = force
    for k, trial in enumerate(outcome.study.trials):
        arrays |= {f"s{k}_time_s": trial.force_time_s, f"s{k}_measured_f0": trial.measured_f0}
    for k, (group, trial) in enumerate(zip(groups, unseen, strict=True)):
        forces = {label: heldout_force(study, f.explanation, f.values, trial) for label, f in fits.items()}
        arrays |= {f"p{k}_time_s": trial.force_time_s, f"p{k}_measured_f0": trial.measured_f0}
        for key, f in (("before", search.base), ("after", search.final)):
            force = forces[f.explanation.label]
            arrays[f"p{k}_{key}_f0"] = np.full(trial.measured_f0.size, np.nan) if force is None else force
        scores = {
            label: None if force is None else float(np.sqrt(np.mean((force - trial.measured_f0) ** 2)))
            for label, force in forces.items()
        }
        rows.append({"trial": trial.name, "tests": group, "rmsd_f0": scores})
    return rows, arrays


if __name__ == "__main__":
    sys.exit(main())
