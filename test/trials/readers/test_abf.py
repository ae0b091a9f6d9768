"""Axon binary files of both versions: channels, units, sweeps, notes, and what is damaged."""

from __future__ import annotations

import contextlib
import struct
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from abf_files import EPISODIC, GAP_FREE, VARIABLE, Input, abf1, abf2, unit_per_count
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.trials.readers.abf_file import read_abf
from xb_muscle_ros.trials.readers.assembly import trial_of
from xb_muscle_ros.trials.readers.registry import reader_for
from xb_muscle_ros.trials.readers.settings import ImportSettings
from xb_muscle_ros.trials.trial import Trial

pyabf = pytest.importorskip("pyabf")  # of the extra 'files'

COUNT = 400
STEP_US = 1000.0 / 3.0  # no whole number of samples in a second, nor of us
# Volts per unit; the inputs are not in order, as an experimenter may choose them.
FORCE = Input(5, "Force", b"mN", 0.5)
LENGTH = Input(2, "Length", b"\xb5m", 0.004)
LIGHT = Input(0, "IN 0", b"V", 1.0)
INPUTS = [LENGTH, LIGHT, FORCE]
LENGTH_COUNTS = np.interp(np.arange(COUNT), [100, 200], [13107, 13762]).astype(int)
FORCE_COUNTS = 3000 + 10 * np.arange(COUNT)
COUNTS = np.column_stack([LENGTH_COUNTS, np.full(COUNT, 7), FORCE_COUNTS])
FACTS: dict[str, Any] = {"pca": 4.5, "f0": "10 mN"}
Write = Callable[..., Path]


def read(path: Path, **keys: Any) -> dict[str, Trial]:
    prepared = ImportSettings({**FACTS, **keys}, "here").prepare(path)
    return {
        pending.trial: trial_of(pending.read(), prepared.mapping, path)
        for pending in prepared.reader.trials(path, prepared.mapping)
    }


def whole(write: Write, path: Path, inputs: list[Input] = INPUTS, tags: tuple[tuple[int, str], ...] = ()) -> Path:
    return write(path, inputs, COUNTS, STEP_US, mode=GAP_FREE, tags=tags)


@pytest.fixture(params=[abf1, abf2])
def write(request: pytest.FixtureRequest) -> Write:
    """One of the two versions."""
    made: Write = request.param
    return made


def test_names_units_and_rate_are_those_of_the_file(tmp_path: Path, write: Write) -> None:
    (trial,) = read(whole(write, tmp_path / "f7.abf")).values()
    assert (trial.facts.fibre, trial.facts.trial, trial.facts.f0_n) == ("f7", "f7", 0.01)
    assert trial.time_s == pytest.approx(np.arange(COUNT) * STEP_US * 1e-6, rel=1e-7, abs=1e-9)
    assert trial.length_m == pytest.approx(1e-6 * LENGTH_COUNTS * unit_per_count(LENGTH), rel=1e-7)
    assert trial.force_n == pytest.approx(1e-3 * FORCE_COUNTS * unit_per_count(FORCE), rel=1e-7)
    (line,) = trial.warnings
    assert line.endswith("f7.abf: units are those of the file: length in um, force in mN")


def test_notes_are_date_protocol_comment_and_tags(tmp_path: Path, write: Write) -> None:
    source = read(whole(write, tmp_path / "f.abf", tags=((1200, "pCa 4.5"),)))["f"].facts.source
    version, protocol = ("ABF1", "stretch 5") if write is abf1 else ("ABF2", "ramp 3")
    for words in (
        f"Axon {version} record of 2026-03-14 10:05:00",
        f"protocol '{protocol}'",
        "comment 'fibre 7, 15 C'",
        "tags of the file: 'pCa 4.5' at 0.1333",
    ):
        assert words in source


@pytest.mark.parametrize("name", ["Force", "force", "2"])
def test_a_channel_goes_by_name_or_number(tmp_path: Path, write: Write, name: str) -> None:
    columns = {"length": {"column": "0"}, "force": {"column": name}}
    (trial,) = read(whole(write, tmp_path / "f.abf"), columns=columns).values()
    assert trial.force_n == pytest.approx(1e-3 * FORCE_COUNTS * unit_per_count(FORCE), rel=1e-7)


def test_offsets_are_added(tmp_path: Path, write: Write) -> None:
    path = whole(write, tmp_path / "f.abf", [LENGTH, LIGHT, FORCE._replace(offset=1.5)])
    assert read(path)["f"].force_n[0] == pytest.approx(1e-3 * (3000 * unit_per_count(FORCE) + 1.5), rel=1e-7)


def test_a_channel_in_volts_takes_a_calibration(tmp_path: Path, write: Write) -> None:
    path = whole(write, tmp_path / "f.abf", [LENGTH, LIGHT, FORCE._replace(unit=b"V")])
    (trial,) = read(path, columns={"force": {"column": "Force", "unit": "0.25 mN/V"}}).values()
    assert trial.force_n == pytest.approx(0.25e-3 * FORCE_COUNTS * unit_per_count(FORCE), rel=1e-7)
    assert not any("V" in line for line in trial.warnings)


def test_each_sweep_is_a_trial(tmp_path: Path) -> None:
    counts = np.vstack([COUNTS, COUNTS])
    for path in (
        abf1(tmp_path / "a.abf", INPUTS, counts, STEP_US, sweeps=2),
        abf2(tmp_path / "b.abf", INPUTS, counts, STEP_US, (COUNT, COUNT), EPISODIC),
    ):
        trials = read(path)
        assert list(trials) == [f"{path.stem}_1", f"{path.stem}_2"]
        assert "sweep 2 of 2" in trials[f"{path.stem}_2"].facts.source
        for trial in trials.values():
            assert trial.time_s[0] == 0.0
            assert trial.force_n == pytest.approx(1e-3 * FORCE_COUNTS * unit_per_count(FORCE), rel=1e-7)
        assert trials[f"{path.stem}_2"].warnings == ()  # units are told once


def test_sweeps_of_several_lengths(tmp_path: Path) -> None:
    trials = read(abf2(tmp_path / "f.abf", INPUTS, COUNTS, STEP_US, (250, 150), VARIABLE))
    assert [trial.time_s.size for trial in trials.values()] == [250, 150]
    assert trials["f_2"].force_n[0] == pytest.approx(1e-3 * FORCE_COUNTS[250] * unit_per_count(FORCE), rel=1e-7)
    path = abf1(tmp_path / "g.abf", INPUTS, COUNTS, STEP_US, sweeps=2, mode=VARIABLE)
    with pytest.raises(UserError, match=r"g\.abf does not tell how long each of its sweeps is"):
        read(path)


def test_files_of_pyabf_are_read(tmp_path: Path) -> None:
    count = 10 * COUNT
    force = np.vstack([np.linspace(1.0, 5.0, count), np.linspace(2.0, 6.0, count)])
    path = tmp_path / "f.abf"
    pyabf.abfWriter.writeABF1(force, str(path), 1000, units="mN")
    file = read_abf(path)
    assert [file.sweeps, file.channels[0].unit, file.step_s] == [((0, count), (count, 2 * count)), "mN", 1e-3]
    known = pyabf.ABF(str(path))
    for sweep in (0, 1):
        known.setSweep(sweep)
        assert file.values(0, sweep) == pytest.approx(known.sweepY, rel=1e-6)
        assert file.values(0, sweep) == pytest.approx(force[sweep], abs=4e-4)
    assert file.notes == ("Axon ABF1 record",)  # it was never dated


def test_what_both_tell_is_as_the_mapping_says(tmp_path: Path, write: Write) -> None:
    columns = {"force": {"column": "Force", "unit": "uN"}}
    trial = read(whole(write, tmp_path / "f.abf"), columns=columns, f0="10 uN")["f"]
    assert trial.facts.f0_n == pytest.approx(1e-5)
    assert any("the file says mN of force, the mapping uN; the mapping's is used" in line for line in trial.warnings)


@pytest.mark.parametrize(
    ("inputs", "keys", "words"),
    [
        ([LENGTH, LIGHT, FORCE._replace(unit=b"lbf")], {}, "channel 'Force': unit 'lbf' of force is not known"),
        (
            [LENGTH, LIGHT, FORCE._replace(unit=b"V")],
            {},
            "'V' is no unit of force; in its place give what one V stands for, for example '0.5 mN/V'",
        ),
        (
            INPUTS,
            {"columns": {"force": {"column": "Farce"}}},
            "has no channel 'Farce'; did you mean 'Force'?; it has 0",
        ),
        (INPUTS, {"columns": {"force": {"column": "3"}}}, "has no channel '3'; known: Force, IN 0, Length; it has 0"),
        (
            [LENGTH._replace(name="L"), LIGHT, FORCE],
            {},
            "columns.length has to name a channel (--length-column); the fil",
        ),
        ([LENGTH, LIGHT._replace(name="Force"), FORCE], {}, "has 2 channels 'Force'; give a number"),
    ],
)
def test_what_does_not_fit_is_told_in_one_line(
    tmp_path: Path, write: Write, inputs: list[Input], keys: dict[str, Any], words: str
) -> None:
    with pytest.raises(UserError) as refused:
        read(whole(write, tmp_path / "f.abf", inputs), **keys)
    assert words in str(refused.value)
    assert "f.abf" in str(refused.value)


def test_contents_are_the_channels_of_the_first_sweep(tmp_path: Path, write: Write) -> None:
    path = whole(write, tmp_path / "f.abf")
    found = reader_for(path).contents(path)
    assert [each.name for each in found.signals] == ["time", "Length", "IN 0", "Force"]
    assert [each.unit for each in found.signals[2:]] == ["V", "mN"]
    assert "3 channels at 3000 Hz" in found.format
    assert found.signals[3].values[0] == pytest.approx(3000 * unit_per_count(FORCE))


def test_facts_that_are_missing_are_asked_for(tmp_path: Path, write: Write) -> None:
    path = whole(write, tmp_path / "f.abf")
    with pytest.raises(UserError, match=r"forces are in mN, so f0 is needed, for example 'f0: 100 mN'"):
        read(path, f0=None)
    with pytest.raises(UserError, match="calcium is not known; give --pca"):
        read(path, pca=None)


def test_f0_of_the_folder_is_that_of_each_files_own_unit(tmp_path: Path, write: Write) -> None:
    level = np.column_stack([np.full(COUNT, 13107), np.zeros(COUNT, dtype=int), np.full(COUNT, 8192)])
    micro = FORCE._replace(unit=b"uN", scale=0.0005)  # the same transducer
    write(tmp_path / "max_45.abf", [LENGTH, LIGHT, micro], level, STEP_US, mode=GAP_FREE)
    keys = {
        "f0": {"isometric_at_pca": 4.5},
        "pca": None,
        "file_name": {"pattern": r"_(?P<pca>\d+)$", "factors": {"pca": 0.1}},
    }
    (trial,) = read(write(tmp_path / "sub_61.abf", INPUTS, COUNTS, STEP_US, mode=GAP_FREE), **keys).values()
    assert trial.facts.f0_n == pytest.approx(5e-3, rel=1e-6)
    assert trial.facts.pca == 6.1


def test_old_short_headers_take_no_gain_from_the_samples(tmp_path: Path) -> None:
    counts = np.full((1, 8000), 1.0)  # every word of the samples is 1, where later headers switch a gain on
    path = tmp_path / "f.abf"
    pyabf.abfWriter.writeABF1(counts / 32768 * 10.0, str(path), 1000, units="mN")
    data = bytearray(path.read_bytes())
    data[2048:] = struct.pack("<h", 1) * ((len(data) - 2048) // 2)
    path.write_bytes(data)
    gain = 10.0 / 32768 / struct.unpack_from("<f", data, 922)[0]
    assert read_abf(path).values(0, 0) == pytest.approx(np.full(8000, gain), rel=1e-6)


def test_samples_of_abf1_that_are_no_integers_are_refused(tmp_path: Path) -> None:
    path = whole(abf1, tmp_path / "f.abf")
    data = bytearray(path.read_bytes())
    data[100] = 1
    path.write_bytes(data)
    with pytest.raises(UserError, match=r"f\.abf is ABF1 with floating-point samples.*save it as ABF2"):
        read(path)


def test_without_pyabf_the_extra_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = whole(abf2, tmp_path / "f.abf")
    monkeypatch.setitem(sys.modules, "pyabf", None)
    with pytest.raises(UserError, match=r"f\.abf is an Axon file, which needs pyabf.*xb_muscle_ros\[files\]"):
        read(path)


@pytest.mark.parametrize("part", [0.0, 0.02, 0.3, 0.6])
def test_a_file_cut_short_is_refused(tmp_path: Path, write: Write, part: float) -> None:
    path = whole(write, tmp_path / "f.abf")
    path.write_bytes(path.read_bytes()[: int(part * path.stat().st_size)])
    with pytest.raises(UserError, match=r"f\.abf (is no whole ABF file|holds \d+ samples of|does not begin with ABF)"):
        read(path)


@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data())
def test_damaged_files_are_refused_or_read_whole(tmp_path: Path, data: st.DataObject) -> None:
    write = data.draw(st.sampled_from([abf1, abf2]))
    path = whole(write, tmp_path / "f.abf", tags=((3, "tag"),))
    content = bytearray(path.read_bytes())
    header = 2048 if write is abf2 else 5200
    for _ in range(data.draw(st.integers(1, 4))):
        content[data.draw(st.integers(0, header - 1))] = data.draw(st.integers(0, 255))
    path.write_bytes(content)
    trials = {}
    with contextlib.suppress(UserError):
        trials = read(path)
    for trial in trials.values():
        assert np.isfinite(trial.force_n).all()
        assert trial.force_n.size == trial.time_s.size
