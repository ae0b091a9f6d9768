"""Several trials in a table, and pCa that holds for a part of it alone."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from xb_muscle_ros.trials.importing import Failed, Imported, import_recordings
from xb_muscle_ros.trials.readers.settings import ImportSettings

N = 300
TIME_S = np.arange(N) / 1000
LENGTH_MM = 1.2 * np.interp(TIME_S, [0.1, 0.18], [1.0, 1.04])
PCAS = (4.5, 6.1, 6.3)
FORCE_MN = {4.5: 0.8, 6.1: 0.5, 6.3: 0.3}
CALCIUM = {"calcium": {"column": "pca", "unit": "pCa"}}


def table(path: Path, **columns: Any) -> Path:
    """The three pCa one after another; columns may be added, changed or (None) taken out."""
    made = {
        "t": np.tile(TIME_S, 3),
        "l": np.tile(LENGTH_MM, 3),
        "f": np.repeat(list(FORCE_MN.values()), N),
        "pca": np.repeat(PCAS, N),
        **columns,
    }
    kept = {name: values for name, values in made.items() if values is not None}
    rows = [",".join(map(str, row)) for row in zip(*(np.asarray(v).tolist() for v in kept.values()), strict=True)]
    path.write_text("\n".join([",".join(kept), *rows]))
    return path


def run(file: Path, more_columns: dict[str, Any] | None = None, **keys: Any) -> list[Imported | Failed]:
    columns = {
        "time": {"column": "t", "unit": "s"},
        "length": {"column": "l", "unit": "mm"},
        "force": {"column": "f", "unit": "mN"},
        **(more_columns or {}),
    }
    settings = ImportSettings({"fibre": "fb", "f0": "1 mN", "columns": columns, **keys}, "here")
    made = list(import_recordings([file], settings, file.parent / "bags"))
    return [event for event in made if isinstance(event, (Imported, Failed))]


def imported(events: list[Imported | Failed]) -> list[Imported]:
    assert all(isinstance(event, Imported) for event in events), events
    return [event for event in events if isinstance(event, Imported)]


def _one_each(events: list[Imported | Failed]) -> None:
    for event, pca in zip(imported(events), PCAS, strict=True):
        assert event.trial.facts.pca == pytest.approx(pca)
        assert event.trial.measured_f0 == pytest.approx(np.full(N, FORCE_MN[pca]))
        assert [phase.name for phase in event.trial.facts.phases] == ["isometric", "test_stretch", "hold"]


def test_time_that_starts_anew_tells_trials_apart(tmp_path: Path) -> None:
    events = run(table(tmp_path / "a.csv"), CALCIUM)
    _one_each(events)
    assert [event.bag.name for event in imported(events)] == ["fb_a_1", "fb_a_2", "fb_a_3"]
    told = [event.trial.warnings for event in imported(events)]
    assert told == [(f"{tmp_path / 'a.csv'}: time starts anew in line 302; the table is 3 trials",), (), ()]


@pytest.mark.parametrize(("name", "columns"), [("Trial", {}), ("run", {"trial": {"column": "run"}})])
def test_a_column_tells_trials_apart(tmp_path: Path, name: str, columns: dict[str, Any]) -> None:
    going_on = np.arange(3 * N) / 1000
    file = table(tmp_path / "a.csv", t=going_on, **{name: np.repeat(["x", "y", "z"], N)})
    events = run(file, {**CALCIUM, **columns})
    _one_each(events)
    assert [event.bag.name for event in imported(events)] == ["fb_a_x", "fb_a_y", "fb_a_z"]
    assert imported(events)[0].trial.warnings == (f"{file}: column '{name}' tells 3 trials apart",)


def test_without_either_calcium_changes_and_that_is_told(tmp_path: Path) -> None:
    (event,) = imported(run(table(tmp_path / "a.csv", t=np.arange(3 * N) / 1000), CALCIUM))
    assert event.trial.facts.pca is None
    assert event.trial.calcium_time_s == pytest.approx([0.0, 0.3, 0.6])
    assert any("column 'pca' changes 2 times, first at 0.3 s from 31.62 to 0.7943" in w for w in event.trial.warnings)


def test_a_given_pca_never_holds_for_a_part_only(tmp_path: Path) -> None:
    (event,) = run(table(tmp_path / "a.csv", t=np.arange(3 * N) / 1000), pca=4.5)
    assert isinstance(event, Failed)
    assert "line 302, column 'pca' holds 6.1, but pCa is given as 4.5" in event.why
    (event,) = run(table(tmp_path / "b.csv", t=np.arange(3 * N) / 1000), CALCIUM, pca=4.5)
    assert isinstance(event, Failed)
    assert "pCa is given as 4.5, but calcium of column 'pca' changes" in event.why


def test_each_trial_is_scaled_by_its_own_isometric_force(tmp_path: Path) -> None:
    fractions = {4.5: 1.0, 6.1: 0.4, 6.3: 0.2}
    events = imported(run(table(tmp_path / "a.csv"), CALCIUM, isometric_scaling={"fractions_f0": fractions}))
    assert [event.trial.measured_f0[0] for event in events] == pytest.approx(list(fractions.values()))


@pytest.mark.parametrize("first", [4.5, 6.3])
def test_f0_is_the_force_of_its_pca_wherever_that_stands(tmp_path: Path, first: float) -> None:
    order = sorted(PCAS, reverse=first == 6.3)
    file = table(tmp_path / "a.csv", f=np.repeat([FORCE_MN[p] for p in order], N), pca=np.repeat(order, N))
    events = imported(run(file, CALCIUM, f0={"isometric_at_pca": 4.5}))
    assert [event.trial.facts.f0_n for event in events] == pytest.approx([0.8e-3] * 3)
    assert [event.trial.measured_f0[0] for event in events] == pytest.approx([FORCE_MN[p] / 0.8 for p in order])


def test_forces_side_by_side_are_told(tmp_path: Path) -> None:
    file = table(tmp_path / "a.csv", pca=None, **{"f_pCa45": np.zeros(3 * N), "f_pCa6.1": np.zeros(3 * N)})
    told = imported(run(file, pca=6.1))[0].trial.warnings
    assert any(
        "not read, because of another pCa by name: 'f_pCa45'; a pattern in the mapping" in warning for warning in told
    )
    (event, *_) = imported(run(file, {"force": {"column": "f_pCa45", "unit": "mN"}}, pca=6.1, trial="b"))
    assert any("force column is 'f_pCa45', but pCa is given as 6.1" in warning for warning in event.trial.warnings)


def test_a_clock_that_steps_back_is_no_new_trial(tmp_path: Path) -> None:
    time_s = np.arange(3 * N) / 1000
    time_s[400:] -= 0.2
    (event,) = run(table(tmp_path / "a.csv", t=time_s, pca=None), pca=6.1)
    assert isinstance(event, Failed)
    assert "line 402, column 't': 0.2 s does not come after 0.399 s" in event.why


def test_a_trial_column_with_an_empty_cell_is_refused(tmp_path: Path) -> None:
    names = np.repeat(["x", "", "z"], N)
    (event,) = run(table(tmp_path / "a.csv", run=names), {**CALCIUM, "trial": {"column": "run"}})
    assert isinstance(event, Failed)
    assert "line 302, column 'run' holds nothing" in event.why
