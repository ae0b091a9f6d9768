"""Messages of any type in an MCAP bag, decoded one by one, as far as the bag can be read."""

from __future__ import annotations

import struct
from collections.abc import Iterator
from typing import Any, NamedTuple

from rosbags.interfaces.typing import Typesdict
from rosbags.serde import SerdeError
from rosbags.typesys import Stores, TypesysError, get_types_from_idl, get_types_from_msg, get_typestore
from rosbags.typesys.store import Typestore

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.trials import ros_types
from xb_muscle_ros.trials.bag_contents import BagContents

_IDL_BEGIN = "=" * 80 + "\n"


class AnyMessage(NamedTuple):
    """A message of any type: its topic, when it was logged (ns), and what it holds."""

    topic: str
    log_time_ns: int
    message: Any


def decoded(bag: BagContents) -> Iterator[AnyMessage]:
    """All messages of a bag, topic by topic in the order of log time.

    Types are those that the bag describes, and the standard ones of ROS 2 Jazzy.

    Raises:
        UserError: a type is neither, or a message is not of its type.
    """
    store = _typestore(bag)
    for topic, messages in bag.messages.items():
        kind = bag.types[topic]
        if bag.encodings[topic] != "cdr" or kind not in store.fielddefs:
            raise UserError(
                f"bag {bag.path}: {topic} is {kind or 'of no known type'} ({bag.encodings[topic]}), which the bag does "
                "not describe; record or convert it again"
            )
        for i, each in enumerate(messages):
            try:
                yield AnyMessage(topic, each.log_time_ns, store.deserialize_cdr(each.data, kind))
            except (SerdeError, struct.error, ValueError, IndexError) as problem:
                raise UserError(f"bag {bag.path}: {topic}, message {i} cannot be decoded: {problem}") from problem


def _typestore(bag: BagContents) -> Typestore:
    described: Typesdict = {}
    for kind in {bag.types[topic] for topic in bag.messages}:
        if kind not in bag.definitions:
            continue
        encoding, text = bag.definitions[kind]
        try:
            if encoding == "ros2msg":
                described.update(get_types_from_msg(text, kind))
            elif encoding == "ros2idl":
                for part in text.split(_IDL_BEGIN):
                    body = part.partition("\n")[2] if part.startswith("IDL: ") else part
                    described.update(get_types_from_idl(body) if body.strip() else {})
        except TypesysError as problem:
            raise UserError(f"bag {bag.path}: the description of {kind} cannot be read: {problem}") from problem
    store = get_typestore(Stores.EMPTY)
    store.register({**ros_types.typestore().fielddefs, **described})
    return store
