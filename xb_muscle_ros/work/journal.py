"""A file that keeps finished results: JSON lines, only ever appended to, whole again after any kill."""

from __future__ import annotations

import fcntl
import json
import os
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Any

from xb_muscle_ros.errors import UserError

_HEADER = b'{"format":"xb_muscle_ros journal","version":1}\n'
_FORMAT = b'{"format":"xb_muscle_ros journal",'


class Journal(AbstractContextManager["Journal"]):
    """Results by key, in a file; open in one process at a time.

    The first line names format and version; every other line is ``{"key": ..., "value": ...}``. A last line that was
    cut short is dropped, and any other line that is no record is passed over. Floats come back bit for bit. Results
    stay in the file: memory holds their keys alone.
    """

    def __init__(self, path: Path) -> None:
        """Open the journal, or make it.

        Raises:
            UserError: the file cannot be opened, is in use by another run, or is no journal (it is left untouched).
        """
        self.path = path
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            self._file = os.fdopen(os.open(path, os.O_RDWR | os.O_CREAT | os.O_APPEND, 0o666), "r+b", buffering=0)
        except OSError as error:
            raise UserError(f"journal {path} cannot be opened: {error.strerror}; choose another file") from error
        try:
            self._lock()
            self._offsets = self._read()
        except BaseException:
            self._file.close()
            raise

    def __contains__(self, key: str) -> bool:
        return key in self._offsets

    def __getitem__(self, key: str) -> Any:
        """The result kept under a key."""
        self._file.seek(self._offsets[key])
        return json.loads(self._file.readline())["value"]

    def add(self, key: str, value: str) -> None:
        """Keep a result, given as JSON.

        Raises:
            UserError: it cannot be written.
        """
        line = f'{{"key":"{key}","value":{value}}}\n'.encode()
        try:
            start = self._file.seek(0, os.SEEK_END)
            # One call for one line, so that an interrupt falls before it or after it.
            written = self._file.write(line)
        except OSError as error:
            raise UserError(f"journal {self.path} cannot be written: {error.strerror}; make room") from error
        if written != len(line):
            raise UserError(f"journal {self.path} cannot be written: no space left; make room and start again")
        self._offsets[key] = start

    def close(self) -> None:
        """Close the file; another run may then open it."""
        self._file.close()

    def __exit__(self, *_: object) -> None:
        self.close()

    def _lock(self) -> None:
        try:
            fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError as error:
            raise UserError(
                f"journal {self.path} is in use by another run; wait for its end or choose another file"
            ) from error
        except OSError:
            # Some network file systems have no locks; to write from one run at a time is then left to the user.
            pass

    def _read(self) -> dict[str, int]:
        """Where each record starts; cuts off what a killed writer left unfinished."""
        first = self._file.readline(len(_HEADER))
        if first != _HEADER:
            # A writer killed at its first line leaves the beginning of it, or nothing.
            if not _HEADER.startswith(first):
                raise UserError(self._refusal(first))
            os.ftruncate(self._file.fileno(), 0)
            self._file.write(_HEADER)
        offsets: dict[str, int] = {}
        end = len(_HEADER)
        with open(self._file.fileno(), "rb", closefd=False) as lines:
            lines.seek(end)
            for line in lines:
                if not line.endswith(b"\n"):
                    os.ftruncate(self._file.fileno(), end)
                    break
                key = _key_of(line)
                if key is not None:
                    offsets[key] = end
                end += len(line)
        return offsets

    def _refusal(self, first: bytes) -> str:
        if first.startswith(_FORMAT):
            return f"journal {self.path} is of another version of xb_muscle_ros; choose another file"
        return f"{self.path} is not a journal; it was left as it is, choose another file for the journal"


def _key_of(line: bytes) -> str | None:
    """The key of a record; None where the line is none."""
    try:
        record = json.loads(line)
    except ValueError:
        return None
    if not isinstance(record, dict) or not {"key", "value"} <= record.keys() or not isinstance(record["key"], str):
        return None
    return record["key"]
