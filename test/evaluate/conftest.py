"""Small made tables and recordings."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import yaml

from xb_muscle_ros.models import fibre_file
from xb_muscle_ros.models.fibre_file import load_fibre
from xb_muscle_ros.models.muscle import Muscle
from xb_muscle_ros.trials.bags import write_trial
from xb_muscle_ros.trials.protocol import StretchShortenStretch
from xb_muscle_ros.trials.trial import Phase, Trial, TrialFacts

FIBRE = "18Dec2017a"
RecordingMaker = Callable[..., Path]


@pytest.fixture(scope="module", autouse=True)
def released_sets_only(tmp_path_factory: pytest.TempPathFactory, repo_root: Path) -> Iterator[None]:
    """Fibre files as the authors' sets alone would make them: what is missing then has to be told."""
    folder = tmp_path_factory.mktemp("released")
    for path in (repo_root / "config" / "fibers").glob("*.yaml"):
        tree = yaml.safe_load(path.read_text(encoding="utf-8"))
        inner = tree["/**"]["ros__parameters"]
        for name in inner.pop("sources", {}):
            inner["models"].pop(name, None)
        if inner["models"]:
            (folder / path.name).write_text(yaml.safe_dump(tree), encoding="utf-8")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(fibre_file, "fibre_folders", lambda: iter([folder]))
        yield


def recording(
    pca: float = 6.1,
    amplitude_l0: float = 0.0383,
    recovery_s: float = 0.05,
    fibre: str = FIBRE,
    error_f0: float = 0.02,
    model: str = "3state_coop",
) -> Trial:
    """A trial whose measured force is the model's, too high by a constant."""
    trial = StretchShortenStretch(amplitude_l0, recovery_s).trial(fibre, pca, 500.0)
    muscle = Muscle(load_fibre(fibre, model))
    held = np.full(trial.time_s.size, trial.calcium_um[0])
    state = muscle.settle(0.0, float(held[0]))
    states = muscle.run(state, np.diff(trial.time_s), trial.length_change_l0, held)
    force = muscle.outputs_of(states)["force_f0"] + error_f0
    return replace(trial, force_time_s=trial.time_s, force_n=force)


def held_at(length_l0: float, force_f0: float, name: str, stretched_s: float | None = None) -> Trial:
    """Six seconds at a length after an optional stretch to it by 0.1 L0 that ends at a time, activated at 1 s."""
    time_s = np.arange(601) * 0.01
    phases: tuple[Phase, ...] = (Phase("isometric", 0.0, 6.0),)
    length = np.full(601, 1.0 + length_l0)
    if stretched_s is not None:
        phases = (
            Phase("isometric", 0.0, stretched_s - 0.2),
            Phase("test_stretch", stretched_s - 0.2, stretched_s),
            Phase("hold", stretched_s, 6.0),
        )
        length = 1.0 + length_l0 - 0.1 * np.clip((stretched_s - time_s) / 0.2, 0.0, 1.0)
    return Trial(
        facts=TrialFacts("cat", name, phases=phases),
        time_s=time_s,
        length_m=length,
        calcium_time_s=np.array([0.0, 1.0]),
        calcium_um=np.array([0.05, 8.0]),
        force_time_s=time_s,
        force_n=np.where(time_s >= 1.0, force_f0, 0.01),
    )


@pytest.fixture(scope="session")
def recorded() -> Callable[..., Trial]:
    """The function `recording`."""
    return recording


@pytest.fixture(scope="session")
def held() -> Callable[..., Trial]:
    """The function `held_at`."""
    return held_at


@pytest.fixture
def make(tmp_path: Path) -> RecordingMaker:
    """Write a trial (by default `recording` with these arguments) as a bag; gives its path."""

    def write(trial: Trial | None = None, name: str = "", **arguments: object) -> Path:
        made = trial if trial is not None else recording(**arguments)
        path = tmp_path / "bags" / (name or f"{made.facts.fibre}_{made.facts.trial}")
        write_trial(path, made)
        return path

    return write
