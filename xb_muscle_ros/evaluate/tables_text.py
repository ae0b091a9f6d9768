"""Tables as text: Markdown whose columns line up, and CSV."""

from __future__ import annotations

import csv
import math
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from xb_muscle_ros.files import replaced
from xb_muscle_ros.scores.estimate import error_text, mark

NOTHING = "–"


def number(value: float | None, form: str = ".3f") -> str:
    """A number for a table; a dash for None and NaN."""
    return NOTHING if value is None or not math.isfinite(value) else format(value, form)


def plus_minus(mean: float | None, sd: float | None, form: str = ".2f") -> str:
    """Mean ± s.d.; the mean alone where there is no s.d."""
    return number(mean, form) + ("" if sd is None or mean is None else f" ± {number(sd, form)}")


def with_error(value: float | None, se: float | None, form: str = ".3f") -> str:
    """A number ± its standard error, marked where that is as large; the number alone where it has none."""
    text = number(value, form)
    return text if text == NOTHING else text + error_text(se) + mark(value, se)


def markdown(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A Markdown table; the first column to the left, the others to the right."""
    lines = [list(head), *([cell.replace("|", "/") for cell in row] for row in rows)]
    widths = [max(3, *(len(line[i]) for line in lines)) for i in range(len(head))]

    def line(cells: Sequence[str]) -> str:
        padded = [c.ljust(w) if i == 0 else c.rjust(w) for i, (c, w) in enumerate(zip(cells, widths, strict=True))]
        return f"| {' | '.join(padded)} |"

    rule = [("-" * w) if i == 0 else "-" * (w - 1) + ":" for i, w in enumerate(widths)]
    return "\n".join([line(lines[0]), line(rule), *map(line, lines[1:])])


def write_csv(path: Path, rows: Iterable[Mapping[str, Any]], columns: Sequence[str]) -> None:
    """Write rows as CSV, one by one; None and NaN become empty, floats stay exact. Appears whole or not at all."""
    with replaced(path) as temporary, temporary.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(columns)
        for row in rows:
            writer.writerow([_cell(row[name]) for name in columns])


def _cell(value: Any) -> str:
    if value is None or (isinstance(value, float) and not math.isfinite(value)):
        return ""
    return repr(value) if isinstance(value, float) else str(value)
