"""``xb_muscle simulate``: a protocol through a model, as bags, with what is read off them."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING

from xb_muscle_ros.cli import common

if TYPE_CHECKING:
    from xb_muscle_ros.protocols.base import Option, Protocol

DESCRIPTION = (
    "Simulate every combination of what a protocol is given: one bag for each trial. With --protocol also what is read "
    "off them: a table as JSON, Markdown and CSV, and a figure."
)
EPILOG = "What each protocol does, and what is read off it, stands in docs/protocols.md."
_DEFAULT = "stretch-shorten-stretch"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    from xb_muscle_ros.protocols.registry import PROTOCOLS, all_options

    common.add_fibre(parser, required=True)
    common.add_model(parser)
    parser.add_argument("--protocol", metavar="NAME", help=f"one of {', '.join(PROTOCOLS)} (default {_DEFAULT})")
    common.add_settle(parser)
    parser.add_argument(
        "--as-measured", action="store_true",
        help="also write the force as measured force, to replay the bag like a recording",
    )  # fmt: skip
    parser.add_argument(
        "--live", action="store_true",
        help="play the trials through a running muscle_node (mode lockstep; for force-clamp control:=force)",
    )  # fmt: skip
    parser.add_argument("--prefix", default="simulated", help="begins the names of the bags (default simulated)")
    common.add_out(parser, "folder for the bags", "bags")
    group = parser.add_argument_group("numbers of the protocols")
    for name, having in all_options().items():
        metavar = having[0][1].allowed.unit or name.upper()
        group.add_argument(
            f"--{name}", type=float, nargs="+", metavar=metavar.replace("/", "_per_").upper(), help=_help(having)
        )


def run(arguments: argparse.Namespace) -> int:
    """Simulate and write, one trial after the other."""
    from xb_muscle_ros.api.protocol_runs import answers
    from xb_muscle_ros.api.protocols import ProtocolResult, check_room
    from xb_muscle_ros.api.simulating import bag_path
    from xb_muscle_ros.progress import Progress
    from xb_muscle_ros.protocols import report
    from xb_muscle_ros.protocols.base import settings_of
    from xb_muscle_ros.protocols.registry import all_options, protocol_of
    from xb_muscle_ros.protocols.running import analysed
    from xb_muscle_ros.simulation.offline import one_for_all, pushing
    from xb_muscle_ros.trials.bag_files import remove_results
    from xb_muscle_ros.trials.bags import write_trial
    from xb_muscle_ros.trials.protocol import ALLOWED

    protocol = protocol_of(arguments.protocol or _DEFAULT)
    given = {name: getattr(arguments, name.replace("-", "_")) for name in all_options()}
    settings = settings_of(protocol, given)
    if arguments.settle is not None:
        ALLOWED["settle_s"].check("--settle", arguments.settle)
    fibre = common.fibre_of(arguments)
    planned = protocol.plan(fibre.name, settings)
    paths = [bag_path(arguments.out, arguments.prefix, each.trial) for each in planned]
    told = arguments.protocol is not None
    check_room(arguments.out, protocol if told else None, paths, arguments.overwrite)
    runs, pushed, lacking = [], [], list[str]()
    with Progress(len(planned), "simulate") as progress:
        asked = (protocol, fibre, planned, arguments.settle, arguments.as_measured, arguments.live, lacking)
        for made in answers(*asked):
            path = bag_path(arguments.out, arguments.prefix, made.trial)
            assert made.simulated is not None  # a model's answer
            write_trial(path, made.trial, made.simulated)
            if line := pushing(made.trial, made.simulated, fibre.model):
                pushed.append(line)
            low, high = made.force_f0.min(), made.force_f0.max()
            progress.write(f"{path}: {made.time_s.size} samples, force {low:.3f} to {high:.3f} F0")
            progress.update()
            runs.append(made)
    for line in one_for_all(pushed):
        common.warn(line)
    for line in lacking:
        common.warn(line)
    if told:
        found = analysed(protocol, fibre.name, fibre.model, runs, lacking)
        for note in found.notes[len(lacking) :]:
            common.warn(note)
        print(ProtocolResult(protocol.name, (found,)))
        remove_results(report.older_results(arguments.out, protocol))
        for path in report.write(arguments.out, protocol, [found]):
            print(path)
    return 0


def _help(having: list[tuple[Protocol, Option]]) -> str:
    """What an option is to each protocol that has it."""
    told: dict[str, list[tuple[str, str]]] = {}
    for protocol, option in having:
        told.setdefault(option.help, []).append((protocol.name, _numbers(option.default)))
    parts = []
    for text, of in told.items():
        by_default: dict[str, list[str]] = {}
        for name, default in of:
            by_default.setdefault(default, []).append(name)
        defaults = "; ".join(f"{', '.join(names)}: {default}" for default, names in by_default.items())
        parts.append(f"{text} (default of {defaults})")
    return "; ".join(parts).replace("%", "%%")


def _numbers(values: tuple[float, ...]) -> str:
    return " ".join(f"{value:g}" for value in values)
