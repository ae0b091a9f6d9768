"""Columns of delimited text are the same numbers, whichever way they are read."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from xb_muscle_ros.trials import spool
from xb_muscle_ros.trials.readers import rows
from xb_muscle_ros.trials.readers.cells import COMMA, POINT, number
from xb_muscle_ros.trials.readers.rows import SPACES, TextRows, split

NUMBERS = st.floats(-1e9, 1e9).map(lambda value: f"{value:.7g}")
# What NumPy's parser and the splitting of lines might see differently.
ODD = st.sampled_from(
    ["", "-", "NaN", "inf", "1_000", "1.234,5", '"2.5"', '5" pipe', "a (b c)", "0:00:01", " 7 ", "\u22123"]
)


@settings(max_examples=400)
@given(
    table=st.lists(
        st.lists(st.one_of(NUMBERS, NUMBERS, NUMBERS, ODD), min_size=1, max_size=4), min_size=1, max_size=12
    ),
    delimiter=st.sampled_from([",", ";", "\t", SPACES]),
    decimal=st.sampled_from([POINT, COMMA]),
    block=st.integers(1, 5),
    least=st.sampled_from([4, 10_000]),
)
def test_a_column_has_the_numbers_of_its_cells(
    table: list[list[str]], delimiter: str, decimal: str, block: int, least: int
) -> None:
    swapped = [[cell.replace(".", "," if decimal == COMMA else ".") for cell in row] for row in table]
    lines = [line for line in (delimiter.join(row) for row in swapped) if line.strip()]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(rows, "_BLOCK", block)
        patch.setattr(rows, "_FEW", max(block // 2, 1))
        patch.setattr(spool, "LEAST", least)
        read = TextRows(lines, range(1, len(lines) + 1), delimiter)
        for index in range(5):
            cells = [split(line, delimiter) for line in lines]
            wanted = [number(row[index].strip(), decimal) if index < len(row) else np.nan for row in cells]
            np.testing.assert_array_equal(read.column(index, decimal), wanted)
    assert list(read.cells) == cells
    assert [read.cells[i] for i in range(len(lines))] == cells


def test_nobody_changes_what_is_read() -> None:
    for lines in (["1,2", "3,4"], ["1,2", "3,-"]):
        column = TextRows(lines, range(1, 3), ",").column(0, POINT)
        assert column.tolist() == [1.0, 3.0]
        with pytest.raises(ValueError, match="read-only"):
            column[0] = 7.0
