"""``xb_muscle simulate``: the stretch-shorten-stretch protocol through a model, as bags."""

from __future__ import annotations

import argparse

from xb_muscle_ros.cli import common

DESCRIPTION = (
    "Simulate every combination of the given pCa, amplitudes and recovery times of the stretch-shorten-stretch "
    "protocol; one bag for each."
)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    common.add_fibre(parser, required=True)
    common.add_model(parser)
    parser.add_argument("--pca", type=float, nargs="+", default=[6.1], help="pCa of the bathing solution (default 6.1)")
    parser.add_argument(
        "--amplitude", type=float, nargs="+", default=[0.0383], metavar="L0",
        help="conditioning stretch, L0 (default 0.0383; 0: none)",
    )  # fmt: skip
    parser.add_argument(
        "--recovery", type=float, nargs="+", default=[0.001], metavar="S",
        help="time between shortening and test stretch, s (default 0.001)",
    )  # fmt: skip
    parser.add_argument("--rate", type=float, default=1000.0, metavar="HZ", help="samples per second (default 1000)")
    common.add_settle(parser)
    parser.add_argument(
        "--as-measured", action="store_true",
        help="also write the force as measured force, to replay the bag like a recording",
    )  # fmt: skip
    parser.add_argument("--prefix", default="simulated", help="begins the names of the bags (default simulated)")
    common.add_out(parser, "folder for the bags", "bags")


def run(arguments: argparse.Namespace) -> int:
    """Simulate and write, one trial after the other."""
    from xb_muscle_ros.api import simulating
    from xb_muscle_ros.files import refuse_older
    from xb_muscle_ros.progress import Progress
    from xb_muscle_ros.simulation.offline import pushing
    from xb_muscle_ros.trials.bags import write_trial

    pca, amplitude, recovery, rate = arguments.pca, arguments.amplitude, arguments.recovery, arguments.rate
    simulating.check_numbers(pca=pca, amplitude=amplitude, recovery=recovery, rate=rate, settle=arguments.settle)
    fibre = common.fibre_of(arguments)
    planned = simulating.protocols(fibre, pca, amplitude, recovery, rate)
    paths = [simulating.bag_path(arguments.out, arguments.prefix, trial) for _, trial in planned]
    refuse_older([path for path in paths if path.exists()], arguments.overwrite)
    made = simulating.simulations(fibre, planned, arguments.settle, arguments.as_measured)
    with Progress(len(planned), "simulate") as progress:
        for path, (trial, simulated) in zip(paths, made, strict=True):
            write_trial(path, trial, simulated)
            if told := pushing(trial, simulated, fibre.model):
                common.warn(told)
            low, high = simulated.force_n.min(), simulated.force_n.max()
            progress.write(f"{path}: {trial.time_s.size} samples, force {low:.3f} to {high:.3f} F0")
            progress.update()
    return 0
