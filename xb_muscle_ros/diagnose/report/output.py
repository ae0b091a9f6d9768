"""The files of a diagnosis that its record makes: `diagnosis.json`, `traces.npz` and `report.html`."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from xb_muscle_ros.diagnose.report.codec import from_json, to_json
from xb_muscle_ros.diagnose.report.glossary import how
from xb_muscle_ros.diagnose.report.prose import headline, summary
from xb_muscle_ros.diagnose.report.traces import TrialTraces, read_traces, write_traces
from xb_muscle_ros.diagnose.result import Diagnosis
from xb_muscle_ros.errors import UserError
from xb_muscle_ros.files import write_json, write_text

JSON, TRACES, PAGE = "diagnosis.json", "traces.npz", "report.html"


def write(out: Path, d: Diagnosis, traces: Sequence[TrialTraces], page: bool = True) -> None:
    """Write all files; each appears whole or not at all.

    Args:
        out: folder, made where there is none.
        d: the diagnosis.
        traces: of its trials.
        page: whether to draw `report.html`, which takes some seconds.

    Raises:
        UserError: the folder cannot be written.
    """
    text = _page(d, traces) if page else None
    write_traces(out / TRACES, traces)
    write_json(out / JSON, as_row(d))
    if text is not None:
        write_text(out / PAGE, text)


def as_row(d: Diagnosis) -> dict[str, Any]:
    """What `diagnosis.json` holds: the record, and for its readers what was made of it in words."""
    row = to_json(d)
    return {"headline": headline(d), "summary": " ".join(summary(d)), **row, "how": how()}


def read(folder: Path) -> Diagnosis:
    """The diagnosis of a folder.

    Raises:
        UserError: its file is missing, damaged or of an older version.
    """
    path = folder / JSON
    try:
        row = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError, json.JSONDecodeError) as error:
        raise UserError(f"{path} cannot be read: {error}; give a folder that xb_muscle diagnose wrote") from error
    return from_json(row, str(path))


def write_page(folder: Path) -> Path:
    """Draw the page of a folder anew from its other two files.

    Returns:
        path of the page.

    Raises:
        UserError: one of them is missing or damaged, or the folder cannot be written.
    """
    write_text(folder / PAGE, _page(read(folder), read_traces(folder / TRACES)))
    return folder / PAGE


def _page(d: Diagnosis, traces: Sequence[TrialTraces]) -> str:
    # Templates and figures take long to load; whoever only reads a diagnosis needs neither.
    from xb_muscle_ros.diagnose.report.html import as_html

    return as_html(d, traces)
