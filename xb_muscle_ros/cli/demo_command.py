"""``xb_muscle demo``: real recordings replayed offline and through the node, with a figure."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from xb_muscle_ros.cli.common import Subparsers


def add(subparsers: Subparsers) -> None:
    """Add the command to the command line."""
    parser = subparsers.add_parser(
        "demo",
        help="replay the recordings of fibre 18Dec2017a offline and through the node",
        description="Import the recordings of fibre 18Dec2017a (or simulate trials), replay them offline and live.",
    )
    parser.add_argument("--recordings", type=Path, help="folder of the recordings (default ../shared/data/recordings)")
    parser.add_argument("--out", type=Path, default=Path("out/demo"), help="folder for results (default out/demo)")
    parser.add_argument("--no-live", action="store_true", help="leave the ROS 2 node out")
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Do it."""
    from xb_muscle_ros.replay.demo import demo

    def timing(*args: Any, **options: Any) -> dict[str, float]:
        # Needs ROS, which is there where this is called.
        from xb_muscle_ros.bench.timing import run_timing

        return run_timing(*args, **options)

    return demo(arguments.recordings, arguments.out, not arguments.no_live, timing)
