"""Trials that the tests of the public functions share."""

from __future__ import annotations

from pathlib import Path

import pytest

import xb_muscle_ros as xb

EXACT = {"smoothing": 0.0}


@pytest.fixture(scope="session")
def made() -> xb.SimulationResult:
    """Two trials of a fibre whose rates differ from those of its file."""
    values = {**EXACT, "f": 95.0, "k21": 20.0}
    return xb.simulate("18Dec2017a", set=values, pca=[4.5, 6.1], recovery=0.1, as_measured=True)


@pytest.fixture(scope="session")
def bags(made: xb.SimulationResult, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The same as bags."""
    folder = tmp_path_factory.mktemp("bags")
    made.save(folder)
    return folder
