"""``xb_muscle simulate``: the stretch-shorten-stretch protocol through a model, as bags."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from xb_muscle_ros.cli.common import add_fibre, add_overwrite, fibre_of, warn

if TYPE_CHECKING:
    from xb_muscle_ros.cli.common import Subparsers


def add(subparsers: Subparsers) -> None:
    """Add the command to the command line."""
    parser = subparsers.add_parser(
        "simulate",
        help="simulate stretch-shorten-stretch trials into bags",
        description="Simulate every combination of the given pCa, amplitudes and recovery times; one bag for each.",
    )
    add_fibre(parser)
    parser.add_argument("--pca", type=float, nargs="+", default=[6.1], help="pCa of the bathing solution (default 6.1)")
    parser.add_argument(
        "--amplitude",
        type=float,
        nargs="+",
        default=[0.0383],
        help="conditioning stretch, L0 (default 0.0383; 0: none)",
    )
    parser.add_argument("--recovery", type=float, nargs="+", default=[0.001], help="recovery, s (default 0.001)")
    parser.add_argument("--rate", type=float, default=1000.0, help="samples per second (default 1000)")
    parser.add_argument("--settle", type=float, help="isometric time before the trial, s (default: until at rest)")
    parser.add_argument(
        "--as-measured",
        action="store_true",
        help="also write the force as measured force, to replay the bag like a recording",
    )
    parser.add_argument("--prefix", default="simulated", help="begins the names of the bags (default 'simulated')")
    parser.add_argument("--out", type=Path, default=Path("bags"), help="folder for the bags (default 'bags')")
    add_overwrite(parser)
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Simulate and write, one trial after the other."""
    from xb_muscle_ros.api import simulating
    from xb_muscle_ros.files import refuse_older
    from xb_muscle_ros.simulation.offline import pushing
    from xb_muscle_ros.trials.bags import write_trial

    pca, amplitude, recovery, rate = arguments.pca, arguments.amplitude, arguments.recovery, arguments.rate
    simulating.check_numbers(pca=pca, amplitude=amplitude, recovery=recovery, rate=rate, settle=arguments.settle)
    fibre = fibre_of(arguments)
    planned = simulating.protocols(fibre, pca, amplitude, recovery, rate)
    paths = [simulating.bag_path(arguments.out, arguments.prefix, trial) for _, trial in planned]
    refuse_older([path for path in paths if path.exists()], arguments.overwrite)
    made = simulating.simulations(fibre, planned, arguments.settle, arguments.as_measured)
    for path, (trial, simulated) in zip(paths, made, strict=True):
        write_trial(path, trial, simulated)
        told = pushing(trial, simulated, fibre.model)
        if told:
            warn(told)
        low, high = simulated.force_n.min(), simulated.force_n.max()
        print(f"{path}: {trial.time_s.size} samples, force {low:.3f} to {high:.3f} F0")
    return 0
