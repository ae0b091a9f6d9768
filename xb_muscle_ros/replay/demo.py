"""The main job in one go: recordings to bags, through the model, through the node, into a figure."""

from __future__ import annotations

import functools
import importlib.util
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path

from xb_muscle_ros.models.fibre_file import fibre_folders, find_fibre_file, load_fibre
from xb_muscle_ros.models.muscle import Muscle
from xb_muscle_ros.replay.run import replay, write_results
from xb_muscle_ros.simulation.offline import simulate_trial
from xb_muscle_ros.trials.bags import read_trial, write_trial
from xb_muscle_ros.trials.protocol import StretchShortenStretch
from xb_muscle_ros.trials.readers.csv import read_csv
from xb_muscle_ros.trials.readers.mapping import build_mapping, load_mapping

FIBRE = "18Dec2017a"
_RECORDINGS = Path("../shared/data/recordings")
_MAPPING = Path("scripts/datasets/rat_soleus_18Dec2017a.yaml")
_FILES = "rat_soleus_18Dec2017a/amp*.csv"
_PCAS = (4.5, 6.1, 6.3, 6.6, 9.0)
# A muscle with what the diagnosis of its recordings found missing, and how long it runs at which rate.
AUGMENTED = Path("augmented") / "GMe1.yaml"
_REALTIME_S, _RATE_HZ = 5.0, 1000.0

Timing = Callable[..., Mapping[str, float]]


def demo(recordings: Path | None, out: Path, live: bool, timing: Timing) -> int:
    """Run the demo from the top of the source tree; returns the exit code, 1 where node and replay differ.

    Args:
        recordings: folder with the recordings of the rat soleus; looked for beside the source tree where None.
        live: also through a muscle_node, over DDS.
        timing: measures a realtime node: `bench.timing.run_timing`.

    Raises:
        UserError: see `replay`.
    """
    files = sorted((recordings or _RECORDINGS).glob(_FILES))
    if files and _MAPPING.is_file():
        print(f"{len(files)} recordings of fibre {FIBRE} from {files[0].parent}")
        bags = _import(files, out / "trials")
    else:
        print(f"no recordings at {recordings or _RECORDINGS} ({_FILES}): simulating trials in their place")
        bags = _simulate(out / "trials")
    trials = [read_trial(bag) for bag in bags]
    fibre = load_fibre(FIBRE)
    offline = replay(trials, fibre)
    print(f"\n{offline.table}")
    through_node, agrees = None, True
    if live and importlib.util.find_spec("rclpy") is None:
        print("\nROS 2 is not installed here (rclpy): the part through muscle_node is left out")
    elif live:
        from xb_muscle_ros.node.client.live import play_live
        from xb_muscle_ros.node.client.process import NodeProcess, private_domain

        domain = private_domain()
        with NodeProcess(domain, {"fiber_file": find_fibre_file(FIBRE), "mode": "lockstep"}):
            through_node = replay(trials, fibre, functools.partial(play_live, domain_id=domain, find_s=30.0))
        print(f"\n{through_node.table}")
        write_results(out / "live", trials, through_node)
        agrees = all(
            bool((a.force_n == b.force_n).all()) and a.force_n.size == b.force_n.size
            for a, b in zip(offline.simulated, through_node.simulated, strict=True)
        )
        print(f"\nforce through the node equals offline replay {'bit for bit' if agrees else 'NOT BIT FOR BIT'}")
        _augmented_in_realtime(timing)
    print("\nresults:")
    for path in write_results(out, trials, offline, through_node):
        print(f"  {path.resolve()}")
    return 0 if agrees else 1


def _augmented_in_realtime(timing: Timing) -> None:
    """A diagnosed model in a realtime node, and how punctual that is."""
    path = next((f / AUGMENTED for f in fibre_folders() if (f / AUGMENTED).is_file()), None)
    if path is None:
        return
    fibre = load_fibre(path)
    # The measurement moves a fibre of 1 m; forces in F0 do not depend on it.
    found = timing(_REALTIME_S, _RATE_HZ, str(path), settings={"constants.reference_length_m": 1.0})
    core = 100.0 * found["cpu_share"]
    late = f"late by {found['lateness_p50_us']:.0f} µs (median), {found['lateness_p99_us']:.0f} µs (99 %)"
    print(
        f"\nmuscle {fibre.name}, model {fibre.model} (method {fibre.method}), found by diagnosis, in muscle_node at "
        f"{_RATE_HZ:g} Hz for {_REALTIME_S:g} s: {found['rate_hz']:.1f} ticks/s, {late}, {core:.0f} % of a core, "
        f"{found['state_violations']:.0f} state violations"
    )


def _import(files: list[Path], folder: Path) -> list[Path]:
    mapping = build_mapping(load_mapping(_MAPPING), f"mapping {_MAPPING}")
    bags = [folder / file.stem for file in files]
    for bag, file in zip(bags, files, strict=True):
        write_trial(bag, read_csv(file, mapping))
    return bags


def _simulate(folder: Path) -> list[Path]:
    """Trials of another parameter set of the fibre, in the place of measurements."""
    stand_in = Muscle(load_fibre(FIBRE, "3state_coop_v3"))
    bags = []
    for pca in _PCAS:
        trial = StretchShortenStretch(0.0383, 0.001).trial(FIBRE, pca)
        force = simulate_trial(stand_in, trial).force_n
        facts = replace(trial.facts, source=f"simulated with {stand_in.fibre.model}, in the place of a recording")
        bags.append(folder / trial.facts.trial)
        write_trial(bags[-1], replace(trial, facts=facts, force_time_s=trial.time_s, force_n=force))
    return bags
