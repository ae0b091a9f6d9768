"""A trial with known numbers, and tables of it as laboratories write them."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from xb_muscle_ros.trials.importing import Failed, Imported, import_recordings
from xb_muscle_ros.trials.readers.settings import ImportSettings
from xb_muscle_ros.trials.trial import Array, Trial

N = 120
TIME_S = np.arange(N) / 1000
LENGTH_MM = np.round(1.2 * np.interp(TIME_S, [0.04, 0.08], [1.0, 1.04]), 6)
FORCE_MN = np.round(0.5 + 0.2 * np.sin(40.0 * TIME_S), 6)
NAMES = ("time_s", "length_mm", "force_mN")
COLUMNS: dict[str, Any] = {
    "time": {"column": "time_s", "unit": "s"},
    "length": {"column": "length_mm", "unit": "mm"},
    "force": {"column": "force_mN", "unit": "mN"},
}


def rows(*columns: Iterable[float], delimiter: str = ",", decimal: str = ".") -> list[str]:
    """Lines of the columns, by default the trial's."""
    made = columns or (TIME_S, LENGTH_MM, FORCE_MN)
    cells = zip(*(np.asarray(column).tolist() for column in made), strict=True)
    return [delimiter.join(repr(value).replace(".", decimal) for value in row) for row in cells]


def write(folder: Path, lines: Sequence[str] | bytes, name: str = "t.csv") -> Path:
    """A file of lines, or of bytes."""
    folder.mkdir(exist_ok=True)
    path = folder / name
    path.write_bytes(lines if isinstance(lines, bytes) else "\n".join(lines).encode())
    return path


def run(path: Path, columns: dict[str, Any] | None = None, **keys: Any) -> list[Imported | Failed]:
    """What importing a file gives; keys that are None are left out."""
    given = {"fibre": "fb", "f0": "1 mN", "pca": 6.1, "columns": COLUMNS if columns is None else columns, **keys}
    settings = ImportSettings({key: value for key, value in given.items() if value is not None}, "here")
    made = list(import_recordings([path], settings, path.parent / "bags"))
    return [event for event in made if isinstance(event, (Imported, Failed))]


def trials(path: Path, columns: dict[str, Any] | None = None, **keys: Any) -> list[Trial]:
    """Trials of a file that is imported whole."""
    events = run(path, columns, **keys)
    assert all(isinstance(event, Imported) for event in events), events
    return [event.trial for event in events if isinstance(event, Imported)]


def refusal(path: Path, columns: dict[str, Any] | None = None, **keys: Any) -> str:
    """Why a file is refused, on one line."""
    (event,) = run(path, columns, **keys)
    assert isinstance(event, Failed), event
    assert "\n" not in event.why
    assert str(path) in event.why
    assert not (path.parent / "bags").exists()
    return event.why


def same(found: Trial, length_mm: Array = LENGTH_MM, force_mn: Array = FORCE_MN, time_s: Array = TIME_S) -> None:
    """The trial, to the last digit of what the file has."""
    assert found.time_s == pytest.approx(time_s, abs=1e-9)
    assert (found.length_m / 1e-3).tolist() == pytest.approx(length_mm.tolist(), rel=1e-14)
    assert (found.force_n / 1e-3).tolist() == pytest.approx(force_mn.tolist(), rel=1e-14)


def told(found: Trial) -> str:
    """All warnings of a trial."""
    return "\n".join(found.warnings)
