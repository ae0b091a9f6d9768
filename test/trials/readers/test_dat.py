"""Files of the 600A software: header, units, protocol, L0, F0, pCa, and what is wrong with them."""

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
from xb_muscle_ros.trials.bags import read_trial
from xb_muscle_ros.trials.importing import Failed, Imported, find_recordings, import_recordings
from xb_muscle_ros.trials.readers.assembly import trial_of
from xb_muscle_ros.trials.readers.registry import READERS, is_recording, reader_for
from xb_muscle_ros.trials.readers.settings import ImportSettings
from xb_muscle_ros.trials.trial import Trial

RATE_HZ = 1000
COUNT = 1200
TIME_MS = np.arange(COUNT) * 1000.0 / RATE_HZ
L0_MM = 1.25
# Stretch by 4 % L0 in 80 ms, back at once, 100 ms of rest, and stretched again.
CORNERS_MS = [400.0, 480.0, 560.0, 660.0, 740.0]
LENGTH_MM = L0_MM * np.interp(TIME_MS, CORNERS_MS, [1.0, 1.04, 1.0, 1.0, 1.04])
FORCE_MN = 0.3 + 8.0 * (LENGTH_MM / L0_MM - 1.0)
PROTOCOL = (
    (0.0, "Data-Enable", ""),
    (400.0, "Length-Ramp", "+0.0400 Lo  80 ms"),
    (480.0, "Length-Ramp", "-0.0400 Lo  80 ms"),
    (660.0, "Length-Ramp", "+0.0400 Lo  80 ms"),
    (1200.0, "Data-Disable", ""),
    (1200.1, "Stop", ""),
)
NAMES = "Time (ms)  Lin (mm)  Lout (mm)  Fin (mN)  Fout (mN)"
FACTS = {
    "Created": "Tue Mar  5 10:11:12 2024",
    "Fiber Length": "1.250 mm",
    "Initial Sarcomere Length": "2.50 um",
    "Diameter": "0.080 mm",
    "Comment": "rat soleus, 15 °C",
}


def dat(
    path: Path,
    facts: dict[str, str] | None = None,
    protocol: tuple[tuple[float, str, str], ...] = PROTOCOL,
    names: str = NAMES,
    end: str = "\r\n",
    rows: list[str] | None = None,
    encoding: str = "latin-1",
) -> Path:
    """A file as the 600A software writes them; ``facts`` change the header, 'None' takes them out."""
    path.parent.mkdir(parents=True, exist_ok=True)
    told = {**FACTS, **(facts or {})}
    lines = ["ASI 600A Data File", f"Created: {told.pop('Created')}", "*** Setup Parameters ***"]
    lines += [f"{name}: {value}" for name, value in told.items() if value != "None" and name != "A/D Sampling Rate"]
    lines += ["*** Calibration Parameters ***", "Device  Channel  Offset  Scale", "(-) (-) (V) (units/V)"]
    lines += ["322C\tLength\t0.0\t0.25", "406A\tForce\t0.02\t0.5", "*** Test Protocol Parameters ***"]
    lines += [f"A/D Sampling Rate: {told.get('A/D Sampling Rate', f'{RATE_HZ} Hz')}", "PD Deadband:    0.000000 mN"]
    lines += ["Stimulus 01: 0.5 ms 200.000 Hz 10.0 ms 50.000 Hz 0.500 s", "Time (ms)\tControl Function\tOptions "]
    lines += [f"{time:9.1f}\t{function}\t\t{options}" for time, function, options in protocol]
    lines += ["*** Force and Length Signals vs Time ***", names, *(made_rows() if rows is None else rows), ""]
    path.write_bytes(end.join(lines).encode(encoding))
    return path


def made_rows(time: str = "{:.1f}", mark: str = ".") -> list[str]:
    columns = zip(TIME_MS, LENGTH_MM, FORCE_MN, strict=True)
    return [f"{time.format(t)}  {x:.6f}  {x:.6f}  {f:.6f}  {0.0:.6f}".replace(".", mark) for t, x, f in columns]


GIVEN: dict[str, Any] = {"f0": "0.5 mN", "pca": 4.5}


def read(path: Path, file_format: str | None = None, **keys: Any) -> Trial:
    prepared = ImportSettings({**GIVEN, **keys}, "here", file_format).prepare(path)
    (pending,) = prepared.reader.trials(path, prepared.mapping)
    return trial_of(pending.read(), prepared.mapping, path)


def test_columns_and_header_give_the_trial(tmp_path: Path) -> None:
    trial = read(dat(tmp_path / "fibre7" / "run1.dat"))
    facts = trial.facts
    assert (facts.fibre, facts.trial, facts.pca, facts.f0_n) == ("fibre7", "run1", 4.5, pytest.approx(5e-4))
    assert facts.reference_length_m == pytest.approx(1.25e-3, rel=1e-15)
    assert trial.time_s == pytest.approx(1e-3 * TIME_MS, rel=1e-12)
    assert trial.length_m == pytest.approx(1e-3 * LENGTH_MM, abs=5.1e-10)
    assert trial.force_n == pytest.approx(1e-3 * FORCE_MN, abs=5.1e-10)
    assert [phase.name for phase in facts.phases] == [
        "isometric", "conditioning_stretch", "shortening", "recovery", "test_stretch", "hold",
    ]  # fmt: skip
    assert (facts.amplitude_l0, facts.recovery_s) == (0.04, pytest.approx(0.1))
    assert facts.phases[4].start_s == pytest.approx(0.66, abs=1e-3)
    for words in ("Tue Mar  5 10:11:12 2024".replace("  ", " "), "sarcomeres 2.50 um", "diameter 0.080 mm", "15 °C"):
        assert words in " ".join(facts.source.split())
    assert "L0 = 0.00125 m (Fiber Length of the header)" in facts.source
    assert "Length-Ramp at 0.66 s (+0.0400 Lo 80 ms)" in facts.source
    assert trial.warnings == ()


@pytest.mark.parametrize("end", ["\n", "\r\n", "\r"])
@pytest.mark.parametrize("encoding", ["latin-1", "utf-8"])
def test_line_ends_and_encodings(tmp_path: Path, end: str, encoding: str) -> None:
    trial = read(dat(tmp_path / "a.dat", end=end, encoding=encoding))
    assert trial.time_s.size == COUNT
    assert "15 °C" in trial.facts.source


@pytest.mark.parametrize("names", [NAMES, NAMES.replace("  ", "\t"), NAMES.replace("  ", " ")])
def test_names_of_columns_with_any_gap(tmp_path: Path, names: str) -> None:
    assert read(dat(tmp_path / "a.dat", names=names)).force_n[0] == pytest.approx(3e-4)


def test_decimal_commas_are_found_and_told(tmp_path: Path) -> None:
    trial = read(dat(tmp_path / "a.dat", {"Fiber Length": "1,250 mm"}, rows=made_rows(mark=",")))
    assert trial.facts.reference_length_m == pytest.approx(1.25e-3)
    assert trial.length_m == pytest.approx(1e-3 * LENGTH_MM, abs=5.1e-10)
    (warning,) = trial.warnings
    assert "has decimal commas" in warning


def test_units_of_the_file_count(tmp_path: Path) -> None:
    rows = [
        f"{t / 1e3:.4f} {1e3 * x:.3f} {x:.6f} {1e3 * f:.3f}"
        for t, x, f in zip(TIME_MS, LENGTH_MM, FORCE_MN, strict=True)
    ]
    trial = read(dat(tmp_path / "a.dat", names="Time (s)  Lin (µm)  Lout (mm)  Fin (uN)", rows=rows))
    assert trial.length_m == pytest.approx(1e-3 * LENGTH_MM, abs=5.1e-10)
    assert trial.force_n == pytest.approx(1e-3 * FORCE_MN, abs=5.1e-10)
    assert trial.time_s == pytest.approx(1e-3 * TIME_MS)


@pytest.mark.parametrize(("unit", "factor"), [("g", 9.80665e-3), ("mg", 9.80665e-6), ("grams", 9.80665e-3)])
def test_grams_are_the_weight_of_a_mass(tmp_path: Path, unit: str, factor: float) -> None:
    trial = read(dat(tmp_path / "a.dat", names=NAMES.replace("Fin (mN)", f"Fin ({unit})")), f0="400 g")
    assert trial.force_n == pytest.approx(factor * FORCE_MN, rel=1e-5)


def test_a_unit_that_is_not_known_has_to_be_given(tmp_path: Path) -> None:
    file = dat(tmp_path / "a.dat", names=NAMES.replace("Fin (mN)", "Fin (Ref)"))
    with pytest.raises(UserError, match=r"a\.dat, column 'Fin' is in 'Ref', which is no known unit .* --force-unit"):
        read(file)
    assert read(file, columns={"force": {"unit": "mN"}}).force_n[0] == pytest.approx(3e-4)
    file = dat(tmp_path / "b.dat", names=NAMES.replace("Fin (mN)", "Fin"))
    with pytest.raises(UserError, match=r"column 'Fin' has no unit; known: .*columns\.force\.unit"):
        read(file)
    assert read(file, f0="0.5 N", columns={"force": {"unit": "N"}}).force_n[0] == pytest.approx(0.3)


def test_a_unit_that_contradicts_the_file_is_refused(tmp_path: Path) -> None:
    file = dat(tmp_path / "a.dat")
    with pytest.raises(
        UserError, match=r"column 'Lin' is in mm by the file, in um by here; leave columns\.length\.unit"
    ):
        read(file, columns={"length": {"unit": "um"}})
    assert read(file, columns={"length": {"unit": "mm"}}).length_m[0] == pytest.approx(1.25e-3)


def test_without_a_fibre_length_l0_is_that_of_the_record_and_told(tmp_path: Path) -> None:
    for name, value, words in (("a", "0.000 mm", "Fiber Length in the header is 0;"), ("b", "None", "has no Fiber")):
        trial = read(dat(tmp_path / f"{name}.dat", {"Fiber Length": value}))
        assert trial.facts.reference_length_m == pytest.approx(1.25e-3, rel=1e-6)
        assert trial.facts.amplitude_l0 == pytest.approx(0.04, abs=1e-4)
        (warning,) = trial.warnings
        assert words in warning
        assert "--reference-length" in warning
    assert read(tmp_path / "a.dat", reference_length="1.3 mm").facts.reference_length_m == pytest.approx(1.3e-3)


def test_what_the_mapping_tells_goes_before_the_header(tmp_path: Path) -> None:
    file = dat(tmp_path / "a.dat", {"Fiber Length": "1.20 mm", "Reference Force": "0.8 mN"})
    assert read(file, f0=None).facts.f0_n == pytest.approx(8e-4)
    assert "F0 = 0.0008 N, Reference Force of the header" in read(file, f0=None).facts.source
    assert read(file).facts.f0_n == pytest.approx(5e-4)
    assert read(file).facts.reference_length_m == pytest.approx(1.2e-3)
    assert read(file, reference_length="1.3 mm").facts.reference_length_m == pytest.approx(1.3e-3)
    assert read(file, reference_length="first_isometric").facts.reference_length_m == pytest.approx(1.25e-3)


def test_l0_and_f0_of_the_header_are_those_of_lengths_in_l0_and_forces_in_f0(tmp_path: Path) -> None:
    names = "Time (ms)  Lin (L0)  Lout (mm)  Fin (F0)  Fout (mN)"
    columns = zip(TIME_MS, LENGTH_MM / L0_MM, FORCE_MN / 0.5, strict=True)
    rows = [f"{t:.1f}  {x:.8f}  {x:.6f}  {f:.8f}  0.0" for t, x, f in columns]
    file = dat(tmp_path / "a.dat", {"Reference Force": "0.5 mN"}, names=names, rows=rows)
    with pytest.raises(UserError, match=r"column 'Lin' is in L0 by the file, .*; give it as columns\.length\.unit or"):
        read(file)
    own = {"columns": {"length": {"unit": "L0"}, "force": {"unit": "F0"}}, "f0": None}
    trial = read(file, **own)
    assert (trial.facts.reference_length_m, trial.facts.f0_n) == pytest.approx((1e-3 * L0_MM, 5e-4))
    assert trial.length_m == pytest.approx(1e-3 * LENGTH_MM, abs=1e-9)
    assert trial.force_n == pytest.approx(1e-3 * FORCE_MN, abs=1e-9)
    assert "L0 = 0.00125 m (Fiber Length of the header)" in trial.facts.source
    without = dat(tmp_path / "b.dat", {"Fiber Length": "0 mm"}, names=names, rows=rows)
    facts = read(without, **own).facts
    assert (facts.reference_length_m, facts.f0_n) == (1.0, 1.0)


def test_two_lengths_of_the_fibre_are_told(tmp_path: Path) -> None:
    (warning,) = read(dat(tmp_path / "a.dat", {"Initial Length": "1.10 mm"})).warnings
    assert "has Fiber Length 1.250 mm and Initial Length 1.10 mm; L0 is the former; give --reference-length" in warning
    assert read(dat(tmp_path / "b.dat", {"Initial Length": "1.251 mm"})).warnings == ()
    assert read(tmp_path / "a.dat", reference_length="1.1 mm").warnings == ()


def test_f0_has_to_be_known(tmp_path: Path) -> None:
    with pytest.raises(UserError, match=r"the header has no Reference Force, so f0 is needed, .* --f0 '100 mN'"):
        read(dat(tmp_path / "a.dat"), f0=None)
    with pytest.raises(UserError, match=r"Reference Force in the header is 0, so f0 is needed"):
        read(dat(tmp_path / "b.dat", {"Reference Force": "0.0 mN"}), f0=None)
    with pytest.raises(UserError, match=r"Reference Force of the header: f0 is 1e-12 N; allowed is"):
        read(dat(tmp_path / "c.dat", {"Reference Force": "0.000000001 mN"}), f0=None)
    with pytest.raises(UserError, match=r"c\.dat: Reference Force: unit 'tons' of force is not known"):
        read(dat(tmp_path / "c.dat", {"Reference Force": "1 tons"}), f0=None)


def test_f0_is_found_in_the_folder_by_the_pca_of_comment_or_name(tmp_path: Path) -> None:
    keys: dict[str, Any] = {"f0": {"isometric_at_pca": 4.5}, "pca": None}
    dat(tmp_path / "max.dat", {"Comment": "rat, pCa 4.5"})
    half = dat(tmp_path / "half_pCa6.1.dat", rows=[row.replace("  0.3", "  0.15", 1) for row in made_rows()])
    (tmp_path / "broken.dat").write_text("ASI 600A Data File\nnothing")
    trial = read(half, **keys)
    assert trial.facts.pca == 6.1
    assert trial.facts.f0_n == pytest.approx(3e-4)
    assert "in max.dat" in trial.facts.source
    assert "pCa 6.1 by the file name" in trial.facts.source


def test_comment_and_name_that_differ_are_refused(tmp_path: Path) -> None:
    file = dat(tmp_path / "x_pCa45.dat", {"Comment": "pCa = 6.0"})
    with pytest.raises(UserError, match=r"comment of the header says pCa 6, the file name 4\.5; give the right one"):
        read(file, pca=None)
    assert read(file, pca=5.0).facts.pca == 5.0
    with pytest.raises(UserError, match="calcium is not known; give --pca"):
        read(dat(tmp_path / "y.dat", {"Comment": "from pCa 9 to pCa 4.5"}), pca=None)


def test_the_header_s_rate_is_compared(tmp_path: Path) -> None:
    (warning,) = read(dat(tmp_path / "a.dat", {"A/D Sampling Rate": "5000 Hz"})).warnings
    assert "the header says 5000 Hz, the time column 1000 Hz; the time column is used" in warning


def test_rounded_times_are_counted_by_the_rate(tmp_path: Path) -> None:
    rows = made_rows()
    shared = [f"{np.floor(t / 2) * 2:.1f} {row.split(maxsplit=1)[1]}" for t, row in zip(TIME_MS, rows, strict=True)]
    trial = read(dat(tmp_path / "a.dat", rows=shared))
    assert trial.time_s == pytest.approx(1e-3 * TIME_MS, abs=1e-12)
    (warning,) = trial.warnings
    assert "times are rounded to 2 ms" in warning
    shared = ["0.0 " + row.split(maxsplit=1)[1] for row in rows]
    with pytest.raises(UserError, match="column 'Time': 0 s comes again"):
        read(dat(tmp_path / "b.dat", rows=shared))


def test_a_protocol_that_is_not_in_the_record_is_told(tmp_path: Path) -> None:
    late = tuple((t + 30.0 * (t == 660.0), function, options) for t, function, options in PROTOCOL)
    trial = read(dat(tmp_path / "a.dat", protocol=late))
    assert any("shows the test stretch at 0.66 s; the file tells of one at 0.69 s" in line for line in trial.warnings)
    assert any("recovery_s is 0.13 s, but the recovery" in line for line in trial.warnings)
    assert trial.facts.recovery_s == pytest.approx(0.1, abs=1e-4)


def test_a_bath_that_is_changed_within_the_record_is_told(tmp_path: Path) -> None:
    protocol = (*PROTOCOL[:1], (200.0, "Bath", "3 0 ms"), *PROTOCOL[1:])
    (warning,) = read(dat(tmp_path / "a.dat", protocol=protocol)).warnings
    assert "changes the bath within the record (to 3 0 ms at 0.2 s)" in warning


def test_sarcomere_lengths_are_a_column(tmp_path: Path) -> None:
    rows = [f"{row}  {2.5 * x / L0_MM:.6f}" for row, x in zip(made_rows(), LENGTH_MM, strict=True)]
    file = dat(tmp_path / "a.dat", names=f"{NAMES}  SL (um)", rows=rows)
    trial = read(file, columns={"length": {"column": "SL", "of": "sarcomere"}})
    assert trial.facts.reference_length_m == 1.0
    assert trial.length_m == pytest.approx(LENGTH_MM / L0_MM, abs=1e-6)
    assert read(file, columns={"length": {"column": "Lin (mm)"}}).length_m[0] == pytest.approx(1.25e-3)


def test_a_last_line_that_was_cut_is_left_out_and_told(tmp_path: Path) -> None:
    file = dat(tmp_path / "a.dat")
    whole = file.read_bytes()
    for keep in (-3, -12, -30):
        file.write_bytes(whole[:keep])
        trial = read(file)
        assert trial.time_s.size == COUNT - 1
        (warning,) = trial.warnings
        assert re.search(r"a\.dat, line \d+: the last line was cut short and is left out", warning)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda data: b"", "is empty; needed is a data file of the 600A software"),
        (lambda data: data[:300], "ends within its header; needed is a data file of the 600A software"),
        (lambda data: data[: data.index(b"Time (ms)  Lin")], "names no columns below"),
        (lambda data: data[: data.index(b"0.0  1.25")], "has no whole rows below its header"),
        (swap(b"5.0  1.2", b"5.0  x1.2"), "column 'Lin' holds 'x1.250000'; needed is a number"),
        (swap(b"5.0  1.2", b"5.0  7 1.2"), "has 6 cells; needed are 5: Time, Lin, Lout, Fin, Fout"),
        (swap(b"5.0  1.250000  1.250000", b"5.0  1.250000"), "has 4 cells; needed are 5"),
        (swap(b"5.0  1.250000", b"5.0  nan"), "column 'Lin' is nan; allowed are finite numbers"),
        (swap(b"5.0  1.250000", b"5.0  1,250000"), "decimal commas and points in one file; tell which"),
        (swap(b"5.0  1.250000", b"5.0  1_2"), "column 'Lin' holds '1_2'"),
        (swap(b"\r\n6.0  ", b"\r\n4.0  "), "column 'Time': 0.004 s does not come after 0.005 s"),
        (swap(b"Fin (mN)", b"Force (mN)"), "has no column 'Fin'; its columns: Time, Lin, Lout, Force, Fout; name"),
        (swap(b"Fout (mN)", b"Fin (mN)"), "has more than one column 'Fin'; rename one"),
        (
            swap(b"Fiber Length: 1.250 mm", b"Fiber Length: 1.250 yd"),
            "Fiber Length: unit 'yd' of length is not known",
        ),
        (
            swap(b"Fiber Length: 1.250 mm", b"Fiber Length: 1.250 mm\r\nFiber Length: 1.3 mm"),
            "Fiber Length is in the header as 1.250 mm and as 1.3 mm; mend the header",
        ),
        (swap(b"Fiber Length: 1.250 mm", b"Fiber Length: 1250 mm"), "fibres have 1e-05 to 0.7 m"),
        (swap(b"1.25", b"1.2\x005"), "is no plain text"),
    ],
)
def test_what_is_broken_is_told_in_one_line(tmp_path: Path, change: Callable[[bytes], bytes], words: str) -> None:
    file = dat(tmp_path / "trial.dat")
    file.write_bytes(change(file.read_bytes()))
    with pytest.raises(UserError) as refused:
        read(file, "dat")
    assert words in str(refused.value)
    assert "trial.dat" in str(refused.value)


@pytest.fixture(scope="module")
def small(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, bytes, Trial]:
    """A short file, its content, and its trial."""
    file = dat(tmp_path_factory.mktemp("dat") / "small.dat", rows=made_rows()[300:420], protocol=PROTOCOL[:2])
    return file, file.read_bytes(), read(file)


def _is_part(trial: Trial, whole: Trial) -> bool:
    """Whether every sample of a trial is one of the whole, with the same numbers."""
    at = np.searchsorted(whole.time_s, trial.time_s)
    return bool(
        np.all(at < whole.time_s.size)
        and np.array_equal(whole.time_s[at], trial.time_s)
        and np.array_equal(whole.length_m[at], trial.length_m)
        and np.array_equal(whole.force_n[at], trial.force_n)
    )


@settings(max_examples=150, deadline=None)
@given(st.data())
def test_damage_gives_one_line_or_a_part_of_the_trial(small: tuple[Path, bytes, Trial], data: st.DataObject) -> None:
    file, content, whole = small
    at = data.draw(st.integers(0, len(content)))
    kind = data.draw(st.sampled_from(["cut", "junk", "line", "lost"]))
    lines = content.split(b"\r\n")
    n = data.draw(st.integers(0, len(lines) - 1))
    if kind == "cut":
        damaged = content[:at]
    elif kind == "junk":
        junk = data.draw(st.binary(min_size=1, max_size=4).filter(lambda b: not re.search(rb"[0-9.,+eE\s-]", b)))
        damaged = content[:at] + junk + content[at:]
    else:
        damaged = b"\r\n".join(lines[:n] + ([lines[n]] * 2 if kind == "line" else []) + lines[n + 1 :])
    file.write_bytes(damaged)
    # What a lost header line told is given, so that only samples can go wrong.
    try:
        trial = read(file, "dat", reference_length="1.25 mm")
    except UserError as problem:
        told = str(problem)
    else:
        assert _is_part(trial, whole)
        return
    assert "small.dat" in told
    assert "\n" not in told


def test_what_is_in_it(tmp_path: Path) -> None:
    contents = READERS["dat"].contents(dat(tmp_path / "a.dat"))
    told = [(content.name, content.unit, content.told_role) for content in contents.signals]
    assert told[:4] == [("Time", "ms", "time"), ("Lin", "mm", "length"), ("Lout", "mm", ""), ("Fin", "mN", "force")]
    assert contents.signals[1].values == pytest.approx(LENGTH_MM, abs=5.1e-7)
    assert contents.in_header == ("reference_length",)
    assert contents.facts["Diameter"] == "0.080 mm"


def test_a_table_in_dat_is_no_600a_file(tmp_path: Path) -> None:
    table = tmp_path / "table.dat"
    table.write_text("t\tl\n0\t1\n1\t1\n")
    assert reader_for(table) is READERS["csv"]
    assert not is_recording(table)
    file = dat(tmp_path / "a.dat")
    assert reader_for(file) is READERS["dat"]
    assert is_recording(file)
    assert reader_for(dat(tmp_path / "a.txt")) is READERS["dat"]
    with pytest.raises(UserError, match=r"table\.dat has no section .* read a table with --format csv"):
        ImportSettings({}, "here", "dat").prepare(table)


def test_a_folder_of_files_becomes_bags(tmp_path: Path) -> None:
    folder = tmp_path / "f1"
    dat(folder / "a_pCa4.5.dat")
    dat(folder / "b_pCa6.dat")
    dat(folder / "cut.dat").write_text("ASI 600A Data File\n")
    (folder / "other.dat").write_text("1 2 3\n")
    settings_ = ImportSettings({"f0": "0.5 mN"}, "here")
    events = list(import_recordings(find_recordings([folder]), settings_, tmp_path / "bags"))
    made = {event.bag.name: event for event in events if isinstance(event, Imported)}
    assert sorted(made) == ["f1_a_pCa4.5", "f1_b_pCa6"]
    (failed,) = (event for event in events if isinstance(event, Failed))
    assert "cut.dat ends within its header" in failed.why
    back = read_trial(made["f1_b_pCa6"].bag)
    assert back.facts == made["f1_b_pCa6"].trial.facts
    assert back.length_m == pytest.approx(1e-3 * LENGTH_MM, abs=5.1e-10)
    assert back.facts.pca == 6.0
