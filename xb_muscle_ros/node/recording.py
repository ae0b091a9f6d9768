"""Live topics into a bag, until told to stop."""

# mypy: allow-untyped-calls

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.node.client.link import Link
from xb_muscle_ros.node.recorder import Recorder
from xb_muscle_ros.trials import ros_types
from xb_muscle_ros.trials.bag_files import remove_results
from xb_muscle_ros.trials.live_bag import LiveBag

# What has come is handed to the system this often, s: so much a kill can take.
SAVED_EVERY_S = 0.2
_LOOK_EVERY_S = 0.1
_NEEDED = (ros_types.LENGTH, ros_types.CALCIUM)


@dataclass(frozen=True)
class Recorded:
    """What became of a recording.

    Attributes:
        bag: the folder.
        counts: messages by topic.
        lines: what is missing, one line each.
    """

    bag: Path
    counts: Mapping[str, int]
    lines: tuple[str, ...]


def record(
    bag: Path,
    facts: Mapping[str, str],
    topics: Sequence[str] = ros_types.TOPICS,
    *,
    duration_s: float | None = None,
    wait_s: float | None = None,
    stop: Callable[[], bool] = lambda: False,
    say: Callable[[str], None] = lambda line: None,
) -> Recorded:
    """Record topics until told to stop.

    Args:
        bag: a folder; an older bag there is replaced when the first message comes.
        facts: the bag's ``custom_data``.
        topics: full names; one that nobody publishes is waited for.
        duration_s: from the first message on, s; None: without end.
        wait_s: how long the first message is waited for, s; None: without end.
        stop: whether to end.
        say: hears one line once it listens, and one on each topic, when its first message comes.

    Raises:
        UserError: ROS cannot be used, the bag cannot be written, or no message came.
    """
    kept: list[LiveBag] = []
    begun: list[float] = []
    problems: list[UserError] = []

    def take(topic: str, kind: str, stamp_ns: int, data: bytes) -> None:
        # An executor may swallow what a callback raises.
        if not problems:
            try:
                put(topic, kind, stamp_ns, data)
            except UserError as problem:
                problems.append(problem)

    def put(topic: str, kind: str, stamp_ns: int, data: bytes) -> None:
        if not kept:
            # Not before there is something to keep: an older bag stays for as long.
            remove_results([bag] if bag.exists() else [])
            kept.append(LiveBag(bag, facts))
            begun.append(time.monotonic())
        if topic not in kept[0].counts:
            kept[0].add(topic, kind, recorder.qos(topic))
            say(f"hears {topic} ({kind})")
        kept[0].write(topic, stamp_ns, data)

    with Link("muscle_recorder") as link:
        recorder = Recorder(link.node, topics, take)
        say(f"waits for {', '.join(topics)}")
        try:
            _listen(link, recorder, kept, begun, (duration_s, wait_s), lambda: bool(problems) or stop())
        finally:
            recorder.close()
            for made in kept:
                made.close()
    if problems:
        raise problems[0]
    if not kept:
        raise UserError(_nothing(topics, recorder.unknown))
    return Recorded(bag, dict(kept[0].counts), tuple(_lines(kept[0].counts, topics, recorder.unknown)))


def _listen(
    link: Link,
    recorder: Recorder,
    kept: list[LiveBag],
    begun: list[float],
    limits_s: tuple[float | None, float | None],
    stop: Callable[[], bool],
) -> None:
    duration_s, wait_s = limits_s
    start = looked = saved = time.monotonic()
    recorder.look()
    while not stop():
        link.wait_for(lambda: False, 0.05)
        now = time.monotonic()
        if now - looked >= _LOOK_EVERY_S:
            recorder.look()
            looked = now
        if now - saved >= SAVED_EVERY_S:
            for made in kept:
                made.save()
            saved = now
        if begun and duration_s is not None and now - begun[0] >= duration_s:
            return
        if not begun and wait_s is not None and now - start >= wait_s:
            return


def _nothing(topics: Sequence[str], unknown: Mapping[str, str]) -> str:
    why = "; ".join(f"{topic}: {reason}" for topic, reason in unknown.items())
    return (
        f"no message came on {', '.join(topics)}{f' ({why})' if why else ''}, so there is no bag; look at the names, "
        "ROS_DOMAIN_ID and ROS_AUTOMATIC_DISCOVERY_RANGE"
    )


def _lines(counts: Mapping[str, int], topics: Sequence[str], unknown: Mapping[str, str]) -> list[str]:
    lines = [f"topic {topic} was not recorded: {reason}" for topic, reason in unknown.items()]
    missing = [topic for topic in _NEEDED if topic in topics and not counts.get(topic)]
    if missing:
        lines.append(f"no message came on {' and '.join(missing)}; a replay needs length and calcium")
    return lines
