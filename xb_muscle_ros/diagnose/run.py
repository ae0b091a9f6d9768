"""A whole diagnosis: from bags to `diagnosis.json`, the augmented fibre files and the report."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from types import MappingProxyType

from xb_muscle_ros.diagnose.effort import QUICK, Effort
from xb_muscle_ros.diagnose.error_sds import error_sd_lines
from xb_muscle_ros.diagnose.feature_tables import FeatureTable, read_features
from xb_muscle_ros.diagnose.featuring import with_features
from xb_muscle_ros.diagnose.intake import FibreStudy, given_twice, read_fibres
from xb_muscle_ros.diagnose.outputs import Files, write
from xb_muscle_ros.diagnose.recording import recorded
from xb_muscle_ros.diagnose.result import Diagnosis
from xb_muscle_ros.diagnose.searching import fit_base, search
from xb_muscle_ros.trials.completing import Known
from xb_muscle_ros.work import Options


def diagnose_bags(
    bags: Sequence[str | Path],
    fibers: Sequence[str | Path] | str | Path,
    out: Path,
    quick: bool = False,
    seed: int = 1,
    model: str | None = None,
    method: str | None = None,
    options: Options | None = None,
    report: bool = True,
    known: Known | None = None,
    only: str | None = None,
    features: Path | None = None,
    predict: Path | None = None,
    error_sds: Mapping[str, float] = MappingProxyType({}),
) -> Diagnosis:
    """Diagnose the trials of some bags and write what was found.

    Args:
        bags: bags or folders of bags, in the order of recording.
        fibers: fibre files or names: where the base models start; with several, bags are found by the fibre's name.
        out: folder for `diagnosis.json`, augmented fibre files, `report.html`, `traces.npz` and the next experiment's
            bag.
        quick: look less hard.
        seed: of the bootstrap.
        model: of the fibre files; their own where None.
        method: of the fibre files; their own where None.
        options: where work is done; finished work is kept in `out`.
        report: write the page as well.
        known: what is known of L0 and F0 beside bags and fibre files.
        only: with one fibre: take trials of this fibre and no other.
        features: table of measured SRS and isometric force to be met beside the traces.
        predict: table of measured SRS and isometric force to be predicted, never fitted.
        error_sds: standard deviations of ordinary measurement errors that are not those of the table, by name.

    Raises:
        UserError: bags that cannot be read or do not belong together, no force, no solution at the start.
    """
    files = [fibers] if isinstance(fibers, (str, Path)) else list(fibers)
    studies = read_fibres(bags, files, model, method, known, only)
    trials = {s.fibre.name: s.trials for s in studies}
    data, table = (None if path is None else read_features(path, trials) for path in (features, predict))
    options = options or Options(processes=0, quiet=True)
    options = replace(options, journal=options.journal or out / "journal.jsonl")
    found, made = diagnose(studies, QUICK if quick else Effort(), seed, options, data, table, error_sds)
    found = replace(found, notes=(*found.notes, *given_twice(bags)))
    write(out, found, made, report)
    return found


def diagnose(
    studies: Sequence[FibreStudy],
    effort: Effort,
    seed: int,
    options: Options,
    data: FeatureTable | None = None,
    table: FeatureTable | None = None,
    error_sds: Mapping[str, float] = MappingProxyType({}),
) -> tuple[Diagnosis, Files]:
    """Diagnose a study of one fibre or of several.

    Args:
        studies: fibres with their trials.
        effort: how hard to look.
        seed: of the bootstrap.
        options: where work is done.
        data: features to be met beside the traces.
        table: features to be predicted, never fitted.
        error_sds: see `diagnose_bags`.

    Returns:
        what was found, and what goes into files beside it.

    Raises:
        UserError: see `diagnose_bags`.
    """
    begun = time.monotonic()
    lines = error_sd_lines(error_sds)
    features = {} if data is None else data.features
    study = search(fit_base(studies, effort, seed, options, features, error_sds), effort.folds)
    found, made = recorded(study, effort, seed)
    found = replace(found, notes=(*found.notes, *lines))
    for given, fitted in ((data, True), (table, False)):
        if given is not None:
            found = with_features(found, study, given, fitted)
    return replace(found, seconds=time.monotonic() - begun), made
