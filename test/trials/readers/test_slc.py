"""SLControl files: headers, calibration, pCa, zero force, F0."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.trials.readers.assembly import trial_of
from xb_muscle_ros.trials.readers.settings import ImportSettings
from xb_muscle_ros.trials.readers.slc import read_columns, read_header
from xb_muscle_ros.trials.trial import Trial

RATE_HZ = 2500
TIME_S = np.arange(1500) / RATE_HZ
CORNERS_S = [0.2, 0.2008, 0.22, 0.2208]
# Motor volts for a release of 20 % of 1200 um at -200 um/V, and force volts: offset, isometric level, slack.
FL_V = np.interp(TIME_S, CORNERS_S, [0.0, 1.2, 1.2, 0.0])


def slc(
    path: Path, pca: str = "4.5", level_v: float = 0.9, rate_hz: int = RATE_HZ, micro: bytes = b"\xb5", **changes: str
) -> Path:
    """A file like those of SLControl; `changes` replace values of the header, 'None' takes them out."""
    path.parent.mkdir(parents=True, exist_ok=True)
    slack = np.abs(TIME_S - 0.5 * (CORNERS_S[0] + CORNERS_S[3])) < 0.5 * (CORNERS_S[3] - CORNERS_S[0])
    force_v = np.where(slack, -0.5, -0.5 + level_v)
    header = {
        "No_of_input_channels": "4",
        "FL_COMMAND_CALIBRATION": "197.3",
        "FL_RESPONSE_CALIBRATION": "200.0",
        "FORCE_CALIBRATION": "0.0006",
        "FL_POLARITY": "-1.000000",
        "Muscle_length_(um)": "1.200e+003",
        "Sarcomere_length_(nm)": "2.291e+003",
        "Area_(m^2)": "4.658e-009",
        "sampling_rate_(Hz)": f"{rate_hz}.0",
        "data_points": str(TIME_S.size),
        **changes,
    }
    lines = ["SLCONTROL_DATA_FILE", "", "_VERSION_", "4.5.2", "", "_FILE_INFO_START_", f"pCa {pca} "]
    lines += ["Temperature 15 ", "Species Rat", "Muscle Soleus", "Drug NaN ", "_FILE_INFO_STOP_", ""]
    lines += ["_RECORD_TIME_", "Day 18 Month 3 Year 2022 Time 4 : 5 : 16", "", "_CALIBRATIONS_"]
    lines += [f"{name}: {value}" for name, value in header.items() if value != "None"]
    lines += ["", "Data"]
    rows = [f"{t:.6f}\t{f:.6f}\t0.000000\t{m:.6f}\t-0.04" for t, f, m in zip(TIME_S, force_v, FL_V, strict=True)]
    text = "\r\n".join([*lines, *rows, ""]).encode().replace(b"(um)", b"(" + micro + b"m)")
    path.write_bytes(text)
    return path


def read(path: Path, **keys: object) -> Trial:
    prepared = ImportSettings(keys, "here").prepare(path)
    (pending,) = prepared.reader.trials(path, prepared.mapping)
    return trial_of(pending.read(), prepared.mapping, path)


def test_calibrations_give_metres_and_newtons(tmp_path: Path) -> None:
    trial = read(slc(tmp_path / "prep1" / "45pCa1.slc"))
    facts = trial.facts
    assert (facts.fibre, facts.trial, facts.pca) == ("prep1", "prep1_45pCa1", 4.5)
    assert facts.reference_length_m == pytest.approx(1.2e-3)
    assert np.min(trial.length_change_l0) == pytest.approx(-0.2)
    assert facts.f0_n == pytest.approx(0.9 * 0.0006)
    assert trial.force_n[0] == pytest.approx(0.9 * 0.0006)
    assert np.min(trial.force_n) == pytest.approx(0.0, abs=1e-12)
    assert [phase.name for phase in facts.phases] == ["isometric", "release", "hold", "stretch", "recovery"]
    for words in ("15 °C", "Rat, Soleus", "4.658e-09 m^2", "in 45pCa1.slc", "slack"):
        assert words in facts.source
    assert "Drug" not in facts.source
    assert trial.warnings == ()


@pytest.mark.parametrize("micro", [b"\xb5", "µ".encode(), "μ".encode(), b"u"])
def test_every_spelling_of_micrometre_is_known(tmp_path: Path, micro: bytes) -> None:
    assert read(slc(tmp_path / "45pCa1.slc", micro=micro)).facts.reference_length_m == pytest.approx(1.2e-3)


def test_the_time_column_goes_before_the_rate_of_the_header(tmp_path: Path) -> None:
    trial = read(slc(tmp_path / "45pCa1.slc", rate_hz=1000))
    assert trial.time_s[-1] == pytest.approx(TIME_S[-1])
    (warning,) = trial.warnings
    assert "the header says 1000 Hz, the time column 2500 Hz; the time column is used" in warning


def test_f0_is_the_largest_isometric_force_at_pca_4_5_of_the_folder(tmp_path: Path) -> None:
    slc(tmp_path / "p" / "45pCa1.slc", level_v=0.9)
    slc(tmp_path / "p" / "45pCa2.slc", level_v=0.8)
    slc(tmp_path / "q" / "45pCa1.slc", level_v=0.5)
    (tmp_path / "p" / "46pCa1.slc").write_text("broken")
    trial = read(slc(tmp_path / "p" / "62pCa1.slc", "6.2", level_v=0.45))
    assert trial.facts.f0_n == pytest.approx(0.9 * 0.0006)
    assert trial.measured_f0[0] == pytest.approx(0.5)
    assert "the initial isometric force at pCa 4.5 in 45pCa1.slc" in trial.facts.source


def test_without_that_trial_f0_has_to_be_given(tmp_path: Path) -> None:
    file = slc(tmp_path / "62pCa1.slc", "6.2", level_v=0.45)
    with pytest.raises(UserError, match=r"62pCa1\.slc: no \.slc file .* at pCa 4\.5, so F0 is not known; .*--f0"):
        read(file)
    assert read(file, f0="0.54 mN").measured_f0[0] == pytest.approx(0.5)


def test_a_header_that_contradicts_the_file_name_is_refused(tmp_path: Path) -> None:
    file = slc(tmp_path / "62pCa1.slc", "6.4")
    with pytest.raises(UserError, match=r"the header says pCa 6\.4, the file name 6\.2; .* --pca"):
        read(file, f0="0.54 mN")
    assert read(file, f0="0.54 mN", pca=6.2).facts.pca == 6.2


def test_a_force_gain_is_divided_out(tmp_path: Path) -> None:
    file = slc(tmp_path / "45pCa1.slc")
    file.write_bytes(file.read_bytes().replace(b"Species Rat", b"Force_gain 10"))
    assert read(file).facts.f0_n == pytest.approx(0.9 * 0.0006 / 10)


def test_without_slack_zero_force_is_not_known(tmp_path: Path) -> None:
    file = slc(tmp_path / "45pCa1.slc")
    flat = b"\r\n".join(
        b"\t".join([*cells[:3], b"0.0", cells[4]]) if len(cells := line.split(b"\t")) == 5 else line
        for line in file.read_bytes().split(b"\r\n")
    )
    file.write_bytes(flat)
    with pytest.raises(UserError, match=r"no release leaves the fibre slack, so zero force is not known; use 'zero"):
        read(file, f0="0.5 mN")
    assert read(file, f0="0.5 mN", columns={"force": {"zero": "as_recorded"}}).force_n[0] == pytest.approx(0.4 * 0.0006)


def _cut(path: Path, keep: int) -> Path:
    path.write_bytes(path.read_bytes()[:keep])
    return path


def _with(path: Path, old: bytes, new: bytes) -> Path:
    assert old in path.read_bytes()
    path.write_bytes(path.read_bytes().replace(old, new, 1))
    return path


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda p: _cut(p, 0), "is empty; needed is a whole SLControl file"),
        (lambda p: _cut(p, 200), "ends within its header"),
        (lambda p: _cut(p, 40000), "rows; its header tells of 1500 data points, so it was cut short"),
        (lambda p: _with(p, b"SLCONTROL", b"SOMETHING"), "does not begin with SLCONTROL_DATA_FILE"),
        (lambda p: _with(p, b"0.004000\t0.4", b"0.004000\tx0.4"), "line 40, column 'force' holds 'x0.400000'"),
        (lambda p: _with(p, b"0.004000\t", b"0.004000\t1\t"), "line 40 has 6 cells; needed are 5: time, force"),
        (lambda p: _with(p, b"0.004000\t0.400000", b"0.004000\tnan"), "line 40, column 'force' is nan"),
        (lambda p: _with(p, b"0.004000\t", b"0.003000\t"), "line 40, column 'time': 0.003 s does not come after"),
        (
            lambda p: _with(p, b"input_channels: 4", b"input_channels: 5"),
            "has 5 input channels; known are files with 4",
        ),
        (lambda p: _with(p, b"FORCE_CALIBRATION: 0.0006\r\n", b""), "FORCE_CALIBRATION is missing in the header"),
        (lambda p: _with(p, b"FL_POLARITY: -1.000000", b"FL_POLARITY: up"), "FL_POLARITY is 'up' in the header"),
        (lambda p: _with(p, b"(\xb5m): 1.2", b"(mm): 1.2"), "Muscle_length_(mm) in the header is not in µm"),
        (lambda p: _with(p, b"Muscle_length", b"Length"), "Muscle_length_(µm) is missing in the header"),
        (lambda p: _with(p, b"1.200e+003", b"5.000e+006"), "fibres have 1e-05 to 0.7 m; is m its unit?"),
        (lambda p: _with(p, b"pCa 4.5", b"pCa NaN"), "calcium is not known"),
    ],
)
def test_what_is_broken_is_told_in_one_line(tmp_path: Path, change: object, words: str) -> None:
    file = slc(tmp_path / "trial.slc")
    assert callable(change)
    change(file)
    with pytest.raises(UserError) as refused:
        read(file, f0="0.54 mN")
    assert words in str(refused.value)
    assert "trial.slc" in str(refused.value)


def test_a_channel_that_is_not_there_is_answered_with_the_nearest(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="has no channel 'flx'; did you mean 'fl'"):
        read(slc(tmp_path / "45pCa1.slc"), f0="1 mN", columns={"length": {"column": "flx"}})


def test_eight_channels_have_their_own_names(tmp_path: Path) -> None:
    file = slc(tmp_path / "t.slc", No_of_input_channels="8", data_points="None")
    head, _, data = file.read_bytes().partition(b"Data\r\n")
    rows = [
        b"\t".join([row.split(b"\t")[i] for i in (0, 1, 3, 3, 4, 4, 4, 4, 4)]) for row in data.split(b"\r\n") if row
    ]
    file.write_bytes(head + b"Data\r\n" + b"\r\n".join(rows))
    columns = read_columns(read_header(file))
    assert list(columns)[:4] == ["time", "force", "fl", "fl_command"]
    assert columns["fl"].max() == pytest.approx(1.2)
    assert read(file).facts.reference_length_m == pytest.approx(1.2e-3)
