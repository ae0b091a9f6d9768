"""``xb_muscle record``: live topics into a bag."""

from __future__ import annotations

import argparse
from pathlib import Path

from xb_muscle_ros.cli import common
from xb_muscle_ros.errors import UserError

DESCRIPTION = (
    "Record live topics into a bag, with what is known of the trial, until ctrl-C. What has come is saved five times a "
    "second, so a recorder that is killed leaves a bag that can be read."
)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    common.add_out(parser, "the bag, a folder that is made")
    parser.add_argument("--fiber", "--fibre", required=True, metavar="NAME", help="name of the fibre that is recorded")
    parser.add_argument("--trial", metavar="NAME", help="name of the trial (default: that of the bag)")
    parser.add_argument("--data-set", metavar="SET", help="set of recordings that the trial belongs to")
    parser.add_argument("--pca", type=float, help="pCa, where calcium stays")
    parser.add_argument("--reference-length", metavar="LENGTH", help="the length that is L0, for example '30 mm'")
    parser.add_argument("--f0", metavar="FORCE", help="the force that is F0, for example '0.5 mN'")
    parser.add_argument("--source", metavar="TEXT", help="where the data come from, in words")
    parser.add_argument(
        "--topics", nargs="+", metavar="TOPIC",
        help="in place of /muscle/calcium, length, measured_force, force and moments",
    )  # fmt: skip
    parser.add_argument(
        "--duration", type=float, metavar="S", help="from the first message on, s (default: until ctrl-C)"
    )
    parser.add_argument("--wait", type=float, metavar="S", help="for the first message, s (default: without end)")


def run(arguments: argparse.Namespace) -> int:
    """Record, and say what was heard."""
    import signal
    from functools import partial

    from xb_muscle_ros.files import refuse_older

    facts = _facts(arguments)
    for option in ("duration", "wait"):
        value = getattr(arguments, option)
        if value is not None and not 0.0 < value < 1e9:
            raise UserError(f"--{option} is {value:g} s; allowed is above 0")
    topics = [topic if topic.startswith("/") else f"/{topic}" for topic in arguments.topics or ()]
    out: Path = arguments.out
    refuse_older([out] if out.exists() else [], arguments.overwrite)
    try:
        from xb_muscle_ros.node.recording import record
    except ImportError as error:
        raise UserError(f"ROS 2 cannot be imported ({error}); source a ROS 2 Jazzy, or run scripts/setup") from error
    from xb_muscle_ros.trials import ros_types
    from xb_muscle_ros.trials.bag_files import check_replaceable

    check_replaceable(out)
    asked: list[int] = []
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda number, frame: asked.append(number))
    found = record(
        out, facts, topics or ros_types.TOPICS, duration_s=arguments.duration, wait_s=arguments.wait,
        stop=lambda: bool(asked), say=partial(print, flush=True),
    )  # fmt: skip
    for line in found.lines:
        common.warn(line)
    print(f"{found.bag}: {', '.join(f'{count} on {topic}' for topic, count in found.counts.items())}")
    return 0


def _facts(arguments: argparse.Namespace) -> dict[str, str]:
    """What the options tell of the trial; what they do not tell, a replay takes from elsewhere and says so."""
    from xb_muscle_ros.api.inputs import known_of
    from xb_muscle_ros.trials.custom_data import facts_to_custom_data
    from xb_muscle_ros.trials.protocol import ALLOWED
    from xb_muscle_ros.trials.trial import TrialFacts

    if arguments.pca is not None:
        ALLOWED["pca"].check("--pca", arguments.pca)
    known = known_of(arguments.reference_length, arguments.f0)
    if known.first_isometric:
        raise UserError("--reference-length is first_isometric, which a recorder does not know yet; give it to replay")
    facts = TrialFacts(
        fibre=arguments.fiber,
        trial=arguments.trial or arguments.out.name,
        pca=arguments.pca,
        reference_length_m=known.reference_length_m or 1.0,
        f0_n=known.f0_n or 1.0,
        source=arguments.source or "recorded live",
        data_set=arguments.data_set or "",
    )
    told = facts_to_custom_data(facts)
    lacking = {"reference_length_m": known.reference_length_m, "f0_n": known.f0_n}
    return {key: text for key, text in told.items() if lacking.get(key, 1.0) is not None and key != "phases"}
