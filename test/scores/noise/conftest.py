"""Windows and trials with made noise of known size and colour."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from types import SimpleNamespace

import numpy as np
import numpy.typing as npt
import pytest
from scipy.signal import lfilter

from xb_muscle_ros.scores.noise.model import NoiseModel
from xb_muscle_ros.scores.noise.trials import by_windows
from xb_muscle_ros.scores.noise.windows import Window
from xb_muscle_ros.simulation.made import coloured_noise
from xb_muscle_ros.trials.trial import Phase, Trial, TrialFacts

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


def even_times(ramp_s: float, hold_s: float, step_s: float) -> Array:
    """Of a ramp and a hold, evenly sampled, s."""
    return np.arange(round((ramp_s + hold_s) / step_s) + 1) * step_s


def spreading_times(ramp_s: float, hold_s: float) -> Array:
    """Of 20 even samples of a ramp and 80 of a hold, further and further apart, s."""
    return np.concatenate(
        [np.linspace(0.0, ramp_s, 20, endpoint=False), [ramp_s], ramp_s + np.geomspace(ramp_s / 20.0, hold_s, 79)]
    )


def fading_noise(random: np.random.Generator, time_s: Array, tau_s: float, share: float = 1.0) -> Array:
    """Noise of unit size that fades within tau_s, and white noise, at any times."""
    slow = random.normal(size=time_s.size)
    for k, kept in enumerate(np.exp(-np.diff(time_s) / tau_s)):
        slow[k + 1] = kept * slow[k] + np.sqrt(1.0 - kept**2) * slow[k + 1]
    return np.sqrt(share) * slow + np.sqrt(1.0 - share) * random.normal(size=time_s.size)


def relaxing(name: str, time_s: Array, ramp_s: float, noise_f0: Array, shape: str = "exponentials") -> Trial:
    """A trial of a stretch of 20 % L0 and a hold in which force falls from 30 % F0.

    Args:
        name: of the trial.
        time_s: of its samples, from 0 on.
        ramp_s: duration of the stretch.
        noise_f0: added to its force.
        shape: of the fall: `exponentials` of a hundredth and of half of the hold, a `power` of time, or one that comes
            back after a quick fall, as active force does.
    """
    since, hold_s = np.maximum(time_s - ramp_s, 0.0), float(time_s[-1]) - ramp_s
    fall = {
        "exponentials": 0.4 + 0.3 * np.exp(-since / (0.01 * hold_s)) + 0.3 * np.exp(-since / (0.5 * hold_s)),
        "power": (1.0 + 10.0 * since / ramp_s) ** -0.25,
        "active": 0.6 + 0.5 * np.exp(-20.0 * since / hold_s) - 0.1 * np.exp(-5.0 * since / hold_s),
    }[shape]
    rise = np.expm1(3.0 * np.minimum(time_s / ramp_s, 1.0)) / np.expm1(3.0)
    phases = (Phase("stretch", 0.0, ramp_s), Phase("hold", ramp_s, float(time_s[-1])))
    length = 1.0 + 0.2 * np.minimum(time_s / ramp_s, 1.0)
    facts = TrialFacts("made", name, 6.0, phases=phases)
    force = 0.3 * np.where(since > 0.0, fall, rise) + noise_f0
    return Trial(facts, time_s, length, np.zeros(1), np.ones(1), time_s, force)


@pytest.fixture(scope="session")
def made() -> SimpleNamespace:
    """Makes times, noise and trials; see the functions of these names."""
    return SimpleNamespace(
        even_times=even_times, spreading_times=spreading_times, fading_noise=fading_noise, relaxing=relaxing
    )


def _model_of(windows: Sequence[Window]) -> NoiseModel:
    return NoiseModel(tuple(by_windows(windows).values()))


@pytest.fixture(scope="session")
def model_of() -> Callable[[Sequence[Window]], NoiseModel]:
    """Makes the noise of a study of its windows."""
    return _model_of
