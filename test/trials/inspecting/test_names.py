"""What names of files, sheets and columns tell."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from xb_muscle_ros.trials.inspecting.names import column_pattern, name_pattern, sheet_pattern


@pytest.mark.parametrize(
    ("names", "pca"),
    [
        (("run_pCa45.csv",), 4.5),
        (("run_pCa4.5.csv", "run_pCa6.csv"), 4.5),
        (("run_pCa9.csv", "run_pCa6.2.csv", "run_pCa10.csv"), 9.0),
        (("run_pCa6,2.csv",), 6.2),
        (("run_pCa62.csv", "run_pCa4.5.csv"), None),
        (("run_pCa6.2_to_pCa4.5.csv",), None),
        (("run_pca6.csv",), 6.0),
        (("a_61pCa.csv",), 6.1),
        # Regression: 4 and 1.
        (("run_pCa4_5.csv",), None),
        (("run_pCa10.csv",), 10.0),
        (("run_pCa45.csv", "run_pCa10.csv"), None),
        (("run_pCa13.csv",), None),
    ],
)
def test_pca_in_names(names: tuple[str, ...], pca: float | None) -> None:
    found = name_pattern([Path(name) for name in names])
    assert (None if found is None else found.found["pca"]) == pca


@pytest.mark.parametrize(
    ("names", "pca"),
    [
        (("pCa 6.1", "pCa 4.5"), [6.1, 4.5]),
        (("F_pCa61 (mN)", "F_pCa45 (mN)"), [6.1, 4.5]),
        (("pCa 9", "pCa 6,2", "pCa 4.5"), [9.0, 6.2, 4.5]),
        (("pCa 6.1 run 1", "pCa 6.1 run 2"), None),
        (("force pCa 6.1", "length pCa 4.5"), None),
        (("force 1", "force 2"), None),
        (("pCa 6.1",), None),
    ],
)
def test_columns_that_differ_in_their_pca(names: tuple[str, ...], pca: list[float] | None) -> None:
    found = column_pattern(names)
    assert (found is None) == (pca is None)
    if found is not None and pca is not None:
        matches = [re.fullmatch(found.pattern, name) for name in names]
        numbers = [match["pca"].replace(",", ".") for match in matches if match is not None]
        told = [float(text) * found.factors.get("pca", 1.0) for text in numbers]
        assert told == pytest.approx(pca)
        assert re.fullmatch(found.pattern, "length pCa 7.0") is None


def test_sheets_that_tell_their_pca() -> None:
    found = sheet_pattern(["rat 3, pCa 6.1", "pCa 4.5 (2)"])
    assert found is not None
    assert all(re.fullmatch(found.pattern, name) for name in ("rat 3, pCa 6.1", "pCa 4.5 (2)"))
    assert sheet_pattern(["pCa 6.1"]) is None
    assert sheet_pattern(["pCa 6.1", "notes"]) is None
    # Regression: others took the pattern from those that have one; the last pCa of a name counted.
    partly = sheet_pattern(["pCa 9", "Plot", "pCa 4.5"])
    assert partly is not None
    assert re.fullmatch(partly.pattern, "Plot") is None
    assert sheet_pattern(["pCa 6.2 -> pCa 4.5", "pCa 4.5 -> pCa 6.2"]) is None
