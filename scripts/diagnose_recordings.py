"""Diagnose real recordings: what differs, what explains it, and how well that predicts held-out trials.

For each case (see `recorded_cases`) the recordings are imported, the training trials are diagnosed, and the
held-out ones are predicted by the base and by the answer's augmented fibre. Cases can be run one by one: one that is
done is kept, one that was interrupted goes on from its journal. Each leaves in <out>/<case> what `xb_muscle diagnose`
writes, `start*.yaml` and `base*.yaml` (where the model started, and the fitted base) and `predictions.json`. Figures go
to --images, the page to --page; sections of cases that are not in <out> stay as they are on the page.
"""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from recorded_cases import CASES, Case
from recorded_figures import write_figure
from recorded_page import write_page
from recorded_predictions import base_fibre, predictions, warned_beforehand
from recorded_trials import chosen

from xb_muscle_ros.cli.common import add_work, work_options_of
from xb_muscle_ros.diagnose.intake import FibreStudy
from xb_muscle_ros.diagnose.outputs import JSON, read, write
from xb_muscle_ros.diagnose.result import Diagnosis
from xb_muscle_ros.diagnose.run import diagnose
from xb_muscle_ros.errors import UserError
from xb_muscle_ros.files import replaced, write_json, write_text
from xb_muscle_ros.fit.coordinates import parameter_coordinates
from xb_muscle_ros.fit.data import fit_trials
from xb_muscle_ros.fit.problem import Problem
from xb_muscle_ros.fit.run import Settings, fit
from xb_muscle_ros.models.fibre_file import Fibre, load_fibre
from xb_muscle_ros.models.fibre_writing import write_fibre
from xb_muscle_ros.trials.bags import find_bags, read_trial
from xb_muscle_ros.trials.between_samples import with_corners
from xb_muscle_ros.trials.importing import Failed, import_recordings
from xb_muscle_ros.trials.readers.mapping import load_mapping
from xb_muscle_ros.trials.readers.settings import ImportSettings
from xb_muscle_ros.trials.trial import Trial
from xb_muscle_ros.work import Options

_MAPPINGS = Path(__file__).parent / "datasets"


def main() -> int:
    """Run the cases that were asked for."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--only", nargs="*", type=_case, metavar="CASE", help=f"of {', '.join(CASES)}; default: all")
    parser.add_argument("--recordings", type=Path, nargs="+", default=[Path("../shared/data/recordings")])
    parser.add_argument("--features", type=Path, default=Path("../shared/data/empirical_srs.json"), help="table of SRS")
    parser.add_argument("--out", type=Path, default=Path("out/recordings"))
    parser.add_argument("--images", type=Path, default=Path("docs/images"))
    parser.add_argument("--page", type=Path, default=Path("docs/recordings.md"))
    parser.add_argument("--quick", action="store_true", help="look less hard")
    parser.add_argument("--again", action="store_true", help="also cases that are done")
    parser.add_argument("--page-only", action="store_true", help="run nothing: page and figures of what is done")
    add_work(parser)
    given = parser.parse_args()
    failed = 0
    for case in [] if given.page_only else given.only or CASES.values():
        folder = given.out / case.key
        try:
            if given.again:
                forget(folder)
            if not (folder / "predictions.json").exists():
                table = given.features if case.features else None
                run_case(case, given.recordings, table, folder, given.quick, work_options_of(given))
        except UserError as error:
            print(f"{case.key}: {error}", file=sys.stderr)
            failed += 1
    done = [(c, given.out / c.key) for c in CASES.values() if (given.out / c.key / "predictions.json").exists()]
    for case, folder in done:
        if not case.pooled or case.held_out:
            print(write_figure(folder, given.images / f"recorded_{case.key}.png"))
    page = write_page(done, os.path.relpath(given.images, given.page.parent), _text(given.page))
    write_text(given.page, page)
    print(given.page)
    return min(failed, 1)


def _case(key: str) -> Case:
    """A case by its key; argparse's own choices do not allow for none."""
    if key not in CASES:
        raise argparse.ArgumentTypeError(f"'{key}' is no case; known: {', '.join(CASES)}")
    return CASES[key]


def _text(path: Path) -> str:
    return path.read_text(encoding="utf-8") if path.is_file() else ""


def forget(folder: Path) -> None:
    """Remove what a case found, and its journal; its bags stay."""
    for name in (JSON, "predictions.json", "journal.jsonl"):
        (folder / name).unlink(missing_ok=True)


def run_case(
    case: Case, recordings: Sequence[Path], features: Path | None, folder: Path, quick: bool, options: Options
) -> None:
    """Import, diagnose and predict, as far as that is not done.

    Raises:
        UserError: recordings are absent or cannot be read, or none of them are those of the case.
    """
    trials = imported(case, recordings, folder / "bags")
    training, held_out = chosen(trials, case.training), {n: chosen(trials, p) for n, p in case.held_out.items()}
    absent = [p for p in (*case.training, *sum(case.held_out.values(), ())) if not chosen(trials, [p])]
    if absent:
        raise UserError(f"no recording of {', '.join(absent)}; name all folders of recordings with --recordings")
    if not (folder / JSON).exists():
        diagnose_training(case, training, features, folder, quick, replace(options, journal=folder / "journal.jsonl"))
    d = read(folder)
    bases = [base_fibre(load_fibre(folder / _file("start", name, d)), d) for name in d.fibres]
    for base in bases:
        write_fibre(folder / _file("base", base.name, d), base, ["The base of the diagnosis beside it, as fitted."])
    rows, arrays = predictions(d, folder, bases, held_out, case.alike)
    for row in rows:
        row["warned"] = warned_beforehand(d, row["fibre"])
    with replaced(folder / "predictions.npz") as temporary, temporary.open("wb") as file:
        np.savez_compressed(file, **arrays)
    write_json(folder / "predictions.json", {"format_version": 2, "case": case.key, "held_out": rows})


def _file(kind: str, fibre: str, d: Diagnosis) -> str:
    return f"{kind}_{fibre}.yaml" if len(d.fibres) > 1 else f"{kind}.yaml"


def diagnose_training(
    case: Case, training: Sequence[Trial], features: Path | None, folder: Path, quick: bool, options: Options
) -> None:
    """Diagnose the training trials, each fibre from its own start, and write what was found."""
    names = list(dict.fromkeys(t.facts.fibre for t in training))
    studies = []
    for name in names:
        own = tuple(t for t in training if t.facts.fibre == name)
        if len(own) < 3:
            raise UserError(f"{len(own)} trials of fibre {name} are to be diagnosed; needed are 3")
        start = case.start(own)
        if case.prefit:
            start = fitted(start, own, options, starts=3 if quick else 6)
        write_fibre(
            folder / (f"start_{name}.yaml" if len(names) > 1 else "start.yaml"),
            start,
            ["Where the base of the diagnosis beside it started."],
        )
        studies.append(FibreStudy(start, own, ()))
    found, made = diagnose(studies, quick, 1, options, predict=features, error_sds=case.error_sds)
    write(folder, found, made)


def imported(case: Case, recordings: Sequence[Path], bags: Path) -> list[Trial]:
    """Trials of a case, through bags, with the corners of length between samples, and prepared."""
    found: list[Trial] = []
    for source in case.imports:
        files = sorted(file for folder in recordings for file in folder.glob(source.pattern))
        if not files:
            raise UserError(f"no {source.pattern} in {', '.join(map(str, recordings))}; name the folder (--recordings)")
        path = _MAPPINGS / f"{source.mapping}.yaml"
        overrides = {"fibre": source.fibre} if source.fibre else None
        settings = ImportSettings(load_mapping(path), f"mapping {path}", overrides=overrides)
        folder = bags / (source.fibre or source.mapping)
        for event in import_recordings(files, settings, folder):
            if isinstance(event, Failed):
                raise UserError(event.why)
        # The 100 s ramps have steps of 5 s, which commands refuse in bags; the mapping file allows them by name.
        found += [case.prepare(with_corners(read_trial(bag))) for bag in find_bags([folder])]
    return found


def fitted(fibre: Fibre, trials: Sequence[Trial], options: Options, starts: int) -> Fibre:
    """The fibre with the base model's parameters fitted to trials from several starts."""
    coordinates = parameter_coordinates(fibre, None, (), {}, {})
    problem = Problem(fibre, fit_trials(trials, [False] * len(trials), whole=True), coordinates, {})
    return problem.fibre_at(fit(problem, Settings(starts=starts, level=None), options).best.z)


if __name__ == "__main__":
    sys.exit(main())
