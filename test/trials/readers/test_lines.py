"""Lines and rows of text files, and amounts in their headers."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.trials.readers.lines import Amount, amount, read_lines, read_rows


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("1.250 mm", Amount(1.25, "mm")),
        ("1,250 mm", Amount(1.25, "mm")),
        ("10000", Amount(10000.0, "")),
        ("-2.5e-3 V", Amount(-0.0025, "V")),
        ("0.05 sq. mm", Amount(0.05, "sq. mm")),
    ],
)
def test_amounts(text: str, found: Amount) -> None:
    assert amount(text) == found


@pytest.mark.parametrize("text", ["NaN mm", "", "mm", "1.2.3 mm", "1,2,3", "fast"])
def test_what_is_no_amount_is_nan(text: str) -> None:
    assert math.isnan(amount(text).value)


@given(st.text())
def test_any_text_has_an_amount_or_none(text: str) -> None:
    amount(text)


@given(st.binary(max_size=200))
def test_any_bytes_are_lines_or_one_error(tmp_path_factory: pytest.TempPathFactory, raw: bytes) -> None:
    file = tmp_path_factory.getbasetemp() / "any.txt"
    file.write_bytes(raw)
    try:
        text = read_lines(file, "a file")
        read_rows(file, text, 0, ("a", "b"))
    except UserError as problem:
        told = str(problem)
    else:
        return
    assert "any.txt" in told


def test_rows_and_their_lines(tmp_path: Path) -> None:
    file = tmp_path / "a.txt"
    file.write_bytes("# µm\r\n\r\n1 2\r\n\r\n 3\t4 \r\n5".encode("latin-1"))
    text = read_lines(file, "a file")
    assert text.lines[0] == "# µm"
    rows = read_rows(file, text, 1, ("a", "b"))
    assert np.array_equal(rows.values, [[1.0, 2.0], [3.0, 4.0]])
    assert [rows.at(0), rows.at(1)] == ["line 3", "line 5"]
    assert rows.notices == (f"{file}, line 6: the last line was cut short and is left out",)


def test_a_comma_that_may_be_of_thousands_has_to_be_told(tmp_path: Path) -> None:
    file = tmp_path / "a.txt"
    file.write_text("0 1,234\n1 1,235\n")
    text = read_lines(file, "a file")
    with pytest.raises(UserError, match=r"holds '1,234', which is 1\.234 or 1234; tell which by --decimal comma"):
        read_rows(file, text, 0, ("a", "b"))
    assert read_rows(file, text, 0, ("a", "b"), "comma").values[0, 1] == 1.234
    with pytest.raises(UserError, match="column 'b' holds '1,234'; if that is a decimal comma, give --decimal comma"):
        read_rows(file, text, 0, ("a", "b"), "point")
