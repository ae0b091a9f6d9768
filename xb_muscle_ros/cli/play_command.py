"""``xb_muscle play``: trials in real time, to a muscle node or an apparatus."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING

from xb_muscle_ros.cli import common
from xb_muscle_ros.errors import UserError

if TYPE_CHECKING:
    from xb_muscle_ros.node.playing import Played
    from xb_muscle_ros.trials.trial import Trial

DESCRIPTION = (
    "Send length and calcium of trials by the clock, to a muscle_node in realtime or to an apparatus that takes its "
    "length from ROS; with --drive load their force, as a load. Record the answers with 'xb_muscle record'. The exit "
    "code is 1 where a trial was not taken whole or its fibre's force was not heard at its end, 130 after ctrl-C."
)
# What is said of bags for the sake of scores and models is of no use here.
_OF_NO_USE = ("compared with the recorded", "phases found", "phases are found", "pCa taken", "so there is no pCa")


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
    parser.add_argument(
        "--travel", type=float, default=0.5, metavar="RATE",
        help="how fast a fibre goes from one trial to its next, L0/s, or F0/s with --drive load (default 0.5)",
    )  # fmt: skip
    parser.add_argument("--wait", type=float, default=10.0, metavar="S", help="for a listener, s (default 10)")
    parser.add_argument("--namespace", default="", metavar="NAME", help="of what listens (default: none)")
    parser.add_argument(
        "--reference-length", metavar="LENGTH", help="the length that is L0 in bags that do not tell it"
    )
    parser.add_argument("--f0", metavar="FORCE", help="the force that is F0 in bags that do not tell it")
    parser.add_argument("--trials-of", metavar="FIBER", help="take this fibre's trials of the bags")


def run(arguments: argparse.Namespace) -> int:
    """Play, and say what became of each trial."""
    import signal
    from functools import partial

    for option, least in (("speed", 1e-6), ("rest", 0.0), ("travel", 1e-3), ("wait", 1e-3)):
        value = getattr(arguments, option)
        if not least <= value <= 1e6:
            raise UserError(f"--{option} is {value:g}; allowed is {least:g} to 1e6")
    by_load = arguments.drive == "load"
    other, given = ("--as-l0", arguments.as_l0) if by_load else ("--as-f0", arguments.as_f0)
    if given is not None:
        raise UserError(f"{other} is of no use with --drive {arguments.drive}; drop it")
    unit = _unit("length", "--as-l0", arguments.as_l0) or _unit("force", "--as-f0", arguments.as_f0)
    trials = _trials(arguments)
    try:
        from xb_muscle_ros.node.playing import Sent, play
    except ImportError as error:
        raise UserError(f"ROS 2 cannot be imported ({error}); source a ROS 2 Jazzy, or run scripts/setup") from error
    sent = [Sent.of(trial, arguments.drive, arguments.fiber or "", unit) for trial in trials]
    made_up = [trial.facts.trial for trial in trials if by_load and not trial.force_is_measured]
    if made_up:
        common.warn(f"the load is a force that a model made, in {', '.join(made_up)}")
    asked: list[int] = []
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda number, frame: asked.append(number))
    played = []
    for each in play(
        sent, arguments.drive, speed=arguments.speed, rest_s=arguments.rest, travel_per_s=arguments.travel,
        wait_s=arguments.wait, stop=lambda: bool(asked), say=partial(print, flush=True),
        namespace=arguments.namespace,
    ):  # fmt: skip
        played.append(each)
        _tell(each, bool(asked))
    if asked:
        common.warn(
            f"stopped after {sum(each.whole for each in played)} of {len(sent)} trials; what was sent last, calcium "
            "too, holds where it was heard"
        )
        return 130
    return 0 if all(each.is_well for each in played) else 1


def _trials(arguments: argparse.Namespace) -> tuple[Trial, ...]:
    from xb_muscle_ros.api.inputs import read_trials

    def tell(line: str) -> None:
        if not any(words in line for words in _OF_NO_USE):
            common.warn(line)

    return read_trials(
        arguments.bags, reference_length=arguments.reference_length, f0=arguments.f0, trials_of=arguments.trials_of,
        tell=tell,
    )  # fmt: skip


def _tell(played: Played, is_stopped: bool) -> None:
    """Say what became of a trial."""
    late = played.lateness
    lateness = f", late by {1e-3 * late.p50_us:.3g} ms (median), {1e-3 * late.max_us:.3g} ms at most"
    print(f"{played.trial}: {played.sent} samples{lateness if played.sent else ''}", flush=True)
    if played.overdue:
        common.warn(f"trial {played.trial}: {played.overdue} samples were sent after the next one was due")
    for why, count in played.refused.items():
        common.warn(f"trial {played.trial}: the muscle node refused {count} samples: {why}; its log tells more")
    if played.fault:
        common.warn(f"trial {played.trial}: the muscle node stopped: {played.fault}; call its ~/reset")
    elif played.joint not in played.answered_by and not is_stopped:
        whose = f"force of {', '.join(sorted(played.answered_by))} alone" if played.answered_by else "no force"
        common.warn(
            f"trial {played.trial}: {whose} was heard at its end on muscle/force and muscle/measured_force; look "
            f"whether what listens is still there, knows fibre {played.joint} (--fiber gives another name) and takes "
            "such lengths (--as-l0) and stamps (~/reset)"
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
