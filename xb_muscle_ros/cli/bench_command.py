"""``xb_muscle bench``: measured times, on screen and in ``bench.json``."""

from __future__ import annotations

import argparse
from pathlib import Path

from xb_muscle_ros.bench.studies import STUDIES
from xb_muscle_ros.cli import common

DESCRIPTION = "Measure how fast models and node are; the figures also go to bench.json, with the machine."
EPILOG = f"Studies: {'; '.join(f'{name}: {study.help}' for name, study in STUDIES.items())}."


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    common.add_fibre(parser, "18Dec2017a")
    common.add_model(parser)
    parser.add_argument(
        "--study", nargs="+", choices=STUDIES, default=["rhs", "trial"], metavar="STUDY",
        help="what to measure, see below (default rhs trial)",
    )  # fmt: skip
    common.add_out(parser, "file for the figures", "bench.json", metavar="FILE")
    peers = parser.add_argument_group("peers")
    peers.add_argument("--empirical", type=Path, metavar="FILE", help="measured SRS, as for evaluate --paper")
    peers.add_argument(
        "--peers-python", type=Path, metavar="FILE",
        help="Python with OpenSim (default: XB_MUSCLE_PEERS_PYTHON, else that of scripts/setup_peers)",
    )  # fmt: skip
    node = parser.add_argument_group("studies of a running node and the soak")
    node.add_argument(
        "--duration", type=float, default=60.0, metavar="S", help="of node, roundtrip and many, s (default 60)"
    )
    node.add_argument(
        "--rate", type=float, metavar="HZ", help="of these, Hz (default: node 1000, roundtrip and many 500)"
    )
    node.add_argument(
        "--priority", type=int, default=0, metavar="P",
        help="realtime_priority of the node in node and many (default 0: ordinary)",
    )  # fmt: skip
    node.add_argument("--fibers", type=int, default=100, metavar="N", help="of many (default 100)")
    node.add_argument("--ticks", type=int, default=10_000_000, metavar="N", help="of soak (default 10 million)")


def run(arguments: argparse.Namespace) -> int:
    """Measure, print, write."""
    from xb_muscle_ros.bench import measure, studies

    of_node = (arguments.duration, arguments.rate, arguments.priority, arguments.fibers)
    of_peers = (arguments.empirical, arguments.peers_python)
    setting = measure.Setting(common.fibre_of(arguments), arguments.out, *of_node, arguments.ticks, *of_peers)
    made = studies.run(arguments.study, setting, arguments.overwrite)
    print(measure.as_text(made))
    measure.write(arguments.out, made)
    print(arguments.out)
    return 0
