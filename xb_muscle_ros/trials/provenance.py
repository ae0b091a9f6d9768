"""What an imported bag was made of, so that an import that is started again leaves alone what is done."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import yaml

from xb_muscle_ros.trials import fast_yaml
from xb_muscle_ros.trials.bag_files import METADATA
from xb_muscle_ros.trials.mcap_records import MAGIC

SOURCE = "import_source"
SETTINGS = "import_settings"
_BLOCK_BYTES = 1 << 20


class Provenance(NamedTuple):
    """Where a bag comes from: name and digest of the file's content, and a digest of how it was read."""

    source: str
    settings: str

    def custom_data(self) -> dict[str, str]:
        """As a bag keeps it."""
        return {SOURCE: self.source, SETTINGS: self.settings}


def provenance_of(path: Path, settings: str) -> Provenance:
    """Provenance of what is made of a file or a bag folder.

    Raises:
        OSError: it cannot be read.
    """
    digest = hashlib.sha256()
    for file in _files(path):
        digest.update(f"{file.name}\n".encode())
        with file.open("rb") as opened:
            while block := opened.read(_BLOCK_BYTES):
                digest.update(block)
    return Provenance(f"{path.name} sha256:{digest.hexdigest()}", settings)


def recorded_provenance(bag: Path) -> Provenance | None:
    """What a bag was imported from; None where it is not complete or was not imported."""
    try:
        tree = fast_yaml.load_text((bag / METADATA).read_bytes())
        information = tree["rosbag2_bagfile_information"]
        custom = information["custom_data"]
        found = Provenance(custom[SOURCE], custom[SETTINGS])
        files = [bag / Path(name).name for name in information["relative_file_paths"]]
        complete = bool(files) and all(_ends_well(file) for file in files)
    except (OSError, yaml.YAMLError, UnicodeDecodeError, KeyError, TypeError):
        return None
    return found if complete else None


def _ends_well(file: Path) -> bool:
    """Whether an MCAP file has its end: the writer puts it there last."""
    with file.open("rb") as opened:
        size = opened.seek(0, os.SEEK_END)
        opened.seek(max(size - len(MAGIC), 0))
        return opened.read() == MAGIC


def _files(path: Path) -> Iterator[Path]:
    if path.is_dir():
        yield from (file for file in sorted(path.iterdir()) if file.is_file())
    else:
        yield path
