"""Workbooks: sheets are trials, cells numbers, text, dates or times; the rest is as for text."""

from __future__ import annotations

import datetime
import re
import zipfile
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import lab_tables as lab
import numpy as np
import pytest

from xb_muscle_ros.trials.inspecting.inspection import inspect_file
from xb_muscle_ros.trials.readers.registry import READERS

openpyxl = pytest.importorskip("openpyxl", reason="needs openpyxl")
xlwt = pytest.importorskip("xlwt", reason="needs xlwt")
pytest.importorskip("python_calamine", reason="needs the extra files")

ROWS = [list(row) for row in zip(lab.TIME_S.tolist(), lab.LENGTH_MM.tolist(), lab.FORCE_MN.tolist(), strict=True)]
DOUBLE = [[t, length, 2 * f] for t, length, f in ROWS]


def book(folder: Path, merged: str = "", name: str = "t.xlsx", **sheets: Sequence[Sequence[Any]]) -> Path:
    made = openpyxl.Workbook()
    made.remove(made.active)
    for title, rows in sheets.items():
        sheet = made.create_sheet(title.replace("_", " "))
        for row in rows:
            sheet.append(list(row))
        if merged:
            sheet.merge_cells(merged)
    folder.mkdir(exist_ok=True)
    made.save(folder / name)
    return folder / name


def test_a_sheet_is_a_trial_and_bits_are_kept(tmp_path: Path) -> None:
    path = book(tmp_path, Sheet1=[lab.NAMES, *ROWS])
    (trial,) = lab.trials(path)
    lab.same(trial)
    assert (trial.facts.trial, trial.warnings) == ("t", ())
    assert (trial.force_n / 1e-3).tolist() == (1e-3 * lab.FORCE_MN / 1e-3).tolist()


def test_sheets_are_trials_and_those_without_the_columns_are_left_out_and_told(tmp_path: Path) -> None:
    path = book(
        tmp_path, notes=[["rig 3"], ["on", "Monday"]], run_1=[lab.NAMES, *ROWS], run_2=[lab.NAMES, *DOUBLE], empty=[]
    )
    one, two = lab.trials(path)
    lab.same(one)
    lab.same(two, force_mn=2 * lab.FORCE_MN)
    assert (one.facts.trial, two.facts.trial) == ("t_run 1", "t_run 2")
    assert f"left out: {path}, sheet 'notes'" in lab.told(one)
    assert f"left out: {path}, sheet 'empty' is empty" in lab.told(one)


def test_a_sheet_by_name_and_by_pattern_with_facts(tmp_path: Path) -> None:
    sheets = {"pCa4.5": [lab.NAMES, *ROWS], "pCa6.1": [lab.NAMES, *DOUBLE], "notes": [["x"]]}
    path = book(tmp_path, **sheets)
    (trial,) = lab.trials(path, sheet="pCa6.1")
    lab.same(trial, force_mn=2 * lab.FORCE_MN)
    assert trial.facts.trial == "t"
    found = lab.trials(book(tmp_path / "b", **sheets), pca=None, sheet={"pattern": "pCa(?P<pca>.+)"})
    assert [(each.facts.trial, each.facts.pca) for each in found] == [("t_pCa4.5", 4.5), ("t_pCa6.1", 6.1)]
    assert "has no sheet 'pCa6.2'; its sheets: pCa4.5, pCa6.1, notes; did you mean 'pCa6.1'" in lab.refusal(
        book(tmp_path / "c", **sheets), sheet="pCa6.2"
    )


def test_sheets_that_are_called_by_their_pca_are_proposed(tmp_path: Path) -> None:
    cover = [["Experiment", "soleus"], ["Force", "mN"]]
    sheets = {"notes": cover, "pCa_4.5": [lab.NAMES, *ROWS], "pCa_6.1": [lab.NAMES, *DOUBLE]}
    found = inspect_file(book(tmp_path, **sheets))
    assert found.proposal.tree["sheet"]["pattern"].startswith(".*?[pP]")
    assert not any(line.startswith("pca") for line in found.proposal.missing)
    assert found.contents.sheets == ("pCa 4.5", "pCa 6.1")


def test_a_sheet_that_is_called_by_another_pca_is_told(tmp_path: Path) -> None:
    path = book(tmp_path, **{"pCa_4.5": [lab.NAMES, *ROWS], "pCa_6.1": [lab.NAMES, *DOUBLE]})
    one, two = lab.trials(path, pca=4.5)
    assert "tells pCa" not in lab.told(one)
    assert "the name of the trial, 't_pCa 6.1', tells pCa 6.1, it has 4.5; check both" in lab.told(two)
    (alone,) = lab.trials(book(tmp_path, name="u.xlsx", **{"pCa_6.1": [lab.NAMES, *ROWS]}), pca=4.5)
    assert "the sheet is called by pCa 6.1, the trial has 4.5; check both" in lab.told(alone)


@pytest.mark.parametrize("number_format", ["0.00%", "0%", '0.000%" of L0"', "0.0_)%"])
@pytest.mark.parametrize(
    ("names", "told"),
    [
        ([("time_s", ""), ("length (% L0)", ""), ("force (% F0)", "")], "as its header says: 5 % is read as 5"),
        ([("time", "s"), ("length", "%L0"), ("force", "%F0")], "as its header says: 5 % is read as 5"),
        ([("time_s", ""), ("length (L0)", ""), ("force (F0)", "")], "have no % in the header: 5 % is read as 0.05"),
    ],
)
def test_cells_that_show_percent(tmp_path: Path, number_format: str, names: list[tuple[str, str]], told: str) -> None:
    heads = [[name for name, _ in names], *([[unit for _, unit in names]] if names[0][1] else [])]
    rows = [[t, length / 1.2, f / 10.0] for t, length, f in ROWS]
    path = book(tmp_path, run=[*heads, *rows])
    made = openpyxl.load_workbook(path)
    for row in made["run"].iter_rows(min_row=len(heads) + 1, min_col=2):
        for cell in row:
            cell.number_format = number_format
    made.save(path)
    columns = {"time": {"column": names[0][0]}, "length": {"column": names[1][0]}, "force": {"column": names[2][0]}}
    (trial,) = lab.trials(path, columns=columns, f0=None, reference_length=None)
    assert trial.length_change_l0 == pytest.approx(lab.LENGTH_MM / 1.2 - 1.0, abs=1e-12)
    assert trial.force_n == pytest.approx(lab.FORCE_MN / 10.0, rel=1e-12)
    assert lab.told(trial).count(told) == 2


@pytest.mark.parametrize("number_format", ["0.00", '0.0" %"', "0.0\\%", "0.00_%", "0.0*%"])
def test_a_sign_of_percent_that_is_text_is_none(tmp_path: Path, number_format: str) -> None:
    path = book(tmp_path, run=[["time_s", "length (%L0)"], *([t, 100 * length / 1.2] for t, length, _ in ROWS)])
    made = openpyxl.load_workbook(path)
    for row in made["run"].iter_rows(min_row=2, min_col=2):
        row[0].number_format = number_format
    made.save(path)
    columns = {"time": {"column": "time_s"}, "length": {"column": "length (%L0)"}}
    (trial,) = lab.trials(path, columns=columns, f0=None, reference_length=None)
    assert trial.length_change_l0 == pytest.approx(lab.LENGTH_MM / 1.2 - 1.0, abs=1e-12)
    assert "show percent" not in lab.told(trial)


PERCENT = {"time": {"column": "time_s"}, "length": {"column": "length (%L0)"}}


Change = tuple[str, str | Callable[[re.Match[str]], str]]


def rewritten(path: Path, part: str, *changes: Change) -> Path:
    """The workbook with some of its parts changed by regular expressions, each of which matches somewhere."""
    with zipfile.ZipFile(path) as file:
        parts = {name: file.read(name).decode() for name in file.namelist()}
    for old, new in changes:
        found = {name: re.subn(old, new, text) for name, text in parts.items() if re.fullmatch(part, name)}
        assert any(count for _, count in found.values()), old
        parts.update({name: text for name, (text, _) in found.items()})
    with zipfile.ZipFile(path, "w") as file:
        for name, text in parts.items():
            file.writestr(name, text)
    return path


def half_percent(
    folder: Path, head: str = "length (%L0)", scale: float = 100.0, above: Sequence[Sequence[Any]] = ()
) -> Path:
    """A length in L0 whose odd samples are formatted as percent; the others are larger by a scale."""
    values = [length / 1.2 if i % 2 else scale * length / 1.2 for i, (_, length, _) in enumerate(ROWS)]
    path = book(folder, run=[*above, ["time_s", head], *([t, v] for (t, _, _), v in zip(ROWS, values, strict=True))])
    made = openpyxl.load_workbook(path)
    for row in range(len(above) + 3, made["run"].max_row + 1, 2):
        made["run"].cell(row, 2).number_format = "0.0%"
    made.save(path)
    return path


STRICT = (
    (r"http://schemas.openxmlformats.org/spreadsheetml/2006/main", "http://purl.oclc.org/ooxml/spreadsheetml/main"),
    (r"http://schemas.openxmlformats.org/officeDocument/2006/rel", "http://purl.oclc.org/ooxml/officeDocument/rel"),
)


@pytest.mark.parametrize(
    ("part", "changes"),
    [
        pytest.param("none", (), id="plain"),
        pytest.param("xl/worksheets/.*", ((r'<c r="[A-Z]+\d+"', "<c"),), id="cells without places"),
        pytest.param("xl/worksheets/.*", ((r'<(c|row) r="\w+"', r"<\1"),), id="rows and cells without places"),
        pytest.param("xl/.*xml(.rels)?", STRICT, id="strict"),
    ],
)
def test_percent_is_read_cell_by_cell(tmp_path: Path, part: str, changes: tuple[Change, ...]) -> None:
    (trial,) = lab.trials(rewritten(half_percent(tmp_path), part, *changes), PERCENT, f0=None, reference_length=None)
    assert trial.length_change_l0 == pytest.approx(lab.LENGTH_MM / 1.2 - 1.0, abs=1e-12)
    line = f"{lab.N // 2} of {lab.N} cells of column 'length (%L0)' show percent, as its header says: 5 % is read as 5"
    assert f"{line}; the other {lab.N - lab.N // 2} are read as they stand" in lab.told(trial)


def test_places_of_percent_are_those_of_the_sheet_with_gaps_above(tmp_path: Path) -> None:
    path = half_percent(tmp_path, above=[["rig 3"], [], []])
    (trial,) = lab.trials(path, PERCENT, f0=None, reference_length=None)
    assert trial.length_change_l0 == pytest.approx(lab.LENGTH_MM / 1.2 - 1.0, abs=1e-12)


def test_a_mixed_column_without_percent_in_the_header_is_told(tmp_path: Path) -> None:
    columns = {**PERCENT, "length": {"column": "length", "unit": "mm"}}
    (trial,) = lab.trials(half_percent(tmp_path, "length", scale=1.0), columns, f0=None)
    assert trial.length_m == pytest.approx(1e-3 * lab.LENGTH_MM / 1.2, rel=1e-12)
    assert f"{lab.N // 2} of {lab.N} cells of column 'length' show percent, and have no % in the header" in lab.told(
        trial
    )


def test_text_numbers_units_and_preamble(tmp_path: Path) -> None:
    text = [[repr(t).replace(".", ","), length, str(f)] for t, length, f in ROWS]
    path = book(tmp_path, s=[["Rig"], [], ["Sampling rate", 1000, "Hz"], ["t", "L", "F"], ["s", "mm", "mN"], *ROWS])
    (trial,) = lab.trials(path, {key: {"column": name} for key, name in zip(lab.COLUMNS, "tLF", strict=True)})
    lab.same(trial)
    assert "row 4 names the columns" in lab.told(trial)
    assert "row 5 holds units: s, mm, mN" in lab.told(trial)
    columns = {key: spec for key, spec in zip(lab.COLUMNS, ({}, {"column": "L"}, {"column": "F"}), strict=True) if spec}
    (trial,) = lab.trials(path, columns, trial="by_rate")
    lab.same(trial)
    assert "there are 1000 samples in a second by 'Sampling rate 1000.0 Hz'" in lab.told(trial)
    why = lab.refusal(book(tmp_path / "b", s=[lab.NAMES, *text]))
    assert "decimal commas and points in one file" in why
    dotless = [[a, length, f] for (a, _, _), (_, length, f) in zip(text, ROWS, strict=True)]
    (trial,) = lab.trials(book(tmp_path / "c", s=[lab.NAMES, *dotless]))
    lab.same(trial)
    assert "has decimal commas: '0,0' in row 2" in lab.told(trial)


@pytest.mark.parametrize("kind", ["time", "datetime", "timedelta"])
def test_times_of_a_clock(tmp_path: Path, kind: str) -> None:
    start = datetime.datetime(2018, 12, 17, 0, 0, 0)
    steps = [datetime.timedelta(milliseconds=i) for i in range(lab.N)]
    cells = {"time": [(start + s).time() for s in steps], "datetime": [start + s for s in steps], "timedelta": steps}[
        kind
    ]
    path = book(tmp_path, s=[lab.NAMES, *([c, *row[1:]] for c, row in zip(cells, ROWS, strict=True))])
    (trial,) = lab.trials(path, {**lab.COLUMNS, "time": {"column": "time_s"}})
    lab.same(trial)
    assert "holds times of a clock" in lab.told(trial)


def test_a_merged_header_names_the_columns_below_it(tmp_path: Path) -> None:
    rows = [[*a, *b[1:]] for a, b in zip(ROWS, DOUBLE, strict=True)]
    head = [["time_s", "pCa 4.5", None, "pCa 6.1", None], [None, "L", "F", "L", "F"]]
    path = book(tmp_path, merged="B1:C1", s=[*head, *rows])
    columns = {"time": {"column": "time_s", "unit": "s"}, "length": {"pattern": "pCa (?P<pca>.+) L", "unit": "mm"},
               "force": {"pattern": "pCa (?P<pca>.+) F", "unit": "mN"}}  # fmt: skip
    one, two = lab.trials(path, columns, pca=None)
    lab.same(one)
    lab.same(two, force_mn=2 * lab.FORCE_MN)
    assert (one.facts.pca, two.facts.pca) == (4.5, 6.1)


def test_blanks_and_faults_name_the_row(tmp_path: Path) -> None:
    rows = [[*row] for row in ROWS]
    rows[7][2] = None
    rows[20][2] = "#N/A"
    (trial,) = lab.trials(book(tmp_path, s=[lab.NAMES, *rows]))
    assert "2 blank samples in 2 runs were filled by straight lines, at 0.007 s, 0.02 s" in lab.told(trial)
    rows[9][1] = "over"
    assert "sheet 's', row 11, column 'length_mm' holds 'over'" in lab.refusal(
        book(tmp_path / "b", s=[lab.NAMES, *rows])
    )


def test_what_is_no_workbook_is_refused_or_read_as_what_it_is(tmp_path: Path) -> None:
    assert "is no whole workbook" in lab.refusal(lab.write(tmp_path / "a", b"PK\x03\x04\x00\x00", "t.xlsx"))
    path = lab.write(tmp_path / "b", ["\t".join(lab.NAMES), *lab.rows(delimiter="\t")], "t.xls")
    lab.same(lab.trials(path)[0])
    assert np.isclose(lab.trials(path, trial="again")[0].facts.pca, 6.1)
    assert "no sheet holds the table" in lab.refusal(book(tmp_path / "c", a=[["x"], ["y"]], b=[["z"]]))


def _xls(path: Path, rows: Sequence[Sequence[Any]]) -> None:
    """A workbook of Excel 97."""
    made = xlwt.Workbook()
    sheet = made.add_sheet("run 1")
    day = xlwt.easyxf(num_format_str="yyyy-mm-dd hh:mm:ss.000")
    for i, row in enumerate(rows):
        for j, cell in enumerate(row):
            if isinstance(cell, datetime.datetime):  # xlwt itself drops parts of a second
                sheet.write(i, j, (cell - datetime.datetime(1899, 12, 30)) / datetime.timedelta(days=1), day)
            elif cell != "":
                sheet.write(i, j, cell)
    made.save(str(path))


def _ods(path: Path, rows: Sequence[Sequence[Any]]) -> None:
    """A spreadsheet as OpenDocument 1.2 describes it."""
    cells = {
        float: lambda v: f'<table:table-cell office:value-type="float" office:value="{v!r}"/>',
        str: lambda v: f'<table:table-cell office:value-type="string"><text:p>{v}</text:p></table:table-cell>',
        datetime.datetime: lambda v: (
            f'<table:table-cell office:value-type="date" office:date-value="{v.isoformat()}"/>'
        ),
    }
    lines = "".join(
        "<table:table-row>"
        + "".join(cells[type(cell)](cell) if cell != "" else "<table:table-cell/>" for cell in row)
        + "</table:table-row>"
        for row in rows
    )
    names = " ".join(
        f'xmlns:{name}="urn:oasis:names:tc:opendocument:xmlns:{name}:1.0"' for name in ("office", "table", "text")
    )
    content = (
        f'<?xml version="1.0" encoding="UTF-8"?><office:document-content {names} office:version="1.2"><office:body>'
        f'<office:spreadsheet><table:table table:name="run 1">{lines}</table:table></office:spreadsheet>'
        "</office:body></office:document-content>"
    )
    kind = "application/vnd.oasis.opendocument.spreadsheet"
    manifest = (
        '<?xml version="1.0" encoding="UTF-8"?><manifest:manifest '
        'xmlns:manifest="urn:oasis:names:tc:opendocument:xmlns:manifest:1.0" manifest:version="1.2">'
        f'<manifest:file-entry manifest:full-path="/" manifest:media-type="{kind}"/>'
        '<manifest:file-entry manifest:full-path="content.xml" manifest:media-type="text/xml"/></manifest:manifest>'
    )
    with zipfile.ZipFile(path, "w") as file:
        file.writestr("mimetype", kind)
        file.writestr("content.xml", content)
        file.writestr("META-INF/manifest.xml", manifest)


WRITERS = [pytest.param(_xls, ".xls", id="xls"), pytest.param(_ods, ".ods", id="ods")]


@pytest.mark.parametrize(("write", "suffix"), WRITERS)
def test_older_and_open_workbooks_keep_their_bits(write: Callable[..., None], suffix: str, tmp_path: Path) -> None:
    write(tmp_path / f"t{suffix}", [["rig 3"], lab.NAMES, *ROWS])
    (trial,) = lab.trials(tmp_path / f"t{suffix}")
    lab.same(trial)
    assert (trial.force_n / 1e-3).tolist() == (1e-3 * lab.FORCE_MN / 1e-3).tolist()
    assert "row 2 names the columns" in lab.told(trial)


@pytest.mark.parametrize(("write", "suffix"), WRITERS)
def test_blanks_and_times_of_older_and_open_workbooks(write: Callable[..., None], suffix: str, tmp_path: Path) -> None:
    path = tmp_path / f"t{suffix}"
    begin = datetime.datetime(2026, 11, 30, 9, 30)
    rows = [[begin + datetime.timedelta(milliseconds=10 * i), length, f] for i, (_, length, f) in enumerate(ROWS)]
    rows[5][2] = ""
    write(path, [lab.NAMES, *rows])
    (trial,) = lab.trials(path, blanks={"longest": "20 ms"})
    assert np.allclose(np.diff(trial.time_s), 0.01, rtol=0.0, atol=1e-6)
    assert "1 blank sample was filled" in lab.told(trial)
    assert "holds times of a clock" in lab.told(trial)


@pytest.mark.parametrize("suffix", [".xls", ".ods", ".xlsb"])
def test_what_is_called_a_workbook_and_is_none(suffix: str, tmp_path: Path) -> None:
    path = tmp_path / f"t{suffix}"
    path.write_bytes(b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1" + bytes(600))
    why = lab.refusal(path)
    assert str(path) in why
    assert "\n" not in why


def test_formulas_that_nothing_has_worked_out_are_told_with_the_remedy(tmp_path: Path) -> None:
    formulas = [[t, length, 2 * f, f"=C{i}/2"] for i, (t, length, f) in enumerate(ROWS, 2)]
    path = book(tmp_path, first=[["notes"]], run_1=[[*lab.NAMES[:2], "twice", lab.NAMES[2]], *formulas])
    why = lab.refusal(path, sheet="run 1")
    assert f"row 2, column '{lab.NAMES[2]}' holds a formula without its value (a run of {len(ROWS)} rows)" in why
    assert "open the workbook in Excel or LibreOffice, which works formulas out, and save it there" in why
    others = READERS["xlsx"].contents(path).others
    assert any(
        f"column '{lab.NAMES[2]}' holds formulas without their values; open the workbook" in line for line in others
    )
    everything = book(tmp_path, name="u.xlsx", run=[lab.NAMES, *([f"={i}/1000", "=1.2", "=0.3"] for i in range(50))])
    assert f"row 2, column '{lab.NAMES[0]}' holds a formula without its value" in lab.refusal(everything)


def with_values(folder: Path, values: Sequence[str], marked: bool, formula: str = "=D{row}*2") -> Path:
    """Forces by formulas, beside which a program has put values; marked as formulas that are to be worked out."""
    path = book(
        folder, run=[lab.NAMES, *([t, length, formula.format(row=i)] for i, (t, length, _) in enumerate(ROWS, 2))]
    )
    left = iter(values)
    rewritten(path, "xl/worksheets/.*", (r"</f><v ?/>|</f><v></v>", lambda _: f"</f>{next(left)}"))
    assert next(left, None) is None
    return path if marked else rewritten(path, "xl/workbook.xml", (' fullCalcOnLoad="1"', ""))


NOUGHT = ["<v>0</v>"] * lab.N
GIVEN = [f"<v>{f!r}</v>" for f in lab.FORCE_MN.tolist()]


@pytest.mark.parametrize(
    ("values", "changes", "row", "run"),
    [
        pytest.param(NOUGHT, (), 2, lab.N, id="all 0"),
        pytest.param(NOUGHT, ((r'<c r="[A-Z]+\d+"', "<c"),), 2, lab.N, id="without places"),
        pytest.param(NOUGHT, STRICT[:1], 2, lab.N, id="strict"),
        pytest.param([*GIVEN[:40], *NOUGHT[40:]], (), 42, lab.N - 40, id="some given"),
    ],
)
def test_formulas_with_0_in_a_book_that_is_to_be_worked_out_have_no_value(
    tmp_path: Path, values: Sequence[str], changes: tuple[Change, ...], row: int, run: int
) -> None:
    path = rewritten(with_values(tmp_path, values, marked=True), "xl/(workbook|worksheets/.*).xml", *changes)
    why = lab.refusal(path)
    assert f"row {row}, column '{lab.NAMES[2]}' holds a formula without its value (a run of {run} rows)" in why
    assert "open the workbook in Excel or LibreOffice, which works formulas out, and save it there" in why


@pytest.mark.parametrize("marked", [True, False])
def test_formulas_with_values_count(tmp_path: Path, marked: bool) -> None:
    (trial,) = lab.trials(with_values(tmp_path, GIVEN, marked))
    lab.same(trial)
    assert "formula" not in lab.told(trial)


def test_0_by_a_formula_that_was_worked_out_is_0_and_a_column_of_them_is_told(tmp_path: Path) -> None:
    force = lab.FORCE_MN.copy()
    force[40:] = 0.0
    (trial,) = lab.trials(with_values(tmp_path / "a", [*GIVEN[:40], *NOUGHT[40:]], marked=False))
    lab.same(trial, force_mn=force)
    assert "have the value 0" not in lab.told(trial)
    (trial,) = lab.trials(with_values(tmp_path / "b", NOUGHT, marked=False))
    lab.same(trial, force_mn=0.0 * force)
    assert f"all {lab.N} formulas of column '{lab.NAMES[2]}' have the value 0; if that is wrong, open" in lab.told(
        trial
    )


def test_cells_that_an_array_formula_fills_have_no_value_either(tmp_path: Path) -> None:
    path = book(tmp_path, run=[lab.NAMES, *([t, length, 0] for t, length, _ in ROWS)])
    first = (r'<c r="C2" t="n"><v>', f'<c r="C2" t="n"><f t="array" ref="C2:C{lab.N + 1}">E2:E9*2</f><v>')
    why = lab.refusal(rewritten(path, "xl/worksheets/.*", first))
    assert f"row 2, column '{lab.NAMES[2]}' holds a formula without its value (a run of {lab.N} rows)" in why


def test_a_formula_that_gives_empty_text_is_a_blank(tmp_path: Path) -> None:
    path = with_values(tmp_path, [*GIVEN[:7], "<v></v>", *GIVEN[8:]], marked=False)
    rewritten(path, "xl/worksheets/.*", (r'<c r="C9"( t="\w+")?>', '<c r="C9" t="str">'))
    assert "1 blank sample was filled" in lab.told(lab.trials(path)[0])


@pytest.mark.parametrize(
    ("head", "told"), [("length (%L0)", "5 % is read as 5"), ("length (L0)", "5 % is read as 0.05")]
)
def test_percent_of_opendocument(tmp_path: Path, head: str, told: str) -> None:
    """Rows and cells that stand there several times count as often."""
    path = tmp_path / "t.ods"
    _ods(
        path, [["rig 3"], *[[""]] * 3, ["time_s", "", "", head], *([t, "", "", length / 1.2] for t, length, _ in ROWS)]
    )
    empty = "<table:table-cell/>"
    rewritten(
        path,
        "content.xml",
        (rf"(<table:table-row>{empty}</table:table-row>){{3}}",
         f'<table:table-row table:number-rows-repeated="3">{empty}</table:table-row>'),
        (rf"({empty}){{2}}", '<table:table-cell table:number-columns-repeated="2"/>'),
        (r'"float"( office:value="[\d.e-]+"/></table:table-row>)', r'"percentage"\1'),
    )  # fmt: skip
    columns = {"time": {"column": "time_s"}, "length": {"column": head}}
    (trial,) = lab.trials(path, columns, f0=None, reference_length=None)
    assert trial.length_change_l0 == pytest.approx(lab.LENGTH_MM / 1.2 - 1.0, abs=1e-12)
    assert f"cells of column '{head}' show percent" in lab.told(trial)
    assert told in lab.told(trial)


def test_a_formula_of_opendocument_without_a_value_is_told(tmp_path: Path) -> None:
    path = tmp_path / "t.ods"
    _ods(path, [lab.NAMES, *ROWS])
    last = (r"<table:table-cell [^<>]*(/></table:table-row>)", r'<table:table-cell table:formula="of:=[.D2]*2"\1')
    assert "holds a formula without its value" in lab.refusal(rewritten(path, "content.xml", last))
