"""Cells of a workbook that hold a formula and no value: programs that write formulas do not work them out."""

from __future__ import annotations

import re
import zipfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

from xb_muscle_ros.trials.readers.cells import FORMULA

_MAIN = "{http://schemas.openxmlformats.org/spreadsheetml/2006/main}"
_ID = "{http://schemas.openxmlformats.org/officeDocument/2006/relationships}id"
_PLACE = re.compile(r"([A-Z]+)(\d+)")
_ANY = re.compile(rb"<(?:\w+:)?f[\s/>]")


def with_formulas(path: Path, sheet: str, rows: list[list[Any]]) -> list[list[Any]]:
    """Rows of a sheet from its first cell on, with `FORMULA` in cells that hold a formula and no value."""
    found = [list(row) for row in rows]
    for row, column in _without_value(path, sheet):
        found += [[] for _ in range(row + 1 - len(found))]
        found[row] += [""] * (column + 1 - len(found[row]))
        if found[row][column] == "":
            found[row][column] = FORMULA
    return found


def _without_value(path: Path, sheet: str) -> Iterator[tuple[int, int]]:
    """Row and column, from 0, of such cells; none where the workbook is of another kind."""
    try:
        with zipfile.ZipFile(path) as archive:
            part = _part_of(archive, sheet)
            if part is None or not _ANY.search(archive.read(part)):
                return
            with archive.open(part) as opened:
                for _, element in ElementTree.iterparse(opened):
                    place = _PLACE.fullmatch(element.get("r", "")) if element.tag == f"{_MAIN}c" else None
                    if place is not None and element.find(f"{_MAIN}f") is not None and not _value(element):
                        yield int(place[2]) - 1, _column(place[1])
                    if element.tag == f"{_MAIN}row":
                        element.clear()
    except (zipfile.BadZipFile, KeyError, ElementTree.ParseError, OSError):
        return


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
