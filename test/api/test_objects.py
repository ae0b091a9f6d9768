"""Objects in memory, tables, figures, warnings."""

from __future__ import annotations

import shutil
import sys
import warnings
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

import xb_muscle_ros as xb
from xb_muscle_ros.api import diagnosing
from xb_muscle_ros.diagnose.outputs import read

FIBRE = "18Dec2017a"
EXACT = {"smoothing": 0.0}


def test_arrays_take_the_steps_of_a_muscle() -> None:
    time = np.arange(0.0, 0.1, 1e-3)
    length, calcium = 0.01 * np.sin(40.0 * time), 0.5 + time
    found = xb.simulate(FIBRE, time=time, length=length, calcium=calcium, name="mine")
    muscle = xb.Muscle(found.fibre)
    state = muscle.settle(length[0], calcium[0])
    for k in range(1, time.size):
        state = muscle.step(state, length[k], calcium[k - 1], 1e-3)
    assert found.simulated[0].force_n[-1] == pytest.approx(muscle.outputs(state).force_f0, abs=1e-12)
    assert found.trials[0].facts.trial == "mine"
    again = xb.replay(found, FIBRE)
    assert np.array_equal(again.simulated[0].force_n, found.simulated[0].force_n)


def test_arrays_of_one_calcium_have_a_pca_and_phases() -> None:
    time = np.arange(0.0, 0.5, 1e-3)
    stretch = np.interp(time, [0.1, 0.2], [0.0, 0.0383])
    (trial,) = xb.simulate(FIBRE, time=time, length=stretch, calcium=10.0**-0.1).trials
    assert trial.facts.pca == pytest.approx(6.1)
    assert [phase.name for phase in trial.facts.phases] == ["isometric", "test_stretch", "hold"]


@pytest.mark.parametrize(
    ("arrays", "words"),
    [
        ({"time": [0.0, 0.1]}, "belong together"),
        ({"time": [0.0], "length": [0.0], "calcium": 1.0}, "two samples or more"),
        ({"time": [0.0, 0.1], "length": [0.0], "calcium": 1.0}, r"length has shape \(1,\)"),
        ({"time": [0.0, 0.1], "length": [0.0, np.nan], "calcium": 1.0}, "length, sample 1 is nan"),
        ({"time": [0.1, 0.0], "length": [0.0, 0.0], "calcium": 1.0}, "time, sample 1 is 0 s"),
        ({"time": [-0.1, 0.0], "length": [0.0, 0.0], "calcium": 1.0}, "time, sample 0 is -0.1 s"),
        ({"time": [0.0, 0.1], "length": "ab", "calcium": 1.0}, "length is no array of numbers"),
        ({"time": [0.0, 0.1], "length": [0.0, 0.0], "calcium": -1.0}, "calcium"),
    ],
)
def test_arrays_that_make_no_trial_are_refused(arrays: dict[str, object], words: str) -> None:
    with pytest.raises(xb.UserError, match=words):
        xb.simulate(FIBRE, **arrays)


def test_made_trials_are_written_and_read_back(tmp_path: Path) -> None:
    time = np.arange(0.0, 0.5, 1e-3)
    stretch = np.interp(time, [0.1, 0.2], [0.0, 0.0383])
    said: list[str] = []
    trial = xb.make_trial(
        "mine", "one", time, stretch, 0.8, 0.3 + stretch, reference_length_m=1e-3, f0_n=2e-4, tell=said.append
    )
    assert any("phases found from length" in line for line in said)
    (bag,) = xb.write_trials(trial, tmp_path)
    (again,) = xb.read_trials(bag)
    assert again.facts == trial.facts
    assert np.array_equal(again.force_n, trial.force_n)
    with pytest.raises(xb.UserError, match="exists"):
        xb.write_trials(trial, tmp_path)
    with pytest.raises(xb.UserError, match="2 trials would become bag"):
        xb.write_trials([trial, trial], tmp_path, overwrite=True)
    with pytest.raises(xb.UserError, match="f0_n is 0"):
        xb.make_trial("mine", "one", time, stretch, 0.8, f0_n=0.0)


def test_lines_go_to_who_listens_and_to_the_result(made: xb.SimulationResult) -> None:
    said: list[str] = []
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        found = xb.replay(made, "13Dec2017a", tell=said.append)
    line = f"2 of 2 trials are of fibre {FIBRE}, replayed with parameters of 13Dec2017a"
    assert said == list(found.warnings) == [line]
    with pytest.warns(xb.DataWarning, match="2 of 2 trials") as caught:
        xb.replay(made, "13Dec2017a")
    assert [warning.filename for warning in caught] == [__file__]


def test_a_fibre_in_memory_is_taken_as_it_is(made: xb.SimulationResult) -> None:
    fibre = xb.changed(xb.load_fibre(FIBRE), {**EXACT, "f": 95.0, "k21": 20.0})
    assert max(row["rmsd_f0"]["whole"] for row in xb.replay(made, fibre).rows) < 1e-3
    with pytest.raises(xb.UserError, match="is loaded with model 3state_coop, not '2state'"):
        xb.replay(made, fibre, model="2state")
    with pytest.raises(xb.UserError, match="--live gives the node a fibre file as it is"):
        xb.replay(made, fibre, live=True)


def test_trials_that_are_none_are_refused(made: xb.SimulationResult, bags: Path) -> None:
    with pytest.raises(xb.UserError, match="an object of type int"):
        xb.replay([3], FIBRE)
    with pytest.raises(xb.UserError, match="bags and trials in memory together"):
        xb.replay([bags, *made.trials], FIBRE)
    with pytest.raises(xb.UserError, match="have their own L0 and F0"):
        xb.replay(made, FIBRE, f0=1e-3)
    with pytest.raises(xb.UserError, match="no trial in memory is of fibre 'other'"):
        xb.replay(made, FIBRE, trials_of="other")
    with pytest.raises(xb.UserError, match="--f0 is -1"):
        xb.replay(bags, FIBRE, f0=-1.0)


def test_studies_in_memory_are_checked(made: xb.SimulationResult) -> None:
    with pytest.raises(xb.UserError, match="trials are of fibres '18Dec2017a', fibre files of"):
        xb.diagnose(made, [FIBRE, "13Dec2017a"])
    bare = xb.StretchShortenStretch(0.0383, 0.1).trial(FIBRE, 6.1)
    with pytest.raises(xb.UserError, match="no measured force"):
        xb.diagnose(bare, FIBRE)


def test_tables_have_a_row_for_each(made: xb.SimulationResult) -> None:
    pytest.importorskip("pandas")
    table = made.to_dataframe()
    assert len(table) == sum(trial.time_s.size for trial in made.trials)
    assert {"trial", "time_s", "length_change_l0", "calcium_um", "force_f0", "n_on"} <= set(table)
    assert table["force_f0"].max() == max(s.force_n.max() for s in made.simulated)
    found = xb.replay(made, FIBRE)
    assert list(found.to_dataframe()["trial"]) == [trial.facts.trial for trial in made.trials]
    assert "rmsd_f0.whole" in found.to_dataframe()
    assert len(found.to_dataframe(samples_of_trials=True)) == len(table)


def test_without_pandas_one_line_names_the_remedy(made: xb.SimulationResult, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pandas", None)
    with pytest.raises(xb.UserError, match="pip install pandas"):
        made.to_dataframe()


def test_figures_are_handed_over_and_not_written(
    made: xb.SimulationResult, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    import matplotlib as mpl

    monkeypatch.chdir(tmp_path)
    backend = mpl.get_backend()
    figures = [made.plot(), xb.replay(made, FIBRE).plot()]
    assert [len(figure.axes) for figure in figures] == [4, 4]
    assert mpl.get_backend() == backend
    figures[0].savefig(tmp_path / "made.png")
    assert [path.name for path in tmp_path.iterdir()] == ["made.png"]
    with pytest.raises(xb.UserError, match="nothing to draw"):
        xb.evaluate(made, measured_only=True, processes=0, tell=lambda line: None).plot("profile")
    with pytest.raises(xb.UserError, match=r"figure 'profile' is not among those of this result.*force_rmsd"):
        xb.evaluate(made, model="2state", processes=0, tell=lambda line: None).plot("profile")


def test_results_are_short_to_look_at(made: xb.SimulationResult) -> None:
    assert repr(made) == f"SimulationResult({FIBRE}, 3state_coop, 2 trials: amp383_rt100ms_pca45, amp383_rt100ms_pca61)"
    assert repr(xb.replay(made, FIBRE)).startswith(f"ReplayResult({FIBRE}, 3state_coop, 2 trials, RMSD ")


def test_bags_given_twice_are_said(repo_root: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    shutil.copy(repo_root / "test" / "diagnose" / "report" / "format_2.json", tmp_path / "diagnosis.json")
    kept = read(tmp_path)
    monkeypatch.setattr(diagnosing, "diagnosed", lambda *_: (kept, SimpleNamespace(augmented={}, protocol=None)))
    (bag,) = xb.simulate(FIBRE, pca=4.5, as_measured=True).save(tmp_path / "bags")
    told: list[str] = []
    found = xb.diagnose([bag, bag], FIBRE, processes=0, tell=told.append)
    assert f"bags that were given more than once are taken once: {bag}" in told
    assert told[-1] in found.diagnosis.notes
