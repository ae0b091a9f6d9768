"""The readers there are, and which one a file needs."""

from __future__ import annotations

from pathlib import Path

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.trials.readers.abf import AbfReader
from xb_muscle_ros.trials.readers.bag import BagReader
from xb_muscle_ros.trials.readers.base import Reader
from xb_muscle_ros.trials.readers.csv import CsvReader
from xb_muscle_ros.trials.readers.dat import DatReader
from xb_muscle_ros.trials.readers.ddf import DdfReader
from xb_muscle_ros.trials.readers.mat import MatReader
from xb_muscle_ros.trials.readers.slc import SlcReader
from xb_muscle_ros.trials.readers.sto import StoReader
from xb_muscle_ros.trials.readers.xlsx import XlsxReader

# In the order they are asked: text that is none of the others is a table.
_INSTRUMENTS = (MatReader(), SlcReader(), AbfReader(), DatReader(), DdfReader(), StoReader())
_ALL = (BagReader(), *_INSTRUMENTS, XlsxReader(), CsvReader())
READERS: dict[str, Reader] = {reader.name: reader for reader in _ALL}


def reader_for(path: Path, name: str | None = None) -> Reader:
    """The reader of a file or bag folder, by its format or else by what the file looks like.

    Raises:
        UserError: the file does not exist or cannot be opened, or is of no known format.
    """
    if not path.exists():
        raise UserError(f"{path} cannot be read: No such file or directory; give a recording")
    if name is not None:
        return READERS[name]
    if path.is_dir() and not READERS["bag"].matches(path):
        raise UserError(f"{path} is a folder without {', '.join(recording_suffixes())}; give recordings")
    try:
        found = next((reader for reader in READERS.values() if reader.matches(path)), None)
    except OSError as problem:
        raise UserError(f"{path} cannot be read: {problem.strerror}; give a recording") from problem
    if found is None:
        raise UserError(f"{path} is of no known format; known: {', '.join(READERS)}; name it with --format")
    return found


def recording_suffixes() -> tuple[str, ...]:
    """Endings of the files that are looked for in folders."""
    return tuple(suffix for reader in READERS.values() for suffix in reader.suffixes)


def is_recording(path: Path) -> bool:
    """Whether a file in a folder is to be read: by its ending, and its begin where others have the ending as well."""
    suffix = path.suffix.lower()
    try:
        return any(suffix in reader.suffixes and reader.matches(path) for reader in READERS.values())
    except OSError:
        return True  # it is named when its turn comes
