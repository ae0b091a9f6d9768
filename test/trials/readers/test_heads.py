"""What stands above the numbers: preambles, headers, rows of units, and heads of recording programs."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import lab_tables as lab
import numpy as np
import pytest

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.trials.inspecting.inspection import inspect_file

TITLES = ["Experiment 12", "Date,2018-12-17", "Rate,1000", "Temperature,15,degC", ""]
BY_NUMBER = {
    "time": {"column": 1, "unit": "s"},
    "length": {"column": 2, "unit": "mm"},
    "force": {"column": 3, "unit": "mN"},
}


def unitless(time: str, length: str, force: str) -> dict[str, Any]:
    return {"time": {"column": time}, "length": {"column": length}, "force": {"column": force}}


def test_lines_above_the_header_are_no_part_of_the_table_and_that_is_told(tmp_path: Path) -> None:
    path = lab.write(tmp_path, [*TITLES, ",".join(lab.NAMES), *lab.rows()])
    (trial,) = lab.trials(path)
    lab.same(trial)
    assert trial.warnings == (f"{path}: line 6 names the columns; what is above is no part of the table",)


def test_a_header_is_found_though_a_name_is_wrong_and_the_refusal_lists_it(tmp_path: Path) -> None:
    path = lab.write(tmp_path, [*TITLES, "time_s,len_mm,force_mN", *lab.rows()])
    assert "has no column 'length_mm'; its columns: time_s, len_mm, force_mN; did you mean" in lab.refusal(path)


@pytest.mark.parametrize("bracket", ["{}", "({})", "[{}]"])
def test_units_below_the_header_are_read_where_the_mapping_has_none(tmp_path: Path, bracket: str) -> None:
    units = ",".join(map(bracket.format, ("ms", "um", "uN")))
    lines = ["t,l,f", units, *lab.rows(1e3 * lab.TIME_S, 1e3 * lab.LENGTH_MM, 1e3 * lab.FORCE_MN)]
    path = lab.write(tmp_path, lines)
    (trial,) = lab.trials(path, unitless("t", "l", "f"))
    lab.same(trial)
    assert trial.warnings == (
        f"{path}: line 2 holds units: {units.replace(',', ', ')}",
        f"{path}: column 't' is read in ms, as its header says",
        f"{path}: column 'l' is read in um, as its header says",
        f"{path}: column 'f' is read in uN, as its header says",
    )


@pytest.mark.parametrize(
    ("names", "factors"),
    [
        (("Time (ms)", "Length [µm]", "Force (mN)"), (1e3, 1e3, 1.0)),
        (("t_s", "L_mm", "F_uN"), (1.0, 1.0, 1e3)),
        (("Zeit / s", "Länge / mm", "Kraft in mN"), (1.0, 1.0, 1.0)),
        (("Time (sec)", "Length (L0)", "Force {%F0}"), (1.0, 1.0 / 1.2, 100.0)),
    ],
)
def test_units_in_names_of_columns(tmp_path: Path, names: tuple[str, ...], factors: tuple[float, ...]) -> None:
    signals = (lab.TIME_S, lab.LENGTH_MM, lab.FORCE_MN)
    lines = [";".join(names), *lab.rows(*(f * s for f, s in zip(factors, signals, strict=True)), delimiter=";")]
    relative = "L0" in names[1]
    (trial,) = lab.trials(lab.write(tmp_path, lines), unitless(*names), f0=None if relative else "1 mN")
    assert trial.time_s == pytest.approx(lab.TIME_S)
    assert trial.length_change_l0 == pytest.approx(lab.LENGTH_MM / 1.2 - 1.0)
    assert trial.measured_f0 == pytest.approx(lab.FORCE_MN)
    assert sum("as its header says" in line for line in trial.warnings) == 3


def test_a_unit_that_is_told_goes_before_the_header_and_that_is_doubted(tmp_path: Path) -> None:
    path = lab.write(tmp_path, ["time (s),length (mm),force (N)", *lab.rows()])
    columns = {key: {"column": f"{key} ({unit})", "unit": own} for key, unit, own in
               (("time", "s", "s"), ("length", "mm", "mm"), ("force", "N", "mN"))}  # fmt: skip
    (trial,) = lab.trials(path, columns)
    lab.same(trial)
    (line,) = trial.warnings
    assert "column 'force (N)' is read in mN, but its header tells N; check columns.force.unit (--force-unit)" in line


def test_without_any_unit_the_refusal_names_the_option(tmp_path: Path) -> None:
    path = lab.write(tmp_path, ["t_s,l_mm,force", *lab.rows()])
    why = lab.refusal(path, unitless("t_s", "l_mm", "force"))
    assert "the header of 'force' tells no unit that is known for it; give it by columns.force.unit" in why


def test_columns_by_number_where_there_is_no_header(tmp_path: Path) -> None:
    path = lab.write(tmp_path, lab.rows(delimiter="\t"), "t.txt")
    (trial,) = lab.trials(path, BY_NUMBER)
    lab.same(trial)
    assert "there is no header; columns go by their number, and rows begin in line 1" in lab.told(trial)
    lab.same(lab.trials(path, BY_NUMBER, header="none", trial="b")[0])
    assert "line 1 holds numbers; needed is a header line" in lab.refusal(lab.write(tmp_path / "other", lab.rows()))


def test_columns_by_number_below_a_header_and_below_a_preamble(tmp_path: Path) -> None:
    lab.same(lab.trials(lab.write(tmp_path, ["x,y,z", *lab.rows()]), BY_NUMBER)[0])
    path = lab.write(tmp_path, ["Made by a rig", "on a Monday", *lab.rows()], "b.csv")
    lab.same(lab.trials(path, BY_NUMBER)[0])


def test_the_line_of_the_header_may_be_told(tmp_path: Path) -> None:
    lines = [",".join(lab.NAMES), "a,b,c", *lab.rows()]
    columns = {key: {**spec, "column": name} for (key, spec), name in zip(lab.COLUMNS.items(), "abc", strict=True)}
    lab.same(lab.trials(lab.write(tmp_path, lines), columns, header=2)[0])
    assert "header is line 999" in lab.refusal(lab.write(tmp_path / "other", lines), header=999)
    with pytest.raises(UserError, match="header is 'top'; needed is the number of the line"):
        lab.run(lab.write(tmp_path, lines, "c.csv"), header="top")


def test_an_empty_cell_between_blanks_is_refused(tmp_path: Path) -> None:
    """Regression: the cells behind it moved to its place, and a column that is not imported became the force."""
    values = zip(lab.TIME_S.tolist(), lab.LENGTH_MM.tolist(), lab.FORCE_MN.tolist(), strict=True)
    lines = [f"{t:8.3f} {x:9.6f} {f:9.6f} {1.2 * f:9.6f}" for t, x, f in values]
    lines[50:60] = [line[:18] + " " * 10 + line[28:] for line in lines[50:60]]
    why = lab.refusal(lab.write(tmp_path, ["time_s length_mm force_mN raw", *lines]))
    assert "line 52 has 3 cells between blanks, and so do 9 more; needed are 4: time_s, length_mm, force_mN, raw" in why


def test_columns_between_blanks(tmp_path: Path) -> None:
    lines = ["Time (s)   Length [mm]  Force", *lab.rows(delimiter="   ")]
    columns = {**unitless("Time (s)", "Length [mm]", "Force"), "force": {"column": "Force", "unit": "mN"}}
    lab.same(lab.trials(lab.write(tmp_path, [lines[0], *(f"  {line}" for line in lines[1:])]), columns)[0])
    lines[0] = "Time Muscle length Force"
    columns = {**BY_NUMBER, "force": {"column": "Force", "unit": "mN"}}
    assert "line 1 has 4 names between blanks, the row below 3" in lab.refusal(
        lab.write(tmp_path / "other", lines), columns
    )


def test_a_comment_may_name_the_columns(tmp_path: Path) -> None:
    path = lab.write(tmp_path, ["# made by NumPy", f"# {' '.join(lab.NAMES)}", *lab.rows(delimiter=" ")], "t.txt")
    lab.same(lab.trials(path)[0])
    lab.same(lab.trials(lab.write(tmp_path, [f"% {','.join(lab.NAMES)}", *lab.rows()], "m.csv"))[0])


def test_names_that_come_twice_are_told_apart_by_the_row_above(tmp_path: Path) -> None:
    columns = [lab.TIME_S, lab.LENGTH_MM, lab.FORCE_MN, lab.LENGTH_MM, 2 * lab.FORCE_MN]
    path = lab.write(tmp_path, [",pCa 6.1,,pCa 4.5,", "time_s,L_mm,F_mN,L_mm,F_mN", *lab.rows(*columns)])
    (trial,) = lab.trials(path, unitless("time_s", "pCa 4.5 L_mm", "pCa 4.5 F_mN"), pca=4.5)
    lab.same(trial, force_mn=2 * lab.FORCE_MN)
    assert "two rows name the columns, for example 'pCa 6.1 L_mm'" in lab.told(trial)


def test_names_that_stay_double_are_refused_with_their_numbers_only_where_they_are_read(tmp_path: Path) -> None:
    lines = ["time_s,length_mm,force_mN,x,x", *(f"{line},1,2" for line in lab.rows())]
    lab.same(lab.trials(lab.write(tmp_path, lines))[0])
    lines[0] = "time_s,length_mm,force_mN,force_mN,x"
    path = lab.write(tmp_path / "other", lines)
    assert "has more than one column 'force_mN'; rename one, or give its number: 3 or 4" in lab.refusal(path)


RATES = ["Sampling rate: 1000 Hz", "Sample interval (ms),1.0", "# sampling frequency = 1 kHz", "Scan Rate;1,0 kHz"]


@pytest.mark.parametrize("line", RATES)
def test_the_rate_of_the_preamble_stands_for_a_column_of_time(tmp_path: Path, line: str) -> None:
    path = lab.write(tmp_path, ["Rig 3", line, "length_mm,force_mN", *lab.rows(lab.LENGTH_MM, lab.FORCE_MN)])
    columns = {key: spec for key, spec in lab.COLUMNS.items() if key != "time"}
    (trial,) = lab.trials(path, columns)
    lab.same(trial)
    assert "there are 1000 samples in a second by" in lab.told(trial)


OTHER_RATES = [["# Sampling rate: 2000 Hz"], ["Rig 3", "Sample interval (ms),0.5"]]


@pytest.mark.parametrize("above", OTHER_RATES)
def test_a_column_of_time_of_another_rate_is_not_passed_over(tmp_path: Path, above: list[str]) -> None:
    """Regression: the head's rate was taken without a word beside a column of time that told another."""
    path = lab.write(tmp_path, [*above, "Time (s),length_mm,force_mN", *lab.rows()])
    columns = {key: spec for key, spec in lab.COLUMNS.items() if key != "time"}
    why = lab.refusal(path, columns)
    assert "there are 2000 samples in a second by '" in why
    remedy = "tell which is right by --time-column 'Time (s)' --time-unit s, or by --rate '2000 Hz'"
    assert f"', 1000 by column 'Time (s)'; {remedy}" in why


@pytest.mark.parametrize(
    ("time", "rate_hz", "line"),
    [
        (
            {"column": "Time (s)", "unit": "s"},
            1000.0,
            "the header says 2000 Hz, the time column 1000 Hz; the time column is used",
        ),
        (
            {"rate": "1000 Hz"},
            1000.0,
            "there are 2000 samples in a second by '# Sampling rate: 2000 Hz', 1000 are taken",
        ),
        ({"rate": "2000 Hz"}, 2000.0, ""),
    ],
)
def test_what_a_mapping_tells_of_time_goes_before_the_rate_above(
    tmp_path: Path, time: dict[str, str], rate_hz: float, line: str
) -> None:
    path = lab.write(tmp_path, [*OTHER_RATES[0], "Time (s),length_mm,force_mN", *lab.rows()])
    (trial,) = lab.trials(path, {**lab.COLUMNS, "time": time})
    lab.same(trial, time_s=lab.TIME_S * 1000.0 / rate_hz)
    assert [line in each for each in trial.warnings if "2000" in each] == ([True] if line else [])


@pytest.mark.parametrize(
    ("name", "values"),
    [
        ("Time (s)", lab.TIME_S),
        ("time_ms", lab.TIME_S.round(2) * 1000.0),  # ten samples share a time
        ("Time", 7.0 * lab.TIME_S),  # in a unit that is not told
        ("Time to peak (s)", 0.0 * lab.TIME_S + 0.3),
        ("Length time (s)", 7.0 * lab.TIME_S),
    ],
)
def test_columns_that_do_not_contradict_the_rate_above_leave_it(tmp_path: Path, name: str, values: np.ndarray) -> None:
    rows = lab.rows(values, lab.LENGTH_MM, lab.FORCE_MN)
    path = lab.write(tmp_path, ["# Sampling rate: 1000 Hz", f"{name},length_mm,force_mN", *rows])
    (trial,) = lab.trials(path, {key: spec for key, spec in lab.COLUMNS.items() if key != "time"})
    lab.same(trial)


def test_without_time_and_rate_the_refusal_names_both(tmp_path: Path) -> None:
    path = lab.write(tmp_path, ["length_mm,force_mN", *lab.rows(lab.LENGTH_MM, lab.FORCE_MN)])
    with pytest.raises(UserError, match=r"columns\.time is missing; name the column and its unit, or give its rate"):
        lab.run(path, {key: spec for key, spec in lab.COLUMNS.items() if key != "time"})


@pytest.mark.parametrize(
    "clock",
    [
        lambda t: f"0:00:{t:06.3f}",
        lambda t: f"{t // 60:02.0f}:{t:06.3f}",
        lambda t: f"0:00:{t:06.3f}".replace(".", ","),
        lambda t: f"2018-12-17 00:00:{t:06.3f}",
        lambda t: f"17.12.2018 12:00:{t:06.3f} AM",
    ],
)
@pytest.mark.parametrize("unit", [None, "s", "ms"])
def test_times_of_a_clock(tmp_path: Path, clock: Any, unit: str | None) -> None:
    times = [clock(t) for t in lab.TIME_S.tolist()]
    lines = [f"{t};{line}" for t, line in zip(times, lab.rows(lab.LENGTH_MM, lab.FORCE_MN, delimiter=";"), strict=True)]
    time = {"column": "Time"} if unit is None else {"column": "Time", "unit": unit}
    decimal = "point" if any("," in t for t in times) else None
    path = lab.write(tmp_path, ["Time;length_mm;force_mN", *lines])
    (trial,) = lab.trials(path, {**lab.COLUMNS, "time": time}, decimal=decimal)
    lab.same(trial)
    assert f"'{times[0]}' is read as 0 s" in lab.told(trial)


def test_a_clock_that_goes_over_midnight_and_one_with_a_fault(tmp_path: Path) -> None:
    ms = [59_940 + i for i in range(lab.N)]
    late = [f"2018-12-{17 + i // 60_000} {'23:59' if i < 60_000 else '00:00'}:{i % 60_000 / 1e3:06.3f}" for i in ms]
    body = lab.rows(lab.LENGTH_MM, lab.FORCE_MN)
    lines = ["time_s,length_mm,force_mN", *(f"{t},{line}" for t, line in zip(late, body, strict=True))]
    (trial,) = lab.trials(lab.write(tmp_path, lines))
    assert trial.time_s == pytest.approx(86399.94 + lab.TIME_S, abs=1e-6)
    lines[5] = lines[5].replace("2018-12-17 23", "23h")
    path = lab.write(tmp_path / "fault", lines)
    assert "line 6, column 'time_s' holds '23h:59:59.944'; needed is the time of a clock" in lab.refusal(path)
    lines = [
        line.replace("2018-12-", "12/").replace("12/17", "12/17/2018").replace("12/18", "12/18/2018") for line in lines
    ]
    lines[5] = lines[4].replace("943", "944")
    path = lab.write(tmp_path / "dates", lines)
    assert "dates change and are not written as 2026-11-30; write them so" in lab.refusal(path)


def labchart(*blocks: list[str], interval: str = "0.001 s", units: bool = True) -> list[str]:
    head = [
        f"Interval=\t{interval}",
        "ExcelDateTime=\t4.3451604166666670e+004\t12/17/2018 14:30:00.000000",
        "TimeFormat=\tStartOfBlock",
        "DateFormat=\tM/d/yyyy",
        "ChannelTitle=\tLength\tForce",
        "Range=\t10.000 V\t5.000 V",
        *(["UnitName=\tmm\tmN"] if units else []),
    ]
    return [line for block in blocks for line in [*head, *block]]


def test_labchart_blocks_are_trials_with_units_and_rate_of_the_head(tmp_path: Path) -> None:
    first, second = lab.rows(delimiter="\t"), lab.rows(lab.TIME_S, lab.LENGTH_MM, 2 * lab.FORCE_MN, delimiter="\t")
    first[7] += "\t#* stimulus on"
    path = lab.write(tmp_path, labchart(first, second), "chart.txt")
    one, two = lab.trials(path, unitless("Time", "Length", "Force"))
    lab.same(one)
    lab.same(two, force_mn=2 * lab.FORCE_MN)
    assert (one.facts.trial, two.facts.trial) == ("chart_1", "chart_2")
    assert one.warnings == (
        f"{path} is a text file of LabChart with 2 blocks, a trial each; its columns: Time, Length, Force",
        f"{path}: comments in 1 lines, first in line 15, are no numbers",
        f"{path}: column 'Time' is read in s, as its header says",
        f"{path}: column 'Length' is read in mm, as its header says",
        f"{path}: column 'Force' is read in mN, as its header says",
        f"{path}: the table has 2 blocks, a trial each",
    )
    assert two.warnings == ()


def test_an_interval_of_labchart_that_its_times_belie_is_refused(tmp_path: Path) -> None:
    columns = {key: spec for key, spec in unitless("", "Length", "Force").items() if key != "time"}
    path = lab.write(tmp_path, labchart(lab.rows(delimiter="\t"), interval="100 us"), "chart.txt")
    why = lab.refusal(path, columns)
    assert "are 10000 samples in a second by 'the head of the LabChart file', 1000 by column 'Time'; tell" in why
    (trial,) = lab.trials(path, unitless("Time", "Length", "Force"))
    assert "the header says 10000 Hz, the time column 1000 Hz" in lab.told(trial)


def test_labchart_interval_stands_for_time(tmp_path: Path) -> None:
    columns = {key: spec for key, spec in unitless("", "Length", "Force").items() if key != "time"}
    blank = ["\t" + line.split("\t", 1)[1] for line in lab.rows(delimiter="\t")]
    path = lab.write(tmp_path, labchart(blank, blank, interval="1 ms"), "chart.txt")
    for trial in lab.trials(path, columns):
        lab.same(trial)
    other = lab.write(tmp_path, [*labchart(blank), *labchart(blank, interval="2 ms")], "other.txt")
    with pytest.raises(UserError, match=r"columns\.time is missing"):
        lab.run(other, columns)


def test_labchart_without_its_column_of_time(tmp_path: Path) -> None:
    """Regression: every channel had the name of the one after it."""
    columns = {key: spec for key, spec in unitless("", "Length", "Force").items() if key != "time"}
    rows = [line.split("\t", 1)[1] for line in lab.rows(delimiter="\t")]
    noted = [rows[0] + "\t#1 stimulus", *rows[1:]]
    for name, lines in (("a", labchart(rows)), ("b", labchart(noted)), ("c", labchart(noted, rows))):
        for trial in lab.trials(lab.write(tmp_path / name, lines, f"{name}.txt"), columns):
            lab.same(trial)
    mixed = lab.write(tmp_path / "mixed", labchart(rows, lab.rows(delimiter="\t")))
    assert "LabChart blocks have different columns: Length, Force, then Time, Length, Force" in lab.refusal(
        mixed, columns
    )


def test_labchart_blocks_of_other_channels_are_refused(tmp_path: Path) -> None:
    lines = labchart(lab.rows(delimiter="\t"))
    other = [line.replace("ChannelTitle=\tLength", "ChannelTitle=\tSL") for line in lines]
    why = lab.refusal(lab.write(tmp_path / "other", [*lines, *other]), unitless("Time", "Length", "Force"))
    assert "LabChart blocks have different columns: Time, Length, Force, then Time, SL, Force" in why


def labview(*segments: list[str], x_columns: str = "One", delta: str = "0.001", decimal: str = ".") -> list[str]:
    lines = [
        "LabVIEW Measurement\t",
        "Writer_Version\t2",
        "Reader_Version\t2",
        "Separator\tTab",
        f"Decimal_Separator\t{decimal}",
        "Multi_Headings\tYes",
        f"X_Columns\t{x_columns}",
        "Time_Pref\tRelative",
        "Date\t2018/12/17",
        "***End_of_Header***\t",
        "",
    ]
    for rows in segments:
        lines += [
            "Channels\t2\t\t",
            f"Samples\t{len(rows)}\t{len(rows)}\t",
            "Date\t2018/12/17\t2018/12/17\t",
            "Time\t17:18:18.93\t17:18:18.93\t",
            "Y_Unit_Label\tmm\tmN\t",
            "X_Dimension\tTime\tTime\t",
            "X0\t0.0000000000000000E+0\t0.0000000000000000E+0\t",
            f"Delta_X\t{delta}\t{delta}\t",
            "***End_of_Header***\t\t\t",
            "X_Value\tLength\tForce\tComment",
            *rows,
        ]
    return lines


def test_labview_segments_are_trials(tmp_path: Path) -> None:
    first, second = lab.rows(delimiter="\t"), lab.rows(lab.TIME_S, lab.LENGTH_MM, 2 * lab.FORCE_MN, delimiter="\t")
    path = lab.write(tmp_path, labview(first, second), "rig.lvm")
    one, two = lab.trials(path, unitless("X_Value", "Length", "Force"))
    lab.same(one)
    lab.same(two, force_mn=2 * lab.FORCE_MN)
    assert (one.facts.trial, two.facts.trial) == ("rig_1", "rig_2")
    assert "is a text file of LabVIEW with 2 blocks, a trial each" in lab.told(one)


def test_labview_without_times_and_with_decimal_commas(tmp_path: Path) -> None:
    rows = ["\t" + line for line in lab.rows(lab.LENGTH_MM, lab.FORCE_MN, delimiter="\t", decimal=",")]
    lines = labview(rows, x_columns="No", delta="0,001000", decimal=",")
    columns = {key: spec for key, spec in unitless("", "Length", "Force").items() if key != "time"}
    (trial,) = lab.trials(lab.write(tmp_path, lines, "rig.lvm"), columns)
    lab.same(trial)
    assert "1000 samples in a second by 'the head of the LabVIEW file'" in lab.told(trial)
    assert "says that it has decimal commas" in lab.told(trial)
    lines[18] = "Delta_X\t0,001\t0,002\t"
    path = lab.write(tmp_path / "other", lines, "two.lvm")
    assert "Delta_X of the channels differs (0.001, 0.002 s)" in lab.refusal(path, columns)


def test_an_empty_column_of_time_beside_a_rate_is_not_proposed(tmp_path: Path) -> None:
    rows = ["\t" + line for line in lab.rows(lab.LENGTH_MM, lab.FORCE_MN, delimiter="\t")]
    path = lab.write(tmp_path, labview(rows, x_columns="No"), "rig.lvm")
    found = inspect_file(path)
    assert found.proposal.tree["columns"]["time"] == {"rate": "1000 Hz"}
    assert [line.partition(":")[0] for line in found.proposal.missing] == ["f0", "pca"]
    columns = {**unitless("X_Value", "Length", "Force"), "time": {"column": "X_Value", "unit": "s"}}
    why = lab.refusal(path, columns)
    assert "name another column, or none for the time: there are 1000 samples in a second by 'the head of" in why
    (trial,) = lab.trials(path, found.proposal.tree["columns"])
    lab.same(trial)


def test_a_header_that_comes_again_begins_another_trial(tmp_path: Path) -> None:
    head = [",".join(lab.NAMES), "s,mm,mN"]
    path = lab.write(tmp_path, [*head, *lab.rows(), *head, *lab.rows(lab.TIME_S, lab.LENGTH_MM, 2 * lab.FORCE_MN)])
    one, two = lab.trials(path)
    lab.same(one)
    lab.same(two, force_mn=2 * lab.FORCE_MN)
    assert "its header comes 2 times, above a trial each" in lab.told(one)


def test_spike2_channel_by_channel_is_refused_with_the_remedy(tmp_path: Path) -> None:
    lines = ['"INFORMATION"', '"a.smr"', "", '"CHANNEL"\t"1"', '"START"\t0.0\t0.001', *lab.rows(lab.FORCE_MN)]
    assert "holds channel below channel" in lab.refusal(lab.write(tmp_path, lines, "a.txt"))


def test_rows_that_a_spreadsheet_adds_at_the_end_are_none(tmp_path: Path) -> None:
    lab.same(lab.trials(lab.write(tmp_path, [",".join(lab.NAMES), *lab.rows(), ",,", " , ,"]))[0])


def test_a_sarcomere_length_in_a_header_of_micrometres_is_pointed_out(tmp_path: Path) -> None:
    path = lab.write(tmp_path, ["time_s,SL (µm),force_mN", *lab.rows(lab.TIME_S, 2.0 * lab.LENGTH_MM, lab.FORCE_MN)])
    columns = {**lab.COLUMNS, "length": {"column": "SL (µm)"}}
    assert "it is that of a sarcomere: give --length-of sarcomere" in lab.refusal(path, columns)
    columns["length"]["of"] = "sarcomere"
    (trial,) = lab.trials(path, columns)
    assert trial.length_change_l0 == pytest.approx(lab.LENGTH_MM / 1.2 - 1.0)
    assert trial.warnings == (f"{path}: column 'SL (µm)' is read in um, as its header says",)


def test_a_row_at_fault_is_no_header(tmp_path: Path) -> None:
    lines = [",".join(lab.NAMES), *lab.rows()]
    lines[1], lines[3] = "x,y,z", "a,b,c"
    assert "line 2, column 'time_s' holds 'x'" in lab.refusal(lab.write(tmp_path, lines))
