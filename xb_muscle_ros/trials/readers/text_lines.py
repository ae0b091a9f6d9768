"""Lines of a text, cut out of it when they are asked for: a list of them takes three times the memory of the text."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import Any, overload

import numpy as np
import numpy.typing as npt

from xb_muscle_ros.trials.spool import Spool, release

Places = npt.NDArray[np.signedinteger[Any]]

_END = b"\n"
# Bytes, or lines, that are looked at in one go.
_BLOCK = 1 << 18
_SEARCHED = 1 << 24
_LAST_BLANK, _LAST_ASCII = 32, 127


class TextLines(Sequence[str]):
    """Some lines of a text, without their ends.

    Attributes:
        numbers: of each line in the text, from 1; shape (lines,).
    """

    def __init__(self, utf8: bytes | Spool, begins: Places, numbers: Places) -> None:
        """Take a text as UTF-8 whose lines all end in a line feed, and the places of lines' first bytes in it."""
        self._utf8, self._begins, self.numbers = utf8, begins, numbers

    def __len__(self) -> int:
        """How many there are."""
        return int(self._begins.size)

    @overload
    def __getitem__(self, key: int) -> str: ...
    @overload
    def __getitem__(self, key: slice) -> TextLines: ...
    def __getitem__(self, key: int | slice) -> str | TextLines:
        """A line, or some of them."""
        if isinstance(key, slice):
            return TextLines(self._utf8, self._begins[key], self.numbers[key])
        begin = int(self._begins[key])
        return _decoded(self._utf8[begin : self._utf8.find(_END, begin)])

    def __iter__(self) -> Iterator[str]:
        """One line after another."""
        utf8, find = self._utf8, self._utf8.find
        for first in range(0, len(self), _BLOCK):
            release(utf8)
            for begin in self._begins[first : first + _BLOCK].tolist():
                yield _decoded(utf8[begin : find(_END, begin)])

    def __contains__(self, line: object) -> bool:
        """Whether one of the lines is this; most often the text as a whole shows that none is."""
        if not isinstance(line, str) or not len(self):
            return False
        whole, first = line.encode() + _END, int(self._begins[0])
        begins_so = self._utf8[first : first + len(whole)] == whole
        return (begins_so or self._may_hold(_END + whole, max(first - 1, 0))) and any(each == line for each in self)

    def _may_hold(self, sought: bytes, first: int) -> bool:
        for begin in range(first, len(self._utf8), _SEARCHED):
            if self._utf8.find(sought, begin, begin + _SEARCHED + len(sought)) >= 0:
                return True
            release(self._utf8)
        return False

    def take(self, places: Places) -> TextLines:
        """The lines at some places."""
        return TextLines(self._utf8, self._begins[places], self.numbers[places])

    def with_line(self, place: int, line: TextLines, skipped: int) -> TextLines:
        """The same with a line of the same text put before the one at a place, without its first bytes."""
        begins = np.insert(self._begins, place, line._begins[0] + skipped)
        return TextLines(self._utf8, begins, np.insert(self.numbers, place, line.numbers[0]))


def lines_of(utf8: bytes | Spool, is_comment: Callable[[str], bool]) -> tuple[TextLines, TextLines]:
    """Lines of a text that hold something: those that are no comments, and comments.

    Args:
        utf8: text whose lines all end in a line feed.
        is_comment: asked of lines that begin with # alone.
    """
    begins, doubtful = _begins(utf8)
    everything = TextLines(utf8, begins, np.arange(1, begins.size + 1, dtype=begins.dtype))
    kept, commented = np.ones(begins.size, bool), []
    for place in doubtful.tolist():
        line = everything[place]
        if line.startswith("#") and is_comment(line):
            commented.append(place)
            kept[place] = False
        elif not line or line.isspace():
            kept[place] = False
    comments = everything.take(np.array(commented, np.int64))
    return (everything if kept.all() else everything.take(np.flatnonzero(kept))), comments


def _begins(utf8: bytes | Spool) -> tuple[Places, Places]:
    """First bytes of lines, and which of the lines may be empty or begin with #."""
    # Half the memory where the places fit.
    kind: type[np.signedinteger[Any]] = np.int32 if len(utf8) < np.iinfo(np.int32).max else np.int64
    begins, doubtful, first, lines = [np.empty(0, kind)], [np.empty(0, np.int64)], 0, 0
    while first < len(utf8):
        # A block ends where a line does.
        end = utf8.rfind(_END, first, first + _BLOCK) + 1 or utf8.find(_END, first) + 1
        codes = np.frombuffer(utf8[first:end], np.uint8)
        here = np.concatenate(([0], np.flatnonzero(codes == _END[0])[:-1] + 1))
        # Beyond ASCII there are blanks, too.
        visible = np.logical_or.reduceat((codes > _LAST_BLANK) & (codes <= _LAST_ASCII), here)
        odd = ~visible | (codes[here] == ord("#"))
        begins.append((here + first).astype(kind))
        doubtful.append(np.flatnonzero(odd) + lines)
        first, lines = end, lines + here.size
        release(utf8)
    return np.concatenate(begins), np.concatenate(doubtful)


def _decoded(line: bytes) -> str:
    return line.decode("utf-8", "surrogatepass")
