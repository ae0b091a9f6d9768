"""Trials from ROS 2 bags of others, MCAP or SQLite, by a mapping of topics and fields.

A field is a path into the message such as ``position[0]``, ``wrench.force.z`` or ``data``; a name in brackets picks
the joint of that name in a JointState (``position[knee]``).
"""

from __future__ import annotations

import re
from array import array
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace
from datetime import datetime, timezone
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.trials import ros_types
from xb_muscle_ros.trials.bag_contents import open_bag
from xb_muscle_ros.trials.bag_files import METADATA, is_bag
from xb_muscle_ros.trials.bag_messages import AnyMessage, decoded
from xb_muscle_ros.trials.mcap_records import MAGIC
from xb_muscle_ros.trials.readers.base import Pending
from xb_muscle_ros.trials.readers.columns import BAG
from xb_muscle_ros.trials.readers.description import Column, ImportMapping
from xb_muscle_ros.trials.readers.recording import Recording, Signal
from xb_muscle_ros.trials.trial import Array

_MAGIC = {b"\x89MCAP0\r\n": ".mcap", b"SQLite format 3\x00": ".db3"}
_STEP = re.compile(r"([A-Za-z_]\w*)((?:\[[^\[\]]+\])*)")


class _Joint(str):
    """Name of a joint in the path to a field."""


class _Series(NamedTuple):
    stamps_ns: npt.NDArray[np.int64]
    values: Array


class BagReader:
    """One trial to a bag. Times begin at the first length message; other signals keep their own."""

    name = "bag"
    suffixes: tuple[str, ...] = (".mcap", ".db3")
    kind = BAG
    defaults: Mapping[str, Any] = {
        "fibre": "{file}",
        "columns": {
            "time": {"stamp": "header"},
            "length": {"topic": ros_types.LENGTH, "field": "position[0]", "unit": "m"},
        },
    }

    def matches(self, path: Path) -> bool:
        """Whether it is a folder that is a bag and holds nothing else, or a file that begins or is called like one."""
        if path.is_dir():
            return is_bag(path) and ((path / METADATA).is_file() or all(_is_mcap(file) for file in path.iterdir()))
        if path.suffix.lower() in self.suffixes:
            return True
        if not path.is_file():
            return False
        with path.open("rb") as file:
            begin = file.read(16)
        return any(begin.startswith(magic) for magic in _MAGIC)

    def trials(self, path: Path, mapping: ImportMapping) -> Iterator[Pending]:
        """The one trial of the bag."""
        yield Pending(mapping.trial_of(path), lambda: _recording(path, mapping))

    def pca(self, path: Path, mapping: ImportMapping) -> float | None:
        """As the bag's name or the mapping tells."""
        return mapping.facts_of(path)["pca"]


def _recording(path: Path, mapping: ImportMapping) -> Recording:
    columns = {
        "length": mapping.length,
        "force": mapping.force,
        "calcium": mapping.calcium,
        "stimulation": None if mapping.stimulation is None else mapping.stimulation.column,
    }
    wanted = {key: column for key, column in columns.items() if column is not None}
    series, flaws = _read(path, wanted, mapping.time.name)
    first_ns = int(series["length"].stamps_ns[0])
    signals = {key: _signal(wanted[key], one, first_ns, key) for key, one in series.items()}
    length = signals["length"]
    assert length.times is not None  # every signal of a bag has its own
    late = {key: one.values.size - signals[key].values.size for key, one in series.items()}
    warnings = flaws
    if late.get("force"):
        warnings += (
            f"bag {path}: {late['force']} messages on {wanted['force'].name} come before the first length; "
            "they are left out",
        )
    begin = datetime.fromtimestamp(first_ns / 1e9, tz=timezone.utc).isoformat(timespec="milliseconds")
    return Recording(
        where=f"bag {path}",
        trial=mapping.trial_of(path),
        time=Signal(f"{mapping.time.name} stamp of {mapping.length.name}", length.times, length.at),
        length=replace(length, times=None),
        force=signals.get("force"),
        calcium=signals.get("calcium"),
        stimulation=signals.get("stimulation"),
        facts=mapping.facts_of(path),
        notes=(f"time 0 is stamp {first_ns} ns ({begin})",),
        warnings=warnings,
    )


def _signal(column: Column, one: _Series, first_ns: int, key: str) -> Signal:
    """A topic from the first length on; what holds until it changes begins with what held then."""
    times = (one.stamps_ns - first_ns) / np.float64(1e9)
    first = int(np.searchsorted(times, 0.0))
    if key in ("calcium", "stimulation") and first and (first == times.size or times[first] > 0.0):
        first -= 1
        times[first] = 0.0
    at = partial(_message, first)
    return Signal(f"{column.name} {column.field}", one.values[first:], at, times[first:])


def _message(first: int, i: int) -> str:
    return f"message {first + i}"


def _read(path: Path, wanted: dict[str, Column], stamp: str) -> tuple[dict[str, _Series], tuple[str, ...]]:
    """Stamps and values of the wanted signals, messages one by one, and what is wrong with the bag."""
    steps = {key: _steps(column, path) for key, column in wanted.items()}
    stamps = {key: array("q") for key in wanted}
    values = {key: array("d") for key in wanted}
    messages, flaws = _messages(path, list(wanted.values()))
    for topic, log_ns, message in messages:
        for key, column in wanted.items():
            if column.name == topic:
                where = f"bag {path}, {column.name}, message {len(values[key])}"
                stamps[key].append(log_ns if stamp == "log" else _header_ns(message, where))
                values[key].append(_value(message, steps[key], f"{where}, {column.field}"))
    for key, column in wanted.items():
        if not values[key]:
            raise UserError(f"bag {path} has no message on {column.name}; record the topic")
    return {key: _Series(np.array(stamps[key], dtype=np.int64), np.array(values[key])) for key in wanted}, flaws


def _messages(path: Path, wanted: list[Column]) -> tuple[Iterator[AnyMessage], tuple[str, ...]]:
    """Messages of the wanted topics, and what is wrong with the bag and was lived with."""
    topics = {column.name for column in wanted}
    if (path.is_file() and not _is_mcap(path)) or (path.is_dir() and not any(map(_is_mcap, path.iterdir()))):
        return _by_library(path, wanted), ()
    bag = open_bag(path, topics)
    _check_topics(path, wanted, bag.types)
    flaws = (f"bag {path}: {'; '.join(bag.flaws)}; what is whole was read",) if bag.flaws else ()
    return decoded(bag), flaws


def _by_library(path: Path, wanted: list[Column]) -> Iterator[AnyMessage]:
    """Messages of a bag that is stored as SQLite."""
    from rosbags.highlevel import AnyReader

    try:
        with AnyReader([path], default_typestore=ros_types.typestore()) as reader:
            _check_topics(path, wanted, [connection.topic for connection in reader.connections])
            topics = {column.name for column in wanted}
            used = [connection for connection in reader.connections if connection.topic in topics]
            for connection, log_ns, data in reader.messages(connections=used):
                yield AnyMessage(connection.topic, log_ns, reader.deserialize(data, connection.msgtype))
    except UserError:
        raise
    except Exception as problem:  # the library passes on what its parsers trip over
        raise UserError(f"bag {path} cannot be read: {problem}; record or convert it again") from problem


def _check_topics(path: Path, wanted: list[Column], topics: Iterable[str]) -> None:
    for column in wanted:
        if column.name not in topics:
            raise UserError(
                f"bag {path} has no topic {column.name}; its topics: {', '.join(sorted(topics))}; name the "
                "topic in columns of the mapping"
            )


def _is_mcap(path: Path) -> bool:
    if not path.is_file():
        return False
    with path.open("rb") as file:
        return file.read(len(MAGIC)) == MAGIC


def _header_ns(message: Any, where: str) -> int:
    try:
        stamp = message.header.stamp
        return int(stamp.sec) * 10**9 + int(stamp.nanosec)
    except AttributeError:
        raise UserError(f"{where} has no header; use 'columns: {{time: {{stamp: log}}}}'") from None


def _steps(column: Column, path: Path) -> list[str | int]:
    """The attributes, indices and joint names that lead to a field."""
    steps: list[str | int] = []
    for part in column.field.split("."):
        match = _STEP.fullmatch(part)
        if match is None:
            raise UserError(f"bag {path}: field '{column.field}' is no path such as position[0] or wrench.force.z")
        steps.append(match.group(1))
        for index in re.findall(r"\[([^\[\]]+)\]", match.group(2)):
            steps.append(int(index) if index.isdecimal() else _Joint(index))
    return steps


def _value(message: Any, steps: list[str | int], where: str) -> float:
    found = message
    for step in steps:
        try:
            if isinstance(step, int):
                found = found[step]
            elif isinstance(step, _Joint):
                found = found[list(message.name).index(step)]
            else:
                found = getattr(found, step)
        except AttributeError:
            fields = [name for name in vars(found) if not name.startswith("_")] if hasattr(found, "__dict__") else []
            raise UserError(f"{where}: there is no {step}; fields: {', '.join(fields) or 'none'}") from None
        except (IndexError, ValueError, TypeError):
            wanted = f"joint '{step}'" if isinstance(step, _Joint) else f"value {step}"
            raise UserError(f"{where}: there is no {wanted}") from None
    try:
        return float(found)
    except (TypeError, ValueError):
        raise UserError(
            f"{where} is a {type(found).__name__}; needed is a number; name an index or a field of it"
        ) from None
