"""Where bags lie: finding them, and telling a bag folder from any other."""

from __future__ import annotations

import os
import re
import shutil
from collections.abc import Iterable
from pathlib import Path

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.trials.mcap_records import read_recording

METADATA = "metadata.yaml"
# Parts of one recording lie no further apart than this, ns; a recording of its own does not begin so soon.
SPLIT_GAP_NS = 1_000_000_000


def find_bags(paths: Iterable[str | Path]) -> list[Path]:
    """Bags named by the user.

    Args:
        paths: each a bag folder, an ``.mcap`` file, or a folder of bags (looked at one level deep, sorted by name).

    Returns:
        Bag folders and ``.mcap`` files in the order given, each once.

    Raises:
        UserError: a path does not exist or holds no bag.
    """
    found: dict[Path, Path] = {}
    for path in map(Path, paths):
        for bag in _bags_at(path):
            found.setdefault(bag.resolve(), bag)
    return list(found.values())


def mcap_files(folder: Path) -> list[Path]:
    """The ``.mcap`` files of a folder in the order they were recorded: by the number rosbag2 gives them."""

    def number(file: Path) -> tuple[int, str]:
        match = re.search(r"_(\d+)$", file.stem)
        return (int(match.group(1)) if match else 0, file.name)

    return sorted((f for f in folder.glob("*.mcap") if f.is_file()), key=number)


def check_replaceable(path: Path) -> None:
    """Make sure that writing a bag to ``path`` destroys nothing but an older bag.

    Raises:
        UserError: the path is a file, or a folder with anything in it that does not belong to a bag.
    """
    if not path.name or path.name == "..":
        raise UserError(f"bag {path} has no name of its own; give the folder to make")
    if not path.exists() and not path.is_symlink():
        return
    if not path.is_dir() or path.is_symlink():
        raise UserError(f"bag {path} cannot be written: something that is no bag folder has this name; choose another")
    foreign = sorted(f.name for f in path.iterdir() if f.name != METADATA and f.suffix != ".mcap")
    if foreign:
        raise UserError(
            f"bag {path} cannot be written: it holds '{foreign[0]}', which belongs to no bag; choose another name"
        )


def plain(text: str) -> str:
    """A text in characters every file system and shell takes: letters, digits, ``_``, ``-`` and ``.``."""
    return re.sub(r"[^A-Za-z0-9_.-]+", "_", text)


def remove_results(found: Iterable[Path]) -> None:
    """Remove files and bags of an older run; a folder that is not a bag alone stays, and so does what is in it.

    Raises:
        UserError: one of them cannot be removed.
    """
    for path in found:
        try:
            if path.is_dir() and not path.is_symlink():
                if all(file.name == METADATA or file.suffix == ".mcap" for file in path.iterdir()):
                    shutil.rmtree(path)
            else:
                path.unlink(missing_ok=True)
        except OSError as problem:
            raise UserError(f"{path} of an older run cannot be removed: {problem.strerror}; remove it") from problem


def clear_leftovers(folder: Path) -> None:
    """Undo what a killed run left half done in a folder of bags: parts of a bag go, an older bag comes back."""
    for left in list(folder.glob(".*.tmp")) + list(folder.glob(".*.old")):
        match = re.fullmatch(r"\.(.+)\.(\d+)\.(tmp|old)", left.name)
        if match is None or not left.is_dir() or _runs(int(match.group(2))):
            continue
        bag = folder / match.group(1)
        if match.group(3) == "old" and not bag.exists():
            left.rename(bag)
        else:
            shutil.rmtree(left, ignore_errors=True)


def _runs(process: int) -> bool:
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    except OSError:  # it is another user's
        return True
    return True


def is_bag(path: Path) -> bool:
    """Whether a folder is one bag.

    It is with metadata. Without, its ``.mcap`` files are one bag where there is one alone, where all carry the folder's
    name, or where they carry one name with the numbers 0, 1, 2, ... that rosbag2 gives the parts of a bag and each
    begins just after the one before. A folder that holds bag folders is none.
    """
    if not path.is_dir():
        return False
    if (path / METADATA).is_file():
        return True
    files = mcap_files(path)
    if not files or any(is_bag(inside) for inside in path.iterdir() if inside.is_dir()):
        return False
    if len(files) == 1 or all(re.fullmatch(re.escape(path.name) + r"(_\d+)?", file.stem) for file in files):
        return True
    stems = {file.stem.rpartition("_")[0] for file in files}
    numbered = [file.stem.rpartition("_")[2] for file in files] == [str(i) for i in range(len(files))]
    return len(stems) == 1 and numbered and _follow_each_other(files)


def _follow_each_other(files: list[Path]) -> bool:
    """Whether files look like the parts of one recording: each begins after the one before, and soon."""
    end_ns: int | None = None
    for file in files:
        try:
            logged = [messages.log_times() for messages in read_recording(file).messages.values()]
        except (OSError, ValueError):
            return False
        if not logged:
            continue
        if end_ns is not None and not 0 <= min(int(times.min()) for times in logged) - end_ns <= SPLIT_GAP_NS:
            return False
        end_ns = max(int(times.max()) for times in logged)
    return True


def _bags_at(path: Path) -> list[Path]:
    if not path.exists():
        raise UserError(f"bag {path} does not exist; give a bag folder, an .mcap file or a folder of bags")
    if path.is_file():
        if path.suffix != ".mcap":
            raise UserError(f"{path} is no bag; allowed are bag folders, .mcap files and folders of bags")
        return [path]
    if is_bag(path):
        return [path]
    inside = sorted(p for p in path.iterdir() if not p.name.startswith("."))
    bags = [p for p in inside if is_bag(p) or (p.is_file() and p.suffix == ".mcap")]
    if not bags:
        raise UserError(
            f"{path} holds no bag; needed is a folder with {METADATA} or an .mcap file, or a folder of such"
        )
    return bags
