"""Trials of a protocol through a model, or through a running node."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import partial

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.models.clamping import is_load_refused
from xb_muscle_ros.models.fibre_file import Fibre
from xb_muscle_ros.protocols import running
from xb_muscle_ros.protocols.base import NoAnswer, Planned, Protocol, Run


def answers(
    protocol: Protocol,
    fibre: Fibre,
    planned: Sequence[Planned],
    settle: float | None,
    as_measured: bool,
    live: bool,
    lacking: list[str] | None = None,
) -> Iterator[Run]:
    """What a model, or with `live` a running node, answers to planned trials, one after the other.

    Args:
        lacking: see `running.answers`.

    Raises:
        UserError: see `Protocol.answer` and `play_live`; a settling time for a node.
    """
    if not live:
        yield from running.answers(protocol, fibre, planned, settle, as_measured, lacking)
        return
    if settle is not None:
        raise UserError("--live leaves settling to the node; drop --settle")
    if not planned:
        return
    # The one place where this module touches ROS, and only when asked to.
    from xb_muscle_ros.node.client.live import playing
    from xb_muscle_ros.node.client.player import Player, Stopped

    def ask(player: Player, each: Planned) -> Run:
        by_load = bool(each.load.size)
        try:
            simulated = player.play(each.trial, each.load if by_load else None)
        except Stopped as problem:
            if by_load and is_load_refused(str(problem)):
                raise NoAnswer(str(problem)) from problem
            raise
        return protocol.answered(each, simulated, player.length_m if by_load else None)

    topic = "load" if planned[0].load.size else "length"
    with playing([each.trial for each in planned], fibre, topic=topic) as player:
        for run in running.answered((partial(ask, player, each) for each in planned), lacking):
            yield running.with_force(run, fibre, as_measured)
