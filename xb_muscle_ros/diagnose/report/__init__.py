"""The report of a diagnosis: one page that needs nothing beside it, to read on a screen or on paper."""

from __future__ import annotations

from pathlib import Path

from xb_muscle_ros.diagnose.written import read_written
from xb_muscle_ros.files import write_text


def write_report(folder: Path) -> Path:
    """Write ``report.html`` beside the ``diagnosis.json`` and ``traces.npz`` that it tells of.

    Args:
        folder: where a diagnosis wrote both.

    Returns:
        path of the page; it appears whole or not at all.

    Raises:
        UserError: one of the two files is missing or damaged, or the folder cannot be written.
    """
    # Matplotlib takes long to load, and a diagnosis that fails early needs none of it.
    from xb_muscle_ros.diagnose.report.page import as_page

    path = folder / "report.html"
    write_text(path, as_page(read_written(folder)))
    return path
