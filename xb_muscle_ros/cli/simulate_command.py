"""``xb_muscle simulate``: the stretch-shorten-stretch protocol through a model, as bags."""

from __future__ import annotations

import argparse
import itertools
from dataclasses import replace

from xb_muscle_ros.cli import common

# Options that are numbers, and what their ranges go by.
_NUMBERS = {
    "pca": "pca",
    "amplitude": "amplitude_l0",
    "recovery": "recovery_s",
    "rate": "rate_hz",
    "settle": "settle_s",
}
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
    """Simulate and write."""
    from xb_muscle_ros.errors import naming
    from xb_muscle_ros.files import refuse_older
    from xb_muscle_ros.models.muscle import Muscle
    from xb_muscle_ros.progress import Progress
    from xb_muscle_ros.simulation.offline import as_simulated, pushing
    from xb_muscle_ros.trials.bags import write_trial
    from xb_muscle_ros.trials.protocol import ALLOWED, StretchShortenStretch

    for option, name in _NUMBERS.items():
        value = getattr(arguments, option)
        for number in value if isinstance(value, list) else [] if value is None else [value]:
            ALLOWED[name].check(f"--{option}", number)
    fibre = common.fibre_of(arguments)
    planned = []
    for pca, amplitude, recovery in itertools.product(arguments.pca, arguments.amplitude, arguments.recovery):
        protocol = StretchShortenStretch(amplitude, recovery)
        trial = protocol.trial(fibre.name, pca, arguments.rate)
        planned.append((protocol, trial, arguments.out / f"{arguments.prefix}_{fibre.name}_{trial.facts.trial}"))
    refuse_older([path for _, _, path in planned if path.exists()], arguments.overwrite)
    muscle = Muscle(fibre)
    with Progress(len(planned), "simulate") as progress:
        for protocol, trial, path in planned:
            calcium = float(trial.calcium_um[0])
            corner_s, corner_l0 = protocol.corners()
            with naming(f"trial {trial.facts.trial}"):
                state = muscle.settle(0.0, calcium, arguments.settle)
                # Variable steps from corner to corner: the protocol itself, not its samples.
                states = muscle.follow(state, corner_s, corner_l0, 0.0 * corner_s + calcium, trial.time_s)
            simulated = as_simulated(muscle, trial, trial.time_s, states)
            source = f"simulated: fibre {fibre.name}, model {fibre.model}, method {fibre.method}"
            trial = replace(trial, facts=replace(trial.facts, source=source))
            if arguments.as_measured:
                trial = replace(trial, force_time_s=trial.time_s, force_n=simulated.force_n)
            write_trial(path, trial, simulated)
            low, high = simulated.force_n.min(), simulated.force_n.max()
            if told := pushing(trial, simulated, fibre.model):
                common.warn(told)
            progress.write(f"{path}: {trial.time_s.size} samples, force {low:.3f} to {high:.3f} F0")
            progress.update()
    return 0
