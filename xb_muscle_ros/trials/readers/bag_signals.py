"""What is in a bag: topics with their types, and the numbers of their messages as signals over time."""

from __future__ import annotations

import dataclasses
from array import array
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.trials import ros_types
from xb_muscle_ros.trials.bag_contents import AnyMessage, BagContents, all_decoded
from xb_muscle_ros.trials.readers.bag_opening import open_any
from xb_muscle_ros.trials.readers.contents import Content, Contents
from xb_muscle_ros.trials.stamps import not_after
from xb_muscle_ros.trials.trial import Array

# Arrays longer than this are images or scans, no signals.
_MOST_VALUES = 12
# Numbers of messages of these types are settings of nodes and no recording.
_NO_SIGNALS = ("rcl_interfaces/", "rosgraph_msgs/", "tf2_msgs/", "diagnostic_msgs/", "action_msgs/")
_ARRAYS = ("position", "velocity", "effort")
_MODEL_UNITS = {"effort": "N", "position": "m", "velocity": "m/s"}
# Topics whose meaning and unit docs/bags.md tells: field, unit, role.
_OWN = {
    ros_types.LENGTH: ("position", "m", "length"),
    ros_types.CALCIUM: ("position", "uM", "calcium"),
    ros_types.MEASURED_FORCE: ("effort", "N", "force"),
}
HEADER, LOG = "header", "log"


@dataclasses.dataclass
class _Series:
    """Stamps (ns; 0 without a header) and values of a field."""

    header_ns: array[int] = dataclasses.field(default_factory=lambda: array("q"))
    log_ns: array[int] = dataclasses.field(default_factory=lambda: array("q"))
    values: array[float] = dataclasses.field(default_factory=lambda: array("d"))


def bag_signals(path: Path) -> Contents:
    """Topics of a bag, and a signal for each number in their messages.

    Times are header stamps where all messages have them and they increase, else log times; 0 is the first of either.

    Raises:
        UserError: it cannot be read, or has no topic.
    """
    bag = open_any(path, list(open_any(path, ()).types))
    if not bag.types:
        raise UserError(f"bag {path} is empty: {'; '.join(bag.flaws) or 'it has no topic'}; record it again")
    series: dict[tuple[str, str], _Series] = {}
    notes = [f"bag {path}: {flaw}" for flaw in bag.flaws]
    for topic in bag.messages:
        if bag.types[topic].startswith(_NO_SIGNALS):
            continue
        try:
            for each in all_decoded(dataclasses.replace(bag, messages={topic: bag.messages[topic]})):
                _take(series, each)
        except UserError as problem:
            notes.append(str(problem))
    clocks = {key: _clock(one) for key, one in series.items()}
    stamps = {
        key: np.array(one.header_ns if clocks[key] == HEADER else one.log_ns, dtype=np.int64)
        for key, one in series.items()
    }
    first_ns = {
        clock: min((int(each[0]) for key, each in stamps.items() if clocks[key] == clock), default=0)
        for clock in (HEADER, LOG)
    }
    signals = [
        _content(bag, key, clocks[key], np.array(one.values), (stamps[key] - first_ns[clocks[key]]) / 1e9)
        for key, one in sorted(series.items())
    ]
    for topic, clock in sorted({(topic, clock) for (topic, _), clock in clocks.items()}):
        if clock == LOG and not bag.types[topic].startswith("std_msgs/"):  # those have no header at all
            notes.append(f"topic {topic}: header stamps are missing or step back; times are those of the recorder")
    form = f"{len(bag.types)} topics, {sum(map(len, bag.messages.values()))} messages"
    others = tuple(_topics(bag, {topic for topic, _ in series}))
    return Contents(form, tuple(signals), facts=bag.custom_data or {}, others=others, notes=tuple(notes))


def _clock(one: _Series) -> str:
    """Header stamps, where all messages have them and they increase."""
    stamps = np.array(one.header_ns, dtype=np.int64)
    unset = bool((stamps < 0).any()) or (stamps.size > 1 and not stamps.any())
    return LOG if unset or not_after(stamps).size else HEADER


def _take(series: dict[tuple[str, str], _Series], each: AnyMessage) -> None:
    header = getattr(each.message, "header", None)
    stamp = -1 if header is None else int(header.stamp.sec) * 10**9 + int(header.stamp.nanosec)
    for field, value in _numbers(each.message):
        one = series.setdefault((each.topic, field), _Series())
        one.header_ns.append(stamp)
        one.log_ns.append(each.log_time_ns)
        one.values.append(value)


def _numbers(message: Any) -> Iterator[tuple[str, float]]:
    """Paths to the numbers of a message; those of joints go by their names."""
    if getattr(message, "__msgtype__", "") == ros_types.JOINT_STATE:
        for name in _ARRAYS:
            for joint, value in zip(message.name, getattr(message, name), strict=False):
                yield f"{name}[{joint}]", float(value)
        return
    yield from _fields(message, "")


def _fields(value: Any, path: str) -> Iterator[tuple[str, float]]:
    if isinstance(value, (bool, str, bytes)):
        return
    if isinstance(value, (int, float, np.integer, np.floating)):
        yield path, float(value)
    elif isinstance(value, (list, tuple, np.ndarray)):
        if len(value) <= _MOST_VALUES:
            for i, each in enumerate(value):
                yield from _fields(each, f"{path}[{i}]")
    elif dataclasses.is_dataclass(value):
        for field in dataclasses.fields(value):
            if field.name not in ("header", "__msgtype__", "layout") and "covariance" not in field.name:
                yield from _fields(getattr(value, field.name), f"{path}.{field.name}".lstrip("."))


def _content(bag: BagContents, key: tuple[str, str], clock: str, values: Array, times_s: Array) -> Content:
    topic, field = key
    array_name, unit, role = _OWN.get(topic, ("", "", ""))
    if bag.types[topic] != ros_types.JOINT_STATE or not field.startswith(f"{array_name}["):
        unit = role = ""
    by_model = topic in (ros_types.FORCE, ros_types.MOMENTS) and bag.types[topic] == ros_types.JOINT_STATE
    if by_model:
        unit = _MODEL_UNITS[field.partition("[")[0]] if topic == ros_types.FORCE else "1"
    if "Wrench" in bag.types[topic] and "force." in field:
        unit = "N"
    return Content(
        topic,
        values,
        unit,
        field,
        role,
        "is made by a model" if by_model else "",
        times_s=times_s,
        of=bag.types[topic],
        clock=clock,
        at="message {}".format,
    )


def _topics(bag: BagContents, read: set[str]) -> Iterator[str]:
    """A line for each topic."""
    for topic, kind in sorted(bag.types.items()):
        count = len(bag.messages.get(topic, ()))
        more = "" if topic in read or not count else ", no numbers read"
        yield f"topic {topic}: {kind or 'of no known type'}, {count} message{'' if count == 1 else 's'}{more}"
