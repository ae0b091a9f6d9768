"""``xb_muscle demo``: real recordings replayed offline and through the node, with a figure."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

DESCRIPTION = (
    "Import the recordings of fibre 18Dec2017a (or simulate trials in their place), replay them offline and through a "
    "muscle_node, and draw both."
)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument(
        "--recordings", type=Path, metavar="DIR", help="folder of the recordings (default ../shared/data/recordings)"
    )
    parser.add_argument("--out", type=Path, metavar="DIR", default=Path("out/demo"), help="results (default out/demo)")
    parser.add_argument("--no-live", action="store_true", help="leave the ROS 2 node out")


def run(arguments: argparse.Namespace) -> int:
    """Do it."""
    from xb_muscle_ros.replay.demo import demo

    def timing(*args: Any, **options: Any) -> dict[str, float]:
        # Needs ROS, which is there where this is called.
        from xb_muscle_ros.bench.timing import run_timing

        return run_timing(*args, **options)

    return demo(arguments.recordings, arguments.out, not arguments.no_live, timing)
