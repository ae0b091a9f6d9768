"""Bags of others become trials: every fibre, in order of time, whole or in parts."""

from __future__ import annotations

import dataclasses
import re
from pathlib import Path

import foreign_bags as foreign
import numpy as np
import pytest

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.trials.bag_reading import TrialBag
from xb_muscle_ros.trials.bags import find_bags, read_trial, write_trial
from xb_muscle_ros.trials.trial import Trial


@pytest.mark.parametrize("listed", [(0, 1), (1, 0), ()])
def test_messages_come_in_the_order_of_log_time(tmp_path: Path, listed: tuple[int, ...]) -> None:
    made = foreign.recording()
    logged = foreign.messages(made)
    order = np.random.default_rng(1).permutation(len(logged)).tolist()
    parts = [[logged[i] for i in order[::2]], [logged[i] for i in order[1::2]]]
    bag = foreign.write_folder(tmp_path / "bag", parts, foreign.facts_of(made), listed)
    (found,), _ = foreign.study(bag)
    assert foreign.same_samples(found, made)


def test_a_recorders_clock_that_steps_back_leaves_the_order_of_the_file(tmp_path: Path) -> None:
    made = foreign.recording()
    logged = foreign.messages(made, begin_ns=foreign.EPOCH_NS)
    middle = len(logged) // 2
    stepped = [one._replace(log_time_ns=one.log_time_ns - (i > middle) * 10**9) for i, one in enumerate(logged)]
    bag = foreign.write_folder(tmp_path / "bag", [stepped], foreign.facts_of(made))
    (found,), _ = foreign.study(bag)
    assert found.length_m.tolist() == made.length_m.tolist()
    assert any("/muscle/length is in the order of the file, because log times step back" in w for w in found.warnings)


def test_header_stamps_that_step_back_are_refused_with_both(tmp_path: Path) -> None:
    made = foreign.recording()
    early = foreign.messages(made)
    late = [one._replace(log_time_ns=one.log_time_ns + 10**9) for one in early if one.topic == foreign.LENGTH]
    bag = foreign.write_folder(tmp_path / "bag", [[*early, *late]], None)
    with pytest.raises(
        UserError, match=r"/muscle/length, message \d+ at t = 0\.0{9} s does not come after .* t = 0\.\d+"
    ):
        foreign.study(bag)


@pytest.mark.parametrize("apart", [False, True])
def test_every_fibre_of_a_bag_is_a_trial(tmp_path: Path, apart: bool) -> None:
    made = foreign.recording()
    logged = foreign.messages(made, {"knee": 1.1, "hip": 0.9}, apart)
    bag = foreign.write_folder(tmp_path / "bag", [logged], None)
    opened = TrialBag(bag)
    assert opened.fibres == ["knee", "hip", "ankle"]
    for name, factor in (("knee", 1.1), ("hip", 0.9), ("ankle", 1.0)):
        (found,), notes = foreign.study(bag, fibre=name)
        assert found.length_m == pytest.approx(factor * made.length_m, rel=1e-15)
        assert found.force_n == pytest.approx(factor * made.force_n, rel=1e-15)
        assert (found.facts.fibre, found.facts.trial) == (name, f"bag_{name}")
        others = ", ".join(f"'{other}'" for other in opened.fibres if other != name)
        assert any(f"taken: '{name}', left out: {others}" in line for line in notes)
    assert foreign.study(bag, fibre="other", only="hip").trials[0].facts.fibre == "hip"
    with pytest.raises(UserError, match=r"is of fibres 'knee', 'hip', 'ankle', not of 'other'; --trials-of takes one"):
        foreign.study(bag, fibre="other")


def test_messages_of_others_are_skipped_and_counted(tmp_path: Path) -> None:
    made = foreign.recording()
    n = made.time_s.size
    bag = foreign.write_folder(tmp_path / "bag", [foreign.messages(made, {"knee": 1.1}, apart=True)], None)
    (found,), _ = foreign.study(bag)
    assert foreign.same_samples(found, made)
    (line,) = found.warnings
    assert f"{n} of {2 * n} messages on /muscle/length, 1 of 2 messages on /muscle/calcium, {n} of" in line
    assert "are without 'ankle'; they are skipped, as the node does" in line


def test_a_model_s_force_stands_for_a_measured_one_and_is_not_written_as_measured(tmp_path: Path) -> None:
    made = foreign.recording()
    logged = foreign.messages(made, force_topic=foreign.FORCE)
    (found,), _ = foreign.study(foreign.write_folder(tmp_path / "bag", [logged], None))
    assert found.force_n.tolist() == made.force_n.tolist()
    assert any("compared with the recorded /muscle/force, which a model made" in line for line in found.warnings)
    write_trial(tmp_path / "again", found)
    assert read_trial(tmp_path / "again").force_n.size == 0


def without(made: Trial, begin_s: float, end_s: float) -> Trial:
    kept = (made.time_s <= begin_s) | (made.time_s >= end_s)
    return dataclasses.replace(
        made,
        time_s=made.time_s[kept],
        length_m=made.length_m[kept],
        force_time_s=made.force_time_s[kept],
        force_n=made.force_n[kept],
    )


def test_a_gap_is_named_with_its_time_and_refused_while_length_moves(tmp_path: Path) -> None:
    write_trial(tmp_path / "held", without(foreign.recording(), 0.04, 0.09))
    (found,), _ = foreign.study(tmp_path / "held")
    line = f"bag {tmp_path / 'held'}: length has no sample for 0.05 s after t = 0.04 s, where samples are 0.002 s apart"
    assert any(each.startswith(line) for each in found.warnings)
    write_trial(tmp_path / "moved", without(foreign.recording(), 0.18, 0.21))
    with pytest.raises(UserError, match=r"no sample for 0\.03 s after t = 0\.18 s.* changes by 0\.0136 L0 within"):
        foreign.study(tmp_path / "moved")


def test_facts_that_reindexing_lost_come_from_the_copy_in_the_file(tmp_path: Path, trial: Trial) -> None:
    write_trial(tmp_path / "bag", trial)
    file = tmp_path / "bag" / "metadata.yaml"
    text = re.sub(r"  custom_data:\n(?:    .*\n)+", "  custom_data: null\n", file.read_text())
    assert "custom_data: null" in text
    file.write_text(text)
    read = read_trial(tmp_path / "bag")
    assert read.facts == trial.facts
    assert "has lost its custom_data; the copy within bag_0.mcap is used" in read.warnings[0]


def test_parts_without_metadata_are_one_bag_whatever_the_folder_is_called(tmp_path: Path) -> None:
    made = foreign.recording()
    logged = foreign.messages(made)
    for i, part in enumerate((logged[:300], logged[300:])):
        foreign.write_mcap(tmp_path / "renamed" / f"session_{i}.mcap", part)
        foreign.write_mcap(tmp_path / "loose" / f"trial_{i}.mcap", logged)  # each begins at 0: trials of their own
    (found,), _ = foreign.study(tmp_path / "renamed")
    assert foreign.same_samples(found, made)
    assert len(find_bags([tmp_path / "loose"])) == 2


def test_a_file_that_the_metadata_lists_and_is_not_there_is_told(tmp_path: Path) -> None:
    made = foreign.recording()
    logged = foreign.messages(made)
    bag = foreign.write_folder(tmp_path / "bag", [logged[:-60], logged[-60:]], foreign.facts_of(made))
    (bag / "bag_1.mcap").unlink()
    (found,), _ = foreign.study(bag)
    assert "bag_1.mcap, which metadata.yaml lists, is missing" in found.warnings[0]


def test_handed_bag_after_reindexing(shared_cases: Path) -> None:
    (found,), _ = foreign.study(shared_cases / "bags" / "reindexed_custom_data")
    assert found.facts.reference_length_m == pytest.approx(0.03)
    assert abs(found.length_change_l0).max() < 0.1
    assert "has lost its custom_data; the copy within" in found.warnings[0]


@pytest.mark.parametrize(
    ("name", "samples", "warning"),
    [
        ("qos_meta_edited", 1000, None),
        ("split_no_metadata", 1000, "metadata.yaml is missing"),
        ("truncated", 692, "cut short after 155205 bytes"),
    ],
)
def test_handed_bags_are_imported(
    shared_cases: Path, tmp_path: Path, name: str, samples: int, warning: str | None, capsys: pytest.CaptureFixture[str]
) -> None:
    from xb_muscle_ros.cli.main import main

    arguments = ["import", str(shared_cases / "bags" / name), "--mapping", str(shared_cases / "bagmap.yaml")]
    assert main([*arguments, "--out", str(tmp_path)]) == 0
    said = capsys.readouterr()
    trial = read_trial(tmp_path / f"ankle_{name}")
    assert trial.time_s.size == samples
    assert np.all(np.diff(trial.time_s) > 0.0)
    assert trial.facts.phases[1].start_s == pytest.approx(0.4, abs=2e-3)
    assert (warning in said.out + said.err) if warning else ("warning" not in said.out + said.err)


def test_calcium_that_was_replaced_before_the_first_length_has_no_part(tmp_path: Path) -> None:
    """A node's topic keeps the older message for late subscribers."""
    made = foreign.recording()
    later = dataclasses.replace(
        made, time_s=made.time_s + 1.0, force_time_s=made.force_time_s + 1.0,
        calcium_time_s=np.array([0.0, 0.5]), calcium_um=np.array([0.01, made.calcium_um[0]]),
    )  # fmt: skip
    (found,), notes = foreign.study(foreign.write_folder(tmp_path / "bag", [foreign.messages(later)], None))
    assert (found.facts.pca, found.calcium_um.tolist()) == (6.1, made.calcium_um[:1].tolist())
    assert "pCa taken from constant calcium (1 trial)" in notes


def test_what_holds_for_several_bags_is_one_line(tmp_path: Path) -> None:
    made = foreign.recording()
    for name, factor in (("a", 1.0), ("b", 0.98), ("c", 0.96), ("d", 0.94), ("e", 0.92)):
        pushing = dataclasses.replace(made, force_n=-factor * made.force_n)
        foreign.write_folder(tmp_path / "bags" / name, [foreign.messages(pushing)], foreign.facts_of(made))
    (line,) = foreign.study(tmp_path / "bags").lines
    assert line.startswith(f"bag {tmp_path / 'bags' / 'a'}: the median of measured force is -0.")
    assert line.endswith("(likewise 4 more bags: b, c, d, ...)")


def test_an_empty_name_of_a_fibre_is_none(tmp_path: Path) -> None:
    made = foreign.recording()
    facts = {**foreign.facts_of(made), "fibre": " "}
    (found,), _ = foreign.study(foreign.write_folder(tmp_path / "bag", [foreign.messages(made)], facts))
    assert (found.facts.fibre, found.warnings) == ("ankle", ())
