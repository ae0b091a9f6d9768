"""JointState topics of an opened bag: stamps, the fibres they name, and the samples of one fibre."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.trials import ros_types
from xb_muscle_ros.trials.bag_contents import BagContents, decoded
from xb_muscle_ros.trials.joint_columns import Pick, Picked, UnusualError, names_of, picked
from xb_muscle_ros.trials.messages import Messages
from xb_muscle_ros.trials.ros_types import JointState
from xb_muscle_ros.trials.stamps import not_after, to_s
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


class Topics:
    """The JointState topics of a bag.

    Args:
        bag: as opened.
    """

    def __init__(self, bag: BagContents) -> None:
        self.bag = bag
        self._decoded: dict[tuple[str, bool], list[JointState]] = {}

    def __contains__(self, topic: str) -> bool:
        """Whether the topic has any message."""
        return topic in self.bag.messages

    def names(self, topic: str) -> list[str]:
        """Every name on a topic, in the order in which they come.

        Raises:
            UserError: no message, not JointState, or a message without a name.
        """
        try:
            return names_of(self._raw(topic))
        except UnusualError:
            seen: dict[str, None] = {}
        for i, message in enumerate(self._messages(topic)):
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

        def pick(names: Sequence[str]) -> list[tuple[str, int]] | None:
            return [(field, names.index(name)) for field in fields] if name in names else None

        return self.rows(topic, pick, len(fields), name)

    def rows(self, topic: str, pick: Pick, width: int, name: str = "") -> Samples:
        """Stamps and the numbers of each message that are asked for.

        Args:
            pick: which, by a message's names; it skips one by None, and refuses one by a ValueError.
            width: how many.

        Raises:
            UserError: as `samples`.
        """
        kept, warnings = self._kept(topic, pick, width), []
        if not_after(kept.stamps_ns).size and self._raw(topic).order is not None:
            # A recorder's own clock may step back; then the file has the order.
            filed = self._kept(topic, pick, width, as_filed=True)
            if not not_after(filed.stamps_ns).size:
                kept = filed
                warnings.append(
                    f"bag {self.bag.path}: {topic} is in the order of the file, because log times step back"
                )
        stamps, values = kept.stamps_ns, kept.values
        for i in not_after(stamps)[:1].tolist():
            raise UserError(
                f"{self._at(topic, kept.places[i], stamps[i])} does not come after the one before, t = "
                f"{stamps[i - 1] / 1e9:.9f} s; header stamps have to increase"
            )
        for i, j in np.argwhere(~np.isfinite(values))[:1].tolist():
            where = self._at(topic, kept.places[i], stamps[i])
            raise UserError(f"{where} has the value {values[i, j]}; allowed are finite numbers")
        total = len(self._raw(topic))
        others = total - len(values)
        skipped = f"{others} of {total} messages on {topic}" if others else ""
        time_s = to_s(stamps)
        time_s.setflags(write=False)
        return Samples(time_s, values, name, tuple(warnings), skipped)

    def _kept(self, topic: str, pick: Pick, width: int, as_filed: bool = False) -> Picked:
        try:
            return picked(self._raw(topic), pick, width, as_filed)
        except UnusualError:
            return self._kept_one_by_one(topic, pick, width, as_filed)

    def _kept_one_by_one(self, topic: str, pick: Pick, width: int, as_filed: bool) -> Picked:
        rows, places, stamps = [], [], []
        for i, message in enumerate(self._messages(topic, as_filed)):
            stamp = message.header.stamp.sec * 10**9 + message.header.stamp.nanosec
            try:
                wanted = pick(list(message.name))
                values = None if wanted is None else [_value(message, field, at) for field, at in wanted]
            except ValueError as problem:
                raise UserError(f"{self._at(topic, i, stamp)} {problem}") from None
            if values is not None:
                rows.append(values)
                places.append(i)
                stamps.append(stamp)
        values_of = np.array(rows, dtype=np.float64).reshape(-1, width)
        return Picked(np.array(stamps, dtype=np.int64), values_of, np.array(places, dtype=np.int64))

    def _raw(self, topic: str) -> Messages:
        """Messages of a topic, which are JointState.

        Raises:
            UserError: there are none, or they are others.
        """
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
        return bag.messages[topic]

    def _messages(self, topic: str, as_filed: bool = False) -> list[JointState]:
        """All messages of a topic in the order of log time, or in that of the files."""
        if (topic, as_filed) not in self._decoded:
            raw = self._raw(topic)
            each = decoded(self.bag, topic, raw.as_filed() if as_filed else raw, ros_types.typestore())
            self._decoded[topic, as_filed] = [one.message for one in each]
        return self._decoded[topic, as_filed]

    def _at(self, topic: str, i: int, stamp: int) -> str:
        return f"bag {self.bag.path}: {topic}, message {i} at t = {stamp / 1e9:.9f} s"


def _value(message: JointState, field: str, at: int) -> float:
    array = getattr(message, field)
    if at < len(array):
        return float(array[at])
    if len(array) == 0:
        raise ValueError(f"has an empty {field}; needed is one value for the fibre")
    raise ValueError(f"has {len(array)} values of {field} for {len(message.name)} names; needed is one each")
