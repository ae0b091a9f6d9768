"""What a workbook's own file tells of its cells beside their values: formulas that nobody worked out, and percent.

Programs that write formulas do not work them out. A cell formatted as percent shows ``5 %`` and holds 0.05.
"""

from __future__ import annotations

import re
import zipfile
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

from xb_muscle_ros.trials.readers.cells import FORMULA

_MAIN = "{http://schemas.openxmlformats.org/spreadsheetml/2006/main}"
_ID = "{http://schemas.openxmlformats.org/officeDocument/2006/relationships}id"
_PLACE = re.compile(r"([A-Z]+)(\d+)")
_ANY = re.compile(rb"<(?:\w+:)?f[\s/>]")
# Two of the formats that every workbook has.
_PERCENT = frozenset(("9", "10"))
# A column has one format as a rule.
_LOOKED_AT = 1000
# Text and single characters that a format shows as they are.
_SHOWN = re.compile(r'"[^"]*"|\\.')


def with_formulas(path: Path, sheet: str, rows: list[list[Any]]) -> list[list[Any]]:
    """Rows of a sheet from its first cell on, with `FORMULA` in cells that hold a formula and no value."""
    found = [list(row) for row in rows]
    for row, column in _without_value(path, sheet):
        found += [[] for _ in range(row + 1 - len(found))]
        found[row] += [""] * (column + 1 - len(found[row]))
        if found[row][column] == "":
            found[row][column] = FORMULA
    return found


def percent_columns(path: Path, sheet: str) -> frozenset[int]:
    """Columns, from 0, most of whose first numbers show percent; none where the workbook is of another kind."""
    try:
        with zipfile.ZipFile(path) as archive:
            styles = _percent_styles(archive)
            part = _part_of(archive, sheet) if styles else None
            counts, percent = Counter[int](), Counter[int]()
            for column, row, cell in _cells(archive, part) if part else ():
                if row >= _LOOKED_AT:
                    break
                if cell.get("t", "n") == "n" and _value(cell):
                    counts[column] += 1
                    percent[column] += cell.get("s") in styles
            return frozenset(column for column, count in counts.items() if 2 * percent[column] > count)
    except (zipfile.BadZipFile, KeyError, ElementTree.ParseError, OSError):
        return frozenset()


def _without_value(path: Path, sheet: str) -> Iterator[tuple[int, int]]:
    """Row and column, from 0, of such cells; none where the workbook is of another kind."""
    try:
        with zipfile.ZipFile(path) as archive:
            part = _part_of(archive, sheet)
            if part is None or not _ANY.search(archive.read(part)):
                return
            for column, row, cell in _cells(archive, part):
                if cell.find(f"{_MAIN}f") is not None and not _value(cell):
                    yield row, column
    except (zipfile.BadZipFile, KeyError, ElementTree.ParseError, OSError):
        return


def _cells(archive: zipfile.ZipFile, part: str) -> Iterator[tuple[int, int, ElementTree.Element]]:
    """Column and row, from 0, of the cells of a sheet."""
    with archive.open(part) as opened:
        for _, element in ElementTree.iterparse(opened):
            place = _PLACE.fullmatch(element.get("r", "")) if element.tag == f"{_MAIN}c" else None
            if place is not None:
                yield _column(place[1]), int(place[2]) - 1, element
            if element.tag == f"{_MAIN}row":
                element.clear()


def _percent_styles(archive: zipfile.ZipFile) -> frozenset[str]:
    """Numbers of the styles that show percent."""
    styles = ElementTree.fromstring(archive.read("xl/styles.xml"))
    own = {
        each.get("numFmtId", "")
        for each in styles.iter(f"{_MAIN}numFmt")
        if "%" in _SHOWN.sub("", each.get("formatCode", ""))
    }
    formats = styles.find(f"{_MAIN}cellXfs")
    every = [] if formats is None else list(formats)
    return frozenset(str(i) for i, each in enumerate(every) if each.get("numFmtId") in _PERCENT | own)


def _part_of(archive: zipfile.ZipFile, sheet: str) -> str | None:
    """The file of a sheet within the workbook."""
    book = ElementTree.fromstring(archive.read("xl/workbook.xml"))
    name = next((each.get(_ID) for each in book.iter(f"{_MAIN}sheet") if each.get("name") == sheet), None)
    links = ElementTree.fromstring(archive.read("xl/_rels/workbook.xml.rels"))
    target = next((each.get("Target", "") for each in links if each.get("Id") == name), None)
    if target is None:
        return None
    return target[1:] if target.startswith("/") else f"xl/{target}"


def _value(cell: ElementTree.Element) -> str:
    found = cell.find(f"{_MAIN}v")
    return "" if found is None else (found.text or "")


def _column(letters: str) -> int:
    number = 0
    for letter in letters:
        number = 26 * number + ord(letter) - ord("A") + 1
    return number - 1
