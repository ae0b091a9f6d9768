"""Trials of a protocol through a model, or through a running node."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.models.fibre_file import Fibre
from xb_muscle_ros.protocols import running
from xb_muscle_ros.protocols.base import Planned, Protocol, Run, run_of


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
    # The one place where this module touches ROS, and only when asked to.
    from xb_muscle_ros.node.client.player import play_live, play_loads

    trials = [each.trial for each in planned]
    if planned and planned[0].load.size:
        for trial, (simulated, length_m) in zip(
            trials, play_loads(trials, [each.load for each in planned], fibre), strict=True
        ):
            yield running.with_force(run_of(replace(trial, length_m=length_m), simulated), fibre, as_measured)
        return
    for trial, simulated in zip(trials, play_live(trials, fibre), strict=True):
        yield running.with_force(run_of(trial, simulated), fibre, as_measured)
