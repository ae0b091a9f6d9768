"""What the file of an Excel workbook tells of its cells beside their values: formulas that nobody worked out, percent.

Programs that write formulas do not work them out. A cell formatted as percent shows ``5 %`` and holds 0.05.
"""

from __future__ import annotations

import re
import zipfile
from collections.abc import Iterator
from typing import NamedTuple
from xml.etree import ElementTree

_PLACE = re.compile(r"([A-Z]+)(\d+)")
_RANGE = re.compile(r"([A-Z]+)(\d+):([A-Z]+)(\d+)")
_FORMULA = rb"<(?:\w+:)?f[\s/>]"
# Two of the formats that every workbook has.
_PERCENT = frozenset(("9", "10"))
# What a format shows as it is: text and single characters; and characters whose width it leaves empty or fills.
_SHOWN = re.compile(r'"[^"]*"|[\\_*].')
_TRUE = ("1", "true")


class Seen(NamedTuple):
    """A cell with more to it than a value.

    Attributes:
        row, column: from 0.
        formula: it holds a formula.
        value: it holds a value; that of a formula was worked out.
        percent: it holds a number and shows percent.
    """

    row: int
    column: int
    formula: bool
    value: bool
    percent: bool


class _Block(NamedTuple):
    """The cells that one array formula gives: columns and rows, the last of each included."""

    left: int
    top: int
    right: int
    bottom: int

    def holds(self, row: int, column: int) -> bool:
        return self.top <= row <= self.bottom and self.left <= column <= self.right


def seen_in_excel(archive: zipfile.ZipFile, sheet: str) -> Iterator[Seen]:
    """Formulas of a sheet and cells that show percent; a sheet without either is not parsed.

    Raises:
        KeyError: the workbook is of another kind.
    """
    book = ElementTree.fromstring(archive.read("xl/workbook.xml"))
    part = _part_of(archive, book, sheet)
    styles = _percent_styles(archive)
    wanted = [_FORMULA, *([rb"\ss=[\"'](?:" + "|".join(sorted(styles)).encode() + rb")[\"']"] if styles else [])]
    if part is None or not re.search(b"|".join(wanted), archive.read(part)):
        return
    to_work_out = _is_to_work_out(book)
    blocks: list[_Block] = []
    for row, column, cell in _cells(archive, part):
        formula = cell.find("{*}f")
        if formula is not None and formula.get("t") == "array" and (block := _block(formula)):
            blocks = [block, *(each for each in blocks if each.bottom >= row)]
        held = formula is not None or any(block.holds(row, column) for block in blocks)
        percent = cell.get("s") in styles and cell.get("t", "n") == "n"
        if held or percent:
            value = _has_value(cell, held, to_work_out)
            yield Seen(row, column, held, value, percent and value)


def local(tag: str) -> str:
    """The name of an element or attribute without its namespace, which differs between kinds of the same format."""
    return tag.rpartition("}")[2]


def _has_value(cell: ElementTree.Element, formula: bool, to_work_out: bool) -> bool:
    """Whether a cell has a value that counts.

    Args:
        formula: it holds a formula.
        to_work_out: nobody has worked the formulas out; programs then write 0 in place of the value.
    """
    found = cell.find("{*}v")
    text = "" if found is None else (found.text or "")
    if not formula:
        return bool(text)
    kind = cell.get("t", "n")
    if to_work_out:
        return bool(text.strip("0.") if kind == "n" else text)
    return bool(text) or (found is not None and kind == "str")  # a formula may give empty text


def _is_to_work_out(book: ElementTree.Element) -> bool:
    """Whether the formulas wait for a program that works them out; one that does takes this mark away."""
    found = book.find("{*}calcPr")
    return found is not None and found.get("fullCalcOnLoad") in _TRUE


def _cells(archive: zipfile.ZipFile, part: str) -> Iterator[tuple[int, int, ElementTree.Element]]:
    """Row and column, from 0, of the cells of a sheet; those without a place of their own follow the one before."""
    row = -1
    with archive.open(part) as opened:
        for _, element in ElementTree.iterparse(opened):
            if local(element.tag) != "row":
                continue
            row, column = int(element.get("r", row + 2)) - 1, -1
            for cell in element:
                if local(cell.tag) != "c":
                    continue
                place = _PLACE.fullmatch(cell.get("r", ""))
                row, column = (int(place[2]) - 1, _column(place[1])) if place else (row, column + 1)
                yield row, column, cell
            element.clear()


def _percent_styles(archive: zipfile.ZipFile) -> frozenset[str]:
    """Numbers of the styles that show percent."""
    styles = ElementTree.fromstring(archive.read("xl/styles.xml")) if "xl/styles.xml" in archive.namelist() else None
    if styles is None:
        return frozenset()
    own = {
        each.get("numFmtId", "")
        for each in styles.findall("{*}numFmts/{*}numFmt")
        if "%" in _SHOWN.sub("", each.get("formatCode", ""))
    }
    every = styles.findall("{*}cellXfs/{*}xf")
    return frozenset(str(i) for i, each in enumerate(every) if each.get("numFmtId") in _PERCENT | own)


def _part_of(archive: zipfile.ZipFile, book: ElementTree.Element, sheet: str) -> str | None:
    """The file of a sheet within the workbook."""
    sheets = (each for each in book.findall("{*}sheets/{*}sheet") if each.get("name") == sheet)
    names = [text for each in sheets for key, text in each.items() if local(key) == "id"]
    links = ElementTree.fromstring(archive.read("xl/_rels/workbook.xml.rels"))
    target = next((each.get("Target", "") for each in links if each.get("Id") in names), None)
    if target is None:
        return None
    return target[1:] if target.startswith("/") else f"xl/{target}"


def _block(formula: ElementTree.Element) -> _Block | None:
    found = _RANGE.fullmatch(formula.get("ref", ""))
    return found and _Block(_column(found[1]), int(found[2]) - 1, _column(found[3]), int(found[4]) - 1)


def _column(letters: str) -> int:
    number = 0
    for letter in letters:
        number = 26 * number + ord(letter) - ord("A") + 1
    return number - 1
