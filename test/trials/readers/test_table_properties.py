"""Whatever the dialect, a table gives its numbers to the last bit, or one line that says why not."""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.trials.readers.cells import COMMA, POINT
from xb_muscle_ros.trials.readers.delimited import read_table
from xb_muscle_ros.trials.readers.options import TableOptions, wanted

NAMES = ("time", "muscle length", "Kraft (µN)")
VALUES = st.floats(-1e6, 1e6, allow_nan=False).map(lambda v: float(f"{v:.9g}"))
BLANK = st.sampled_from(["", "NaN", "#N/A", "-"])
ENDS = st.sampled_from(["\n", "\r\n", "\r"])
PREAMBLES = st.lists(
    st.sampled_from(["Rig 3", "Rate{d}1000", "a{d}b{d}c", "Date{d}17.12.2018", "x{d}1{d}2", ""]), max_size=4
)


@settings(max_examples=150)
@given(
    rows=st.lists(st.tuples(VALUES, VALUES, VALUES), min_size=12, max_size=20),
    blanks=st.dictionaries(st.tuples(st.integers(0, 11), st.integers(1, 2)), BLANK, max_size=3),
    delimiter=st.sampled_from(["\t", ";", ",", "   "]),
    decimal=st.sampled_from([POINT, COMMA]),
    told=st.booleans(),
    encoding=st.sampled_from(["utf-8", "utf-8-sig", "utf-16", "utf-16-le", "cp1252"]),
    end=ENDS,
    preamble=PREAMBLES,
    units=st.booleans(),
    trailing=st.booleans(),
)
def test_round_trip(
    rows: list[tuple[float, float, float]],
    blanks: dict[tuple[int, int], str],
    delimiter: str,
    decimal: str,
    told: bool,
    encoding: str,
    end: str,
    preamble: list[str],
    units: bool,
    trailing: bool,
) -> None:
    names = NAMES if delimiter != "   " else tuple(name.replace(" l", "_l") for name in NAMES)
    cells = [[repr(value).replace(".", "," if decimal == COMMA else ".") for value in row] for row in rows]
    for (row, column), mark in blanks.items():
        cells[row][column] = mark
    head = [names, *([("s", "mm", "µN")] if units else [])]
    body = [delimiter.join(each) + (delimiter if trailing else "") for each in [*head, *cells]]
    text = end.join([*(line.format(d=delimiter) for line in preamble), *body])
    options = TableOptions(decimal if told else None, wanted=wanted(names))
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "t.txt"
        path.write_bytes(text.encode(encoding))
        try:
            table = read_table(path, options)
            found = [table.samples(name) for name in names]
        except UserError as refused:
            why = str(refused)
        else:
            why = ""
    if why:
        assert "\n" not in why
        assert str(path) in why
        # Decimal commas between commas, or each one that of a thousand; nothing between blanks; classic ends of lines,
        # which are not those of cp1252.
        commas = decimal == COMMA and (delimiter == "," or (not told and "tell which by --decimal comma" in why))
        assert commas or (delimiter == "   " and "" in blanks.values()) or (end == "\r" and encoding == "cp1252"), why
        return
    for column, (values, blank) in enumerate(found):
        places = [row for row, at in blanks if at == column]
        assert np.flatnonzero(blank).tolist() == sorted(places)
        kept = [i for i in range(len(rows)) if i not in places]
        assert values[kept].tolist() == [rows[i][column] for i in kept]
