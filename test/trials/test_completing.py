"""Facts that a bag lacks are found and said, facts that its samples belie are refused."""

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
from xb_muscle_ros.trials.bags import read_trial, write_trial
from xb_muscle_ros.trials.completing import Known
from xb_muscle_ros.trials.phases import conditioning, detect_phases
from xb_muscle_ros.trials.protocol import StretchShortenStretch
from xb_muscle_ros.trials.readers.registry import READERS
from xb_muscle_ros.trials.trial import Trial


def bare(folder: Path, length: float, force: float) -> Path:
    made = foreign.recording()
    made = dataclasses.replace(made, length_m=length * made.length_m, force_n=force * made.force_n)
    return foreign.write_folder(folder / "bag", [foreign.messages(made)], None)


def test_facts_of_one_fibre_are_not_those_of_another(tmp_path: Path) -> None:
    made = foreign.recording()
    facts = {**foreign.facts_of(made), "f0_n": "2.0", "reference_length_m": "1.125"}
    bag = foreign.write_folder(tmp_path / "bag", [foreign.messages(made, {"knee": 1.0})], facts)
    (own,), _ = foreign.study(bag)
    (other,), _ = foreign.study(bag, fibre="knee")
    assert (own.facts.f0_n, own.facts.reference_length_m, own.facts.trial) == (2.0, 1.125, made.facts.trial)
    assert (other.facts.f0_n, other.facts.reference_length_m) == (1.0, 1.0)


def test_what_a_bag_lacks_is_found_and_said_once_for_the_run(tmp_path: Path) -> None:
    for name, amplitude in (("a", 0.0383), ("b", 0.0)):
        made = foreign.recording(amplitude)
        foreign.write_folder(tmp_path / "bags" / name, [foreign.messages(made)], foreign.facts_of(made, foreign.BARE))
    (conditioned, reference), notes = foreign.study(tmp_path / "bags")
    names = ["isometric", "conditioning_stretch", "shortening", "recovery", "test_stretch", "hold"]
    assert [phase.name for phase in conditioned.facts.phases] == names
    starts = {phase.name: phase.start_s for phase in foreign.recording().facts.phases}
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
    made = foreign.recording()
    write_trial(tmp_path / "bag", made)
    (found,), notes = foreign.study(tmp_path / "bag", Known(file_reference_length_m=0.03, file_f0_n=7.0, file="f.yaml"))
    assert (found.facts, notes, found.warnings) == (made.facts, [], ())


def test_l0_and_f0_come_from_the_user_before_the_fibre_file(tmp_path: Path) -> None:
    bag = bare(tmp_path, 0.03, 5e-4)
    file = Known(file_reference_length_m=0.03, file_f0_n=5e-4, file="mine.yaml")
    (found,), notes = foreign.study(bag, file)
    assert (found.facts.reference_length_m, found.facts.f0_n) == (0.03, 5e-4)
    assert any("L0 = 0.03 m (of fibre file mine.yaml), F0 = 0.0005 N (of fibre file mine.yaml)" in n for n in notes)
    (found,), notes = foreign.study(bag, dataclasses.replace(file, reference_length_m=0.0303, f0_n=6e-4))
    assert (found.facts.reference_length_m, found.facts.f0_n) == (0.0303, 6e-4)
    assert not any("facts missing" in line for line in notes)
    (found,), notes = foreign.study(bag, dataclasses.replace(file, first_isometric=True))
    assert found.facts.reference_length_m == pytest.approx(0.03, rel=1e-9)
    assert "L0 is the length before the first stretch (1 trial)" in notes


@pytest.mark.parametrize(
    ("length", "force", "known", "words"),
    [
        (
            0.03,
            1.0,
            Known(),
            "length differs from L0 by -0.97 L0; allowed is -0.9 to 1: lengths are in m, one L0 is 1 m",
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
        foreign.study(bare(tmp_path, length, force), known)
    assert words in str(refused.value)
    assert "\n" not in str(refused.value)


def test_what_is_unusual_is_one_line(tmp_path: Path) -> None:
    (found,), _ = foreign.study(bare(tmp_path, 1.6, 1e-4), Known(f0_n=1.0))
    lines = [line for line in found.warnings if "far from" in line]
    assert len(lines) == 2
    assert "length goes to 1.66 L0, far from L0: one L0 is 1 m (reference_length_m); --reference-length" in lines[0]
    assert "measured force goes to 6.92e-05 F0, far from F0" in lines[1]


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
    made = foreign.recording(rate_hz=1 / 0.006)
    noise = 0.004 * np.random.default_rng(1).normal(size=made.time_s.size)
    made = dataclasses.replace(made, length_m=made.length_m + noise)
    bag = foreign.write_folder(tmp_path / "bag", [foreign.messages(made)], foreign.facts_of(made, ("phases",)))
    _, notes = foreign.study(bag)
    assert any("no phases found, though length moves" in line for line in notes)


def test_phases_of_another_clock_are_found_anew_and_said(tmp_path: Path) -> None:
    made = foreign.recording()
    logged = foreign.messages(made, begin_ns=foreign.EPOCH_NS)
    (found,), notes = foreign.study(foreign.write_folder(tmp_path / "bag", [logged], foreign.facts_of(made)))
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
    made = foreign.recording()
    bag = foreign.write_folder(tmp_path / "bag", [foreign.messages(made)], {**foreign.facts_of(made), key: text})
    with pytest.raises(UserError, match=re.escape(words)):
        foreign.study(bag)


def test_a_pca_that_changing_calcium_never_has_is_refused(tmp_path: Path) -> None:
    made = dataclasses.replace(
        foreign.recording(), calcium_time_s=np.array([0.0, 0.2]), calcium_um=np.array([0.01, 0.1])
    )
    bag = foreign.write_folder(tmp_path / "bag", [foreign.messages(made)], foreign.facts_of(made))
    with pytest.raises(
        UserError, match=r"pCa is 6\.1, but calcium changes from 0\.01 to 0\.1 µM and never comes near 0"
    ):
        foreign.study(bag)
    bare = foreign.write_folder(tmp_path / "bare", [foreign.messages(made)], None)
    (found,), notes = foreign.study(bare)
    assert found.facts.pca is None
    assert "calcium changes, so there is no pCa (1 trial)" in notes


def test_changes_of_length_are_no_lengths(tmp_path: Path) -> None:
    made = foreign.recording()
    changes = dataclasses.replace(made, length_m=made.length_m - 1.0)
    bag = foreign.write_folder(tmp_path / "bag", [foreign.messages(changes)], None)
    with pytest.raises(UserError, match=r"before the first stretch is 0 m and cannot be L0; .*--length-is change"):
        foreign.study(bag, Known(first_isometric=True))


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
    made = foreign.recording()
    bare = ("phases", "pca")
    bag = foreign.write_folder(tmp_path / "bag", [foreign.messages(change(made))], foreign.facts_of(made, bare))
    (found,), _ = foreign.study(bag)
    (line,) = found.warnings
    assert words in line


def test_phases_that_go_on_after_the_lengths_are_said(tmp_path: Path) -> None:
    made = foreign.recording()
    logged = [one for one in foreign.messages(made) if one.log_time_ns < 200_000_000]
    (found,), notes = foreign.study(foreign.write_folder(tmp_path / "bag", [logged], foreign.facts_of(made)))
    assert found.time_s[-1] == pytest.approx(0.198)
    assert notes == [
        "phases of the bag go on after its lengths end; of those the scores have a part, or none (1 trial)"
    ]
    check_trial(found, "bag")  # force is there as far as lengths are
    assert not foreign.study(
        foreign.write_folder(tmp_path / "whole", [foreign.messages(made)], foreign.facts_of(made))
    ).notes


@pytest.mark.parametrize(
    ("samples", "forces", "words"), [(2, 2, "2 samples of length"), (9, 1, "1 samples of measured")]
)
def test_samples_that_nothing_can_be_compared_by_are_refused(
    tmp_path: Path, samples: int, forces: int, words: str
) -> None:
    made = foreign.recording()
    few = dataclasses.replace(
        made,
        time_s=made.time_s[:samples],
        length_m=made.length_m[:samples],
        force_time_s=made.force_time_s[:forces],
        force_n=made.force_n[:forces],
    )
    bag = foreign.write_folder(tmp_path / "bag", [foreign.messages(few)], foreign.facts_of(few, ("phases",)))
    with pytest.raises(UserError, match=f"there are {words}.*; needed are 3; leave it out"):
        foreign.study(bag)


@pytest.mark.parametrize("long", ["all", "one of two"])
def test_bytes_behind_a_message_are_nobodys(tmp_path: Path, long: str) -> None:
    """Serialization in rclpy makes more bytes than it fills; who publishes those has them in the bag."""
    made = foreign.recording()
    whole = foreign.messages(made)
    padded = [one._replace(data=one.data + bytes(8)) if long == "all" or i % 2 else one for i, one in enumerate(whole)]
    facts = foreign.facts_of(made)
    plain, other = (
        read_trial(foreign.write_folder(tmp_path / name, [part], facts))
        for name, part in (("plain", whole), ("padded", padded))
    )
    assert other.time_s.tolist() == plain.time_s.tolist()
    assert other.length_m.tolist() == plain.length_m.tolist()
    assert other.force_n.tolist() == plain.force_n.tolist()
    recorded = READERS["bag"].contents(tmp_path / "padded")
    assert any(content.finite.size == made.time_s.size for content in recorded.signals)
