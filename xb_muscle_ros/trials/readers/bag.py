"""Trials from ROS 2 bags of others, MCAP or SQLite, by a mapping of topics and fields (see `fields`)."""

from __future__ import annotations

import re
from array import array
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from datetime import datetime, timezone
from pathlib import Path
from typing import Any

import numpy as np

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.trials import ros_types
from xb_muscle_ros.trials.bag_contents import BagContents, all_decoded
from xb_muscle_ros.trials.bag_files import METADATA, is_bag
from xb_muscle_ros.trials.mcap_records import MAGIC
from xb_muscle_ros.trials.readers.bag_opening import SQLITE, open_any, sqlite_parts
from xb_muscle_ros.trials.readers.bag_signals import bag_signals
from xb_muscle_ros.trials.readers.base import Pending, Reader, Recording, Signal
from xb_muscle_ros.trials.readers.columns import BAG
from xb_muscle_ros.trials.readers.contents import Contents
from xb_muscle_ros.trials.readers.description import Column, ImportMapping, filled
from xb_muscle_ros.trials.readers.fields import FieldPath
from xb_muscle_ros.trials.stamps import not_after, to_s
from xb_muscle_ros.trials.trial import Array


@dataclass
class _Series:
    """One signal: where its numbers are, and what was found.

    Attributes:
        column: topic, field and unit.
        path: to the field.
        stamps_ns, values: of the messages that have it.
        numbers: which message of the topic each is, from 0.
        joints: names seen in messages that are not of the joint.
        at_index: the joint an index picks, as the first message has it.
        skipped: messages that are not of the joint.
    """

    column: Column
    path: FieldPath
    stamps_ns: array[int] = field(default_factory=lambda: array("q"))
    values: array[float] = field(default_factory=lambda: array("d"))
    numbers: array[int] = field(default_factory=lambda: array("q"))
    joints: dict[str, None] = field(default_factory=dict)
    at_index: str | None = None
    skipped: int = 0


class BagReader(Reader):
    """One trial to a bag. Times begin at the first length message; other signals keep their own."""

    name = "bag"
    suffixes = (".mcap", ".db3")
    begins = (MAGIC, SQLITE)
    kind = BAG
    defaults: Mapping[str, Any] = {
        "fibre": "{file}",
        "columns": {
            "time": {"stamp": "header"},
            "length": {"topic": ros_types.LENGTH, "field": "position[0]", "unit": "m"},
        },
    }

    def matches(self, path: Path) -> bool:
        """Whether it is a bag's folder, or a file that begins or is called like a bag's."""
        if path.is_dir():
            return (path / METADATA).is_file() or is_bag(path) or bool(sqlite_parts(path))
        return super().matches(path)

    def trials(self, path: Path, mapping: ImportMapping) -> Iterator[Pending]:
        """The one trial of the bag."""
        yield Pending(filled(mapping.trial, path), lambda: _recording(path, mapping))

    def contents(self, path: Path) -> Contents:
        """Topics, and a signal for each number that their messages have."""
        return bag_signals(path)


def _recording(path: Path, mapping: ImportMapping) -> Recording:
    wanted = {key: column for key, column in mapping.columns.items() if key != "time"}
    bag, found = _read(path, wanted, mapping.time.name)
    first_ns = int(found["length"].stamps_ns[0])
    signals = {key: _signal(one, first_ns, key) for key, one in found.items()}
    length = signals["length"]
    assert length.times is not None  # every signal of a bag has its own
    time = Signal(f"{mapping.time.name} stamp of {mapping.length.name}", length.times, length.at)
    begin = datetime.fromtimestamp(first_ns / 1e9, tz=timezone.utc).isoformat(timespec="milliseconds")
    return Recording(
        f"bag {path}",
        filled(mapping.trial, path),
        {"time": time, **signals, "length": replace(length, times=None)},
        mapping.facts_of(path),
        (f"time 0 is stamp {first_ns} ns ({begin})",),
        (*_state(path, bag), *_left_out(path, found, signals)),
    )


def _state(path: Path, bag: BagContents) -> Iterator[str]:
    """What is wrong with the bag's files."""
    if bag.flaws:
        yield f"bag {path}: {'; '.join(bag.flaws)}; {sum(map(len, bag.messages.values()))} messages were read"
    number = re.fullmatch(r"(.+_)\d+", path.stem)
    if path.is_file() and number is not None:
        others = [f for f in path.parent.glob(f"{number.group(1)}*{path.suffix}") if f != path]
        if any(re.fullmatch(re.escape(number.group(1)) + r"\d+", other.stem) for other in others):
            yield f"bag {path} looks like one part of several; give the folder {path.parent} for all of them"


def _left_out(path: Path, found: Mapping[str, _Series], signals: Mapping[str, Signal]) -> Iterator[str]:
    """Messages that are not taken over."""
    told = set()
    for one in found.values():
        topic, joint = one.column.name, one.path.joint
        if one.skipped and (topic, joint) not in told:
            told.add((topic, joint))
            yield (
                f"bag {path}: {one.skipped} of {one.skipped + len(one.values)} messages on {topic} have no joint "
                f"'{joint}' and are skipped; they name {', '.join(one.joints) or 'none'}"
            )
    if "force" in found:
        late = len(found["force"].values) - signals["force"].values.size
        if late:
            yield (
                f"bag {path}: {late} messages on {found['force'].column.name} come before the first length; they are "
                "left out"
            )


def _signal(one: _Series, first_ns: int, key: str) -> Signal:
    """A topic from the first length on; what holds until it changes begins with what held then."""
    times = to_s(np.array(one.stamps_ns, dtype=np.int64) - first_ns)
    values: Array = np.array(one.values)
    first = int(np.searchsorted(times, 0.0))
    if key in ("calcium", "stimulation") and first and (first == times.size or times[first] > 0.0):
        first -= 1
        times[first] = 0.0
    numbers = one.numbers[first:]
    name = f"{one.column.name} {one.column.field}"
    return Signal(name, values[first:], lambda i: f"message {numbers[i]}", times[first:])


def _read(path: Path, wanted: Mapping[str, Column], stamp: str) -> tuple[BagContents, dict[str, _Series]]:
    """Stamps and values of the wanted signals; stamps increase."""
    found = {key: _Series(column, FieldPath(column.field, f"bag {path}")) for key, column in wanted.items()}
    topics = {column.name for column in wanted.values()}
    bag = open_any(path, topics)
    if not bag.types:
        raise UserError(f"bag {path} is empty: {'; '.join(bag.flaws) or 'it has no topic'}; record it again")
    for topic in sorted(topics):
        if topic not in bag.types:
            raise UserError(
                f"bag {path} has no topic {topic}; its topics: {', '.join(sorted(bag.types))}; name the topic in "
                "columns of the mapping"
            )
        if topic not in bag.messages:
            raise UserError(f"bag {path} has no message on {topic}{bag.flaws_text}; record the topic")
    numbers = dict.fromkeys(topics, 0)
    for topic, log_ns, message in all_decoded(bag):
        where = f"bag {path}, {topic}, message {numbers[topic]}"
        for one in found.values():
            if one.column.name == topic:
                _take(one, message, numbers[topic], log_ns if stamp == "log" else None, where)
        numbers[topic] += 1
    for one in found.values():
        _check(path, one, stamp)
    return bag, found


def _take(one: _Series, message: Any, i: int, log_ns: int | None, where: str) -> None:
    """Take a message over, or count it as one of another joint."""
    if not one.path.has_joint(message, where):
        one.skipped += 1
        one.joints.update(dict.fromkeys(map(str, message.name)))
        return
    joint = one.path.joint_at_index(message)
    if one.at_index is None:
        one.at_index = joint
    elif joint is not None and joint != one.at_index:
        raise UserError(
            f"{where}, {one.path.text} is of joint '{joint}', earlier ones of '{one.at_index}'; name the joint, for "
            f"example {one.path.text.partition('[')[0]}[{one.at_index}]"
        )
    one.values.append(one.path.value(message, where))
    one.stamps_ns.append(_header_ns(message, where) if log_ns is None else log_ns)
    one.numbers.append(i)


def _check(path: Path, one: _Series, stamp: str) -> None:
    """Make sure that there is something, in order of time: nothing may be looked up in times before."""
    where = f"bag {path}, {one.column.name}"
    if not one.values:
        raise UserError(
            f"{where}, {one.path.text}: there is no joint '{one.path.joint}' in any of {one.skipped} messages; joints "
            f"there: {', '.join(one.joints) or 'none'}"
        )
    stamps = np.array(one.stamps_ns, dtype=np.int64)
    back = not_after(stamps)
    if back.size:
        i = int(back[0])
        more = f" ({back.size} such in all)" if back.size > 1 else ""
        unset = stamp == "header" and not stamps.any()
        remedy = (
            "the sender leaves the stamps unset; use 'columns: {time: {stamp: log}}'"
            if unset
            else "time has to increase; record it anew, or cut the bag there"
        )
        raise UserError(
            f"{where}, message {one.numbers[i]}: its {stamp} stamp, {_shown(stamps[i])}, does not come after "
            f"{_shown(stamps[i - 1])} of message {one.numbers[i - 1]}{more}; {remedy}"
        )


def _shown(stamp_ns: np.int64) -> str:
    """A stamp in s, all of its digits."""
    return f"{int(stamp_ns) // 10**9}.{int(stamp_ns) % 10**9:09d} s"


def _header_ns(message: Any, where: str) -> int:
    try:
        stamp = message.header.stamp
        return int(stamp.sec) * 10**9 + int(stamp.nanosec)
    except AttributeError:
        raise UserError(f"{where} has no header; use 'columns: {{time: {{stamp: log}}}}'") from None
