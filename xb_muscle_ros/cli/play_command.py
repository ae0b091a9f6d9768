"""``xb_muscle play``: trials in real time, to a muscle node or an apparatus."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING

from xb_muscle_ros.cli import common
from xb_muscle_ros.errors import UserError

if TYPE_CHECKING:
    from xb_muscle_ros.node.playing import Played

DESCRIPTION = (
    "Send length and calcium of trials by the clock, to a muscle_node in realtime or to an apparatus that takes its "
    "length from ROS; with --drive load their force, as a load. Record the answers with 'xb_muscle record'."
)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    common.add_bags(parser)
    parser.add_argument(
        "--drive", choices=("length", "load"), default="length",
        help="what is sent: the trial's length, or its force as muscle/load (default: length)",
    )  # fmt: skip
    parser.add_argument("--fiber", "--fibre", metavar="NAME", help="name in the messages (default: the trial's fibre)")
    parser.add_argument(
        "--as-l0", metavar="LENGTH", help="length that is sent for one L0, for example '30 mm' (default: the trial's)"
    )
    parser.add_argument(
        "--as-f0", metavar="FORCE", help="load that is sent for one F0, for example '20 N' (default: the trial's)"
    )
    parser.add_argument("--speed", type=float, default=1.0, help="times faster than the trials (default 1)")
    parser.add_argument(
        "--rest", type=float, default=1.0, metavar="S",
        help="for how long the first sample of each trial is held before it, s (default 1)",
    )  # fmt: skip
    parser.add_argument("--wait", type=float, default=10.0, metavar="S", help="for a listener, s (default 10)")


def run(arguments: argparse.Namespace) -> int:
    """Play, and say what became of each trial."""
    import signal
    from functools import partial

    from xb_muscle_ros.api.inputs import read_trials

    for option, least in (("speed", 0.0), ("rest", -1e-12), ("wait", 0.0)):
        value = getattr(arguments, option)
        if not least < value <= 1e6:
            raise UserError(f"--{option} is {value:g}; allowed is {'from' if least else 'above'} 0 to 1e6")
    other, given = ("--as-f0", arguments.as_f0) if arguments.drive == "length" else ("--as-l0", arguments.as_l0)
    if given is not None:
        raise UserError(f"{other} is of no use with --drive {arguments.drive}; drop it")
    unit = _unit("length", "--as-l0", arguments.as_l0) or _unit("force", "--as-f0", arguments.as_f0)
    trials = read_trials(arguments.bags, tell=common.warn)
    try:
        from xb_muscle_ros.node.playing import Sent, play
    except ImportError as error:
        raise UserError(f"ROS 2 cannot be imported ({error}); source a ROS 2 Jazzy, or run scripts/setup") from error
    sent = [Sent.of(trial, arguments.drive, arguments.fiber or "", unit) for trial in trials]
    asked: list[int] = []
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda number, frame: asked.append(number))
    done = 0
    for each in play(
        sent, arguments.drive, speed=arguments.speed, rest_s=arguments.rest, wait_s=arguments.wait,
        stop=lambda: bool(asked), say=partial(print, flush=True),
    ):  # fmt: skip
        _tell(each)
        done += each.whole
    if asked:
        common.warn(f"stopped after {done} of {len(sent)} trials; the fibre keeps what was sent last")
        return 130
    return 0


def _tell(played: Played) -> None:
    """Say what became of a trial."""
    late = played.lateness
    print(
        f"{played.trial}: {played.sent} samples, late by {1e-3 * late.p50_us:.3g} ms (median), "
        f"{1e-3 * late.max_us:.3g} ms at most",
        flush=True,
    )
    if played.overdue:
        common.warn(f"trial {played.trial}: {played.overdue} samples were sent later than the next one was due")
    if played.joint not in played.answered_by:
        whose = f" of {', '.join(sorted(played.answered_by))} alone" if played.answered_by else " of none"
        common.warn(
            f"trial {played.trial}: force was heard{whose} on muscle/force and muscle/measured_force; look whether "
            f"what listens knows fibre {played.joint} (--fiber gives another name) and is in realtime"
        )


def _unit(kind: str, option: str, text: str | None) -> float | None:
    """What is sent for one L0 (m) or one F0 (N); None where it is not given."""
    from xb_muscle_ros.trials.readers.units import quantity

    if text is None:
        return None
    example = "30 mm" if kind == "length" else "20 N"
    found = quantity(text, kind, "value", option, example)
    if found.kind != kind:
        raise UserError(f"{option} is '{text}'; needed is a {kind}, for example '{example}'")
    return found.value
