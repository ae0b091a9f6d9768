"""Importing one trial after another: what is kept, refused, left out, and what an interruption leaves."""

from __future__ import annotations

import os
import shutil
import tracemalloc
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.io import savemat

from xb_muscle_ros.trials import importing
from xb_muscle_ros.trials.bag_files import clear_leftovers
from xb_muscle_ros.trials.bags import find_bags, read_trial, write_trial
from xb_muscle_ros.trials.completing import Known
from xb_muscle_ros.trials.importing import (
    Failed,
    FileDone,
    Imported,
    Kept,
    bag_name,
    find_recordings,
    import_recordings,
    line_of,
    recorded_provenance,
)
from xb_muscle_ros.trials.readers.settings import ImportSettings
from xb_muscle_ros.trials.study import read_study
from xb_muscle_ros.trials.trial import Phase, Trial, TrialFacts

TREE: dict[str, Any] = {
    "fibre": "f1",
    "pca": 6.1,
    "columns": {
        "time": {"column": "t", "unit": "s"},
        "length": {"column": "l", "unit": "L0"},
        "force": {"column": "f", "unit": "F0"},
    },
}


def _file(path: Path, force: str = "0.4") -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text("t,l,f\n" + "\n".join(f"{i / 1000},1.0,{force}" for i in range(20)))
    return path


def _run(files: list[Path], out: Path, overwrite: bool = False, **keys: Any) -> list[importing.Event]:
    return list(import_recordings(files, ImportSettings({**TREE, **keys}, "here"), out, overwrite))


def _kinds(events: list[importing.Event]) -> list[str]:
    return [type(event).__name__ for event in events if not isinstance(event, FileDone)]


@pytest.mark.parametrize(("count", "end"), [(16, "hold@0.0150"), (700, "hold@0.0150 and 684 more phases")])
def test_the_line_on_a_trial_tells_a_few_phases_and_how_many_more(count: int, end: str) -> None:
    time_s = np.arange(count + 1) / 1000
    phases = tuple(Phase("hold", i / 1000, (i + 1) / 1000) for i in range(count))
    facts = TrialFacts("f1", "t1", 6.1, reference_length_m=7e-4, phases=phases)
    trial = Trial(facts, time_s, np.full(time_s.size, 7e-4), np.zeros(1), np.array([0.8]), np.empty(0), np.empty(0))
    line = line_of(trial)
    assert line.endswith(end)
    assert line.count("@") == 16


def test_one_trial_is_written_before_the_next_is_read(tmp_path: Path) -> None:
    files = [_file(tmp_path / "a.csv"), tmp_path / "b.csv"]  # the second comes into being later
    events: Iterator[importing.Event] = import_recordings(files, ImportSettings(TREE, "here"), tmp_path / "bags")
    first = next(events)
    assert isinstance(first, Imported)
    assert read_trial(first.bag).facts == first.trial.facts
    assert isinstance(next(events), FileDone)
    _file(files[1])
    assert isinstance(next(events), Imported)


def test_the_same_again_is_kept_wherever_the_file_lies(tmp_path: Path) -> None:
    _run([_file(tmp_path / "a.csv")], tmp_path / "bags")
    moved = tmp_path / "elsewhere" / "a.csv"
    moved.parent.mkdir()
    shutil.copy(tmp_path / "a.csv", moved)
    (event, _) = _run([moved], tmp_path / "bags")
    assert event == Kept(tmp_path / "bags" / "f1_a")


@pytest.mark.parametrize(
    ("force", "keys", "words"),
    [
        ("0.5", {}, "exists, made of another content of a.csv; use --overwrite"),
        ("0.4", {"pca": 9.0}, "exists, made of the same file with another mapping; use --overwrite"),
    ],
)
def test_what_has_changed_is_refused_unless_told_otherwise(
    tmp_path: Path, force: str, keys: dict[str, Any], words: str
) -> None:
    _run([_file(tmp_path / "a.csv")], tmp_path / "bags")
    before = read_trial(tmp_path / "bags" / "f1_a")
    file = _file(tmp_path / "a.csv", force)
    (event, _) = _run([file], tmp_path / "bags", **keys)
    assert isinstance(event, Failed)
    assert words in event.why
    assert read_trial(tmp_path / "bags" / "f1_a").force_n.tolist() == before.force_n.tolist()
    assert _kinds(_run([file], tmp_path / "bags", overwrite=True, **keys)) == ["Imported"]
    assert _kinds(_run([file], tmp_path / "bags", **keys)) == ["Kept"]


def test_a_bag_that_was_not_imported_is_never_taken_for_one(tmp_path: Path, trial: Trial) -> None:
    write_trial(tmp_path / "bags" / "f1_a", trial)
    (event, _) = _run([_file(tmp_path / "a.csv")], tmp_path / "bags")
    assert isinstance(event, Failed)
    assert "f1_a exists; use --overwrite" in event.why


@pytest.mark.parametrize("damage", ["cut", "gone", "metadata"])
def test_a_bag_that_is_not_whole_is_not_kept(tmp_path: Path, damage: str) -> None:
    file = _file(tmp_path / "a.csv")
    _run([file], tmp_path / "bags")
    bag = tmp_path / "bags" / "f1_a"
    data = bag / "f1_a_0.mcap"
    if damage == "cut":
        data.write_bytes(data.read_bytes()[:-20])
    elif damage == "gone":
        data.unlink()
    else:
        (bag / "metadata.yaml").write_text("a: [")
    assert recorded_provenance(bag) is None
    assert _kinds(_run([file], tmp_path / "bags")) == ["Failed"]
    assert _kinds(_run([file], tmp_path / "bags", overwrite=True)) == ["Imported"]


def test_after_an_interruption_the_next_run_goes_on(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    files = [_file(tmp_path / f"{name}.csv") for name in "abc"]
    write, written = importing.write_trial, []

    def stopped(bag: Path, trial: Trial, **more: Any) -> None:
        if len(written) == 1:
            raise KeyboardInterrupt
        written.append(bag)
        write(bag, trial, **more)

    monkeypatch.setattr(importing, "write_trial", stopped)
    with pytest.raises(KeyboardInterrupt):
        _run(files, tmp_path / "bags")
    assert [path.name for path in (tmp_path / "bags").iterdir()] == ["f1_a"]
    monkeypatch.setattr(importing, "write_trial", write)
    assert _kinds(_run(files, tmp_path / "bags")) == ["Kept", "Imported", "Imported"]


def test_a_bag_that_is_interrupted_leaves_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from xb_muscle_ros.trials import bag_writing

    def stopped(*_: Any, **__: Any) -> bytes:
        raise KeyboardInterrupt

    monkeypatch.setattr(bag_writing.ros_types, "joint_state", stopped)
    with pytest.raises(KeyboardInterrupt):
        _run([_file(tmp_path / "a.csv")], tmp_path / "bags")
    assert list((tmp_path / "bags").iterdir()) == []


def test_leftovers_of_a_killed_run_are_cleared(tmp_path: Path, trial: Trial) -> None:
    gone = 2**22 + 1  # beyond the largest process number
    for name in ("a", "b"):
        write_trial(tmp_path / name, trial)
    (tmp_path / "a").rename(
        tmp_path / f".a.{gone}.old"
    )  # killed between taking the old bag away and the new one's place
    shutil.copytree(tmp_path / "b", tmp_path / f".b.{gone}.old")
    shutil.copytree(tmp_path / "b", tmp_path / f".c.{gone}.tmp")
    shutil.copytree(tmp_path / "b", tmp_path / f".d.{os.getpid()}.tmp")  # of a run that goes on
    (tmp_path / ".e.1.tmp.txt").write_text("not ours")
    clear_leftovers(tmp_path)
    assert sorted(path.name for path in tmp_path.iterdir()) == [f".d.{os.getpid()}.tmp", ".e.1.tmp.txt", "a", "b"]
    assert read_trial(tmp_path / "a").facts == trial.facts


def test_trials_of_one_file_are_kept_and_left_out_one_by_one(tmp_path: Path) -> None:
    time_s = (np.arange(200) - 100) / 1000
    shape = (200, 3, 1, 1)
    data = {
        "texp": np.broadcast_to(time_s[:, None, None, None], shape),
        "Lexp": np.broadcast_to(np.interp(time_s, [0.005, 0.0893], [0, 0.0383])[:, None, None, None], shape),
        "Fexp": np.ones(shape),
        "pCas": [4.5, 6.1, 6.1],  # one twice
        "ISIs": [1.0],
        "AMPs": [0.0],
    }
    savemat(tmp_path / "f1.mat", {"data": data})
    settings = ImportSettings({}, "here")
    events = list(import_recordings([tmp_path / "f1.mat"], settings, tmp_path / "bags"))
    assert _kinds(events) == ["Imported", "Imported", "Failed"]
    assert isinstance(events[2], Failed)
    assert "trial f1_amp0_rt1ms_pca61, and" in events[2].why
    shutil.rmtree(tmp_path / "bags" / "f1_amp0_rt1ms_pca45")
    again = list(import_recordings([tmp_path / "f1.mat"], settings, tmp_path / "bags"))
    assert _kinds(again) == ["Imported", "Kept", "Failed"]
    assert len(find_bags([tmp_path / "bags"])) == 2


def test_broken_files_do_not_stop_the_others(tmp_path: Path) -> None:
    (tmp_path / "b.csv").write_text("")
    (tmp_path / "c.mat").write_bytes(b"MATLAB 5.0 MAT-file")
    (tmp_path / "d.csv").mkdir()
    files = [_file(tmp_path / "a.csv"), *(tmp_path / name for name in ("b.csv", "c.mat", "d.csv", "e.csv"))]
    files.append(_file(tmp_path / "f.csv"))
    events = _run(files, tmp_path / "bags")
    assert _kinds(events) == ["Imported", "Failed", "Failed", "Failed", "Failed", "Imported"]
    for event, file in zip((e for e in events if isinstance(e, Failed)), files[1:5], strict=True):
        assert str(file) in event.why
        assert "\n" not in event.why


def test_a_broken_file_does_not_keep_its_name_from_another(tmp_path: Path) -> None:
    files = [_file(tmp_path / "a.csv", "nan"), _file(tmp_path / "x" / "a.csv")]
    assert _kinds(_run(files, tmp_path / "bags")) == ["Failed", "Imported"]


def test_points_in_names_are_kept(tmp_path: Path) -> None:
    names = ("s_pCa6.0.csv", "s_pCa6.2.csv", "plain_pCa6.0", "plain_pCa6.2", "fa1.txt", "b1.CSV", "x.d01")
    events = _run([_file(tmp_path / name) for name in names], tmp_path / "bags", fibre="fa")
    found = [event.bag.name for event in events if isinstance(event, Imported)]
    assert found == [
        *("fa_s_pCa6.0", "fa_s_pCa6.2", "fa_plain_pCa6.0", "fa_plain_pCa6.2", "fa_fa1", "fa_b1", "fa_x.d01"),
    ]


def test_bags_with_points_in_their_names_stay_apart(tmp_path: Path, trial: Trial) -> None:
    for name in ("sss_pCa6.0", "sss_pCa6.2"):
        write_trial(tmp_path / "raw" / name, trial)
    settings = ImportSettings(
        {"fibre": "f", "file_name": {"pattern": r"pCa(?P<pca>[\d.]+)$"}, "reference_length": "0.5717 mm"}, "here"
    )
    events = list(import_recordings(find_recordings([tmp_path / "raw"]), settings, tmp_path / "bags"))
    made = [event for event in events if isinstance(event, Imported)]
    assert [event.bag.name for event in made] == ["f_sss_pCa6.0", "f_sss_pCa6.2"]
    assert [event.trial.facts.pca for event in made] == [6.0, 6.2]


@pytest.mark.parametrize(
    ("mapping", "options", "pca", "told"),
    [({}, {"pca": 6.1}, 6.1, "pca is 6.1, as the option gives it; the file's name tells 4.5"),
     ({"pca": 6.1}, {}, 4.5, "pca is 4.5, as the file's name tells by file_name.pattern; the mapping's 6.1 is for"),
     ({"pca": 4.5}, {}, 4.5, "")],
)  # fmt: skip
def test_pca_of_an_option_goes_before_that_of_a_name(
    tmp_path: Path, trial: Trial, mapping: dict[str, float], options: dict[str, float], pca: float, told: str
) -> None:
    """Regression: the name's was taken without a word."""
    write_trial(tmp_path / "raw" / "sss_pCa4.5", trial)
    name = {"pattern": r"pCa(?P<pca>[\d.]+)$"}
    tree = {"fibre": "f", "file_name": name, "reference_length": "0.5717 mm", **mapping}
    settings = ImportSettings(tree, "here", overrides=options)
    events = list(import_recordings(find_recordings([tmp_path / "raw"]), settings, tmp_path / "bags"))
    (made,) = (event.trial for event in events if isinstance(event, Imported))
    assert made.facts.pca == pca
    assert [told] * bool(told) == [told for line in made.warnings if "as the" in line and told in line]


def test_trials_that_would_have_one_name_are_named(tmp_path: Path) -> None:
    events = _run([_file(tmp_path / name) for name in ("a 1.csv", "a_1.csv", "a_1")], tmp_path / "bags")
    assert _kinds(events) == ["Imported", "Failed", "Failed"]
    assert all("would both become" in event.why for event in events if isinstance(event, Failed))


@pytest.mark.parametrize(
    ("data_set", "trial", "name"),
    [
        ("cat", "ramp 1", "cat_ramp_1"),
        ("cat", "cat_1", "cat_1"),
        ("cat", "cat", "cat"),
        ("a", "a1", "a_a1"),
        ("a", "b1", "a_b1"),
        ("a", "a-1", "a_a-1"),
        ("my cat", "my cat_1", "my_cat_1"),
        ("c/a..t", "é", "c_a..t__"),
        ("..", "x", "_x"),
    ],
)
def test_bag_names_are_plain(data_set: str, trial: str, name: str) -> None:
    assert bag_name(data_set, trial) == name


def test_memory_of_an_import_is_that_of_its_samples(tmp_path: Path) -> None:
    """Neither text nor cells of a large table are kept: less than 100 bytes a row of three numbers."""

    def peak_bytes(rows: int) -> int:
        path = tmp_path / f"t{rows}.csv"
        path.write_text("\n".join(["t,l,f", *(f"{i / 1000:.3f},1.05000,0.30000" for i in range(rows))]))
        tracemalloc.start()
        try:
            assert _kinds(_run([path], tmp_path / "bags")) == ["Imported"]
            return tracemalloc.get_traced_memory()[1]
        finally:
            tracemalloc.stop()

    more = peak_bytes(800_000) - peak_bytes(400_000)
    assert more < 400_000 * 100


TIME_S = np.arange(1200) / 1000
CORNERS_S = [0.4, 0.48, 0.56, 0.66, 0.74]
QUIET = np.full(TIME_S.size, 0.4)


def _stretches(amplitude: float) -> np.ndarray:
    return 1.0 + np.interp(TIME_S, CORNERS_S, np.array([0.0, 1.0, 0.0, 0.0, 1.0]) * amplitude)


def _lone_stretch(amplitude: float) -> np.ndarray:
    return 1.0 + np.interp(TIME_S, CORNERS_S[3:], [0.0, amplitude])


def _artefact(force_f0: float) -> np.ndarray:
    return np.where((TIME_S >= 0.2) & (TIME_S < 0.22), force_f0, QUIET)


@pytest.mark.parametrize(
    ("length", "force", "keys", "words"),
    [
        (_stretches(0.6), QUIET, {}, ""),
        (_stretches(0.6), QUIET, {"amplitude_l0": 0.58}, ""),
        (_stretches(0.04), _artefact(-1.9), {}, ""),
        (
            _stretches(0.04),
            _artefact(-2.78),
            {},
            "line 202, column 'f' is -2.78 F0; allowed is -2 to 10; check its unit",
        ),
        (_stretches(0.04), _artefact(16.7), {}, "column 'f' is 16.7 F0; allowed is -2 to 10"),
        (1.0 + 1.2 * np.clip(TIME_S, 0.0, 1.0), QUIET, {}, "is 2.0008 L0 (L0 = 1 m); allowed is 0.1 to 2"),
        (_stretches(0.04), QUIET, {"pca": 1.5}, "pca is 1.5; allowed is 2 to 12"),
        (_stretches(0.04), QUIET, {"amplitude_l0": 4.0}, "amplitude_l0 is 4; allowed is 0 to 0.5: amplitudes are frac"),
        (_stretches(0.04), QUIET, {"recovery_s": 0.2}, "recovery_s is 0.2 s, but the recovery at 0.5600 s has 0.1 s"),
        (_stretches(0.0), QUIET, {"amplitude_l0": 0.7}, "amplitude_l0 is 0.7; allowed is 0 to 0.5"),
        (_lone_stretch(0.04), QUIET, {"amplitude_l0": 0.04, "recovery_s": 0.1}, "show no conditioning stretch from 0"),
    ],
)
def test_what_no_command_takes_is_not_imported_and_what_is_imported_is_taken(
    tmp_path: Path, length: np.ndarray, force: np.ndarray, keys: dict[str, Any], words: str
) -> None:
    rows = [f"{t:.3f},{x:.6f},{f:.6f}" for t, x, f in zip(TIME_S, length, force, strict=True)]
    (tmp_path / "a.csv").write_text("\n".join(("t,l,f", *rows)))
    event, _ = _run([tmp_path / "a.csv"], tmp_path / "bags", **keys)
    if words:
        assert isinstance(event, Failed)
        assert words in event.why
        return
    assert isinstance(event, Imported)
    (trial,) = read_study([event.bag], "f1", Known()).trials
    assert trial.facts.amplitude_l0 == pytest.approx(event.trial.facts.amplitude_l0)


def test_calcium_that_no_command_takes_is_not_imported(tmp_path: Path) -> None:
    rows = [f"{i / 1000},1.0,0.4,{1.2e4}" for i in range(20)]
    (tmp_path / "a.csv").write_text("\n".join(("t,l,f,ca", *rows)))
    columns = {**TREE["columns"], "calcium": {"column": "ca", "unit": "uM"}}
    tree = {key: value for key, value in TREE.items() if key != "pca"}
    settings = ImportSettings({**tree, "columns": columns}, "here")
    event, _ = import_recordings([tmp_path / "a.csv"], settings, tmp_path / "bags")
    assert isinstance(event, Failed)
    assert "is 12000 µM; allowed is 0 to 10000" in event.why
