"""Finding bags."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import pytest

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.trials.bags import find_bags, read_trial, write_trial
from xb_muscle_ros.trials.trial import Trial


def test_bags_are_found_by_folder_file_and_folder_of_bags(tmp_path: Path, trial: Trial) -> None:
    for name in ("b", "a"):
        write_trial(tmp_path / name, trial)
    (tmp_path / "notes.txt").write_text("no bag")
    (tmp_path / ".hidden").mkdir()
    assert find_bags([tmp_path]) == [tmp_path / "a", tmp_path / "b"]
    assert find_bags([tmp_path / "b"]) == [tmp_path / "b"]
    assert find_bags([tmp_path / "b" / "b_0.mcap"]) == [tmp_path / "b" / "b_0.mcap"]
    assert find_bags([str(tmp_path / "b"), tmp_path]) == [tmp_path / "b", tmp_path / "a"]  # each once, as given


def test_loose_files_are_bags_of_their_own(tmp_path: Path, trial: Trial) -> None:
    write_trial(tmp_path / "x", trial)
    loose = tmp_path / "loose"
    loose.mkdir()
    for name in ("one.mcap", "two.mcap"):
        (loose / name).write_bytes((tmp_path / "x" / "x_0.mcap").read_bytes())
    assert find_bags([loose]) == [loose / "one.mcap", loose / "two.mcap"]
    assert read_trial(loose / "one.mcap").facts == trial.facts


def test_split_files_are_one_bag_in_the_order_of_their_numbers(tmp_path: Path, trial: Trial) -> None:
    later = dataclasses.replace(
        trial, time_s=trial.time_s + 1, calcium_time_s=trial.calcium_time_s + 1, force_time_s=trial.force_time_s + 1
    )
    split = tmp_path / "split"
    split.mkdir()
    for name, part in (("split_9", trial), ("split_10", later)):  # by name, 10 would come before 9
        write_trial(tmp_path / "x", part)
        (split / f"{name}.mcap").write_bytes((tmp_path / "x" / "x_0.mcap").read_bytes())
    assert find_bags([split]) == [split]
    read = read_trial(split)
    assert read.time_s.tolist() == [0.0, 0.001, 0.002, 0.003, 0.004, 1.0, 1.001, 1.002, 1.003, 1.004]
    assert read.calcium_um.tolist() == trial.calcium_um.tolist() * 2


@pytest.mark.parametrize(
    ("name", "words"),
    [("nowhere", "does not exist"), ("notes.txt", "is no bag"), ("empty", "holds no bag")],
)
def test_what_is_no_bag_is_refused_by_name(tmp_path: Path, name: str, words: str) -> None:
    (tmp_path / "notes.txt").write_text("no bag")
    (tmp_path / "empty").mkdir()
    with pytest.raises(UserError, match=words) as refused:
        find_bags([tmp_path / name])
    assert name in str(refused.value)
