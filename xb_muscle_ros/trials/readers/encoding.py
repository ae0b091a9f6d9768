"""Text of a file, whatever its encoding; what was found is told in one line."""

from __future__ import annotations

import codecs
from pathlib import Path

from xb_muscle_ros.errors import UserError

_BEGINS = {
    codecs.BOM_UTF8: "utf-8-sig",
    codecs.BOM_UTF16_LE: "utf-16",
    codecs.BOM_UTF16_BE: "utf-16",
}


def looks_like_text(begin: bytes) -> bool:
    """Whether the first bytes of a file may be text."""
    return bool(begin) and (_encoding(begin) is not None or b"\x00" not in begin)


def read_text(path: Path, encoding: str | None = None) -> tuple[str, str]:
    """Read a text file; a line on its encoding, where that is not UTF-8 and was not given, comes with the text.

    Args:
        encoding: as Python names it; None for what the bytes show.

    Raises:
        UserError: it cannot be read, or is no text.
    """
    if path.is_dir():
        raise UserError(f"{path} is a folder; give the files themselves, for example {path}/*.csv")
    try:
        data = path.read_bytes()
    except OSError as problem:
        raise UserError(f"{path} cannot be read: {problem.strerror}; give a CSV or TSV file") from problem
    text, notice = _found(path, data) if encoding is None else (_told(path, data, encoding), "")
    if "\x00" in text:
        raise UserError(f"{path} is no text; export the recording as CSV or TSV")
    return text, notice


def _told(path: Path, data: bytes, encoding: str) -> str:
    try:
        return data.decode(encoding).removeprefix("\ufeff")
    except UnicodeDecodeError as problem:
        raise UserError(
            f"{path}, line {_line(data, problem.start)} is no {encoding} text ({problem.reason}); give another "
            "encoding, or leave it out"
        ) from None


def _found(path: Path, data: bytes) -> tuple[str, str]:
    encoding = _encoding(data)
    notice = "" if encoding in (None, "utf-8-sig") else f"{path} is UTF-16 text and read as such"
    try:
        return data.decode(encoding or "utf-8"), notice
    except UnicodeDecodeError as problem:
        if encoding is not None:
            raise UserError(f"{path} is no whole {encoding} text ({problem.reason}); export it again") from None
        if b"\x00" in data:
            raise UserError(f"{path} is no text; export the recording as CSV or TSV") from None
        text, name = _one_byte(data)
        where = f"{path}, line {_line(data, problem.start)}"
        return text, f"{where} is no UTF-8; the file is read as {name} (--encoding names another)"


def _one_byte(data: bytes) -> tuple[str, str]:
    """Text of one byte a character, and the name of its encoding."""
    # Lines that end in a carriage return alone are those of a classic Macintosh.
    if b"\r" in data and b"\n" not in data:
        return data.decode("mac_roman"), "Mac Roman, as its ends of lines are those of a Macintosh"
    try:
        return data.decode("cp1252"), "Windows-1252 (cp1252)"
    except UnicodeDecodeError:
        return data.decode("latin-1"), "Latin-1"


def _line(data: bytes, byte: int) -> int:
    return len(data[: byte + 1].splitlines())


def _encoding(data: bytes) -> str | None:
    """Encoding by the mark at the begin; UTF-16 without its mark has zero in every other byte of plain numbers."""
    marked = next((name for mark, name in _BEGINS.items() if data.startswith(mark)), None)
    if marked is not None:
        return marked
    pairs = data[:512]
    half = len(pairs) // 2
    for name, zeros, others in (("utf-16-le", pairs[1::2], pairs[::2]), ("utf-16-be", pairs[::2], pairs[1::2])):
        if half >= 2 and zeros.count(0) >= 0.9 * half and not others.count(0):
            return name
    return None
