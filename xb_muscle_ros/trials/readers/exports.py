"""Text files of recording programs that say themselves where their tables are: LabChart and LabVIEW.

Both may have several blocks, each below lines of its own; a block is a trial.
"""

from __future__ import annotations

import itertools
import math
import re
from collections.abc import Iterator, Sequence
from typing import NamedTuple

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.trials.readers.cells import COMMA, POINT, number
from xb_muscle_ros.trials.readers.units import UNITS, unit_in

_LABVIEW_END = "***End_of_Header***"
_LABVIEW_SEPARATORS = {"Tab": "\t", "Comma": ",", "Semicolon": ";"}
_LABCHART_KEY = re.compile(r"([A-Z]\w*)=")
_LABCHART_TIME = "Time"
# Rows that show how many columns there are.
_LOOKED_AT = 100
# A line above a table that tells its rate: the words for it, then a number and its unit, in either order.
_RATE = re.compile(
    r"(?:sampl\w*|scan|acquisition|data)[ _-]*(?P<what>rate|freq\w*|interval|period)\b\W*?"
    r"(?:[(\[]\s*(?P<unit>\S+?)\s*[)\]]\W*?)?(?P<value>\d[\d.,]*(?:[eE][+-]?\d+)?)(?:\W*(?P<after>[^\W\d]\w*))?",
    re.IGNORECASE,
)


class Block(NamedTuple):
    """Rows of one table in a file; places count lines from 0, without those left out before.

    Attributes:
        first, end: its rows, the last one excluded.
        rate_hz: samples in a second, where its head tells them.
    """

    first: int
    end: int
    rate_hz: float | None


class Export(NamedTuple):
    """What a program says of its tables.

    Attributes:
        program: its name.
        header: names of the columns.
        units: of each column; empty where none is told.
        line: place of the line that names the columns.
        decimal: decimal mark; None where it is not told.
    """

    program: str
    delimiter: str
    header: tuple[str, ...]
    units: tuple[str, ...]
    line: int
    blocks: tuple[Block, ...]
    decimal: str | None


def find_export(where: str, lines: Sequence[str]) -> Export | None:
    """The tables of a file of LabChart or LabVIEW; None where it is of neither.

    Raises:
        UserError: blocks with different columns, or a head without its table.
    """
    if any(line.startswith("Interval=") for line in lines[:3]):
        return _labchart(where, lines)
    if lines[0].startswith("LabVIEW Measurement"):
        return _labview(where, lines)
    return None


def rate_of(lines: Sequence[str]) -> tuple[float, str] | None:
    """Samples in a second as told by one of the lines above a table with its unit, and that line."""
    for line in lines:
        match = _RATE.search(line)
        if match is None:
            continue
        unit = next((name for name in (match["unit"], match["after"]) if name), "")
        rate = match["what"].lower() in ("rate",) or match["what"].lower().startswith("freq")
        found = _hz(f"{match['value']} {unit}", "rate" if rate else "time")
        if found is not None:
            return found, " ".join(line.split())
    return None


def _hz(text: str, kind: str) -> float | None:
    """Samples in a second by a rate or an interval such as ``0.001 s``; None where it is none."""
    value, _, name = text.strip().partition(" ")
    spelled = "Hz" if kind == "rate" and name.lower() in ("hz", "samples", "hertz") else name
    spelled = "kHz" if spelled.lower() == "khz" else spelled
    unit = unit_in(spelled, kind)
    amount = number(value) if not math.isnan(number(value)) else number(value, COMMA)
    if unit is None or not math.isfinite(amount) or amount <= 0.0:
        return None
    amount *= UNITS[unit].factor
    return amount if kind == "rate" else 1.0 / amount


def _labchart(where: str, lines: Sequence[str]) -> Export:
    starts = [i for i, line in enumerate(lines) if line.startswith("Interval=")]
    blocks: list[Block] = []
    header: tuple[str, ...] = ()
    units: tuple[str, ...] = ()
    place = 0
    for start, end in zip(starts, [*starts[1:], len(lines)], strict=True):
        keys: dict[str, list[str]] = {}
        first = start
        while first < end and (match := _LABCHART_KEY.match(lines[first])):
            keys[match[1]] = [cell.strip() for cell in lines[first].split("\t")[1:]]
            first += 1
        titles = keys.get("ChannelTitle", [])
        while titles and not titles[-1]:
            titles.pop()
        if not titles:
            raise UserError(f"{where}: a LabChart block has no line ChannelTitle=; export it again with channel titles")
        # The program can leave its column of time out.
        time = () if _fit(lines[first:end], len(titles)) else (_LABCHART_TIME,)
        if header and header != (*time, *titles):
            raise UserError(
                f"{where}: LabChart blocks have different columns: {', '.join(header)}, then "
                f"{', '.join((*time, *titles))}; export blocks of like columns into one file each"
            )
        if not header:
            told = [cell if cell != "*" else "" for cell in keys.get("UnitName", [])]
            header, place = (*time, *titles), start + list(keys).index("ChannelTitle")
            units = (*("s" for _ in time), *(told + [""] * len(titles))[: len(titles)])
        blocks.append(Block(first, end, _hz(" ".join(keys["Interval"]), "time")))
    return Export("LabChart", "\t", header, units, place, tuple(blocks), None)


def _fit(rows: Sequence[str], titles: int) -> bool:
    """Whether the first rows have a cell for each title and none for time; a comment may stand behind them."""
    widest = 0
    for row in rows[:_LOOKED_AT]:
        cells = row.split("\t")
        widest = max(widest, next((i for i, cell in enumerate(cells) if cell.startswith("#")), len(cells)))
    return widest == titles


def _labview(where: str, lines: Sequence[str]) -> Export:
    ends = [i for i, line in enumerate(lines) if line.startswith(_LABVIEW_END)]
    if not ends:
        raise UserError(f"{where}: a LabVIEW file without {_LABVIEW_END} has no table; copy it again")
    keys = dict(_key(line) for line in lines[: ends[0]])
    delimiter = _LABVIEW_SEPARATORS.get(keys.get("Separator", "Tab"), "\t")
    decimal = COMMA if lines and "," in keys.get("Decimal_Separator", ".") else POINT
    header: tuple[str, ...] = ()
    units: tuple[str, ...] = ()
    blocks, place = [], 0
    for _, end, stop in _segments(lines, ends, delimiter):
        head = {line.split(delimiter)[0].strip(): line.split(delimiter)[1:] for line in lines[_:end]}
        names = tuple(cell.strip() for cell in lines[end + 1].split(delimiter)) if end + 1 < stop else ()
        if not names:
            raise UserError(f"{where}: a LabVIEW segment has no line of column names; save it with headers")
        if header and names != header:
            raise UserError(
                f"{where}: LabVIEW segments have different columns: {', '.join(header)}, then {', '.join(names)}; save "
                "them into one file each"
            )
        if not header:
            told = [cell.strip() for cell in head.get("Y_Unit_Label", [])]
            header, place = names, end + 1
            units = ("s", *(told + [""] * len(names))[: len(names) - 1]) if names[0] == "X_Value" else ()
        blocks.append(Block(end + 2, stop, _delta_x(where, head, decimal)))
    return Export("LabVIEW", delimiter, header, units, place, tuple(blocks), decimal)


def _segments(lines: Sequence[str], ends: Sequence[int], delimiter: str) -> Iterator[tuple[int, int, int]]:
    """Begin of each segment's head, the line that ends it, and the end of its rows."""
    if len(ends) == 1:
        yield 0, ends[0], len(lines)
        return
    begins = [ends[0] + 1]
    for last, end in itertools.pairwise(ends[1:]):
        # A head begins behind the rows before it with the number of its channels.
        begins.append(next((i for i in range(end, last, -1) if _key(lines[i])[0] == "Channels"), end))
    for begin, end, stop in zip(begins, ends[1:], [*begins[1:], len(lines)], strict=True):
        yield begin, end, stop


def _delta_x(where: str, head: dict[str, list[str]], decimal: str) -> float | None:
    steps = {number(cell.strip(), decimal) for cell in head.get("Delta_X", []) if cell.strip()}
    dimensions = {cell.strip() for cell in head.get("X_Dimension", []) if cell.strip()}
    if not steps or (dimensions and dimensions != {"Time"}):
        return None
    if len(steps) > 1:
        raise UserError(
            f"{where}: Delta_X of the channels differs ({', '.join(f'{step:g}' for step in sorted(steps))} s); save "
            "channels of one rate together"
        )
    (step,) = steps
    return 1.0 / step if math.isfinite(step) and step > 0.0 else None


def _key(line: str) -> tuple[str, str]:
    parts = re.split(r"[\t,;]", line, maxsplit=1)
    return parts[0].strip(), parts[1].strip() if len(parts) > 1 else ""
