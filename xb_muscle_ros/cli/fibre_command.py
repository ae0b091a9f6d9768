"""``xb_muscle fibre new``: a fibre file to start from."""

from __future__ import annotations

import argparse
from pathlib import Path

from xb_muscle_ros.cli import common

DESCRIPTION = (
    "Write a fibre file from a published parameter set and from what is known of the fibre. The file says where each "
    "value comes from; what is not known stays as published, and a line says so."
)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument("action", choices=("new",), help="write a new fibre file")
    parser.add_argument("name", metavar="NAME", help="name of the fibre; the file is NAME.yaml")
    parser.add_argument("--like", metavar="FIBER", help="fibre of the package (default: nearest to the median of all)")
    parser.add_argument("--model", help="parameter set that the file picks (default: that of the published file)")
    parser.add_argument("--length", metavar="LENGTH", help="L0, for example 1.2mm")
    parser.add_argument("--f0", metavar="FORCE", help="F0, for example 0.5mN")
    parser.add_argument("--area", metavar="AREA", help="cross-section, for example 0.005mm2")
    parser.add_argument("--temperature", type=float, metavar="C", help="of the experiments, °C")
    parser.add_argument("--q10", type=float, metavar="X", help="scale rates to --temperature by this factor per 10 K")
    parser.add_argument("--species", help="for example rat")
    parser.add_argument("--muscle", help="for example soleus")
    common.add_out(parser, "folder of the file", ".")


def run(arguments: argparse.Namespace) -> int:
    """Write the file, say where its values come from."""
    from xb_muscle_ros.api.new_fibre import new_fibre

    path: Path = common.called(new_fibre, arguments, folder=arguments.out, tell=print)
    print(path)
    return 0
