"""What a diagnosis writes beside its record: augmented fibre files, and the next experiment's bag."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from xb_muscle_ros.diagnose.report import output
from xb_muscle_ros.diagnose.report.traces import TrialTraces
from xb_muscle_ros.diagnose.result import Diagnosis
from xb_muscle_ros.files import matching
from xb_muscle_ros.models.fibre_file import Fibre
from xb_muscle_ros.models.fibre_writing import write_fibre
from xb_muscle_ros.trials.bag_files import remove_results
from xb_muscle_ros.trials.bag_writing import write_trial
from xb_muscle_ros.trials.trial import Trial

AUGMENTED, NEXT = "augmented", "next_experiment"


@dataclass(frozen=True)
class Files:
    """What goes into files beside the record.

    Attributes:
        augmented: fibres with the answer's mechanisms, by file name.
        traces: of every trial.
        protocol: the next experiment in the first fibre's units; None where there is none.
    """

    augmented: Mapping[str, Fibre]
    traces: tuple[TrialTraces, ...]
    protocol: Trial | None


def augmented_name(fibre: str, several: bool) -> str:
    """File of an augmented fibre."""
    return f"{AUGMENTED}_{re.sub(r'[^A-Za-z0-9._-]', '_', fibre)}.yaml" if several else f"{AUGMENTED}.yaml"


def older_results(out: Path) -> list[Path]:
    """What an older diagnosis left in a folder; not its journal, which holds what is computed already."""
    files = matching(out, r"diagnosis\.json", rf"{AUGMENTED}(_[^/]+)?\.yaml", r"traces\.npz", r"report\.html")
    return [*files, *([out / NEXT] if (out / NEXT).is_dir() else [])]


def write(out: Path, d: Diagnosis, made: Files, report: bool = True) -> None:
    """Write all files of a diagnosis in the place of an older one's; each appears whole or not at all.

    Raises:
        UserError: the folder cannot be written.
    """
    remove_results(older_results(out))
    for name, fibre in made.augmented.items():
        write_fibre(
            out / name,
            fibre,
            [
                f"Model of fibre {fibre.name} with what a diagnosis found missing; see diagnosis.json beside it.",
                "The fit also moved ordinary measurement errors, which no model has; they are in diagnosis.json.",
            ],
        )
    if made.protocol is not None:
        write_trial(out / NEXT, made.protocol)
    output.write(out, d, made.traces, report)
