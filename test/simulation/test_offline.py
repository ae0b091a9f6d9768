"""Replay against the step it is made of, and what it makes of calcium and reference trials."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.models.fibre_file import load_fibre
from xb_muscle_ros.models.muscle import Muscle
from xb_muscle_ros.replay.report import RELATIVE, Record, record, table, with_relative_srs
from xb_muscle_ros.replay.run import replay, write_results
from xb_muscle_ros.scores.estimate import Estimate
from xb_muscle_ros.scores.readout import ISOMETRIC, SRS_TEST
from xb_muscle_ros.simulation import offline
from xb_muscle_ros.simulation.offline import calcium_per_step, simulate_trial
from xb_muscle_ros.trials.bags import read_simulated, read_trial, write_trial
from xb_muscle_ros.trials.protocol import StretchShortenStretch
from xb_muscle_ros.trials.trial import Trial, TrialFacts


@pytest.fixture(scope="module")
def muscle() -> Muscle:
    return Muscle(load_fibre("18Dec2017a"))


def test_calcium_holds_until_the_next_value() -> None:
    trial = Trial(
        TrialFacts("f", "t"),
        time_s=np.array([1.0, 2.0, 3.0, 4.0]),
        length_m=np.ones(4),
        calcium_time_s=np.array([0.5, 2.0, 3.5]),
        calcium_um=np.array([10.0, 20.0, 30.0]),
    )
    # settles with the one at 0.5; steps ending at 2, 3, 4 start at 1, 2, 3
    assert calcium_per_step(trial).tolist() == [10.0, 10.0, 20.0, 20.0]


def test_calcium_must_be_known_at_the_start() -> None:
    trial = Trial(TrialFacts("f", "late"), np.array([0.0, 1.0]), np.ones(2), np.array([0.5]), np.array([1.0]))
    with pytest.raises(UserError, match="trial late: first calcium is stamped"):
        calcium_per_step(trial)


def test_replay_takes_the_steps_that_step_takes(muscle: Muscle) -> None:
    trial = StretchShortenStretch(0.0383, 0.01).trial("18Dec2017a", 6.1)
    simulated = simulate_trial(muscle, trial)
    length, calcium = trial.length_change_l0, float(trial.calcium_um[0])
    state = muscle.settle(float(length[0]), calcium)
    stamps = np.rint(trial.time_s * 1e9).astype(np.int64).tolist()
    for k in range(1, trial.time_s.size):
        dt_s = (stamps[k] - stamps[k - 1]) / 1e9
        state = muscle.step(state, float(length[k]), calcium, dt_s)
        assert muscle.outputs(state).force_f0 == simulated.force_n[k]


def test_a_bag_and_its_trial_give_the_same_bits(muscle: Muscle, tmp_path: Path) -> None:
    trial = StretchShortenStretch(0.0121, 0.05).trial("18Dec2017a", 6.3)
    write_trial(tmp_path / "bag", trial)
    again = simulate_trial(muscle, read_trial(tmp_path / "bag"))
    np.testing.assert_array_equal(again.force_n, simulate_trial(muscle, trial).force_n)


def test_units_of_the_bag_do_not_change_the_answer(muscle: Muscle) -> None:
    """The same fibre in metres and newtons as in L0 and F0."""
    trial = StretchShortenStretch(0.0383, 0.01).trial("18Dec2017a", 6.1)
    si = replace(
        trial,
        length_m=trial.length_m * 2.0**-10,
        facts=replace(trial.facts, reference_length_m=2.0**-10, f0_n=2.0**-11),
    )
    normalised, scaled = simulate_trial(muscle, trial), simulate_trial(muscle, si)
    np.testing.assert_array_equal(scaled.force_n, normalised.force_n * 2.0**-11)
    np.testing.assert_array_equal(scaled.ce_length_m, normalised.ce_length_m * 2.0**-10)


def test_a_perfect_model_has_no_error(muscle: Muscle) -> None:
    trial = StretchShortenStretch(0.0383, 0.01).trial("18Dec2017a", 6.1)
    simulated = simulate_trial(muscle, trial)
    trial = replace(trial, force_time_s=trial.time_s, force_n=simulated.force_n)
    entry = record(trial, simulated, muscle.fibre).as_row()
    assert entry["rmsd_f0"] == {"whole": 0.0, "conditioning": 0.0, "test": 0.0}
    assert entry["srs_test"] == entry["measured_srs_test"]
    assert entry["srs_conditioning"] == entry["measured_srs_conditioning"] > entry["srs_test"]
    assert entry["isometric_force_f0"] == pytest.approx(0.5243, abs=1e-3)


def test_absent_phases_and_measurements_are_null(muscle: Muscle) -> None:
    trial = StretchShortenStretch(0.0, 0.01).trial("18Dec2017a", 6.1)
    entry = record(trial, simulate_trial(muscle, trial), muscle.fibre).as_row()
    assert entry["rmsd_f0"] == {"whole": None, "conditioning": None, "test": None}
    assert entry["srs_conditioning"] is None
    assert entry["measured_srs_test"] is None
    assert entry["relative_srs"] is None


def test_relative_srs_needs_a_reference_of_the_same_pca() -> None:
    def of(pca: float, amplitude_l0: float, simulated: float, measured: Estimate) -> Record:
        found = ({SRS_TEST: each, RELATIVE: Estimate(None)} for each in (Estimate(simulated), measured))
        return Record("t", "f", "m", "", pca, amplitude_l0, 0.1, {}, *found)

    records = [
        of(6.1, 0.0383, 8.0, Estimate(6.0, 0.3)),
        of(6.1, 0.0, 10.0, Estimate(None, 0.3)),
        of(6.3, 0.0383, 8.0, Estimate(6.0, 0.3)),
    ]
    found = with_relative_srs(records)
    assert [r.simulated[RELATIVE].value for r in found] == [0.8, 1.0, None]
    assert [r.measured[RELATIVE].value for r in found] == [None, None, None]


def test_files_of_a_replay(tmp_path: Path) -> None:
    fibre = load_fibre("18Dec2017a")
    trials = [StretchShortenStretch(a, 0.01).trial(fibre.name, 6.1) for a in (0.0, 0.0383)]
    results = replay(trials, fibre)
    pages = write_results(tmp_path, trials, results)
    content = json.loads((tmp_path / "replay.json").read_text())
    assert [t["trial"] for t in content["trials"]] == ["amp0_rt10ms_pca61", "amp383_rt10ms_pca61"]
    assert content["trials"][1]["relative_srs"] == pytest.approx(
        content["trials"][1]["srs_test"] / content["trials"][0]["srs_test"]
    )
    assert pages[1].stat().st_size > 10_000
    assert pages[1].with_suffix(".pdf").is_file()
    back = read_simulated(tmp_path / "bags" / "amp383_rt10ms_pca61")
    assert back is not None
    np.testing.assert_array_equal(back.force_n, results.simulated[1].force_n)
    assert "amp383_rt10ms_pca61" in table(results.records, "title")


def test_trial_names_must_differ() -> None:
    fibre = load_fibre("18Dec2017a")
    trial = StretchShortenStretch(0.0, 0.01).trial(fibre.name, 6.1)
    with pytest.raises(UserError, match="amp0_rt10ms_pca61 comes 2 times"):
        replay([trial, trial], fibre)


def test_recordings_of_18dec2017a(shared_data: Path, repo_root: Path) -> None:
    """The released set against the measured forces; the numbers are what it gave when first run."""
    from xb_muscle_ros.trials.readers.csv import read_csv
    from xb_muscle_ros.trials.readers.mapping import build_mapping, load_mapping

    where = repo_root / "scripts/datasets/rat_soleus_18Dec2017a.yaml"
    mapping = build_mapping(load_mapping(where), "test")
    files = sorted((shared_data / "recordings/rat_soleus_18Dec2017a").glob("amp*.csv"))
    results = replay([read_csv(f, mapping) for f in files], load_fibre("18Dec2017a"))
    whole = {r.pca: r.rmsd_f0["whole"] for r in results.records}
    assert whole == pytest.approx({4.5: 0.066, 6.1: 0.059, 6.3: 0.086, 6.6: 0.024, 9.0: 0.0019}, abs=0.002)


def test_measured_numbers_come_with_errors_and_a_mark(muscle: Muscle) -> None:
    """A slow ramp in loud hum: the value, its error and a mark; at 6 ms a dash, and a line that says why."""
    protocol = StretchShortenStretch(0.0, 0.01, lead_s=0.5).trial("18Dec2017a", 9.0)
    simulated = simulate_trial(muscle, protocol)
    loud = simulated.force_n + 0.02 * np.sin(2.0 * np.pi * 50.0 * protocol.time_s)
    found = record(replace(protocol, force_time_s=protocol.time_s, force_n=loud), simulated, muscle.fibre)
    entry = found.as_row()
    assert entry["measured_srs_test_se"] > abs(entry["measured_srs_test"] - entry["srs_test"]) / 1.5
    assert "srs_test_se" not in entry
    text = table([replace(found, measured={**found.measured, SRS_TEST: Estimate(2.0, 5.1)})], "title")
    assert "2.0 ± 5.1*" in text
    assert "* standard error as large as the value or larger" in text
    slow = replace(protocol, force_time_s=protocol.time_s[::6], force_n=loud[::6])
    sparse = record(slow, simulated, muscle.fibre)
    assert sparse.measured[SRS_TEST].value is None
    assert (sparse.measured[ISOMETRIC].se or 0.0) > 0.0
    assert "SRS of the test stretch, measured, of trial" in table([sparse], "title")


def test_parts_of_a_trial_are_the_trial(muscle: Muscle, monkeypatch: pytest.MonkeyPatch) -> None:
    trial = StretchShortenStretch(0.0383, 0.01).trial("18Dec2017a", 6.1)
    whole = simulate_trial(muscle, trial)
    few = replace(trial, time_s=trial.time_s[:9], length_m=trial.length_m[:9])
    for at_once, given in ((1, few), (7, trial), (trial.time_s.size - 1, trial)):
        monkeypatch.setattr(offline, "_AT_ONCE", at_once)
        found = simulate_trial(muscle, given)
        size = given.time_s.size
        assert found.force_n.tobytes() == whole.force_n[:size].tobytes()
        assert found.ce_velocity_m_per_s.tobytes() == whole.ce_velocity_m_per_s[:size].tobytes()
        assert all(values.tobytes() == whole.moments[name][:size].tobytes() for name, values in found.moments.items())


def test_a_fault_in_a_later_part_is_told_as_one_of_the_trial(muscle: Muscle, monkeypatch: pytest.MonkeyPatch) -> None:
    trial = StretchShortenStretch(0.0383, 0.01).trial("18Dec2017a", 6.1)
    length = trial.length_m.copy()
    length[400] = 12.0 * trial.facts.reference_length_m
    broken = replace(trial, length_m=length)
    told = []
    for at_once in (64, trial.time_s.size):
        monkeypatch.setattr(offline, "_AT_ONCE", at_once)
        with pytest.raises(UserError, match="sample 400: length change is 11 L0") as refused:
            simulate_trial(muscle, broken)
        told.append(str(refused.value))
    assert told[0] == told[1]
