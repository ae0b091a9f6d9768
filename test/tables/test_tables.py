"""Tables: columns that line up, dashes for what is missing, marks for what is no better than noise."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import pytest

from xb_muscle_ros.files import write_json
from xb_muscle_ros.tables import Columns, aligned, filled, markdown, number, with_error, write_csv


@dataclass(frozen=True)
class Row:
    name: str
    value: float | None

    def as_row(self) -> dict[str, object]:
        return {"called": self.name, "value": self.value}


ROWS = [Row("a", 1.25), Row("longer|name", None)]
COLUMNS: Columns[Row] = {"name": lambda r: r.name, "force (% F0)": lambda r: number(r.value, ".1f", 100.0)}


def test_columns_line_up() -> None:
    lines = aligned(*filled(COLUMNS, ROWS)).split("\n")
    assert lines == [
        "name         force (% F0)",
        "-----------  ------------",
        "a                   125.0",
        "longer|name             –",
    ]


def test_markdown_keeps_its_bars() -> None:
    lines = markdown(*filled(COLUMNS, ROWS)).split("\n")
    assert lines[1] == "| ----------- | -----------: |"
    assert lines[3] == "| longer/name |            – |"


def test_numbers_have_their_errors_and_a_mark_where_these_are_as_large() -> None:
    assert [with_error(*each) for each in ((2.0, 0.1), (2.0, 5.0), (2.0, None), (None, 1.0))] == [
        "2.000 ± 0.1", "2.000 ± 5*", "2.000", "–",
    ]  # fmt: skip
    assert with_error(0.2, 0.01, ".1f", 100.0) == "20.0 ± 1"


def test_csv_is_exact_and_has_its_head_without_rows(tmp_path: Path) -> None:
    path = tmp_path / "t.csv"
    write_csv(path, [{"a": 0.1 + 0.2, "b": float("nan")}, {"a": None, "b": "x,y"}])
    assert path.read_text() == 'a,b\n0.30000000000000004,\n,"x,y"\n'
    write_csv(path, [], ["a", "b"])
    assert path.read_text() == "a,b\n"


def test_json_takes_dataclasses_and_no_nan(tmp_path: Path) -> None:
    path = tmp_path / "t.json"
    write_json(path, {"rows": ROWS[:1], "unit": "µM"})
    assert path.read_text() == '{\n "rows": [\n  {\n   "called": "a",\n   "value": 1.25\n  }\n ],\n "unit": "µM"\n}\n'
    with pytest.raises(ValueError, match="not JSON compliant"):
        write_json(path, {"value": float("nan")})
