"""The files of a diagnosis: its record, its page, traces, augmented fibres and the next experiment's bag."""

from __future__ import annotations

import contextlib
import json
import re
import shutil
import tempfile
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from xb_muscle_ros.diagnose.report.codec import from_json, to_json
from xb_muscle_ros.diagnose.report.glossary import GLOSSARY
from xb_muscle_ros.diagnose.report.prose import headline, summary
from xb_muscle_ros.diagnose.report.traces import TrialTraces, write_traces
from xb_muscle_ros.diagnose.result import Diagnosis
from xb_muscle_ros.errors import UserError
from xb_muscle_ros.files import matching, write_json, write_text
from xb_muscle_ros.models.fibre_file import Fibre
from xb_muscle_ros.models.fibre_writing import write_fibre
from xb_muscle_ros.trials.bag_files import remove_results
from xb_muscle_ros.trials.bag_writing import write_trial
from xb_muscle_ros.trials.trial import Trial

AUGMENTED, NEXT = "augmented", "next_experiment"
JSON, TRACES, PAGE = "diagnosis.json", "traces.npz", "report.html"


@dataclass(frozen=True)
class Files:
    """What goes into files beside the record.

    Attributes:
        augmented: fibres with the answer's mechanisms, by file name.
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
    """Write all files of a diagnosis, and put them in the place of an older one's once all are there.

    Raises:
        UserError: the folder cannot be written.
    """
    with _aside(out) as folder:
        _write(folder, d, made, report)
        remove_results(older_results(out))
        for path in sorted(folder.iterdir()):
            path.rename(out / path.name)


@contextlib.contextmanager
def _aside(out: Path) -> Iterator[Path]:
    """A folder within another one, gone afterwards with what is left in it."""
    try:
        out.mkdir(parents=True, exist_ok=True)
        folder = Path(tempfile.mkdtemp(prefix=".diagnosis-", dir=out))
    except OSError as problem:
        raise UserError(f"{out} cannot be written: {problem.strerror}; choose another name for --out") from problem
    try:
        yield folder
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def _write(out: Path, d: Diagnosis, made: Files, report: bool) -> None:
    for name, fibre in made.augmented.items():
        write_fibre(
            out / name,
            fibre,
            [
                f"Model of fibre {fibre.name} with what a diagnosis found missing; see diagnosis.json beside it.",
                "The fit also moved ordinary measurement artefacts, which no model has; they are in diagnosis.json.",
            ],
        )
    if made.protocol is not None:
        write_trial(out / NEXT, made.protocol)
    # Templates and figures take long to load; whoever only reads a diagnosis needs neither.
    if report:
        from xb_muscle_ros.diagnose.report.html import as_html

        write_text(out / PAGE, as_html(d, made.traces))
    write_traces(out / TRACES, made.traces)
    write_json(out / JSON, as_row(d))


def as_row(d: Diagnosis) -> dict[str, Any]:
    """What `diagnosis.json` holds: the record, and for its readers what was made of it in words."""
    terms = {key: term.text for key, term in GLOSSARY.items()}
    return {"headline": headline(d), "summary": " ".join(summary(d)), **to_json(d), "glossary": terms}


def read(folder: Path) -> Diagnosis:
    """The diagnosis of a folder.

    Raises:
        UserError: its file is missing, damaged or of a format that is not read.
    """
    path = folder / JSON
    try:
        row = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError, json.JSONDecodeError) as error:
        raise UserError(f"{path} cannot be read: {error}; give a folder that xb_muscle diagnose wrote") from error
    return from_json(row, str(path))
