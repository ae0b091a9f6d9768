"""What names of files tell."""

from __future__ import annotations

from pathlib import Path

import pytest

from xb_muscle_ros.trials.inspecting.names import name_pattern


@pytest.mark.parametrize(
    ("names", "pca"),
    [
        (("run_pCa45.csv",), 4.5),
        (("run_pCa4.5.csv", "run_pCa6.csv"), None),
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
