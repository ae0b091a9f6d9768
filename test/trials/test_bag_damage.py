"""Bags cut short: what is readable comes back, nothing is made up, and one line tells."""

from __future__ import annotations

from io import BytesIO
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mcap.writer import CompressionType
from mcap.writer import Writer as McapWriter

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.trials import ros_types
from xb_muscle_ros.trials.bags import Simulated, read_simulated, read_trial, write_trial
from xb_muscle_ros.trials.completing import Known
from xb_muscle_ros.trials.mcap_records import read_recording
from xb_muscle_ros.trials.study import read_study
from xb_muscle_ros.trials.trial import Phase, Trial, TrialFacts

FACTS = TrialFacts("f", "t", pca=6.0, reference_length_m=0.5, phases=(Phase("isometric", 0.0, 0.039),))


def _is_prefix(part: np.ndarray, whole: np.ndarray) -> bool:
    return part.tobytes() == whole[: part.size].tobytes()


def _read_or_refused(path: Path) -> Trial | None:
    """The trial; None where it is refused as a user's error that names the bag. Any other error fails the test."""
    try:
        return read_trial(path)
    except UserError as error:
        refusal = error
    assert path.name in str(refusal)
    return None


def _check_prefix(read: Trial, whole: Trial) -> None:
    assert read.time_s.size >= 1
    assert read.calcium_um.size >= 1
    for name in ("time_s", "length_m", "calcium_time_s", "calcium_um", "force_time_s", "force_n"):
        assert _is_prefix(getattr(read, name), getattr(whole, name)), name


@pytest.mark.slow
def test_every_cut_gives_a_prefix_or_a_user_error(tmp_path: Path, trial: Trial) -> None:
    write_trial(tmp_path / "bag", trial)
    whole = read_trial(tmp_path / "bag")
    data = (tmp_path / "bag" / "bag_0.mcap").read_bytes()
    file = tmp_path / "cut.mcap"
    counts = []
    first, last = data.index(b"18Dec2017a"), data.index(b"storage_identifier")
    # Every byte where messages are, every seventh in the texts before and after.
    for size in (*range(0, first, 7), *range(first, last), *range(last, len(data), 7)):
        file.write_bytes(data[:size])
        read = _read_or_refused(file)
        if read is None:
            counts.append(0)
            continue
        _check_prefix(read, whole)
        if size < len(data) - 8:  # the last 8 bytes only repeat the magic
            (warning,) = read.warnings
            assert f"cut short after {size} bytes" in warning
        counts.append(read.time_s.size)
    assert counts == sorted(counts)  # more bytes never give fewer samples
    assert set(counts) == {0, 1, 2, 3, 4, 5}


@settings(max_examples=40, deadline=None)
@given(fraction=st.floats(0.0, 1.0))
def test_a_cut_folder_keeps_its_facts(tmp_path_factory: pytest.TempPathFactory, fraction: float) -> None:
    folder = tmp_path_factory.mktemp("cut")
    time_s = np.arange(40) / 1000
    whole = Trial(FACTS, time_s, 1.0 + time_s, time_s[:1], np.array([1.0]), time_s, 2.0 + time_s)
    write_trial(folder / "bag", whole)
    file = folder / "bag" / "bag_0.mcap"
    data = file.read_bytes()
    file.write_bytes(data[: int(fraction * (len(data) - 9))])
    read = _read_or_refused(folder / "bag")
    if read is None:
        assert fraction < 0.9  # near the end there is something to read
        return
    _check_prefix(read, whole)
    assert read.facts == whole.facts
    assert len(read.warnings) == 1


@pytest.mark.slow
@settings(max_examples=150, deadline=None)
@given(where=st.floats(0.0, 1.0, exclude_max=True), value=st.integers(0, 255))
def test_a_changed_byte_never_ends_in_a_traceback(
    tmp_path_factory: pytest.TempPathFactory, where: float, value: int
) -> None:
    folder = tmp_path_factory.mktemp("changed")
    time_s = np.arange(5) / 1000
    write_trial(folder / "bag", Trial(FACTS, time_s, 1.0 + time_s, time_s[:1], np.array([1.0])))
    data = bytearray((folder / "bag" / "bag_0.mcap").read_bytes())
    data[int(where * len(data))] = value
    file = folder / "changed.mcap"
    file.write_bytes(data)
    read = _read_or_refused(file)
    if read is None:
        return
    assert 1 <= read.time_s.size <= 5


def test_missing_metadata_is_read_from_the_file_itself(tmp_path: Path, trial: Trial) -> None:
    write_trial(tmp_path / "bag", trial)
    (tmp_path / "bag" / "metadata.yaml").unlink()
    read = read_trial(tmp_path / "bag")
    assert read.facts == trial.facts
    assert read.warnings == (f"bag {tmp_path / 'bag'}: metadata.yaml is missing; 12 messages were read",)


def test_half_a_metadata_file_counts_as_missing(tmp_path: Path, trial: Trial) -> None:
    write_trial(tmp_path / "bag", trial)
    file = tmp_path / "bag" / "metadata.yaml"
    file.write_text(file.read_text()[:150])
    read = read_trial(tmp_path / "bag")
    assert read.facts == trial.facts
    (warning,) = read.warnings
    assert "metadata.yaml cannot be read" in warning


def test_with_all_facts_lost_the_data_tell_what_they_can(tmp_path: Path, trial: Trial) -> None:
    time_s = np.arange(200) / 1000
    write_trial(tmp_path / "bag", Trial(trial.facts, time_s, np.full(200, 5e-4), [0.0], [10.0**-0.5]))
    (tmp_path / "bag" / "metadata.yaml").unlink()
    file = tmp_path / "bag" / "bag_0.mcap"
    file.write_bytes(file.read_bytes()[:12_000])
    read = read_trial(tmp_path / "bag")
    assert 1 < read.time_s.size < 200
    assert read.facts.fibre == "18Dec2017a"  # from the messages
    assert read.facts.trial == "bag"
    (warning,) = read.warnings
    assert "metadata.yaml is missing" in warning
    assert "cut short after 12000 bytes" in warning
    assert "trial facts are lost" in warning
    # 0.5 mm is no fibre of 1 m; who knows better may say so.
    with pytest.raises(UserError, match=r"length differs from L0 by -1 L0; .*--reference-length gives another"):
        read_study([tmp_path / "bag"], "18Dec2017a", Known())
    (completed,), notes = read_study([tmp_path / "bag"], "18Dec2017a", Known(first_isometric=True))
    assert completed.facts.reference_length_m == pytest.approx(5e-4)
    assert completed.facts.pca == pytest.approx(6.5)
    assert "pCa taken from constant calcium (1 trial)" in notes


def test_a_file_given_by_itself_finds_its_facts_in_the_folder(tmp_path: Path, trial: Trial) -> None:
    write_trial(tmp_path / "bag", trial)
    file = tmp_path / "bag" / "bag_0.mcap"
    data = file.read_bytes()
    cut = data[: data.index(b"storage_identifier")]  # within the metadata at its end
    file.write_bytes(cut)
    assert read_trial(file).facts == trial.facts
    stray = tmp_path / "bag" / "stray.mcap"
    stray.write_bytes(cut)  # not listed in metadata.yaml, which therefore is not its own
    assert read_trial(stray).facts.trial == "stray"


def test_a_cut_simulation_keeps_stamps_that_have_both(tmp_path: Path, trial: Trial, simulated: Simulated) -> None:
    write_trial(tmp_path / "bag", trial, simulated)
    data = (tmp_path / "bag" / "bag_0.mcap").read_bytes()
    sizes = set()
    for size in range(data.index(b"18Dec2017a"), data.index(b"storage_identifier"), 7):
        (tmp_path / "cut.mcap").write_bytes(data[:size])
        try:
            read = read_simulated(tmp_path / "cut.mcap")
        except UserError:
            continue
        if read is None:
            continue
        assert _is_prefix(read.force_n, simulated.force_n)
        assert _is_prefix(read.moments["r"], simulated.moments["r"])
        sizes.add(read.time_s.size)
    assert sizes == {1, 2, 3, 4, 5}


@pytest.mark.parametrize("content", [b"", b"not a bag at all", b"\x89PNG\r\n\x1a\n"])
def test_a_file_that_is_no_mcap_is_refused(tmp_path: Path, content: bytes) -> None:
    (tmp_path / "x.mcap").write_bytes(content)
    with pytest.raises(UserError, match=r"x\.mcap"):
        read_trial(tmp_path / "x.mcap")


def _compressed(compression: CompressionType, messages: int) -> bytes:
    stream = BytesIO()
    writer = McapWriter(stream, chunk_size=1 << 20, compression=compression)
    writer.start(profile="ros2", library="test")
    schema = writer.register_schema(ros_types.JOINT_STATE, "ros2msg", b"")
    channel = writer.register_channel("/muscle/length", "cdr", schema)
    random = np.random.default_rng(1)  # so that compression cannot shrink it to nothing
    for i in range(messages):
        writer.add_message(channel, i, random.bytes(300), i)
    writer.finish()
    return stream.getvalue()


@pytest.mark.parametrize("compression", [CompressionType.NONE, CompressionType.ZSTD, CompressionType.LZ4])
def test_compressed_chunks_are_read_whole_and_cut(tmp_path: Path, compression: CompressionType) -> None:
    data = _compressed(compression, 2000)
    file = tmp_path / "c.mcap"
    file.write_bytes(data)
    whole = read_recording(file)
    assert whole.damage is None
    (messages,) = whole.messages.values()
    assert [m.log_time_ns for m in messages] == list(range(2000))
    file.write_bytes(data[:400_000])
    cut = read_recording(file)
    assert cut.damage == "cut short after 400000 bytes"
    (part,) = cut.messages.values()
    assert 500 < len(part) < 2000
    assert list(part) == list(messages)[: len(part)]


def test_a_wrong_checksum_ends_the_reading(tmp_path: Path) -> None:
    data = bytearray(_compressed(CompressionType.NONE, 10))
    data[1500] ^= 0xFF  # within the chunk's messages
    (tmp_path / "c.mcap").write_bytes(data)
    recording = read_recording(tmp_path / "c.mcap")
    assert recording.damage == "damaged, a chunk's checksum is wrong"
    assert recording.messages == {}
