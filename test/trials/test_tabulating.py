"""Trials as tables: columns, clocks, and files that come back as the same trial."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from xb_muscle_ros.trials.importing import Imported, import_recordings
from xb_muscle_ros.trials.readers.mapping import load_mapping
from xb_muscle_ros.trials.readers.settings import ImportSettings
from xb_muscle_ros.trials.simulated import MOMENTS, Simulated
from xb_muscle_ros.trials.table_writing import write_csv, write_mapping, write_parquet, write_sto
from xb_muscle_ros.trials.tabulating import tables_of
from xb_muscle_ros.trials.trial import Trial, TrialFacts

TIME_S = np.arange(300) / 1000.0


def _trial(l0_m: float = 1.2e-3, f0_n: float = 0.5e-3, force_s: np.ndarray = TIME_S, steps: bool = False) -> Trial:
    length = l0_m * np.interp(TIME_S, [0.1, 0.2], [1.0, 1.04])
    calcium_s, calcium = (np.array([0.0, 0.05]), np.array([0.1, 2.0])) if steps else (np.zeros(1), np.array([0.8]))
    pca = None if steps else float(6.0 - np.log10(0.8))
    facts = TrialFacts("mine", "ramp", pca, 0.0, None, l0_m, f0_n, source="a test: it's made", data_set="set")
    return Trial(facts, TIME_S, length, calcium_s, calcium, force_s, f0_n * (0.4 + force_s))


def _simulated(time_s: np.ndarray = TIME_S) -> Simulated:
    moments = {name: np.full(time_s.size, 0.1 * i) for i, name in enumerate(MOMENTS)}
    return Simulated(time_s, 0.4e-3 + 0.0 * time_s, 1e-3 + 0.0 * time_s, 0.0 * time_s, moments)


def test_measured_and_simulated_stand_side_by_side() -> None:
    [table] = tables_of(_trial(), _simulated())
    assert list(table.columns)[:8] == [
        *("time_s", "length_m", "length_change_l0", "calcium_um"),
        *("force_measured_n", "force_measured_f0", "force_simulated_n", "force_simulated_f0"),
    ]  # fmt: skip
    assert set(MOMENTS) < set(table.columns)
    assert {values.size for values in table.columns.values()} == {TIME_S.size}
    assert table.columns["force_simulated_f0"][0] == pytest.approx(0.8)


def test_a_force_of_another_clock_is_not_interpolated_unasked() -> None:
    force_s = np.arange(150) / 500.0
    main, own = tables_of(_trial(force_s=force_s), None)
    assert "force_measured_n" not in main.columns
    assert own.columns["time_s"].tolist() == force_s.tolist()
    assert "in a table of its own" in main.notes[0]
    # it ends before the lengths do, so that there is nothing to interpolate at their end
    assert len(tables_of(_trial(force_s=force_s), None, interpolate=True)) == 2
    [whole] = tables_of(_trial(force_s=np.arange(151) / 500.0), None, interpolate=True)
    np.testing.assert_allclose(whole.columns["force_measured_f0"], 0.4 + TIME_S, rtol=1e-12)
    assert "interpolated by straight lines" in whole.notes[0]


def test_calcium_holds_and_changes_between_samples_are_told() -> None:
    [table] = tables_of(_trial(steps=True), None)
    assert table.columns["calcium_um"][[0, 49, 50, 299]].tolist() == [0.1, 0.1, 2.0, 2.0]
    trial = _trial(steps=True)
    shifted = Trial(
        trial.facts, TIME_S, trial.length_m, np.array([0.0, 0.0505]), trial.calcium_um, TIME_S, trial.force_n
    )
    assert "1 changes lie between samples" in tables_of(shifted, None)[0].notes[0]


@settings(max_examples=20, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    l0_m=st.one_of(st.just(1.0), st.floats(1e-4, 0.5)),
    stress_pa=st.floats(1e5, 3e5),
    steps=st.booleans(),
    seed=st.integers(0, 2**32 - 1),
)
def test_csv_comes_back_bit_for_bit(tmp_path: Path, l0_m: float, stress_pa: float, steps: bool, seed: int) -> None:
    f0_n = 1.0 if l0_m == 1.0 else stress_pa * (0.05 * l0_m) ** 2
    trial = _trial(l0_m, f0_n, steps=steps)
    noise = np.random.default_rng(seed).normal(0.0, 1e-3 * f0_n, TIME_S.size)
    trial = Trial(
        trial.facts, TIME_S, trial.length_m, trial.calcium_time_s, trial.calcium_um, TIME_S, trial.force_n + noise
    )
    [table] = tables_of(trial, None)
    write_csv(tmp_path / "a.csv", table)
    write_mapping(tmp_path / "a.yaml", trial, table)
    settings_ = ImportSettings(load_mapping(tmp_path / "a.yaml"), "a.yaml")
    [event, _] = list(import_recordings([tmp_path / "a.csv"], settings_, tmp_path / "bags", overwrite=True))
    assert isinstance(event, Imported), event
    back = event.trial
    for name in ("time_s", "length_m", "calcium_time_s", "calcium_um", "force_time_s", "force_n"):
        np.testing.assert_array_equal(getattr(back, name), getattr(trial, name), err_msg=name)
    for name in ("fibre", "trial", "data_set", "reference_length_m", "f0_n", "amplitude_l0"):
        assert getattr(back.facts, name) == getattr(trial.facts, name), name
    assert back.facts.pca == (None if steps else pytest.approx(trial.facts.pca, abs=1e-12))


def test_parquet_has_columns_and_facts(tmp_path: Path) -> None:
    [table] = tables_of(_trial(), _simulated())
    pq = pytest.importorskip("pyarrow.parquet")
    write_parquet(tmp_path / "a.parquet", table)
    read = pq.read_table(tmp_path / "a.parquet")
    assert read.column_names == list(table.columns)
    np.testing.assert_array_equal(read["length_m"].to_numpy(), table.columns["length_m"])
    assert read.schema.metadata[b"reference_length_m"] == b"0.0012"


def test_a_storage_file_is_as_opensim_wants_it(tmp_path: Path) -> None:
    [table] = tables_of(_trial(), _simulated())
    write_sto(tmp_path / "a.sto", table)
    lines = (tmp_path / "a.sto").read_text().splitlines()
    end = lines.index("endheader")
    assert lines[:5] == ["a", "version=1", f"nRows={TIME_S.size}", f"nColumns={len(table.columns)}", "inDegrees=no"]
    assert "fibre=mine" in lines[:end]
    names = lines[end + 1].split("\t")
    assert names[0] == "time"
    rows = [line.split("\t") for line in lines[end + 2 :]]
    assert len(rows) == TIME_S.size
    assert {len(row) for row in rows} == {len(names)} == {len(table.columns)}
    assert float(rows[1][names.index("length_m")]) == table.columns["length_m"][1]
