"""What the file of an OpenDocument spreadsheet tells of its cells beside their values: formulas, and percent."""

from __future__ import annotations

import re
import zipfile
from collections.abc import Iterator
from xml.etree import ElementTree

from xb_muscle_ros.trials.readers.xlsx_cells import Seen

CONTENT = "content.xml"
_OFFICE = "{urn:oasis:names:tc:opendocument:xmlns:office:1.0}"
_TABLE = "{urn:oasis:names:tc:opendocument:xmlns:table:1.0}"
_ANY = re.compile(rb"value-type=[\"']percentage[\"']|\stable:formula=")
_CELLS = (f"{_TABLE}table-cell", f"{_TABLE}covered-table-cell")


def seen_in_ods(archive: zipfile.ZipFile, sheet: str) -> Iterator[Seen]:
    """Formulas of a sheet and cells that show percent; a file without either is not parsed."""
    if not _ANY.search(archive.read(CONTENT)):
        return
    row, here = 0, False
    with archive.open(CONTENT) as opened:
        for event, element in ElementTree.iterparse(opened, ("start", "end")):
            if element.tag == f"{_TABLE}table":
                row, here = 0, event == "start" and element.get(f"{_TABLE}name") == sheet
            elif event == "end" and element.tag == f"{_TABLE}table-row":
                times = _times(element, "rows")
                for columns, cell in _special(element) if here else ():
                    yield from (cell._replace(row=i, column=j) for i in range(row, row + times) for j in columns)
                row += times
                element.clear()


def _special(row: ElementTree.Element) -> Iterator[tuple[range, Seen]]:
    """Columns of equal cells beside each other, where there is more to them than a value."""
    first = 0
    for cell in row:
        if cell.tag not in _CELLS:
            continue
        columns = range(first, first + _times(cell, "columns"))
        kind, formula = cell.get(f"{_OFFICE}value-type"), f"{_TABLE}formula" in cell.attrib
        if formula or kind == "percentage":
            yield columns, Seen(0, first, formula, kind is not None, kind == "percentage")
        first = columns.stop


def _times(element: ElementTree.Element, what: str) -> int:
    """How often a row or a cell stands there."""
    return int(element.get(f"{_TABLE}number-{what}-repeated", "1"))
