"""Tables in delimited text: columns between commas, semicolons, tabs or blanks, as laboratories export them."""

from __future__ import annotations

import itertools
import re
from array import array
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.trials.readers.cells import COMMA
from xb_muscle_ros.trials.readers.encoding import read_text
from xb_muscle_ros.trials.readers.exports import Export, find_export, rate_of
from xb_muscle_ros.trials.readers.layout import LOOKED_AT, Wanted, header_units, plain
from xb_muscle_ros.trials.readers.making import Head, head_of, locate, make_table
from xb_muscle_ros.trials.readers.options import TableOptions
from xb_muscle_ros.trials.readers.rows import SPACES, TextRows, split
from xb_muscle_ros.trials.readers.table import Table
from xb_muscle_ros.trials.readers.text_lines import TextLines, lines_of

_DELIMITERS = ("\t", ";", ",", SPACES)
# Excel tells itself the delimiter in a line before the header.
_SEPARATOR_LINE = re.compile(r"sep=(.)", re.IGNORECASE)
# What begins with # and is no comment: a missing value of a spreadsheet.
_MISSING = re.compile(r"#(?:N/A|NA|NV|NUM!|DIV/0!|VALUE!|REF!|NULL!)", re.IGNORECASE)
# Spike2 and Signal may export channel below channel.
_BY_CHANNEL = re.compile(r'"?(INFORMATION|SUMMARY|CHANNEL)"?\b')


class _Lines(NamedTuple):
    """Lines of a file that are neither empty nor comments, and the comments."""

    texts: TextLines
    comments: TextLines


def read_table(path: Path, options: TableOptions | None = None) -> Table:
    """Read delimited text; lines that begin with # are comments.

    Raises:
        UserError: the file is missing, no text, has no header line or no rows, has rows that are longer than the
            header, or its decimal mark cannot be told.
    """
    options = options or TableOptions()
    text, encoding = read_text(path, options.encoding)
    lines = _Lines(*lines_of(text, lambda line: not _MISSING.match(line)))
    separator = _SEPARATOR_LINE.fullmatch(lines.texts[0].strip()) if lines.texts else None
    if separator is not None:
        lines = lines._replace(texts=lines.texts[1:])
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


def _table(path: Path, lines: _Lines, separator: str | None, options: TableOptions, encoding: str) -> Table:
    """A table below a header that may have other lines above it, and may come again."""
    commented = _commented_header(lines, separator, options.wanted)
    if commented is not None and options.header is None:
        lines, options = commented.lines, options._replace(header=str(commented.number))
    texts, numbers = lines.texts, lines.texts.numbers[:LOOKED_AT].tolist()
    marks = (separator,) if separator is not None else _DELIMITERS
    splits = {mark: [split(_bare(line), mark) for line in texts[:LOOKED_AT]] for mark in marks}
    mark, found = locate(str(path), TextRows.word, numbers, splits, options)
    head = head_of(TextRows.word, numbers, splits[mark], found)
    if mark == SPACES and found.header is not None:
        _check_names(f"{path}, line {numbers[found.header]}", head.names, splits[mark][found.first : found.first + 1])
    above = [*texts[: found.header or 0], *lines.comments]
    body = texts[found.first :]
    starts: tuple[int, ...] = (0,)
    if found.header is not None and texts[found.header] in body:
        body, starts = _blocks(body, list(texts[found.header : found.first]))
        head = head._replace(notices=(*head.notices, f"its header comes {len(starts)} times, above a trial each"))
    end = len(body)
    while end and not body[end - 1].strip(f'{mark} \t"'):  # rows a spreadsheet adds
        end -= 1
    rows = TextRows(body[:end], body.numbers[:end], mark)
    table = make_table(path, "", head, rows, options, (encoding,), starts, rate_of(above))
    if mark == SPACES:
        _check_whole(table)
    return table


def _check_whole(table: Table) -> None:
    """Every row between blanks has all its cells: where one is empty, those behind it would move to its place.

    Raises:
        UserError: a row is short.
    """
    if table.rows.matrix(table.decimal) is not None:
        return
    width = len(table.header)
    short = [row for row, cells in enumerate(table.rows.cells) if len(cells) < width]
    if short:
        more = f", and so do {len(short) - 1} more" if len(short) > 1 else ""
        raise UserError(
            f"{table.where}, {table.place(short[0])} has {len(table.rows.cells[short[0]])} cells between blanks{more}; "
            f"needed are {width}: {', '.join(table.header)}; which of them is empty cannot be told: write nan there, "
            "export the table with tabs or commas, or remove the line"
        )


def _exported(path: Path, lines: _Lines, export: Export, options: TableOptions, encoding: str) -> Table:
    """The blocks of a table whose program says where they are."""
    places = [np.arange(block.first, block.end) for block in export.blocks if block.end > block.first]
    starts = [0, *itertools.accumulate(each.size for each in places[:-1])]
    body = lines.texts.take(np.concatenate([np.empty(0, int), *places]))
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
        TextRows(body, body.numbers, export.delimiter),
        options,
        (encoding, told, comma),
        tuple(starts),
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

    comments = lines.comments
    found = next((i for i, line in enumerate(comments) if names(line.lstrip("# "))), None)
    if found is None or any(names(_bare(line)) for line in lines.texts[:LOOKED_AT]):
        return None
    number, sign = int(comments.numbers[found]), len(comments[found]) - len(comments[found].lstrip("# "))
    place = int(np.searchsorted(lines.texts.numbers[:LOOKED_AT], number))
    texts = lines.texts.with_line(place, comments[found : found + 1], sign)
    return _Commented(_Lines(texts, comments.take(np.delete(np.arange(len(comments)), found))), number)


def _check_names(where: str, names: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
    """Names of columns between blanks hold none themselves."""
    if rows and len(rows[0]) != len(names):
        raise UserError(
            f"{where} has {len(names)} names between blanks, the row below {len(rows[0])} numbers; write names without "
            "blanks, or give columns by their number (column: 1, with 'header: none')"
        )


def _blocks(body: TextLines, head: Sequence[str]) -> tuple[TextLines, tuple[int, ...]]:
    """Rows without the headers that come again, and where the blocks below them begin."""
    rows, starts, skip = array("q"), [0], 0
    for place, text in enumerate(body):
        if text == head[0]:
            skip = len(head)
            if len(rows) > starts[-1]:
                starts.append(len(rows))
        if skip and text in head:
            skip -= 1
            continue
        skip = 0
        rows.append(place)
    return body.take(np.array(rows)), tuple(start for start in starts if start < len(rows))


def _bare(line: str) -> str:
    """A line without the sign before a header that MATLAB writes as a comment."""
    return line[1:].lstrip() if line.startswith("% ") else line
