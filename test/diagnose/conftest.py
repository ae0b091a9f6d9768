"""Made studies: stretch-shortening-stretch trials with coloured noise, and slopes that a fit might have."""

from __future__ import annotations

import itertools
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
import pytest

from xb_muscle_ros.diagnose.names import Name
from xb_muscle_ros.diagnose.noise.cells import Residual
from xb_muscle_ros.diagnose.search.descent import Fit, fitted
from xb_muscle_ros.diagnose.search.system import System
from xb_muscle_ros.diagnose.search.whole import whole
from xb_muscle_ros.fit.linear_fit import LinearFit
from xb_muscle_ros.models.fibre_file import Fibre, changed, load_fibre
from xb_muscle_ros.scores.noise.model import NoiseModel
from xb_muscle_ros.scores.noise.trials import by_windows
from xb_muscle_ros.scores.noise.windows import Window
from xb_muscle_ros.simulation.made import coloured_noise
from xb_muscle_ros.trials.protocol import StretchShortenStretch

# Made evidence that several test modules share, and makers of bags that the tests of trials have.
sys.path.insert(0, str(Path(__file__).parent))
sys.path.insert(0, str(Path(__file__).parent / "report"))
sys.path.insert(0, str(Path(__file__).parents[1] / "trials"))

Array = npt.NDArray[np.float64]
PCAS = (4.5, 5.8, 6.1, 6.3, 6.6)


class Study(NamedTuple):
    """Trials without a residual, and a fit of them."""

    residuals: tuple[Residual, ...]
    fit: LinearFit

    @property
    def sizes(self) -> list[int]:
        return [r.time_s.size for r in self.residuals]

    def split(self, values: Array) -> list[Array]:
        """Values of all samples by trial."""
        return np.split(values, np.cumsum(self.sizes)[:-1])

    def noise(self, random: np.random.Generator, memory: float = 0.95) -> Array:
        """Noise of all samples, 0.03 to 0.14 % F0."""
        sds = np.geomspace(3e-4, 1.4e-3, len(self.sizes))[::-1]
        parts = [coloured_noise(random, n, sd, memory) for n, sd in zip(self.sizes, sds, strict=True)]
        return np.concatenate(parts)

    def windows(self, noise: Array) -> list[Window]:
        """Isometric windows: noise, a level and a drift."""
        found = []
        for r, value in zip(self.residuals, self.split(noise), strict=True):
            inside = r.time_s < 0.085
            found.append(Window(r.trial, 1e-3, 0.6 + 0.02 * r.time_s[inside] + value[inside]))
        return found

    def after(self, change: Array) -> tuple[Residual, ...]:
        """Residuals that the fit leaves of a change of the data."""
        left = self.split(self.fit.residual(change[:, None])[:, 0])
        return tuple(r._replace(value_f0=value) for r, value in zip(self.residuals, left, strict=True))


def make_study(pcas: tuple[float, ...], shared: int, seed: int, recovery_s: float = 0.1) -> Study:
    """Trials, and slopes of some shared smooth coordinates and of an offset for each trial."""
    random = np.random.default_rng(seed)
    residuals = []
    for pca in pcas:
        protocol = StretchShortenStretch(0.0383, recovery_s, lead_s=0.1)
        trial = protocol.trial("made", pca)
        n = trial.time_s.size
        calcium = np.full(n, float(trial.calcium_um[0]))
        facts = trial.facts
        residuals.append(
            Residual(f"pca{pca:g}", pca, trial.time_s, np.zeros(n), facts.phases, trial.length_change_l0, calcium)
        )
    sizes = [r.time_s.size for r in residuals]
    slopes = np.zeros((sum(sizes), shared + len(sizes)))
    # Smooth over 30 ms, of the size that forces change by when a parameter does by a factor of e.
    kernel = np.exp(-0.5 * np.linspace(-3, 3, 91) ** 2)
    for j in range(shared):
        rough = random.normal(size=sum(sizes) + 90)
        slopes[:, j] = 0.1 * np.convolve(rough, kernel / np.sqrt(np.sum(kernel**2)), "valid")
    edges = np.cumsum([0, *sizes])
    for i, (a, b) in enumerate(itertools.pairwise(edges)):
        slopes[a:b, shared + i] = 1.0
    prior = np.array([1.0] * shared + [1.0 / 0.005**2] * len(sizes))
    return Study(tuple(residuals), LinearFit(slopes, np.full(sum(sizes), 1.0 / (0.001 * np.sqrt(40.0))), prior))


@pytest.fixture(scope="session")
def study() -> Study:
    """Five trials and eight shared coordinates."""
    return make_study(PCAS, 8, 0)


@pytest.fixture(scope="session")
def long_study() -> Study:
    """The same with half a second of recovery."""
    return make_study(PCAS, 8, 0, 0.5)


def _model_of(windows: Sequence[Window]) -> NoiseModel:
    return NoiseModel(tuple(by_windows(windows).values()))


@pytest.fixture(scope="session")
def model_of() -> Callable[[Sequence[Window]], NoiseModel]:
    """Makes the noise of a study of its windows."""
    return _model_of


@pytest.fixture(scope="session")
def gaussian_whole() -> Fibre:
    """The whole model of `3state_coop` with everything absent: the one that the made studies compile."""
    return whole(changed(load_fibre("18Dec2017a"), {"smoothing": 0.0}, "test"), ())


@pytest.fixture(scope="session")
def system() -> System:
    """Two trials at other parameters and with a drag; no errors but noise."""
    from made_trials import fitted_trials, given_fibre, trials_of, truth

    trials = trials_of(truth("3state_coop+viscous_drag", drag=0.03), (4.5, 6.2), noise_f0=3e-4, ordinary=False)
    return System.of(given_fibre(), fitted_trials(trials), 1e-3)


def _fitted(system: System, *names: Name) -> Fit:
    """From the fibre file's values and the catalogue's."""
    found = fitted(system, names, [{}], 10, 0.02)
    assert found is not None
    return found


@pytest.fixture(scope="session")
def base_fit(system: System) -> Fit:
    """Without the drag."""
    return _fitted(system)


@pytest.fixture(scope="session")
def drag_fit(system: System) -> Fit:
    """With it."""
    return _fitted(system, Name.VISCOUS_DRAG)
