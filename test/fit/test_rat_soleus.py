"""Real recordings: rat soleus fibre 18Dec2017a with two calcium levels left out, beside the released set."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from xb_muscle_ros.fit.coordinates import fault_coordinates, parameter_coordinates
from xb_muscle_ros.fit.data import FitTrial, fit_trials
from xb_muscle_ros.fit.features import F0_ANCHOR
from xb_muscle_ros.fit.ordinary import shown_by
from xb_muscle_ros.fit.problem import Problem
from xb_muscle_ros.fit.report import as_json
from xb_muscle_ros.fit.run import Settings, fit
from xb_muscle_ros.measurement.artefacts import ORDINARY
from xb_muscle_ros.models.fibre_file import Fibre
from xb_muscle_ros.trials.phases import detect_phases
from xb_muscle_ros.trials.trial import Trial, TrialFacts
from xb_muscle_ros.work import Options

LEFT_OUT = (6.2, 6.3)


def recorded(path: Path) -> Trial:
    """A trial of `rat_soleus_fibres`, forces in F0 and lengths in L0."""
    named = re.fullmatch(r"amp(\d+)_rt(\d+)ms_pca(\d+)", path.stem)
    assert named is not None
    amplitude, recovery, pca = (
        float(part) * unit for part, unit in zip(named.groups(), (1e-4, 1e-3, 0.1), strict=True)
    )
    time_s, change, force = np.loadtxt(path, delimiter=",", skiprows=1).T
    phases = detect_phases(time_s, 1.0 + change, amplitude, recovery, 1.0)
    facts = TrialFacts("18Dec2017a", path.stem, round(pca, 1), amplitude, recovery, phases=phases)
    return Trial(facts, time_s, 1.0 + change, np.zeros(1), np.array([10.0 ** (6.0 - pca)]), time_s, force)


@pytest.fixture(scope="module")
def trials(shared_data: Path) -> tuple[FitTrial, ...]:
    """Ten trials at five levels of calcium."""
    found = [recorded(path) for path in sorted((shared_data / "recordings/rat_soleus_fibres/18Dec2017a").glob("*.csv"))]
    assert len(found) == 10
    return fit_trials(found, [trial.facts.pca in LEFT_OUT for trial in found])


def fitted(start: Fibre, trials: tuple[FitTrial, ...], names: list[str]) -> dict[str, Any]:
    training = [t for t in trials if not t.held_out]
    coordinates = parameter_coordinates(start, None, (), {}, {})
    coordinates += fault_coordinates(names, [t.name for t in training], [t.solution for t in training], {})
    problem = Problem(start, trials, coordinates, {}, (F0_ANCHOR,))
    return as_json(fit(problem, Settings(1, level=None), Options(processes=0, quiet=True)), {})


def test_ordinary_errors_make_a_fit_better_than_the_released_set_where_it_was_worse(
    start: Fibre, trials: tuple[FitTrial, ...]
) -> None:
    """The released set was fitted to all five levels, so that beating it at two that were left out is something.

    Measured: released 8.1, fitted without errors 15.9; with them and each solution's own isometric force 4.3 beside
    5.1 (% F0, held out).
    """
    names, unseen = shown_by([t for t in trials if not t.held_out])
    assert (tuple(names), unseen) == (ORDINARY, [])
    bare, full = fitted(start, trials, []), fitted(start, trials, names)
    assert bare["heldout_rmsd_f0"] > 1.2 * bare["before"]["heldout_rmsd_f0"]
    assert bare["heldout_rmsd_calibrated_f0"] is None
    assert full["before"]["heldout_rmsd_f0"] == bare["before"]["heldout_rmsd_f0"]
    # On the same footing: both know what the left-out solutions' isometric force tells, and nothing more.
    assert full["heldout_rmsd_calibrated_f0"] < 0.95 * full["before"]["heldout_rmsd_calibrated_f0"]
    assert full["heldout_rmsd_calibrated_f0"] < 0.4 * bare["heldout_rmsd_f0"]
    assert full["train_rmsd_f0"] < bare["train_rmsd_f0"]
    # Solution 6.3 is out of line with its neighbours, and that is said.
    (line,) = [line for line in full["warnings"] if line.startswith("beyond what is ordinary")]
    assert "pca_shift[amp0_rt1ms_pca63]" in line
