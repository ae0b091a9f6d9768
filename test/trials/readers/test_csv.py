"""Trials from CSV: units, facts, scaling, and every refusal."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from lab_tables import NAMES, rows
from lab_tables import trials as lab_trials
from lab_tables import write as lab_write

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.trials.readers.csv import read_csv
from xb_muscle_ros.trials.readers.description import ImportMapping
from xb_muscle_ros.trials.readers.mapping import build_mapping, load_mapping
from xb_muscle_ros.trials.trial import Trial

TIME_S = np.arange(300) / 1000
STRAIN = np.interp(TIME_S, [0.0, 0.1, 0.18, 0.3], [0.0, 0.0, 0.04, 0.04])  # a stretch of 4 % L0 from 0.1 s
FORCE = 0.4 + 5.0 * STRAIN  # in F0


def _mapping(length: str = "mm", force: str = "kPa", **keys: Any) -> ImportMapping:
    columns = {
        "time": {"column": "t", "unit": keys.pop("time", "s")},
        "length": {"column": "l", "unit": length, **keys.pop("of_length", {})},
        "force": {"column": "f", "unit": force},
        **keys.pop("columns", {}),
    }
    tree = {"fibre": "f1", "pca": 6.1, "columns": columns, **keys}
    return build_mapping({key: value for key, value in tree.items() if value is not None}, "here")


def _file(folder: Path, time: np.ndarray, length: np.ndarray, force: np.ndarray, **more: np.ndarray) -> Path:
    columns = {"t": time, "l": length, "f": force, **more}
    rows = [",".join(columns), *(",".join(repr(float(v)) for v in row) for row in zip(*columns.values(), strict=True))]
    path = folder / "trial_7.csv"
    path.write_text("\n".join(rows))
    return path


def _check(trial: Trial) -> None:
    """However the record came in, relative to L0 and F0 it is the same."""
    assert trial.time_s == pytest.approx(TIME_S, abs=1e-9)
    assert trial.length_change_l0 == pytest.approx(STRAIN, abs=1e-9)
    assert trial.measured_f0 == pytest.approx(FORCE, abs=1e-9)
    assert [phase.name for phase in trial.facts.phases] == ["isometric", "test_stretch", "hold"]
    assert trial.facts.phases[1].start_s == pytest.approx(0.1, abs=1e-5)
    assert (trial.facts.fibre, trial.facts.trial, trial.facts.pca) == ("f1", "trial_7", 6.1)
    assert trial.calcium_um == pytest.approx([10**-0.1])
    assert trial.calcium_time_s.tolist() == [0.0]
    assert trial.warnings == ()


@pytest.mark.parametrize("change", [False, True])
def test_lengths_in_l0_and_forces_in_f0_with_the_length_and_the_force_of_one(tmp_path: Path, change: bool) -> None:
    how = {"of_length": {"is": "change"}} if change else {}
    path = _file(tmp_path, TIME_S, 100.0 * (STRAIN + (not change)), 100.0 * FORCE)
    trial = read_csv(path, _mapping("%L0", "%F0", reference_length="1.25 mm", f0="0.9 mN", **how))
    _check(trial)
    assert (trial.facts.reference_length_m, trial.facts.f0_n) == pytest.approx((1.25e-3, 9e-4))
    assert trial.length_m[-1] == pytest.approx(1.04 * 1.25e-3)
    assert trial.force_n[0] == pytest.approx(0.4 * 9e-4)
    assert "lengths come relative to L0 = 0.00125 m (given)" in trial.facts.source
    assert "forces come relative to F0 = 0.0009 N" in trial.facts.source


@pytest.mark.parametrize(
    ("keys", "words"),
    [
        ({"reference_length": "1.25 m"}, r"L0 is 1.25 m; .*; is the reference length right\?"),
        ({"f0": "0.9 nF0"}, "unit 'nF0' of force is not known"),
        ({"f0": "1e-12 N"}, "f0 is 1e-12 N; allowed is"),
    ],
)
def test_a_length_of_l0_or_force_of_f0_that_no_muscle_has_is_refused(
    tmp_path: Path, keys: dict[str, str], words: str
) -> None:
    with pytest.raises(UserError, match=words):
        read_csv(_file(tmp_path, TIME_S, 1.0 + STRAIN, FORCE), _mapping("L0", "F0", **keys))


def test_lengths_in_mm_and_forces_in_mN(tmp_path: Path) -> None:
    path = _file(tmp_path, TIME_S, 20.0 * (1 + STRAIN), 300.0 * FORCE)
    trial = read_csv(path, _mapping("mm", "mN", f0="300 mN"))
    _check(trial)
    assert trial.facts.reference_length_m == pytest.approx(0.02)
    assert trial.facts.f0_n == pytest.approx(0.3)
    assert trial.length_m[-1] == pytest.approx(0.02 * 1.04)
    assert trial.force_n[0] == pytest.approx(0.12)


def test_times_in_ms(tmp_path: Path) -> None:
    _check(read_csv(_file(tmp_path, 1000 * TIME_S, 1 + STRAIN, FORCE), _mapping("L0", "F0", time="ms")))


def test_stress_is_stored_relative_to_f0(tmp_path: Path) -> None:
    trial = read_csv(_file(tmp_path, TIME_S, 1 + STRAIN, 90 * FORCE), _mapping("L0", "kPa", f0="90 kPa"))
    _check(trial)
    assert (trial.facts.reference_length_m, trial.facts.f0_n) == (1.0, 1.0)
    assert "F0 = 90000 Pa" in trial.facts.source


def test_change_of_length_in_mm_and_force_in_N(tmp_path: Path) -> None:
    mapping = _mapping("mm", "N", of_length={"is": "change"}, reference_length="42.8 mm", f0="36 N")
    trial = read_csv(_file(tmp_path, TIME_S, 42.8 * STRAIN, 36 * FORCE), mapping)
    _check(trial)
    assert trial.facts.reference_length_m == pytest.approx(0.0428)


def test_change_of_length_in_percent(tmp_path: Path) -> None:
    mapping = _mapping("%L0", "%F0", of_length={"is": "change"})
    _check(read_csv(_file(tmp_path, TIME_S, 100 * STRAIN, 100 * FORCE), mapping))


def test_half_sarcomeres_are_stored_relative_to_rest(tmp_path: Path) -> None:
    mapping = _mapping("nm", "F0", of_length={"of": "half_sarcomere"})
    trial = read_csv(_file(tmp_path, TIME_S, 1300 * (1 + STRAIN), FORCE), mapping)
    _check(trial)
    assert trial.facts.reference_length_m == 1.0
    assert trial.length_m[0] == pytest.approx(1.0)


def test_calcium_that_changes_is_kept_where_it_does(tmp_path: Path) -> None:
    pca = np.where(TIME_S < 0.05, 9.0, 4.5)
    mapping = _mapping("L0", "F0", pca=None, columns={"calcium": {"column": "ca", "unit": "pCa"}})
    trial = read_csv(_file(tmp_path, TIME_S, 1 + STRAIN, FORCE, ca=pca), mapping)
    assert trial.calcium_time_s.tolist() == [0.0, 0.05]
    assert trial.calcium_um == pytest.approx([1e-3, 10**1.5])
    assert trial.facts.pca is None


def test_constant_calcium_tells_pca(tmp_path: Path) -> None:
    mapping = _mapping("L0", "F0", pca=None, columns={"calcium": {"column": "ca", "unit": "nM"}})
    trial = read_csv(_file(tmp_path, TIME_S, 1 + STRAIN, FORCE, ca=np.full(300, 100.0)), mapping)
    assert trial.calcium_um == pytest.approx([0.1])
    assert trial.facts.pca == pytest.approx(7.0)


def test_amplitude_and_recovery_are_measured_where_not_given(tmp_path: Path) -> None:
    time_s = np.arange(600) / 1000
    strain = np.interp(time_s, [0, 0.1, 0.14, 0.18, 0.28, 0.36, 0.6], [0, 0, 0.02, 0, 0, 0.04, 0.04])
    path = _file(tmp_path, time_s, 1 + strain, 1 + strain)
    facts = read_csv(path, _mapping("L0", "F0")).facts
    assert facts.amplitude_l0 == pytest.approx(0.02, abs=1e-4)
    assert facts.recovery_s == pytest.approx(0.1, abs=1e-4)
    facts = read_csv(path, _mapping("L0", "F0", amplitude_l0=0.0203, recovery_s=0.116)).facts
    assert (facts.amplitude_l0, facts.recovery_s) == (0.0203, 0.116)


def test_negative_times_are_shifted_and_told(tmp_path: Path) -> None:
    trial = read_csv(_file(tmp_path, TIME_S - 0.1, 1 + STRAIN, FORCE), _mapping("L0", "F0"))
    assert trial.time_s == pytest.approx(TIME_S)
    assert trial.facts.phases[1].start_s == pytest.approx(0.1, abs=1e-5)
    (warning,) = trial.warnings
    assert "shifted by 0.1 s" in warning


TABLE = {"isometric_scaling": {"source": "a table", "fractions_f0": {6.1: 0.5}}}


def test_isometric_scaling_makes_the_initial_force_that_of_the_table(tmp_path: Path) -> None:
    path = _file(tmp_path, TIME_S, 1 + STRAIN, FORCE)
    scaled = read_csv(path, _mapping("L0", "F0", **TABLE))
    assert scaled.measured_f0 == pytest.approx(FORCE * 0.5 / 0.4)
    assert "force multiplied by 1.25" in scaled.facts.source
    assert "0.5 F0 (a table)" in scaled.facts.source
    plain = read_csv(path, _mapping("L0", "F0", **TABLE), isometric_scaling=False)
    assert plain.measured_f0.tolist() == FORCE.tolist()
    assert "multiplied" not in plain.facts.source


@pytest.mark.parametrize(
    ("keys", "wanted", "words"),
    [
        ({}, True, "isometric scaling needs isometric_scaling.fractions_f0"),
        ({**TABLE, "pca": 6.2}, None, "pCa is 6.2; isometric_scaling.fractions_f0 of here has 6.1"),
    ],
)
def test_scaling_that_cannot_be_done_is_refused(
    tmp_path: Path, keys: dict[str, Any], wanted: bool | None, words: str
) -> None:
    with pytest.raises(UserError) as refused:
        read_csv(_file(tmp_path, TIME_S, 1 + STRAIN, FORCE), _mapping("L0", "F0", **keys), wanted)
    assert words in str(refused.value)
    assert "--no-isometric-scaling" in str(refused.value)


def test_scaling_of_a_force_below_zero_is_refused(tmp_path: Path) -> None:
    with pytest.raises(UserError, match=r"initial isometric force is -0\.1 F0"):
        read_csv(_file(tmp_path, TIME_S, 1 + STRAIN, FORCE - 0.5), _mapping("L0", "F0", **TABLE))


def test_a_large_scaling_is_pointed_out(tmp_path: Path) -> None:
    (warning,) = read_csv(_file(tmp_path, TIME_S, 1 + STRAIN, FORCE / 4), _mapping("L0", "F0", **TABLE)).warnings
    assert "multiplied by 5 " in warning


def test_a_trial_that_begins_with_a_stretch_is_not_scaled_and_says_so(tmp_path: Path) -> None:
    path = _file(tmp_path, TIME_S[:180], 1 + STRAIN[100:280], FORCE[100:280])
    trial = read_csv(path, _mapping("mm", "F0", **TABLE))
    assert trial.measured_f0.tolist() == FORCE[100:280].tolist()
    assert trial.facts.reference_length_m == pytest.approx(1e-3)  # the first sample
    assert len(trial.warnings) == 2
    assert "not scaled to an isometric trial" in trial.facts.source


def _with(values: np.ndarray, index: int, value: float) -> np.ndarray:
    changed = values.copy()
    changed[index] = value
    return changed


@pytest.mark.parametrize(
    ("time", "length", "force", "words"),
    [
        (_with(TIME_S, 5, 0.003), 1 + STRAIN, FORCE, "line 7, column 't': 0.003 s does not come after 0.004 s"),
        (_with(TIME_S, 5, 0.004), 1 + STRAIN, FORCE, "line 7, column 't': 0.004 s does not come after 0.004 s"),
        (TIME_S, _with(1 + STRAIN, 0, np.nan), FORCE, "line 2, column 'l' holds 'nan'"),
        (TIME_S, 1 + STRAIN, _with(FORCE, 299, np.inf), "line 301, column 'f' holds 'inf'"),
        (1000 * TIME_S, 1 + STRAIN, FORCE, "samples are 1 s apart"),
        (TIME_S, 100 * (1 + STRAIN), FORCE, "line 2, column 'l' is 100 L0"),
        (TIME_S, _with(1 + STRAIN, 9, -1.0), FORCE, "line 11, column 'l' is -1 L0"),
        (TIME_S, 1 + STRAIN, 100 * FORCE, "line 2, column 'f' is 40 F0"),
    ],
)
def test_bad_numbers_are_refused_by_line_and_column(
    tmp_path: Path, time: np.ndarray, length: np.ndarray, force: np.ndarray, words: str
) -> None:
    with pytest.raises(UserError) as refused:
        read_csv(_file(tmp_path, time, length, force), _mapping("L0", "F0"))
    assert words in str(refused.value)
    assert "trial_7.csv" in str(refused.value)


@pytest.mark.parametrize(
    ("name", "pca", "told"),
    [("fa_pCa6.2", 4.5, True), ("fa_pCa62", 6.2, False), ("fa_pCa4_5", 4.5, False), ("pCa6.2_to_pCa4.5", 6.2, False)],
)
def test_a_file_that_is_called_by_another_pca_is_told(tmp_path: Path, name: str, pca: float, told: bool) -> None:
    (trial,) = lab_trials(lab_write(tmp_path, [",".join(NAMES), *rows()], f"{name}.csv"), pca=pca)
    line = "the file's name tells pCa 6.2, the trial has 4.5; check both"
    assert any(line in warning for warning in trial.warnings) == told


def test_a_change_taken_for_a_length_is_refused(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="does the column hold a change of length"):
        read_csv(_file(tmp_path, TIME_S, 20 * STRAIN, FORCE), _mapping("mm", "F0"))


def test_without_calcium_there_is_no_trial(tmp_path: Path) -> None:
    columns = {name: {"column": name[0], "unit": unit} for name, unit in (("time", "s"), ("length", "L0"))}
    with pytest.raises(UserError, match=r"trial_7\.csv: calcium is not known; give --pca"):
        read_csv(_file(tmp_path, TIME_S, 1 + STRAIN, FORCE), build_mapping({"fibre": "f", "columns": columns}, "here"))


def test_an_absurd_pca_is_refused(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="pca is 61; allowed is 2 to 12"):
        read_csv(_file(tmp_path, TIME_S, 1 + STRAIN, FORCE), _mapping("L0", "F0", pca=61))


PROTOCOL = {
    "45": (4.5, 1.001428),
    "61": (6.1, 0.516474),
    "63": (6.3, 0.340731),
    "66": (6.6, 0.028163),
    "90": (9.0, 0.018888),
}


@pytest.mark.parametrize("name", list(PROTOCOL))
def test_the_recordings_of_18Dec2017a(repo_root: Path, shared_data: Path, name: str) -> None:
    pca, fraction = PROTOCOL[name]
    file = repo_root / "scripts" / "datasets" / "rat_soleus_18Dec2017a.yaml"
    mapping = build_mapping(load_mapping(file), str(file))
    folder = shared_data / "recordings" / "rat_soleus_18Dec2017a"
    trial = read_csv(folder / f"amp383_rt1ms_pca{name}.csv", mapping)
    facts = trial.facts
    assert (facts.fibre, facts.pca, facts.amplitude_l0, facts.recovery_s) == ("18Dec2017a", pca, 0.0383, 0.001)
    before = trial.time_s <= 0.08
    assert np.mean(trial.length_change_l0[before]) == pytest.approx(0.0, abs=1e-5)
    assert np.mean(trial.measured_f0[before]) == pytest.approx(fraction, rel=1e-3)
    # The record shows a little less than the 3.83 % asked for.
    assert 0.035 < np.max(trial.length_change_l0) < 0.0383
    assert trial.time_s.size == 501
    assert trial.warnings == ()


@pytest.mark.parametrize("name", ["triangle1_pca45", "triangle4_pca90", "triangle5_pca90", "triangle6_pca66"])
def test_the_triangles_of_18Dec2017a(repo_root: Path, shared_data: Path, name: str) -> None:
    file = repo_root / "scripts" / "datasets" / "rat_soleus_18Dec2017a_triangles.yaml"
    mapping = build_mapping(load_mapping(file), str(file))
    trial = read_csv(shared_data / "recordings" / "rat_soleus_18Dec2017a" / f"{name}.csv", mapping)
    assert trial.facts.pca == float(name[-2:]) / 10
    assert trial.facts.reference_length_m == 1.0
    # About 1300 nm at rest, and 82 nm more at the peak.
    assert trial.length_m[0] == pytest.approx(1.0, abs=3e-4)
    assert np.max(trial.length_m) == pytest.approx(1.064, abs=0.002)
    assert len(trial.warnings) == (2 if "5_" in name else 0)  # triangle 5 begins with its stretch
