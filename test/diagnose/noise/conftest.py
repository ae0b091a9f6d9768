"""Windows of made noise of known size and colour."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import numpy.typing as npt
import pytest
from scipy.signal import lfilter

from xb_muscle_ros.diagnose.noise.windows import Window
from xb_muscle_ros.replay.made import coloured_noise

Array = npt.NDArray[np.float64]
# Of five trials, F0.
SDS = (1.4e-3, 7e-4, 5e-4, 3e-4, 4e-4)


def hum(random: np.random.Generator, n: int) -> Array:
    """60 Hz at 1 kHz that lasts for some 30 ms, of unit size, and slower noise of the same size."""
    turn = 2.0 * np.pi * 0.06
    fast = lfilter([1.0], [1.0, -2.0 * 0.97 * np.cos(turn), 0.97**2], random.normal(size=n + 500))[500:]
    unit = np.sqrt((1.0 + 0.97**2) / (1.0 - 0.97**2) / ((1.0 + 0.97**2) ** 2 - (2.0 * 0.97 * np.cos(turn)) ** 2))
    return (fast / unit + coloured_noise(random, n, 1.0, 0.9)) / np.sqrt(2.0)


def windows(seed: int, n: int, drift_f0: float = 0.0, humming: bool = False) -> list[Window]:
    random = np.random.default_rng(seed)
    found = []
    for i, sd in enumerate(SDS):
        noise = sd * (hum(random, n) if humming else coloured_noise(random, n, 1.0, 0.95))
        found.append(Window(f"t{i}", 1e-3, 0.5 + drift_f0 * np.linspace(0.0, 1.0, n) + noise))
    return found


@pytest.fixture(name="windows", scope="session")
def _windows() -> Callable[..., list[Window]]:
    """Makes windows: (seed, samples, drift_f0=, humming=)."""
    return windows


@pytest.fixture(scope="session")
def sds() -> Array:
    """Of the noise in the windows, F0."""
    return np.array(SDS)
