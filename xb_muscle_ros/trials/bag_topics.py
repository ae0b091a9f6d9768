"""JointState topics of an opened bag: stamps, the fibres they name, and the samples of one fibre."""

from __future__ import annotations

import struct
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from rosbags.serde import SerdeError

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.trials import ros_types
from xb_muscle_ros.trials.bag_contents import BagContents
from xb_muscle_ros.trials.mcap_records import Message
from xb_muscle_ros.trials.ros_types import JointState
from xb_muscle_ros.trials.stamps import Stamps, not_after, to_s
from xb_muscle_ros.trials.trial import Array


class Samples(NamedTuple):
    """Samples of one fibre.

    Attributes:
        time_s: shape (n,), strictly increasing header stamps, s.
        values: shape (n, fields).
        name: under which the topic has them.
        warnings: a line for each thing that was lived with.
        skipped: how many messages of the topic are without the name; empty for none.
    """

    time_s: Array
    values: Array
    name: str
    warnings: tuple[str, ...] = ()
    skipped: str = ""


class Decoded(NamedTuple):
    """Messages of a topic in the order of log time, decoded, and their header stamps in ns (in any order)."""

    stamps: Stamps
    messages: list[JointState]


class Topics:
    """The JointState topics of a bag, each decoded once.

    Args:
        bag: as opened.
    """

    def __init__(self, bag: BagContents) -> None:
        self.bag = bag
        self._decoded: dict[str, Decoded] = {}
        self._as_filed: dict[str, Decoded] = {}

    def __contains__(self, topic: str) -> bool:
        """Whether the topic has any message."""
        return topic in self.bag.messages

    def names(self, topic: str) -> list[str]:
        """Every name on a topic, in the order in which they come.

        Raises:
            UserError: no message, not JointState, or a message without a name.
        """
        seen: dict[str, None] = {}
        for i, message in enumerate(self.decoded(topic).messages):
            if not message.name:
                raise UserError(
                    f"bag {self.bag.path}: {topic}, message {i} has an empty name; needed is the fibre in name[0]"
                )
            seen.update(dict.fromkeys(map(str, message.name)))
        return list(seen)

    def samples(self, topic: str, fields: Sequence[str], name: str) -> Samples:
        """Stamps and values under a name; messages without it are skipped, as a node does, and counted.

        Raises:
            UserError: see `names`; stamps that do not increase, values that are missing or not finite.
        """

        def row(message: JointState, i: int, stamps: Stamps) -> list[float] | None:
            if name not in message.name:
                return None
            at = list(message.name).index(name)
            return [self._value(topic, message, field, at, i, stamps) for field in fields]

        return self._rows(topic, row, name)

    def rows(self, topic: str, values: Callable[[JointState, int], list[float]]) -> Samples:
        """Stamps and what a function makes of each message and its number.

        Raises:
            UserError: as `samples`.
        """
        return self._rows(topic, lambda message, i, _: values(message, i), "")

    def decoded(self, topic: str) -> Decoded:
        """All messages of a topic in the order of log time.

        Raises:
            UserError: there is none, or it is no JointState.
        """
        if topic not in self._decoded:
            self._check(topic)
            self._decoded[topic] = self._decode(topic, self.bag.messages[topic])
        return self._decoded[topic]

    def _rows(self, topic: str, row: Callable[[JointState, int, Stamps], list[float] | None], name: str) -> Samples:
        found = self._kept(self.decoded(topic), row)
        warnings = []
        if not_after(found.stamps).size and topic in self.bag.as_filed:
            # A recorder's own clock may step back; then the file has the order.
            if topic not in self._as_filed:
                self._as_filed[topic] = self._decode(topic, self.bag.as_filed[topic])
            filed = self._kept(self._as_filed[topic], row)
            if not not_after(filed.stamps).size:
                found = filed
                warnings.append(
                    f"bag {self.bag.path}: {topic} is in the order of the file, because log times step back"
                )
        self._check_order(topic, found)
        values = np.array(found.rows, dtype=np.float64)
        bad = np.argwhere(~np.isfinite(values))
        if bad.size:
            i, j = (int(k) for k in bad[0])
            where = self._at(topic, found.places[i], found.stamps[i])
            raise UserError(f"{where} has the value {values[i, j]}; allowed are finite numbers")
        total = len(found.rows) + found.others
        skipped = f"{found.others} of {total} messages on {topic}" if found.others else ""
        return Samples(to_s(found.stamps), values, name, tuple(warnings), skipped)

    def _kept(self, decoded: Decoded, row: Callable[[JointState, int, Stamps], list[float] | None]) -> _Kept:
        rows, places = [], []
        for i, message in enumerate(decoded.messages):
            values = row(message, i, decoded.stamps)
            if values is not None:
                rows.append(values)
                places.append(i)
        return _Kept(decoded.stamps[places], rows, places, len(decoded.messages) - len(rows))

    def _value(self, topic: str, message: JointState, field: str, at: int, i: int, stamps: Stamps) -> float:
        array = getattr(message, field)
        if at < len(array):
            return float(array[at])
        where = self._at(topic, i, stamps[i])
        if len(array) == 0:
            raise UserError(f"{where} has an empty {field}; needed is one value for the fibre")
        raise UserError(f"{where} has {len(array)} values of {field} for {len(message.name)} names; needed is one each")

    def _check(self, topic: str) -> None:
        bag = self.bag
        if topic not in bag.messages:
            raise UserError(
                f"bag {bag.path} has no message on {topic}; topics there: {', '.join(sorted(bag.messages))}"
                f"{bag.flaws_text}; record or remap the topic"
            )
        if bag.types[topic] != ros_types.JOINT_STATE or bag.encodings[topic] != "cdr":
            raise UserError(
                f"bag {bag.path}: {topic} is {bag.types[topic] or 'of no known type'} ({bag.encodings[topic]}); "
                f"allowed is {ros_types.JOINT_STATE} (cdr)"
            )

    def _decode(self, topic: str, raw: list[Message]) -> Decoded:
        messages = []
        for i, each in enumerate(raw):
            try:
                message = ros_types.typestore().deserialize_cdr(each.data, ros_types.JOINT_STATE)
            except (SerdeError, struct.error, ValueError, IndexError) as problem:
                raise UserError(f"bag {self.bag.path}: {topic}, message {i} cannot be decoded: {problem}") from problem
            assert isinstance(message, JointState)  # the type asked for
            messages.append(message)
        stamps = [message.header.stamp.sec * 10**9 + message.header.stamp.nanosec for message in messages]
        return Decoded(np.array(stamps, dtype=np.int64), messages)

    def _check_order(self, topic: str, found: _Kept) -> None:
        for i in not_after(found.stamps)[:1].tolist():
            where = self._at(topic, found.places[i], found.stamps[i])
            raise UserError(
                f"{where} does not come after the one before, t = {found.stamps[i - 1] / 1e9:.9f} s; header stamps "
                "have to increase"
            )

    def _at(self, topic: str, i: int, stamp: int) -> str:
        return f"bag {self.bag.path}: {topic}, message {i} at t = {stamp / 1e9:.9f} s"


class _Kept(NamedTuple):
    stamps: Stamps
    rows: list[list[float]]
    places: list[int]
    others: int
