"""Tables in delimited text: columns between commas, semicolons, tabs or blanks, as laboratories export them."""

from __future__ import annotations

import re
from array import array
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.trials.readers.cells import COMMA
from xb_muscle_ros.trials.readers.encoding import read_text
from xb_muscle_ros.trials.readers.exports import Export, find_export, rate_of
from xb_muscle_ros.trials.readers.layout import LOOKED_AT, Wanted, header_units, plain
from xb_muscle_ros.trials.readers.making import Head, head_of, locate, make_table
from xb_muscle_ros.trials.readers.options import TableOptions
from xb_muscle_ros.trials.readers.rows import SPACES, TextRows, split
from xb_muscle_ros.trials.readers.table import Table

_DELIMITERS = ("\t", ";", ",", SPACES)
# Excel tells itself the delimiter in a line before the header.
_SEPARATOR_LINE = re.compile(r"sep=(.)", re.IGNORECASE)
# What begins with # and is no comment: a missing value of a spreadsheet.
_MISSING = re.compile(r"#(?:N/A|NA|NV|NUM!|DIV/0!|VALUE!|REF!|NULL!)", re.IGNORECASE)
# Spike2 and Signal may export channel below channel.
_BY_CHANNEL = re.compile(r'"?(INFORMATION|SUMMARY|CHANNEL)"?\b')


class _Lines(NamedTuple):
    """Lines of a file that are neither empty nor comments, their numbers from 1, and the comments with theirs."""

    texts: list[str]
    numbers: array[int]
    comments: list[tuple[int, str]]

    def after(self, place: int) -> _Lines:
        """Those from a place on."""
        return _Lines(self.texts[place:], self.numbers[place:], self.comments)


def read_table(path: Path, options: TableOptions | None = None) -> Table:
    """Read delimited text; lines that begin with # are comments.

    Raises:
        UserError: the file is missing, no text, has no header line or no rows, has rows that are longer than the
            header, or its decimal mark cannot be told.
    """
    options = options or TableOptions()
    text, encoding = read_text(path, options.encoding)
    lines = _lines(text)
    del text  # an hour at 1 kHz is 100 MB
    separator = _SEPARATOR_LINE.fullmatch(lines.texts[0].strip()) if lines.texts else None
    if separator is not None:
        lines = lines.after(1)
    if not lines.texts:
        raise UserError(f"{path} is empty; needed are a header line and rows of numbers")
    export = find_export(str(path), lines.texts) if options.header is None else None
    if export is not None:
        return _exported(path, lines, export, options, encoding)
    if _BY_CHANNEL.match(lines.texts[0]):
        raise UserError(
            f"{path} holds channel below channel, as Spike2 writes them; export it again as a spreadsheet, a "
            "column for each channel"
        )
    return _table(path, lines, separator.group(1) if separator else None, options, encoding)


def _lines(text: str) -> _Lines:
    """Lines that may be part of a table."""
    texts = text.splitlines()
    comments, out = [], set()
    for i, line in enumerate(texts):
        if line.startswith("#") and not _MISSING.match(line):
            comments.append((i + 1, line))
            out.add(i)
        elif not line or line.isspace():
            out.add(i)
    numbers = array("q", range(1, len(texts) + 1))
    if out:
        texts = [line for i, line in enumerate(texts) if i not in out]
        numbers = array("q", (number for number in numbers if number - 1 not in out))
    return _Lines(texts, numbers, comments)


def _table(path: Path, lines: _Lines, separator: str | None, options: TableOptions, encoding: str) -> Table:
    """A table below a header that may have other lines above it, and may come again."""
    commented = _commented_header(lines, separator, options.wanted)
    if commented is not None and options.header is None:
        lines, options = commented.lines, options._replace(header=str(commented.number))
    texts, numbers = lines.texts, lines.numbers
    marks = (separator,) if separator is not None else _DELIMITERS
    splits = {mark: [split(_bare(line), mark) for line in texts[:LOOKED_AT]] for mark in marks}
    mark, found = locate(str(path), TextRows.word, numbers, splits, options)
    head = head_of(TextRows.word, numbers, splits[mark], found)
    if mark == SPACES and found.header is not None:
        _check_names(f"{path}, line {numbers[found.header]}", head.names, splits[mark][found.first : found.first + 1])
    above = [*texts[: found.header or 0], *(line for _, line in lines.comments)]
    body = lines.after(found.first)
    starts: tuple[int, ...] = (0,)
    if found.header is not None and texts[found.header] in body.texts:
        body, starts = _blocks(body, texts[found.header : found.first])
        head = head._replace(notices=(*head.notices, f"its header comes {len(starts)} times, above a trial each"))
    while body.texts and not body.texts[-1].strip(f'{mark} \t"'):  # rows a spreadsheet adds
        body.texts.pop()
        body.numbers.pop()
    return make_table(
        path, "", head, TextRows(body.texts, body.numbers, mark), options, (encoding,), starts, rate_of(above)
    )


def _exported(path: Path, lines: _Lines, export: Export, options: TableOptions, encoding: str) -> Table:
    """The blocks of a table whose program says where they are."""
    body = _Lines([], array("q"), [])
    starts = []
    for block in export.blocks:
        if block.end > block.first:
            starts.append(len(body.texts))
            body.texts.extend(lines.texts[block.first : block.end])
            body.numbers.extend(lines.numbers[block.first : block.end])
    what = f"{path} is a text file of {export.program}"
    more = f" with {len(starts)} blocks, a trial each" if len(starts) > 1 else ""
    rates = {block.rate_hz for block in export.blocks}
    (rate_hz,) = rates if len(rates) == 1 else (None,)
    rate = None if rate_hz is None else (rate_hz, f"the head of the {export.program} file")
    told = f"{what}{more}; its columns: {', '.join(name for name in export.header if name)}"
    units = header_units(export.header, export.units)
    options = options._replace(decimal=options.decimal or export.decimal)
    comma = f"{what}, which says that it has decimal commas" if export.decimal == COMMA else ""
    return make_table(
        path,
        "",
        Head(export.header, units),
        TextRows(body.texts, body.numbers, export.delimiter),
        options,
        (encoding, told, comma),
        tuple(starts) or (0,),
        rate,
    )


class _Commented(NamedTuple):
    """Lines with the comment that names the columns among them."""

    lines: _Lines
    number: int


def _commented_header(lines: _Lines, separator: str | None, wanted: Wanted) -> _Commented | None:
    """A comment that names the columns asked for, as NumPy writes it, where no other line does."""
    marks = (separator,) if separator is not None else _DELIMITERS

    def names(line: str) -> bool:
        return any(wanted.named_by([plain(cell) for cell in split(line, mark)]) for mark in marks)

    if not any(names(line.lstrip("# ")) for _, line in lines.comments):
        return None
    if any(names(_bare(line)) for line in lines.texts[:LOOKED_AT]):
        return None
    number, text = next((i, line.lstrip("# ")) for i, line in lines.comments if names(line.lstrip("# ")))
    place = sum(i < number for i in lines.numbers[:LOOKED_AT])
    texts, numbers = [*lines.texts], lines.numbers[:]
    texts.insert(place, text)
    numbers.insert(place, number)
    return _Commented(_Lines(texts, numbers, [each for each in lines.comments if each[0] != number]), number)


def _check_names(where: str, names: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
    """Names of columns between blanks hold none themselves."""
    if rows and len(rows[0]) != len(names):
        raise UserError(
            f"{where} has {len(names)} names between blanks, the row below {len(rows[0])} numbers; write names without "
            "blanks, or give columns by their number (column: 1, with 'header: none')"
        )


def _blocks(body: _Lines, head: Sequence[str]) -> tuple[_Lines, tuple[int, ...]]:
    """Rows without the headers that come again, and where the blocks below them begin."""
    rows, starts, skip = _Lines([], array("q"), body.comments), [0], 0
    for text, number in zip(body.texts, body.numbers, strict=True):
        if text == head[0]:
            skip = len(head)
            if len(rows.texts) > starts[-1]:
                starts.append(len(rows.texts))
        if skip and text in head:
            skip -= 1
            continue
        skip = 0
        rows.texts.append(text)
        rows.numbers.append(number)
    return rows, tuple(start for start in starts if start < len(rows.texts))


def _bare(line: str) -> str:
    """A line without the sign before a header that MATLAB writes as a comment."""
    return line[1:].lstrip() if line.startswith("% ") else line
