"""Trials played through a running muscle node in lockstep, once it is found and known to be the right one."""

# mypy: allow-untyped-calls

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.models.fibre_file import Fibre
from xb_muscle_ros.node.client.link import Link
from xb_muscle_ros.node.client.player import Player
from xb_muscle_ros.node.configuration import flat
from xb_muscle_ros.trials.simulated import Simulated
from xb_muscle_ros.trials.trial import Trial

_FIND_S = 10.0


def play_live(
    trials: Sequence[Trial],
    fibre: Fibre | None = None,
    timeout_s: float = 10.0,
    find_s: float = _FIND_S,
    namespace: str = "",
    domain_id: int | None = None,
) -> list[Simulated]:
    """Play trials one after the other through the muscle node of a namespace, which is in lockstep.

    Every trial starts from a reset with the trial's own constants; calcium is delivered before the length that needs
    it, so that the forces are those of an offline replay, bit for bit.

    Args:
        trials: all of the node's fibre.
        fibre: parameters that the node must have; None leaves them to the node.
        timeout_s: longest wait for one answer, s.
        find_s: longest wait for the node to appear, s.
        namespace: of the node.
        domain_id: of ROS; None stands for that of the environment.

    Returns:
        One result per trial, in order.

    Raises:
        UserError: no node, not the right one, a refused parameter, or no answer.
    """
    if not trials:
        return []
    with playing(trials, fibre, timeout_s, find_s, namespace, domain_id) as player:
        return [player.play(trial) for trial in trials]


@contextmanager
def playing(
    trials: Sequence[Trial],
    fibre: Fibre | None = None,
    timeout_s: float = 10.0,
    find_s: float = _FIND_S,
    namespace: str = "",
    domain_id: int | None = None,
    topic: str = "length",
) -> Iterator[Player]:
    """A player for trials, which has met the node.

    Args:
        trials: one at least; those that will be played.
        fibre, timeout_s, find_s, namespace, domain_id: see `play_live`.
        topic: what the node hears: ``length``, or ``load`` under force control.

    Raises:
        UserError: see `play_live`.
    """
    with Link("muscle_player", namespace, domain_id) as link:
        yield _met(link, trials, fibre, (timeout_s, find_s), topic)


def _met(
    link: Link, trials: Sequence[Trial], fibre: Fibre | None, patience_s: tuple[float, float], topic: str
) -> Player:
    """A player and the node that it needs, which know each other."""
    timeout_s, find_s = patience_s
    name = trials[0].facts.fibre
    model = f" -p model:={fibre.model}" if fibre is not None else ""
    given = str(fibre.path) if fibre is not None and fibre.path is not None else name
    control = " -p control:=force" if topic == "load" else ""
    command = f"muscle_node --ros-args -p fiber_file:={given}{model} -p mode:=lockstep{control}"
    player = Player(link, name, timeout_s, topic)
    link.find(find_s, command)
    _check(link, trials, fibre, command, "force" if topic == "load" else "length")
    player.meet(find_s)
    return player


def _check(link: Link, trials: Sequence[Trial], fibre: Fibre | None, command: str, control: str) -> None:
    link.check_active()
    wanted: dict[str, object] = {"mode": "lockstep", "control": control}
    if fibre is not None:
        wanted |= {n: v for n, v in flat(fibre).items() if not n.startswith(("source", "constants."))}
    fibre_there = link.parameters(["fibre"])["fibre"]
    for trial in trials:
        if trial.facts.fibre != fibre_there:
            raise UserError(
                f"node {link.peer} has fibre {fibre_there}, trial {trial.facts.trial} is of fibre "
                f"{trial.facts.fibre}; end the node and start another: {command}"
            )
    link.check(wanted, command)
