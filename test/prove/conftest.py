"""Fibres, trials and results that the tests of the benchmark share."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

from xb_muscle_ros.prove.generator.fibres import nominal
from xb_muscle_ros.prove.generator.world import Stimulus, World

# Made records of diagnoses.
sys.path.insert(0, str(Path(__file__).parents[1] / "diagnose" / "report"))


def length_of_a_study(speed: float = 0.4545, amplitude: float = 0.0383) -> np.ndarray:
    """Isometric, stretch, shortening, pause, stretch, hold; at every millisecond, L0."""
    ramp = round(amplitude / speed * 1e3)
    corners = np.cumsum([0, 200, ramp, ramp, 100, ramp, 300])
    return np.interp(np.arange(corners[-1] + 1), corners, np.array([0, 0, 1, 0, 0, 1, 1]) * amplitude)


@pytest.fixture(scope="session")
def study() -> list[Stimulus]:
    """Three trials: relaxed, half and fully active."""
    return [Stimulus(length_of_a_study(), 10.0 ** (6.0 - pca)) for pca in (9.0, 6.2, 4.5)]


@pytest.fixture(scope="session")
def worlds() -> dict[str, World]:
    """A plain fibre for every model that a case may be given."""
    models = ("3state_coop", "2state_coop", "2state", "3state_coop_rigid", "2state_coop_rigid")
    return {model: World(model, nominal("18Dec2017a", model)) for model in models}
