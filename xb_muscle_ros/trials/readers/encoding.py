"""Text of a file, whatever its encoding, as UTF-8; what was found is told in one line.

A file is read in blocks, and what is made of a large one lies in a temporary file, so that memory does not limit it.
"""

from __future__ import annotations

import codecs
import io
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.trials.spool import Spool, spooled

_BEGINS = {
    codecs.BOM_UTF8: "utf-8-sig",
    codecs.BOM_UTF16_LE: "utf-16",
    codecs.BOM_UTF16_BE: "utf-16",
}
_BLOCK_BYTES = 1 << 20
# Encodings that have a mark of their order of bytes at the begin.
_ORDERED = ("utf-16", "utf-32")
_ORDERED_MARKS = (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE, codecs.BOM_UTF32_BE)  # UTF-32-LE begins as UTF-16-LE


class Text(NamedTuple):
    """Text as UTF-8 whose lines end in a line feed, the last one too, and a line on its encoding, or none."""

    utf8: bytes | Spool
    notice: str


def looks_like_text(begin: bytes) -> bool:
    """Whether the first bytes of a file may be text."""
    return bool(begin) and (_encoding(begin) is not None or b"\x00" not in begin)


def read_text(path: Path, encoding: str | None = None) -> Text:
    """Read a text file; its encoding is told where that is not UTF-8 and was not given.

    Args:
        encoding: as Python names it; None for what the bytes show.

    Raises:
        UserError: it cannot be read, or is no text.
    """
    if path.is_dir():
        raise UserError(f"{path} is a folder; give the files themselves, for example {path}/*.csv")
    try:
        return _found(path) if encoding is None else _told(path, encoding)
    except OSError as problem:
        raise UserError(f"{path} cannot be read: {problem.strerror}; give a CSV or TSV file") from problem


class _NoText(Exception):
    """Bytes that an encoding does not know: why, and the line of the first."""

    def __init__(self, why: str, line: int) -> None:
        super().__init__(why)
        self.why, self.line = why, line


def _told(path: Path, encoding: str) -> Text:
    begin = next(_blocks(path), b"")
    name = codecs.lookup(encoding).name
    if name in _ORDERED and not begin.startswith(_ORDERED_MARKS):
        name += f"-{sys.byteorder[0]}e"  # as Python takes it
    try:
        return Text(_utf8(path, name), "")
    except _NoText as problem:
        raise UserError(
            f"{path}, line {problem.line} is no {encoding} text ({problem.why}); give another encoding, or leave it out"
        ) from None


def _found(path: Path) -> Text:
    encoding = _encoding(next(_blocks(path), b""))
    notice = "" if encoding in (None, "utf-8-sig") else f"{path} is UTF-16 text and read as such"
    try:
        return Text(_utf8(path, encoding or "utf-8"), notice)
    except _NoText as problem:
        if encoding is not None:
            raise UserError(f"{path} is no whole {encoding} text ({problem.why}); export it again") from None
        name, called = _one_byte(path)
        where = f"{path}, line {problem.line}"
        notice = f"{where} is no UTF-8; the file is read as {called} (--encoding names another)"
        return Text(_utf8(path, name), notice)


def _utf8(path: Path, encoding: str) -> bytes | Spool:
    """The text, whatever its lines end in.

    Raises:
        _NoText: a byte that the encoding does not know.
    """
    return spooled(_decoded(path, encoding))


def _decoded(path: Path, encoding: str) -> Iterator[bytes]:
    decoder = io.IncrementalNewlineDecoder(codecs.getincrementaldecoder(encoding)(), translate=True)
    line, last = 1, ""
    for block in _blocks(path, ended=True):
        # A carriage return at the end of a block waits for what follows.
        waiting = decoder.getstate()[1] & 1
        try:
            text = decoder.decode(block, final=not block)
        except UnicodeDecodeError as problem:
            before = problem.object[: problem.start].decode(encoding, "ignore")
            ends = before.replace("\r\n", "\n").replace("\r", "\n").count("\n")
            raise _NoText(problem.reason, line + waiting + ends) from None
        except UnicodeError as problem:
            raise _NoText(str(problem), line) from None
        text = text.removeprefix("\ufeff") if not last else text
        if "\x00" in text:
            raise UserError(f"{path} is no text; export the recording as CSV or TSV")
        line, last = line + text.count("\n"), text or last
        yield text.encode("utf-8", "surrogatepass")
    if last and not last.endswith("\n"):
        yield b"\n"


def _one_byte(path: Path) -> tuple[str, str]:
    """The encoding of text with one byte a character, as Python names it and in words."""
    # Lines that end in a carriage return alone are those of a classic Macintosh.
    if any(b"\r" in block for block in _blocks(path)) and not any(b"\n" in block for block in _blocks(path)):
        return "mac_roman", "Mac Roman, as its ends of lines are those of a Macintosh"
    try:
        for block in _blocks(path):
            block.decode("cp1252")
    except UnicodeDecodeError:
        return "latin-1", "Latin-1"
    return "cp1252", "Windows-1252 (cp1252)"


def _blocks(path: Path, ended: bool = False) -> Iterator[bytes]:
    """The bytes of a file; where that is asked for, an empty block at the end."""
    with path.open("rb") as file:
        while block := file.read(_BLOCK_BYTES):
            yield block
    if ended:
        yield b""


def _encoding(begin: bytes) -> str | None:
    """Encoding by the mark at the begin; UTF-16 without its mark has zero in every other byte of plain numbers."""
    marked = next((name for mark, name in _BEGINS.items() if begin.startswith(mark)), None)
    if marked is not None:
        return marked
    pairs = begin[:512]
    half = len(pairs) // 2
    for name, zeros, others in (("utf-16-le", pairs[1::2], pairs[::2]), ("utf-16-be", pairs[::2], pairs[1::2])):
        if half >= 2 and zeros.count(0) >= 0.9 * half and not others.count(0):
            return name
    return None
