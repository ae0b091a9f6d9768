"""Recordings become bags, one trial at a time; what a run did not finish, the next one goes on with."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import NamedTuple

import yaml

from xb_muscle_ros import fast_yaml
from xb_muscle_ros.errors import UserError
from xb_muscle_ros.trials.bag_files import METADATA, clear_leftovers, mcap_files, plain
from xb_muscle_ros.trials.bags import write_trial
from xb_muscle_ros.trials.mcap_records import MAGIC
from xb_muscle_ros.trials.readers.assembly import trial_of
from xb_muscle_ros.trials.readers.base import Pending
from xb_muscle_ros.trials.readers.description import filled
from xb_muscle_ros.trials.readers.registry import READERS, is_recording, recording_suffixes
from xb_muscle_ros.trials.readers.settings import ImportSettings, MappingError, Prepared
from xb_muscle_ros.trials.trial import Trial

SOURCE = "import_source"
SETTINGS = "import_settings"
_BLOCK_BYTES = 1 << 20
# Phases in the line on a trial.
_PHASES_TOLD = 16


class Imported(NamedTuple):
    """A bag was written."""

    bag: Path
    trial: Trial


class Kept(NamedTuple):
    """A bag of the same file and the same mapping is there already."""

    bag: Path


class Failed(NamedTuple):
    """A file, or a trial in it, was not imported; why, on one line."""

    why: str


class FileDone(NamedTuple):
    """All there is to do with a file is done."""

    path: Path


Event = Imported | Kept | Failed | FileDone


def find_recordings(paths: Iterable[Path], out: Path | None = None) -> list[Path]:
    """Files and bag folders to import: those given, and in folders, at any depth, those that are called like one.

    Args:
        out: folder of the bags that are made; what is in it is no recording.

    Raises:
        UserError: a folder holds none.
    """
    found: list[Path] = []
    for path in paths:
        if not path.is_dir() or _is_plain_bag(path):
            found.append(path)
            continue
        inside = list(_recordings_in(path, None if out is None else out.resolve()))
        if not inside:
            raise UserError(f"{path} holds no recording; looked for: bags, {', '.join(recording_suffixes())}")
        found += inside
    return found


def import_recordings(
    paths: Iterable[Path], settings: ImportSettings, out: Path, overwrite: bool = False
) -> Iterator[Event]:
    """Import files one by one. Of the files that are done, nothing is kept but names.

    Args:
        overwrite: replace bags that exist and were made of something else.

    Raises:
        MappingError: the mapping is wrong.
    """
    if out.is_dir():
        clear_leftovers(out)
    run = _Run(settings, out, overwrite, {})
    for path in paths:
        yield from _import_file(path, run)
        yield FileDone(path)


def line_of(trial: Trial) -> str:
    """One line on an imported trial."""
    facts = trial.facts
    parts = [
        f"{trial.time_s.size} samples",
        f"{trial.time_s[-1] - trial.time_s[0]:.3f} s",
        "pCa changes" if facts.pca is None else f"pCa {facts.pca:g}",
        f"L0 {facts.reference_length_m:.6g} m",
    ]
    if facts.amplitude_l0 is not None:
        parts.append(f"amplitude {100.0 * facts.amplitude_l0:g} % L0")
    if facts.recovery_s is not None:
        parts.append(f"recovery {facts.recovery_s:g} s")
    if trial.force_n.size:
        parts.append(f"force {trial.force_n.min() / facts.f0_n:.3f} to {trial.force_n.max() / facts.f0_n:.3f} F0")
    phases = [f"{phase.name}@{phase.start_s:.4f}" for phase in facts.phases[:_PHASES_TOLD]]
    if len(facts.phases) > len(phases):
        phases.append(f"and {len(facts.phases) - len(phases)} more phases")
    parts.append(" ".join(phases))
    return ", ".join(parts)


def bag_name(data_set: str, trial: str) -> str:
    """Name of a trial's bag: ``<data set>_<trial>``, in characters every file system and shell takes.

    A trial whose name is the data set's, or begins with it and ``_``, does not get it twice.
    """
    first, name = plain(data_set), plain(trial)
    whole = name if name == first or name.startswith(f"{first}_") else f"{first}_{name}"
    return whole.lstrip(".-")


class _Run(NamedTuple):
    """What holds for all files, and the file of each bag that is done, by their names."""

    settings: ImportSettings
    out: Path
    overwrite: bool
    done: dict[str, str]


def _import_file(path: Path, run: _Run) -> Iterator[Event]:
    try:
        prepared = run.settings.prepare(path)
        origin = provenance_of(path, prepared.digest)
        any_trial = False
        for pending in prepared.reader.trials(path, prepared.mapping):
            any_trial = True
            yield _import_trial(pending, prepared, origin, run)
        if not any_trial:
            yield Failed(f"{path} holds no measured trial; give another file")
    except MappingError:
        raise
    except UserError as problem:
        yield Failed(str(problem))
    except OSError as problem:
        yield Failed(f"{path} cannot be read: {problem.strerror or problem}; look at its permissions")


def _import_trial(pending: Pending, prepared: Prepared, origin: Provenance, run: _Run) -> Event:
    bag = run.out / bag_name(filled(prepared.mapping.data_set, prepared.path), pending.trial)
    here = f"{prepared.path}, trial {pending.trial}"
    if bag.name in run.done:
        other = run.done[bag.name]
        return Failed(f"{here}, and {other} would both become {bag}; import one of them into another folder")
    if bag.exists():
        recorded = recorded_provenance(bag)
        if recorded == origin:
            run.done[bag.name] = str(prepared.path)
            return Kept(bag)
        if not run.overwrite:
            return Failed(
                f"bag {bag} exists{_other(recorded, origin)}; use --overwrite to replace it or --out for another folder"
            )
    try:
        trial = trial_of(pending.read(), prepared.mapping, prepared.path, run.settings.isometric_scaling)
        write_trial(bag, trial, more=origin.custom_data())
    except UserError as problem:
        return Failed(str(problem))
    run.done[bag.name] = str(prepared.path)
    return Imported(bag, trial)


def _other(recorded: Provenance | None, origin: Provenance) -> str:
    """What a bag was made of that is not what it would be made of now."""
    if recorded is None:
        return ""
    if recorded.source == origin.source:
        return ", made of the same file with another mapping"
    name = recorded.source.rpartition(" ")[0]
    same = name == origin.source.rpartition(" ")[0]
    return f", made of {'another content of ' if same else ''}{name}"


def _is_plain_bag(folder: Path) -> bool:
    """Whether a folder is a bag and nothing else: without metadata, other recordings may lie beside a bag's files."""
    if not READERS["bag"].matches(folder):
        return False
    if (folder / METADATA).is_file():
        return True
    kinds = {path.suffix.lower() for path in folder.iterdir()} & set(recording_suffixes())
    return kinds in ({".mcap"}, {".db3"})


def _recordings_in(folder: Path, out: Path | None) -> Iterator[Path]:
    """Recordings of a folder; a split bag whose files lie beside other recordings is the folder itself."""
    split = READERS["bag"].matches(folder) and len(mcap_files(folder)) > 1
    if split:
        yield folder
    for path in sorted(folder.iterdir()):
        if split and path.suffix.lower() == ".mcap":
            continue
        if path.name.startswith(".") or path.resolve() == out:
            continue
        if path.is_dir():
            if not _is_plain_bag(path):
                yield from _recordings_in(path, out)
            elif folder.resolve() != out:
                yield path
        elif is_recording(path):
            yield path


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
    for file in _files_of(path):
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


def _files_of(path: Path) -> Iterator[Path]:
    if path.is_dir():
        yield from (file for file in sorted(path.iterdir()) if file.is_file())
    else:
        yield path
