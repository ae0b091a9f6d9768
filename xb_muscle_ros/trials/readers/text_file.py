"""Text of a file, whatever it is encoded in: UTF-8, UTF-16 as Excel's "Unicode text", or Windows-1252."""

from __future__ import annotations

import codecs
from pathlib import Path
from typing import NamedTuple

from xb_muscle_ros.errors import UserError

_BEGINS = {
    codecs.BOM_UTF8: "utf-8-sig",
    codecs.BOM_UTF16_LE: "utf-16",
    codecs.BOM_UTF16_BE: "utf-16",
}


class Text(NamedTuple):
    """Text, and what was found of its encoding where that is not UTF-8; empty where it is."""

    text: str
    told: str


def looks_like_text(begin: bytes) -> bool:
    """Whether the first bytes of a file may be text."""
    return bool(begin) and (_marked(begin) is not None or _unmarked_utf16(begin) is not None or b"\x00" not in begin)


def read_text(path: Path) -> Text:
    """Read a text file.

    Raises:
        UserError: it cannot be read, or is no text.
    """
    try:
        data = path.read_bytes()
    except OSError as problem:
        raise UserError(f"{path} cannot be read: {problem.strerror}; give a CSV or TSV file") from problem
    encoding = _marked(data) or _unmarked_utf16(data)
    told = "" if encoding in (None, "utf-8-sig") else f"{path} is UTF-16 text and read as such"
    try:
        text = data.decode(encoding or "utf-8")
    except UnicodeDecodeError as problem:
        if encoding is not None:
            raise UserError(f"{path} is no whole {encoding} text ({problem.reason}); export it again") from None
        if b"\x00" in data:
            raise UserError(f"{path} is no text; export the recording as CSV or TSV") from None
        try:
            text, name = data.decode("cp1252"), "Windows-1252 (cp1252)"
        except UnicodeDecodeError:
            text, name = data.decode("latin-1"), "Latin-1"
        line = data[: problem.start].count(b"\n") + 1
        told = f"{path}, line {line} is no UTF-8; the file is read as {name}"
    if "\x00" in text:
        raise UserError(f"{path} is no text; export the recording as CSV or TSV")
    return Text(text, told)


def _marked(data: bytes) -> str | None:
    """Encoding by the mark at the begin."""
    return next((name for mark, name in _BEGINS.items() if data.startswith(mark)), None)


def _unmarked_utf16(data: bytes) -> str | None:
    """UTF-16 without its mark: every other byte of plain numbers is then zero."""
    pairs = data[:512]
    half = len(pairs) // 2
    for name, zeros, others in (("utf-16-le", pairs[1::2], pairs[::2]), ("utf-16-be", pairs[::2], pairs[1::2])):
        if half >= 2 and zeros.count(0) >= 0.9 * half and not others.count(0):
            return name
    return None
