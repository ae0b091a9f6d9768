"""Files of Dynamic Muscle Control: calibrations, stimulation, references, gear ratio, and what is wrong with them."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from changes import swap
from hypothesis import given, settings
from hypothesis import strategies as st

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.trials.activation import CalciumTransient
from xb_muscle_ros.trials.bags import read_trial
from xb_muscle_ros.trials.importing import Failed, Imported, find_recordings, import_recordings
from xb_muscle_ros.trials.inspecting.proposal import propose
from xb_muscle_ros.trials.inspecting.recognition import recognise
from xb_muscle_ros.trials.readers.assembly import trial_of
from xb_muscle_ros.trials.readers.registry import READERS, reader_for
from xb_muscle_ros.trials.readers.settings import ImportSettings, MappingError
from xb_muscle_ros.trials.trial import Trial

RATE_HZ = 2000
COUNT = 1600
TIME_S = np.arange(COUNT) / RATE_HZ
# The motor is at 0.6 V at rest and shortens the muscle by 0.5 V, that is mm; force is 500 mN/V.
LENGTH_V = 0.6 + np.interp(TIME_S, [0.3, 0.5], [0.0, -0.5])
FORCE_V = np.interp(TIME_S, [0.1, 0.15, 0.45, 0.5], [0.02, 0.8, 0.5, 0.02])
# Pulses of one sample, 200 Hz, from 0.1 to 0.4 s.
STIM = np.where((TIME_S >= 0.1) & (TIME_S < 0.4) & (np.arange(COUNT) % 10 == 0), 1, 0)
HEADER = {
    "Sample Frequency (Hz)": f"{RATE_HZ}",
    "Reference Area": "NaN sq. mm",
    "Reference Force": "400.000 mN",
    "Reference Length": "12.5 mm",
}
CHANNELS = ("AI0", "AI1", "AI2", "AO0")
TABLE = {
    "Units": ["mm", "mN", "TTL", "mm"],
    "Scale (units/V)": ["1.000000", "500.000000", "0.200000", "1.000000"],
    "Offset (volts)": ["0.000000"] * 4,
    "TADs": ["0.000000"] * 4,
}
PROTOCOL = ("0.100000\tStimulus-Tetanus\tStimulator\t.1,200,.2,.3\t", "0.200000\tRamp\tLength Out\t-.5,.2\t")
ACTIVATION: dict[str, Any] = {"rest": "0.05 uM", "tetanus": "8 uM", "rise": "50 ms", "decay": "30 ms"}


def ddf(
    path: Path,
    header: dict[str, str] | None = None,
    table: dict[str, list[str]] | None = None,
    end: str = "\n",
    zeros: bool = True,
    mark: str = ".",
    stim: bool = True,
) -> Path:
    """A file as DMC writes them; ``header`` and ``table`` change it, 'None' takes a line out."""
    path.parent.mkdir(parents=True, exist_ok=True)
    told = {**HEADER, **(header or {})}
    lines = ["DMCv5.3 Data File", *(f"{name}: {value}" for name, value in told.items() if value != "None")]
    lines += ["Calibration Data:", "\t".join(("Channel", *CHANNELS))]
    lines += ["\t".join((name, *cells)) for name, cells in {**TABLE, **(table or {})}.items()]
    lines += ["Test Comments:", "soleus, 25 °C", "", "Protocol Array:", "", *PROTOCOL, "0.4\tStop\t\t\t", "", ""]
    lines += ["Test Data in Volts:", "", "\t".join(("Sample", *CHANNELS, *(["Stim"] if stim else [])))]
    samples = [
        f"{i}\t{x:.6f}\t{f:.6f}\t{-0.001:.6f}\t{0.0948:.6f}" + (f"\t{s}" if stim else "")
        for i, (x, f, s) in enumerate(zip(LENGTH_V, FORCE_V, STIM, strict=True))
    ]
    samples += [f"{COUNT}" + "\t0.000000" * 4 + ("\t0" if stim else "")] * zeros
    lines += [sample.replace(".", mark) for sample in samples]
    path.write_bytes(end.join([*lines, ""]).encode("latin-1"))
    return path


def read(path: Path, file_format: str | None = None, **keys: Any) -> Trial:
    prepared = ImportSettings({"activation": ACTIVATION, **keys}, "here", file_format).prepare(path)
    (pending,) = prepared.reader.trials(path, prepared.mapping)
    return trial_of(pending.read(), prepared.mapping, path)


def test_volts_become_lengths_and_forces(tmp_path: Path) -> None:
    trial = read(ddf(tmp_path / "mouse3" / "tetanus1.ddf"))
    facts = trial.facts
    assert (facts.fibre, facts.trial, facts.pca) == ("mouse3", "tetanus1", None)
    assert facts.reference_length_m == pytest.approx(12.5e-3, rel=1e-15)
    assert facts.f0_n == pytest.approx(0.4, rel=1e-15)
    assert trial.time_s == pytest.approx(TIME_S, abs=1e-9)
    assert trial.length_m == pytest.approx(12.5e-3 + 1e-3 * (LENGTH_V - 0.6), abs=1.1e-9)
    assert trial.force_n == pytest.approx(0.5 * FORCE_V, abs=3e-7)
    assert [phase.name for phase in facts.phases] == ["isometric", "shortening", "recovery"]
    for words in ("400.000", "soleus, 25 °C", "0.100000 Stimulus-Tetanus Stimulator .1,200,.2,.3", "row of zeros"):
        assert words in facts.source or words == "400.000"
    assert "L0 = 0.0125 m (Reference Length of the header)" in facts.source
    assert "F0 = 0.4 N, Reference Force of the header" in facts.source
    assert "0.0006 m as recorded" in facts.source
    assert trial.warnings == ()


def test_pulses_become_calcium(tmp_path: Path) -> None:
    trial = read(ddf(tmp_path / "a.ddf"))
    # Its last pulse is one sample long; pulses 4.5 ms apart are one tetanus.
    expected = CalciumTransient(0.05, 8.0, 0.05, 0.03).samples(TIME_S, ((0.1, 0.3955),))
    assert trial.calcium_time_s == pytest.approx(expected[0])
    assert trial.calcium_um == pytest.approx(expected[1])
    assert "stimulated 0.1 to 0.3955 s" in trial.facts.source
    told = read(tmp_path / "a.ddf", activation={**ACTIVATION, "begin": "0.2 s", "end": "0.3 s"})
    assert "stimulated 0.2 to 0.3 s" in told.facts.source
    with pytest.raises(UserError, match=r"a\.ddf has no column 'Stim'; its columns: Sample, AI0, AI1, AI2, AO0"):
        read(ddf(tmp_path / "a.ddf", stim=False))


def test_pulses_without_activation_are_told(tmp_path: Path) -> None:
    file = ddf(tmp_path / "a.ddf")
    with pytest.raises(UserError, match=r"Stim has pulses from 0\.1 to 0\.395 s, and nothing makes calcium of them; "):
        read(file, activation=None)
    trial = read(file, activation=None, pca=5.5)
    assert trial.facts.pca == 5.5
    (warning,) = trial.warnings
    assert "pCa is given as 5.5 for all of the trial, so they are not used" in warning


def test_offset_is_added_before_scaling_and_told(tmp_path: Path) -> None:
    file = ddf(tmp_path / "a.ddf", table={"Offset (volts)": ["0.1", "-0.02", "0", "0"], "TADs": ["0", "3", "0", "0"]})
    trial = read(file)
    assert trial.force_n == pytest.approx(0.5 * (FORCE_V - 0.02), abs=3e-7)
    assert trial.length_m[0] == pytest.approx(12.5e-3)
    offset, tad = trial.warnings
    assert "AI1 has an offset of -0.02 V in the header; it is added before scaling, so force moves by -10 mN" in offset
    assert "AI1 has a TAD of 3 in the header; it is not used" in tad


def test_a_gear_ratio_divides_length_and_multiplies_force(tmp_path: Path) -> None:
    trial = read(ddf(tmp_path / "a.ddf"), gear_ratio=2.0)
    assert trial.length_m == pytest.approx(12.5e-3 + 0.5e-3 * (LENGTH_V - 0.6), abs=1.1e-9)
    assert trial.force_n == pytest.approx(FORCE_V, abs=6e-7)
    assert "gear ratio 2: length divided by it" in trial.facts.source
    with pytest.raises(MappingError, match=r"gear_ratio is 0; allowed is 0\.01 to 100"):
        read(tmp_path / "a.ddf", gear_ratio=0)
    (tmp_path / "a.csv").write_text("t,l\n0,1\n")
    with pytest.raises(MappingError, match="gear_ratio is for ddf, the file is csv; leave it out"):
        read(tmp_path / "a.csv", gear_ratio=2, fibre="f", activation=None, columns={
            "time": {"column": "t", "unit": "s"}, "length": {"column": "l", "unit": "mm"},
        })  # fmt: skip


def test_absolute_lengths_keep_their_zero(tmp_path: Path) -> None:
    length = {"is": "absolute", "at_reference": "0.5 mm"}
    trial = read(ddf(tmp_path / "a.ddf"), columns={"length": length})
    assert trial.length_m == pytest.approx(12.5e-3 + 1e-3 * (LENGTH_V - 0.5), abs=1.1e-9)


def test_references_that_were_not_entered_have_to_be_given(tmp_path: Path) -> None:
    file = ddf(tmp_path / "a.ddf", {"Reference Length": "NaN mm", "Reference Force": "NaN mN"})
    with pytest.raises(UserError, match=r"Reference Length in the header is NaN, .* --reference-length '42\.8 mm'"):
        read(file)
    with pytest.raises(UserError, match=r"Reference Force in the header is NaN, so f0 is needed, .* --f0 '100 mN'"):
        read(file, reference_length="12 mm")
    trial = read(file, reference_length="12 mm", f0="0.3 N")
    assert (trial.facts.reference_length_m, trial.facts.f0_n) == (pytest.approx(0.012), 0.3)
    with pytest.raises(UserError, match="the header has no Reference Length"):
        read(ddf(tmp_path / "b.ddf", {"Reference Length": "None"}))


def test_units_decide_what_a_channel_may_be(tmp_path: Path) -> None:
    file = ddf(tmp_path / "a.ddf", table={"Units": ["mm", "Ref", "TTL", "mm"]})
    with pytest.raises(UserError, match=r"column 'AI1' is in 'Ref', which is no known unit of force; .* --force-unit"):
        read(file)
    assert read(file, columns={"force": {"unit": "mN"}}).force_n[400] == pytest.approx(0.5 * FORCE_V[400], abs=3e-7)
    with pytest.raises(UserError, match="column 'AI2' is in 'TTL', which is no known unit of length"):
        read(ddf(tmp_path / "b.ddf"), columns={"length": {"column": "AI2"}})
    # Another unit of the same kind is converted.
    file = ddf(
        tmp_path / "c.ddf", table={"Units": ["um", "N", "TTL", "mm"], "Scale (units/V)": ["1000", ".5", "1", "1"]}
    )
    trial = read(file, f0="0.4 N")
    assert trial.length_m == pytest.approx(12.5e-3 + 1e-3 * (LENGTH_V - 0.6), abs=1.1e-9)
    assert trial.force_n == pytest.approx(0.5 * FORCE_V, abs=3e-7)


def test_without_force_is_possible_and_plain(tmp_path: Path) -> None:
    with pytest.raises(UserError, match=r"has no column 'AI7'; its columns: .*'force: null' under columns"):
        read(ddf(tmp_path / "a.ddf"), columns={"force": {"column": "AI7"}})
    assert read(tmp_path / "a.ddf", columns={"force": None}).force_n.size == 0


@pytest.mark.parametrize("end", ["\n", "\r\n"])
@pytest.mark.parametrize("mark", [".", ","])
def test_line_ends_and_decimal_marks(tmp_path: Path, end: str, mark: str) -> None:
    trial = read(ddf(tmp_path / "a.ddf", end=end, mark=mark))
    assert trial.force_n == pytest.approx(0.5 * FORCE_V, abs=3e-7)
    assert len(trial.warnings) == (mark == ",")


def test_only_the_row_of_zeros_that_ends_the_file_is_left_out(tmp_path: Path) -> None:
    trial = read(ddf(tmp_path / "a.ddf", zeros=False))
    assert trial.time_s.size == COUNT
    assert "row of zeros" not in trial.facts.source


def test_samples_that_are_missing_are_told(tmp_path: Path) -> None:
    file = ddf(tmp_path / "a.ddf")
    lines = file.read_bytes().split(b"\n")
    first = lines.index(next(line for line in lines if line.startswith(b"200\t")))
    file.write_bytes(b"\n".join(lines[:first] + lines[first + 20 :]))
    trial = read(file)
    assert trial.time_s.size == COUNT - 20
    assert any("column 'Sample': samples are missing from 0.0995 to 0.11 s" in line for line in trial.warnings)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda data: b"", "is empty; needed is a data file of Dynamic Muscle Control"),
        (lambda data: b"DMC\n" + data, "does not begin with DMC ... Data File"),
        (lambda data: data[:300], "ends within its header"),
        (lambda data: data[: data.index(b"\n0\t0.6")], "has no whole rows below its header"),
        (swap(b"Sample Frequency (Hz): 2000\n", b""), "Sample Frequency (Hz) is missing in the header"),
        (swap(b"(Hz): 2000", b"(Hz): fast"), "Sample Frequency (Hz) is 'fast' in the header"),
        (swap(b"(Hz): 2000", b"(Hz): 0"), "Sample Frequency (Hz) is '0' in the header"),
        (
            swap(b"(Hz): 2000\n", b"(Hz): 2000\nSample Frequency (Hz): 10\n"),
            "is in the header twice, and differently",
        ),
        (swap(b"(Hz): 2000", b"(Hz): 2"), "samples are 0.5 s apart; allowed is"),
        (swap(b"Calibration Data:", b"Calibration"), "the header has no calibration"),
        (swap(b"500.000000", b"lots"), "Scale (units/V) of AI1 is 'lots' in the header; needed is a number"),
        (
            swap(b"500.000000", b"0.000000"),
            "Scale (units/V) of AI1 is 0 in the header, so its volts have no meaning",
        ),
        (swap(b"\n5\t0.6", b"\n5\tx0.6"), "column 'AI0' holds 'x0.600000'; needed is a number"),
        (swap(b"\n5\t0.6", b'\n5\t"a"\t0.6'), "has 7 cells; needed are 6: Sample, AI0, AI1, AI2, AO0, Stim"),
        (swap(b"\n5\t0.600000", b"\n5\tinf"), "column 'AI0' is inf"),
        (swap(b"\n6\t", b"\n5\t"), "column 'Sample': 0.0025 s does not come after 0.0025 s"),
        (swap(b"Reference Length: 12.5 mm", b"Reference Length: 12.5 in"), "Reference Length: unit 'in' of length"),
        (swap(b"Reference Force: 400.000 mN", b"Reference Force: 400.000 lbf"), "Reference Force: unit 'lbf' of force"),
    ],
)
def test_what_is_broken_is_told_in_one_line(tmp_path: Path, change: Callable[[bytes], bytes], words: str) -> None:
    file = ddf(tmp_path / "trial.ddf")
    file.write_bytes(change(file.read_bytes()))
    with pytest.raises(UserError) as refused:
        read(file)
    assert words in str(refused.value)
    assert "trial.ddf" in str(refused.value)


def test_forces_in_grams(tmp_path: Path) -> None:
    units = {"Units": ["mm", "g", "TTL", "mm"]}
    trial = read(ddf(tmp_path / "trial.ddf", {"Reference Force": "40 g"}, units))
    assert trial.facts.f0_n == pytest.approx(0.392266, rel=1e-12)
    assert trial.force_n == pytest.approx(500.0 * 9.80665e-3 * FORCE_V, rel=1e-5)


@pytest.fixture(scope="module")
def small(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, bytes, Trial]:
    """A short file, its content, and its trial."""
    file = ddf(tmp_path_factory.mktemp("ddf") / "small.ddf")
    lines = file.read_bytes().split(b"\n")
    first = next(i for i, line in enumerate(lines) if line.startswith(b"0\t"))
    file.write_bytes(b"\n".join([*lines[: first + 80], b""]))
    return file, file.read_bytes(), read(file)


@settings(max_examples=150, deadline=None)
@given(st.data())
def test_damage_gives_one_line_or_a_part_of_the_trial(small: tuple[Path, bytes, Trial], data: st.DataObject) -> None:
    file, content, whole = small
    at = data.draw(st.integers(0, len(content)))
    kind = data.draw(st.sampled_from(["cut", "junk", "twice", "lost"]))
    lines = content.split(b"\n")
    rows = [i for i, line in enumerate(lines) if re.match(rb"\d+\t-?\d\.\d+\t-?\d", line)]
    n = data.draw(st.sampled_from(rows))
    if kind == "cut":
        damaged = content[:at]
    elif kind == "junk":
        junk = data.draw(st.binary(min_size=1, max_size=4).filter(lambda b: not re.search(rb"[0-9.,+eE\s-]", b)))
        damaged = content[:at] + junk + content[at:]
    else:
        damaged = b"\n".join(lines[:n] + ([lines[n]] * 2 if kind == "twice" else []) + lines[n + 1 :])
    file.write_bytes(damaged)
    try:
        trial = read(file, "ddf")
    except UserError as problem:
        told = str(problem)
    else:
        step = np.rint(trial.time_s * RATE_HZ).astype(int)
        assert trial.time_s == pytest.approx(step / RATE_HZ, abs=1e-9)
        assert trial.force_n == pytest.approx(whole.force_n[step], rel=1e-12)
        assert trial.length_m == pytest.approx(whole.length_m[step], rel=1e-6)
        return
    assert "small.ddf" in told
    assert "\n" not in told


def test_what_is_in_it_is_told_and_proposed(tmp_path: Path) -> None:
    file = ddf(tmp_path / "a.ddf")
    contents = READERS["ddf"].contents(file)
    roles = {content.name: (content.told_role, content.unit) for content in contents.signals}
    assert roles["AI0"] == ("length", "mm")
    assert roles["AI1"] == ("force", "mN")
    assert roles["AI2"] == ("", "TTL")
    assert contents.in_header == ("reference_length", "f0")
    assert contents.facts["Reference Length"] == "12.5 mm"
    proposed = propose([file], READERS["ddf"], contents, recognise(contents))
    assert [line.partition(":")[0] for line in proposed.missing] == ["pca"]
    assert "# reference_length:" in proposed.text
    no_l0 = READERS["ddf"].contents(ddf(tmp_path / "b.ddf", {"Reference Length": "NaN mm"}))
    assert no_l0.in_header == ("f0",)


def test_a_folder_of_mixed_files_becomes_bags(tmp_path: Path) -> None:
    folder = tmp_path / "mouse3"
    ddf(folder / "tetanus.ddf")
    ddf(folder / "cut.ddf").write_text("DMCv5.3 Data File\n")
    ddf(folder / "unknown.dat")
    assert reader_for(folder / "unknown.dat") is READERS["ddf"]
    (folder / "notes.dat").write_text("of the day")
    (folder / "t.csv").write_text("t\tl\n" + "".join(f"{i}\t12\n" for i in range(20)))
    csv_keys = {
        "files": "^t$",
        "activation": None,
        "pca": 9.0,
        "columns": {"time": {"column": "t", "unit": "ms"}, "length": {"column": "l", "unit": "mm"}},
    }
    settings_ = ImportSettings({"fibre": "m", "activation": ACTIVATION, "per_file": [csv_keys]}, "here")
    events = list(import_recordings(find_recordings([folder]), settings_, tmp_path / "bags"))
    made = {event.bag.name: event for event in events if isinstance(event, Imported)}
    assert sorted(made) == ["m_t", "m_tetanus"]
    (failed,) = (event for event in events if isinstance(event, Failed))
    assert "cut.ddf ends within its header" in failed.why
    back = read_trial(made["m_tetanus"].bag)
    assert back.facts == made["m_tetanus"].trial.facts
    assert back.force_n == pytest.approx(0.5 * FORCE_V, abs=3e-7)


def test_a_zero_of_force_goes_through_the_gear(tmp_path: Path) -> None:
    plain, geared = (
        read(ddf(tmp_path / "a.ddf"), columns={"force": {"zero": "10 mN"}}, **more)
        for more in ({}, {"gear_ratio": 2.0})
    )
    assert geared.force_n == pytest.approx(2.0 * plain.force_n, abs=1e-12)


def test_changes_in_l0_are_scaled_by_the_header_s_length(tmp_path: Path) -> None:
    table = {"Units": ["Lo", "mN", "TTL", "mm"], "Scale (units/V)": ["0.08", "500.000000", "0.200000", "1.000000"]}
    trial = read(ddf(tmp_path / "a.ddf", table=table), columns={"length": {"unit": "L0"}})
    assert trial.facts.reference_length_m == pytest.approx(12.5e-3)
    assert trial.length_m == pytest.approx(12.5e-3 + 1e-3 * (LENGTH_V - 0.6), abs=1e-9)
