"""A whole diagnosis: from trials to the record, and what goes into files beside it."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from types import MappingProxyType

from xb_muscle_ros.diagnose.effort import QUICK, Effort
from xb_muscle_ros.diagnose.error_sds import error_sd_lines
from xb_muscle_ros.diagnose.feature_tables import read_features
from xb_muscle_ros.diagnose.featuring import with_features
from xb_muscle_ros.diagnose.intake import FibreStudy
from xb_muscle_ros.diagnose.outputs import Files
from xb_muscle_ros.diagnose.recording import recorded
from xb_muscle_ros.diagnose.result import Diagnosis
from xb_muscle_ros.diagnose.searching import fit_base, search
from xb_muscle_ros.work import Options


def diagnose(
    studies: Sequence[FibreStudy],
    quick: bool,
    seed: int,
    options: Options,
    features: str | Path | None = None,
    predict: str | Path | None = None,
    error_sds: Mapping[str, float] = MappingProxyType({}),
) -> tuple[Diagnosis, Files]:
    """Diagnose a study of one fibre or of several.

    Args:
        features: table of measured SRS and isometric force to be met beside the traces.
        predict: such a table to be predicted, never fitted.
        error_sds: standard deviations of ordinary measurement errors that are not those of the table, by name.

    Returns:
        what was found, and what goes into files beside it.

    Raises:
        UserError: a table or SD that cannot be used, no solution at the start.
    """
    begun = time.monotonic()
    lines = error_sd_lines(error_sds)
    trials = {study.fibre.name: study.trials for study in studies}
    met, told = (None if path is None else read_features(path, trials) for path in (features, predict))
    effort = QUICK if quick else Effort()
    study = search(fit_base(studies, effort, seed, options, {} if met is None else met.features, error_sds))
    found, made = recorded(study, effort, seed)
    found = replace(found, notes=(*found.notes, *lines))
    for table, fitted in ((met, True), (told, False)):
        if table is not None:
            found = with_features(found, study, table, fitted)
    return replace(found, seconds=time.monotonic() - begun), made
