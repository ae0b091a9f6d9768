"""Made data: a fibre's trials simulated with changed values and noise like that of real recordings."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import pytest

from xb_muscle_ros.fit import descents
from xb_muscle_ros.fit.coordinates import parameter_coordinates
from xb_muscle_ros.fit.data import fit_trials
from xb_muscle_ros.fit.problem import Problem
from xb_muscle_ros.models.fibre_file import Fibre, changed, load_fibre
from xb_muscle_ros.models.muscle import Muscle
from xb_muscle_ros.simulation.made import made
from xb_muscle_ros.trials.protocol import StretchShortenStretch
from xb_muscle_ros.trials.trial import Trial

Maker = Callable[..., list[Trial]]


@pytest.fixture(scope="session")
def start() -> Fibre:
    """Where fits begin: the released set, without its smoothing."""
    return changed(load_fibre("18Dec2017a"), {"smoothing": 0.0}, "test")


@pytest.fixture(scope="session")
def truth(start: Fibre) -> Fibre:
    """The fibre that made the data."""
    return changed(start, {"f": 95.0, "k21": 19.0, "kse": 0.33}, "test")


@pytest.fixture(scope="session")
def made_trials(truth: Fibre) -> Maker:
    """Trials of the true fibre: stretch-shortening-stretch, one for each pCa, with a fault where wanted."""

    def make(pcas: Sequence[float], seed: int = 0, **faults: float) -> list[Trial]:
        random = np.random.default_rng(seed)
        protocol, muscle = StretchShortenStretch(0.0383, 0.1), Muscle(truth)
        return [made(muscle, protocol.trial(truth.name, pca), random, **faults) for pca in pcas]

    return make


@pytest.fixture(scope="session")
def problem(start: Fibre, truth: Fibre, made_trials: Maker) -> Problem:
    """Three trials, one of them held out, and the three values that differ."""
    trials = fit_trials(made_trials((4.5, 6.1, 6.3)), [False, False, True])
    return Problem(start, trials, parameter_coordinates(start, ["f", "k21", "kse"], (), {}, {}), {})


@pytest.fixture
def descents_begun(monkeypatch: pytest.MonkeyPatch) -> Callable[[int], list[int]]:
    """Interrupts the descent of a number, counted from 1; gives a list that grows with each descent begun."""

    def interrupt(number: int) -> list[int]:
        begun: list[int] = []
        descend = descents.descend

        def interrupted(*arguments: Any) -> Any:
            begun.append(len(begun) + 1)
            if begun[-1] == number:
                raise KeyboardInterrupt
            return descend(*arguments)

        monkeypatch.setattr(descents, "descend", interrupted)
        return begun

    return interrupt
