"""Bags of others become trials: every fibre, in order of time, with the facts that they lack found and said."""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Callable
from pathlib import Path

import foreign_bags as foreign
import numpy as np
import pytest

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.evaluate.checks import check_trial
from xb_muscle_ros.trials.bag_reading import TrialBag
from xb_muscle_ros.trials.bags import find_bags, read_trial, write_trial
from xb_muscle_ros.trials.completing import Known
from xb_muscle_ros.trials.phases import conditioning, detect_phases
from xb_muscle_ros.trials.protocol import StretchShortenStretch
from xb_muscle_ros.trials.study import Study, read_study
from xb_muscle_ros.trials.trial import Trial

BARE = ("phases", "amplitude_l0", "recovery_s", "pca", "reference_length_m", "f0_n", "fibre", "trial", "source")


def recording(amplitude_l0: float = 0.0383, recovery_s: float = 0.1, rate_hz: float = 500.0) -> Trial:
    """A trial of the paper's protocol whose force follows length."""
    trial = StretchShortenStretch(amplitude_l0, recovery_s, lead_s=0.15).trial("ankle", 6.1, rate_hz)
    return dataclasses.replace(trial, force_time_s=trial.time_s, force_n=0.5 + 5.0 * trial.length_change_l0)


def study(bag: Path, known: Known | None = None, **options: str) -> Study:
    return read_study([bag], options.pop("fibre", "ankle"), known or Known(), **options)


def same_samples(found: Trial, made: Trial) -> bool:
    names = ("time_s", "length_m", "calcium_um", "force_time_s", "force_n")
    return all(np.array_equal(getattr(found, name), getattr(made, name)) for name in names)


@pytest.mark.parametrize("listed", [(0, 1), (1, 0), ()])
def test_messages_come_in_the_order_of_log_time(tmp_path: Path, listed: tuple[int, ...]) -> None:
    made = recording()
    logged = foreign.messages(made)
    order = np.random.default_rng(1).permutation(len(logged)).tolist()
    parts = [[logged[i] for i in order[::2]], [logged[i] for i in order[1::2]]]
    bag = foreign.write_folder(tmp_path / "bag", parts, foreign.facts_of(made), listed)
    (found,), _ = study(bag)
    assert same_samples(found, made)


def test_a_recorders_clock_that_steps_back_leaves_the_order_of_the_file(tmp_path: Path) -> None:
    made = recording()
    logged = foreign.messages(made, begin_ns=foreign.EPOCH_NS)
    middle = len(logged) // 2
    stepped = [one._replace(log_time_ns=one.log_time_ns - (i > middle) * 10**9) for i, one in enumerate(logged)]
    bag = foreign.write_folder(tmp_path / "bag", [stepped], foreign.facts_of(made))
    (found,), _ = study(bag)
    assert found.length_m.tolist() == made.length_m.tolist()
    assert any("/muscle/length is in the order of the file, because log times step back" in w for w in found.warnings)


def test_header_stamps_that_step_back_are_refused_with_both(tmp_path: Path) -> None:
    made = recording()
    early = foreign.messages(made)
    late = [one._replace(log_time_ns=one.log_time_ns + 10**9) for one in early if one.topic == foreign.LENGTH]
    bag = foreign.write_folder(tmp_path / "bag", [[*early, *late]], None)
    with pytest.raises(
        UserError, match=r"/muscle/length, message \d+ at t = 0\.0{9} s does not come after .* t = 0\.\d+"
    ):
        study(bag)


@pytest.mark.parametrize("apart", [False, True])
def test_every_fibre_of_a_bag_is_a_trial(tmp_path: Path, apart: bool) -> None:
    made = recording()
    logged = foreign.messages(made, {"knee": 1.1, "hip": 0.9}, apart)
    bag = foreign.write_folder(tmp_path / "bag", [logged], None)
    opened = TrialBag(bag)
    assert opened.fibres == ["knee", "hip", "ankle"]
    for name, factor in (("knee", 1.1), ("hip", 0.9), ("ankle", 1.0)):
        (found,), notes = study(bag, fibre=name)
        assert found.length_m == pytest.approx(factor * made.length_m, rel=1e-15)
        assert found.force_n == pytest.approx(factor * made.force_n, rel=1e-15)
        assert (found.facts.fibre, found.facts.trial) == (name, f"bag_{name}")
        others = ", ".join(f"'{other}'" for other in opened.fibres if other != name)
        assert any(f"taken: '{name}', left out: {others}" in line for line in notes)
    assert study(bag, fibre="other", only="hip").trials[0].facts.fibre == "hip"
    with pytest.raises(UserError, match=r"is of fibres 'knee', 'hip', 'ankle', not of 'other'; --trials-of takes one"):
        study(bag, fibre="other")


def test_messages_of_others_are_skipped_and_counted(tmp_path: Path) -> None:
    made = recording()
    n = made.time_s.size
    bag = foreign.write_folder(tmp_path / "bag", [foreign.messages(made, {"knee": 1.1}, apart=True)], None)
    (found,), _ = study(bag)
    assert same_samples(found, made)
    (line,) = found.warnings
    assert f"{n} of {2 * n} messages on /muscle/length, 1 of 2 messages on /muscle/calcium, {n} of" in line
    assert "are without 'ankle'; they are skipped, as the node does" in line


def test_facts_of_one_fibre_are_not_those_of_another(tmp_path: Path) -> None:
    made = recording()
    facts = {**foreign.facts_of(made), "f0_n": "2.0", "reference_length_m": "1.125"}
    bag = foreign.write_folder(tmp_path / "bag", [foreign.messages(made, {"knee": 1.0})], facts)
    (own,), _ = study(bag)
    (other,), _ = study(bag, fibre="knee")
    assert (own.facts.f0_n, own.facts.reference_length_m, own.facts.trial) == (2.0, 1.125, made.facts.trial)
    assert (other.facts.f0_n, other.facts.reference_length_m) == (1.0, 1.0)


def test_a_model_s_force_stands_for_a_measured_one_and_is_not_written_as_measured(tmp_path: Path) -> None:
    made = recording()
    logged = foreign.messages(made, force_topic=foreign.FORCE)
    (found,), _ = study(foreign.write_folder(tmp_path / "bag", [logged], None))
    assert found.force_n.tolist() == made.force_n.tolist()
    assert any("compared with the recorded /muscle/force, which a model made" in line for line in found.warnings)
    write_trial(tmp_path / "again", found)
    assert read_trial(tmp_path / "again").force_n.size == 0


def test_what_a_bag_lacks_is_found_and_said_once_for_the_run(tmp_path: Path) -> None:
    for name, amplitude in (("a", 0.0383), ("b", 0.0)):
        made = recording(amplitude)
        foreign.write_folder(tmp_path / "bags" / name, [foreign.messages(made)], foreign.facts_of(made, BARE))
    (conditioned, reference), notes = study(tmp_path / "bags")
    names = ["isometric", "conditioning_stretch", "shortening", "recovery", "test_stretch", "hold"]
    assert [phase.name for phase in conditioned.facts.phases] == names
    starts = {phase.name: phase.start_s for phase in recording().facts.phases}
    for phase in conditioned.facts.phases:
        assert phase.start_s == pytest.approx(starts[phase.name], abs=1e-3)
    facts = conditioned.facts
    assert (facts.pca, facts.amplitude_l0, facts.recovery_s) == pytest.approx((6.1, 0.0383, 0.1), abs=2e-3)
    assert (reference.facts.amplitude_l0, reference.facts.recovery_s) == (0.0, None)
    assert notes == [
        "phases found from length (2 trials)",
        "facts missing in the bag, taken: L0 = 1 m (as for normalised data), F0 = 1 N (as for normalised data); "
        "--reference-length and --f0 give others (2 trials)",
        "amplitude and recovery found from length (2 trials)",
        "pCa taken from constant calcium (2 trials)",
    ]


def test_what_a_bag_tells_is_left_as_it_is(tmp_path: Path) -> None:
    made = recording()
    write_trial(tmp_path / "bag", made)
    (found,), notes = study(tmp_path / "bag", Known(file_reference_length_m=0.03, file_f0_n=7.0, file="f.yaml"))
    assert (found.facts, notes, found.warnings) == (made.facts, [], ())


def bare(folder: Path, length: float, force: float) -> Path:
    made = recording()
    made = dataclasses.replace(made, length_m=length * made.length_m, force_n=force * made.force_n)
    return foreign.write_folder(folder / "bag", [foreign.messages(made)], None)


def test_l0_and_f0_come_from_the_user_before_the_fibre_file(tmp_path: Path) -> None:
    bag = bare(tmp_path, 0.03, 5e-4)
    file = Known(file_reference_length_m=0.03, file_f0_n=5e-4, file="mine.yaml")
    (found,), notes = study(bag, file)
    assert (found.facts.reference_length_m, found.facts.f0_n) == (0.03, 5e-4)
    assert any("L0 = 0.03 m (of fibre file mine.yaml), F0 = 0.0005 N (of fibre file mine.yaml)" in n for n in notes)
    (found,), notes = study(bag, dataclasses.replace(file, reference_length_m=0.0303, f0_n=6e-4))
    assert (found.facts.reference_length_m, found.facts.f0_n) == (0.0303, 6e-4)
    assert not any("facts missing" in line for line in notes)
    (found,), notes = study(bag, dataclasses.replace(file, first_isometric=True))
    assert found.facts.reference_length_m == pytest.approx(0.03, rel=1e-9)
    assert "L0 is the length before the first stretch (1 trial)" in notes


@pytest.mark.parametrize(
    ("length", "force", "known", "words"),
    [
        (
            0.03,
            1.0,
            Known(),
            "length differs from L0 by -0.97 L0; allowed is -0.6 to 1: lengths are in m, one L0 is 1 m",
        ),
        (
            1.0,
            1e-4,
            Known(),
            "far from F0: forces are in N, one F0 is 1 N (f0_n); --f0 gives another, and nothing tells",
        ),
        (1.0, 6.0, Known(), "measured force goes to 4.15 F0, far from F0"),
        (1.0, 1e3, Known(f0_n=1.0), "allowed is -2 to 10: forces are in N, one F0 is 1 N"),
    ],
)
def test_values_of_no_muscle_are_refused_with_the_remedy(
    tmp_path: Path, length: float, force: float, known: Known, words: str
) -> None:
    with pytest.raises(UserError) as refused:
        study(bare(tmp_path, length, force), known)
    assert words in str(refused.value)
    assert "\n" not in str(refused.value)


def test_what_is_unusual_is_one_line(tmp_path: Path) -> None:
    (found,), _ = study(bare(tmp_path, 1.6, 1e-4), Known(f0_n=1.0))
    lines = [line for line in found.warnings if "far from" in line]
    assert len(lines) == 2
    assert "length goes to 1.66 L0, far from L0: one L0 is 1 m (reference_length_m); --reference-length" in lines[0]
    assert "measured force goes to 6.92e-05 F0, far from F0" in lines[1]


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
    write_trial(tmp_path / "held", without(recording(), 0.04, 0.09))
    (found,), _ = study(tmp_path / "held")
    line = f"bag {tmp_path / 'held'}: length has no sample for 0.05 s after t = 0.04 s, where samples are 0.002 s apart"
    assert any(each.startswith(line) for each in found.warnings)
    write_trial(tmp_path / "moved", without(recording(), 0.18, 0.21))
    with pytest.raises(UserError, match=r"no sample for 0\.03 s after t = 0\.18 s.* changes by 0\.0136 L0 within"):
        study(tmp_path / "moved")


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
    made = recording()
    logged = foreign.messages(made)
    for i, part in enumerate((logged[:300], logged[300:])):
        foreign.write_mcap(tmp_path / "renamed" / f"session_{i}.mcap", part)
        foreign.write_mcap(tmp_path / "loose" / f"trial_{i}.mcap", logged)  # each begins at 0: trials of their own
    (found,), _ = study(tmp_path / "renamed")
    assert same_samples(found, made)
    assert len(find_bags([tmp_path / "loose"])) == 2


def test_a_file_that_the_metadata_lists_and_is_not_there_is_told(tmp_path: Path) -> None:
    made = recording()
    logged = foreign.messages(made)
    bag = foreign.write_folder(tmp_path / "bag", [logged[:-60], logged[-60:]], foreign.facts_of(made))
    (bag / "bag_1.mcap").unlink()
    (found,), _ = study(bag)
    assert "bag_1.mcap, which metadata.yaml lists, is missing" in found.warnings[0]


@pytest.mark.parametrize(
    ("rate_hz", "noise_l0", "recovery_s", "amplitude_l0"),
    [
        (1 / 0.006, 0.0, 0.05, 0.0383),
        (1 / 0.006, 3e-4, 0.1, 0.0383),
        (1000.0, 1e-3, 1.0, 0.0383),
        (10_000.0, 1e-3, 0.1, 0.0383),
        (500.0, 3e-4, 0.05, 0.01),
    ],
)
def test_phases_are_found_in_coarse_and_noisy_lengths(
    rate_hz: float, noise_l0: float, recovery_s: float, amplitude_l0: float
) -> None:
    made = StretchShortenStretch(amplitude_l0, recovery_s, lead_s=0.1).trial("f", 6.1, rate_hz)
    length = made.length_m + noise_l0 * np.random.default_rng(1).normal(size=made.time_s.size)
    phases = detect_phases(made.time_s, length, l0=1.0)
    assert [phase.name for phase in phases] == [phase.name for phase in made.facts.phases]
    for found, given in zip(phases, made.facts.phases, strict=True):
        assert found.start_s == pytest.approx(given.start_s, abs=max(2.0 / rate_hz, 4e-3))
    amplitude, recovery = conditioning(made.time_s, length, 1.0, phases)
    assert amplitude == pytest.approx(amplitude_l0, abs=max(3.0 * noise_l0, 3e-3))
    assert recovery == pytest.approx(recovery_s, abs=max(2.0 / rate_hz, 6e-3))


def test_length_that_moves_under_its_noise_is_told(tmp_path: Path) -> None:
    made = recording(rate_hz=1 / 0.006)
    noise = 0.004 * np.random.default_rng(1).normal(size=made.time_s.size)
    made = dataclasses.replace(made, length_m=made.length_m + noise)
    bag = foreign.write_folder(tmp_path / "bag", [foreign.messages(made)], foreign.facts_of(made, ("phases",)))
    _, notes = study(bag)
    assert any("no phases found, though length moves" in line for line in notes)


@pytest.fixture(scope="module")
def cases(shared_data: Path) -> Path:
    """Small inputs that are kept beside the repository; tests that need them are skipped without."""
    folder = shared_data.parent / "cases" / "bags"
    if not folder.is_dir():
        pytest.skip(f"no cases at {folder}")
    return folder


def test_handed_bag_after_reindexing(cases: Path) -> None:
    (found,), _ = study(cases / "reindexed_custom_data")
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
    cases: Path, tmp_path: Path, name: str, samples: int, warning: str | None, capsys: pytest.CaptureFixture[str]
) -> None:
    from xb_muscle_ros.cli.main import main

    arguments = ["import", str(cases / name), "--mapping", str(cases.parent / "bagmap.yaml"), "--out", str(tmp_path)]
    assert main(arguments) == 0
    said = capsys.readouterr()
    trial = read_trial(tmp_path / f"ankle_{name}")
    assert trial.time_s.size == samples
    assert np.all(np.diff(trial.time_s) > 0.0)
    assert trial.facts.phases[1].start_s == pytest.approx(0.4, abs=2e-3)
    assert (warning in said.out + said.err) if warning else ("warning" not in said.out + said.err)


def test_phases_of_another_clock_are_found_anew_and_said(tmp_path: Path) -> None:
    made = recording()
    logged = foreign.messages(made, begin_ns=foreign.EPOCH_NS)
    (found,), notes = study(foreign.write_folder(tmp_path / "bag", [logged], foreign.facts_of(made)))
    phases = {phase.name: phase for phase in found.facts.phases}
    told = {phase.name: phase for phase in made.facts.phases}
    assert phases["test_stretch"].start_s - found.time_s[0] == pytest.approx(told["test_stretch"].start_s, abs=2e-3)
    assert notes[0] == "phases of the bag lie at other times than its lengths and are left out (1 trial)"
    assert "phases found from length (1 trial)" in notes


@pytest.mark.parametrize(
    ("key", "text", "words"),
    [
        (
            "amplitude_l0",
            "3.83",
            "amplitude_l0 is 3.83; allowed is 0 to 0.5: amplitudes are fractions of L0, not percent",
        ),
        (
            "recovery_s",
            "100",
            "recovery_s is 100 s, but the recovery at 0.3185 s has 0.1 s; correct the one that is wrong",
        ),
    ],
)
def test_facts_that_lengths_belie_are_refused_on_reading(tmp_path: Path, key: str, text: str, words: str) -> None:
    made = recording()
    bag = foreign.write_folder(tmp_path / "bag", [foreign.messages(made)], {**foreign.facts_of(made), key: text})
    with pytest.raises(UserError, match=re.escape(words)):
        study(bag)


def test_a_pca_that_changing_calcium_never_has_is_refused(tmp_path: Path) -> None:
    made = dataclasses.replace(recording(), calcium_time_s=np.array([0.0, 0.2]), calcium_um=np.array([0.01, 0.1]))
    bag = foreign.write_folder(tmp_path / "bag", [foreign.messages(made)], foreign.facts_of(made))
    with pytest.raises(
        UserError, match=r"pCa is 6\.1, but calcium changes from 0\.01 to 0\.1 µM and never comes near 0"
    ):
        study(bag)
    bare = foreign.write_folder(tmp_path / "bare", [foreign.messages(made)], None)
    (found,), notes = study(bare)
    assert found.facts.pca is None
    assert "calcium changes, so there is no pCa (1 trial)" in notes


def test_calcium_that_was_replaced_before_the_first_length_has_no_part(tmp_path: Path) -> None:
    """A node's topic keeps the older message for late subscribers."""
    made = recording()
    later = dataclasses.replace(
        made, time_s=made.time_s + 1.0, force_time_s=made.force_time_s + 1.0,
        calcium_time_s=np.array([0.0, 0.5]), calcium_um=np.array([0.01, made.calcium_um[0]]),
    )  # fmt: skip
    (found,), notes = study(foreign.write_folder(tmp_path / "bag", [foreign.messages(later)], None))
    assert (found.facts.pca, found.calcium_um.tolist()) == (6.1, made.calcium_um[:1].tolist())
    assert "pCa taken from constant calcium (1 trial)" in notes


def test_changes_of_length_are_no_lengths(tmp_path: Path) -> None:
    made = recording()
    changes = dataclasses.replace(made, length_m=made.length_m - 1.0)
    bag = foreign.write_folder(tmp_path / "bag", [foreign.messages(changes)], None)
    with pytest.raises(UserError, match=r"before the first stretch is 0 m and cannot be L0; .*--length-is change"):
        study(bag, Known(first_isometric=True))


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda t: dataclasses.replace(t, force_n=-t.force_n), "is its sign reversed, or its zero off?"),
        (
            lambda t: dataclasses.replace(t, calcium_um=1e-6 * t.calcium_um),
            "though calcium is 7.94e-07 µM, at which fibres are relaxed: calcium is in µM",
        ),
        (
            lambda t: dataclasses.replace(t, force_time_s=t.force_time_s[100:], force_n=t.force_n[100:]),
            "measured force covers 0.2 to 0.602 s, lengths 0 to 0.602 s; nothing is compared elsewhere",
        ),
    ],
)
def test_what_is_doubtful_in_a_bag_is_one_line(tmp_path: Path, change: Callable[[Trial], Trial], words: str) -> None:
    made = recording()
    bare = ("phases", "pca")
    bag = foreign.write_folder(tmp_path / "bag", [foreign.messages(change(made))], foreign.facts_of(made, bare))
    (found,), _ = study(bag)
    (line,) = found.warnings
    assert words in line


def test_phases_that_go_on_after_the_lengths_are_said(tmp_path: Path) -> None:
    made = recording()
    logged = [one for one in foreign.messages(made) if one.log_time_ns < 200_000_000]
    (found,), notes = study(foreign.write_folder(tmp_path / "bag", [logged], foreign.facts_of(made)))
    assert found.time_s[-1] == pytest.approx(0.198)
    assert notes == [
        "phases of the bag go on after its lengths end; of those the scores have a part, or none (1 trial)"
    ]
    check_trial(found, "bag")  # force is there as far as lengths are
    assert not study(foreign.write_folder(tmp_path / "whole", [foreign.messages(made)], foreign.facts_of(made))).notes


def test_what_holds_for_several_bags_is_one_line(tmp_path: Path) -> None:
    made = recording()
    for name, factor in (("a", 1.0), ("b", 0.98), ("c", 0.96), ("d", 0.94), ("e", 0.92)):
        pushing = dataclasses.replace(made, force_n=-factor * made.force_n)
        foreign.write_folder(tmp_path / "bags" / name, [foreign.messages(pushing)], foreign.facts_of(made))
    (line,) = study(tmp_path / "bags").lines
    assert line.startswith(f"bag {tmp_path / 'bags' / 'a'}: the median of measured force is -0.")
    assert line.endswith("(likewise 4 more bags: b, c, d, ...)")


def test_an_empty_name_of_a_fibre_is_none(tmp_path: Path) -> None:
    made = recording()
    facts = {**foreign.facts_of(made), "fibre": " "}
    (found,), _ = study(foreign.write_folder(tmp_path / "bag", [foreign.messages(made)], facts))
    assert (found.facts.fibre, found.warnings) == ("ankle", ())
