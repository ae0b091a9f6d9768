"""Delimited text."""

from __future__ import annotations

from pathlib import Path

import pytest

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.trials.readers.delimited import read_table
from xb_muscle_ros.trials.readers.options import TableOptions


def _file(folder: Path, text: str, name: str = "t.csv") -> Path:
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return path


@pytest.mark.parametrize(
    "text",
    [
        "a,b\n1,2\n3,4\n",
        "a;b\n1;2\n3;4",
        "a\tb\r\n1\t2\r\n3\t4\r\n",
        "\ufeffa,b\n1,2\n3,4\n",
        '# made by hand\n"a" , b\n\n1, 2\n# half way\n3 ,4,\n\n',
    ],
)
def test_dialects_read_alike(tmp_path: Path, text: str) -> None:
    table = read_table(_file(tmp_path, text))
    assert table.numbers("a").tolist() == [1.0, 3.0]
    assert table.numbers("b").tolist() == [2.0, 4.0]


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (b"a;b\n1,0;2\n3;4,00", ["has decimal commas: '1,0' in line 2 is read as 1.0"]),
        ("a\tb\n1,0\t2\n3\t4,5e0".replace("4,5e0", "4e0").encode(), ["decimal commas"]),
        ("a\tb\r\n1,0\t2\r\n3\t4".encode("utf-16"), ["UTF-16", "decimal commas"]),
        ("a\tb\n1\t2\n3\t4".encode("utf-16-le"), ["UTF-16"]),
        ("a,b,SL (µm)\n1,2,0\n3,4,0".encode("cp1252"), ["line 1 is no UTF-8; the file is read as Windows-1252"]),
        ("a,b\n1,2\n3,4\n# 20 °C".encode("cp1252"), ["line 4 is no UTF-8"]),
        (b"sep=;\na;b\n1;2\n3;4", []),
        (b'a,b\n"1,0",2\n3,"4,0"', ["decimal commas"]),
        ("a,b\n1,2\n3,4".replace("1", "+1").encode(), []),
    ],
)
def test_what_spreadsheets_write_is_read_and_told(tmp_path: Path, data: bytes, words: list[str]) -> None:
    (tmp_path / "t.csv").write_bytes(data)
    table = read_table(tmp_path / "t.csv")
    assert table.numbers("a").tolist() == [1.0, 3.0]
    assert table.numbers("b").tolist() == [2.0, 4.0]
    assert len(table.notices) == len(words)
    assert all(word in told for word, told in zip(words, table.notices, strict=True))


def test_the_two_signs_for_micro_are_one(tmp_path: Path) -> None:
    assert read_table(_file(tmp_path, "L (\u00b5m)\n1\n")).numbers("L (\u03bcm)").tolist() == [1.0]


@pytest.mark.parametrize(
    ("text", "decimal", "words"),
    [
        ("a,b\n0,5,1,5\n", None, "line 2 has 4 cells, the header 2; decimal commas need another delimiter"),
        ("a;b\n0,5;1.5\n", None, "line 2 holds '0,5', line 2 '1.5': .* --decimal comma or --decimal point"),
        ("a;b\n1,234;2\n", None, "'1,234', which is 1.234 or 1234; tell which by --decimal comma"),
        ("a;b\n1.234,5;0,5\n", None, "'1.234,5'; thousands separators are not read"),
        ("a;b\n1 234,5;0,5\n", None, "'1 234,5'; thousands separators are not read"),
        ("a;b\n1.234;0,5\n", "comma", "holds '1.234'; thousands separators are not read"),
        ("a;b\n0,001;2\n", "point", "holds '0,001'; if that is a decimal comma, give --decimal comma"),
        ("a;b\n1,5;2\n", "point", "holds '1,5'; if that is a decimal comma, give --decimal comma"),
        ("a;b\n;1\n;1\n3;1\n;1\n", None, r"line 2, .*nothing \(a run of 2 lines\); so do 1 further lines"),
    ],
)
def test_numbers_that_could_be_others_are_refused(tmp_path: Path, text: str, decimal: str | None, words: str) -> None:
    path = _file(tmp_path, text)
    with pytest.raises(UserError, match=words):
        read_table(path, TableOptions(decimal)).numbers("a")


def test_the_decimal_mark_may_be_told(tmp_path: Path) -> None:
    assert read_table(_file(tmp_path, "a;b\n1,234;2\n"), TableOptions("comma")).numbers("a").tolist() == [1.234]


def test_line_numbers_are_those_of_the_file(tmp_path: Path) -> None:
    table = read_table(_file(tmp_path, "# comment\na,b\n\n1,2\n3,x\n"))
    assert [table.place(0), table.place(1)] == ["line 4", "line 5"]
    with pytest.raises(UserError, match=r"t\.csv, line 5, column 'b' holds 'x'"):
        table.numbers("b")


@pytest.mark.parametrize(("cell", "found"), [("", "nothing"), ("nan", "'nan'"), ("inf", "'inf'"), ("1_5", "'1_5'")])
def test_a_cell_that_is_no_finite_number_is_named(tmp_path: Path, cell: str, found: str) -> None:
    table = read_table(_file(tmp_path, f"a;b\n1;2\n3;{cell}\n"))
    with pytest.raises(UserError, match=f"line 3, column 'b' holds {found}"):
        table.numbers("b")


@pytest.mark.parametrize(
    ("cells", "words"),
    [("1 x x 2", "line 3.* holds 'x' .a run of 2 lines."), ("1 2 x x x", "line 4.*a run of 3 lines")],
)
def test_a_run_of_them_is_counted(tmp_path: Path, cells: str, words: str) -> None:
    with pytest.raises(UserError, match=words):
        read_table(_file(tmp_path, "\n".join(["a", *cells.split()]))).numbers("a")


def test_a_short_line_is_named(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="line 3, column 'b' holds nothing"):
        read_table(_file(tmp_path, "a,b\n1,2\n3\n")).numbers("b")


def test_a_missing_column_is_answered_with_those_there(tmp_path: Path) -> None:
    table = read_table(_file(tmp_path, "time_s,length_m\n1,2\n"))
    with pytest.raises(
        UserError, match=r"t\.csv has no column 'length_n'; its columns: time_s, length_m; did you mean"
    ):
        table.numbers("length_n")


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "is empty"),
        ("# nothing\n\n", "is empty"),
        ("a,b\n", "no rows"),
        ("0,1\n1,2\n", "line 1 holds numbers; needed is a header line"),
    ],
)
def test_what_is_no_table_is_refused(tmp_path: Path, text: str, words: str) -> None:
    with pytest.raises(UserError, match=words):
        read_table(_file(tmp_path, text))


def test_files_that_cannot_be_read_are_named(tmp_path: Path) -> None:
    (tmp_path / "b.csv").write_bytes(b"a,b\n\x00\xb5,1\n")
    for path, words in (
        (tmp_path / "no.csv", "cannot be read"),
        (tmp_path, "is a folder"),
        (tmp_path / "b.csv", "is no text"),
    ):
        with pytest.raises(UserError, match=words) as refused:
            read_table(path)
        assert str(path) in str(refused.value)
