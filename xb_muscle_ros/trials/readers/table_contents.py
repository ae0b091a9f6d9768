"""What is in a table: columns with their units, cells that hold no number, and facts in lines of comment."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from xb_muscle_ros.trials.inspecting.words import read_name
from xb_muscle_ros.trials.readers.cells import COMMA, FORMULA, WORKED_OUT, is_grouped
from xb_muscle_ros.trials.readers.contents import Content, Contents
from xb_muscle_ros.trials.readers.encoding import read_text
from xb_muscle_ros.trials.readers.table import Table
from xb_muscle_ros.trials.readers.text_lines import lines_of
from xb_muscle_ros.trials.trial import Array

_FACT = re.compile(r"#+\s*([A-Za-zµ][^:=]*?)\s*[:=]\s*(.+?)\s*")
_MOST_TEXTS = 5


def table_contents(path: Path, tables: Iterator[Table]) -> Contents:
    """Columns of the table that names most signals of a recording, of several the first; others are named.

    Raises:
        UserError: see the reader of the tables.
    """
    every = list(tables)
    table = max(every, key=_signals_named)
    rows = table.rows
    columns, others = [], []
    for i, header in enumerate(table.header):
        # A name that is there twice goes by its number.
        name = header if header and table.header.count(header) == 1 else str(i + 1)
        values = table.times(name, np.arange(len(rows)))[0] if table.has_clock(name) else rows.column(i, table.decimal)
        if not np.isfinite(values).any() and any(table.texts(name)):
            others.append(_text_column(name, list(dict.fromkeys(table.texts(name)))))
            continue
        unit = table.units[i].strip("()[] ") if table.units and not read_name(name).unit else ""
        columns.append(Content(name, values, unit, faults=tuple(_faults(table, name, values)), at=table.place))
    others += [f"{more.where} is a table as well; its signals are not shown" for more in every if more is not table]
    alike = tuple(each.sheet for each in every if each.sheet and each.header == table.header)
    mark = "comma" if table.decimal == COMMA else "point"
    sheet = f"sheet '{table.sheet}', " if table.sheet else ""
    form = f"{sheet}decimal {mark}, {len(rows)} rows"
    facts = {} if table.sheet else dict(_facts(path))
    return Contents(
        form, tuple(columns), facts=facts, others=tuple(others), notes=table.notices, rate=table.rate, sheets=alike
    )


def _signals_named(table: Table) -> int:
    """How many signals the columns of a table are called after."""
    return len({role for name in table.header for role in read_name(name).roles})


def _text_column(name: str, different: list[str]) -> str:
    """A column of words."""
    if different == [FORMULA]:
        return f"column '{name}' holds formulas without their values; {WORKED_OUT}"
    shown = ", ".join(f"'{text}'" for text in different[:_MOST_TEXTS])
    more = ", ..." if len(different) > _MOST_TEXTS else ""
    return f"column '{name}' holds no numbers but {len(different)} texts: {shown}{more}"


def _faults(table: Table, name: str, values: Array) -> Iterator[str]:
    texts = {row: table.text(name, row) for row in np.flatnonzero(~np.isfinite(values)).tolist()}
    empty = [row for row, text in texts.items() if not text]
    strange = [row for row, text in texts.items() if text]
    if empty:
        yield f"{_cells(len(empty))} empty, the first in {table.place(empty[0])}"
    if strange:
        row, text = strange[0], texts[strange[0]]
        why = ", thousands separators" if is_grouped(text) else ""
        yield (f"{_cells(len(strange))} no finite number, the first '{text}' in {table.place(row)}{why}")


def _cells(count: int) -> str:
    return f"{count} cell{' is' if count == 1 else 's are'}"


def _facts(path: Path) -> Iterator[tuple[str, str]]:
    """Names and values in lines of comment."""
    _, comments = lines_of(read_text(path).utf8, lambda line: True)
    for line in comments:
        match = _FACT.fullmatch(line)
        if match is not None:
            yield match.group(1), match.group(2)
