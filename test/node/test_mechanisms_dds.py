"""A fibre with diagnosed mechanisms in the node: its file is taken as any other, its forces are replay's to the bit."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import MappingProxyType

import pytest

from xb_muscle_ros.models.fibre_file import load_fibre
from xb_muscle_ros.models.fibre_writing import write_fibre
from xb_muscle_ros.models.muscle import Muscle
from xb_muscle_ros.models.parameters import complete
from xb_muscle_ros.models.registry import with_mechanisms
from xb_muscle_ros.simulation.offline import simulate_trial
from xb_muscle_ros.trials.protocol import StretchShortenStretch

FIBRE = "18Dec2017a"


@pytest.mark.slow
@pytest.mark.parametrize("method", ["gaussian", "characteristics"])
def test_force_through_the_node_is_that_of_replay(method: str, domain: int, tmp_path: Path) -> None:
    from xb_muscle_ros.node.client.live import play_live
    from xb_muscle_ros.node.client.process import NodeProcess

    given = load_fibre(FIBRE, "3state_coop", method)
    name = with_mechanisms(given.model, "viscous_drag", "length_dependent_activation")
    values = complete({**given.values, "smoothing": 0.0, "drag": 0.02, "calcium_per_length": 1.5}, name, "test", method)
    path = tmp_path / "augmented.yaml"
    write_fibre(path, replace(given, model=name, values=MappingProxyType(values)))
    fibre = load_fibre(path)
    trial = StretchShortenStretch(0.0383, 0.01).trial(FIBRE, 6.1)
    offline = simulate_trial(Muscle(fibre), trial).force_n
    with NodeProcess(domain, {"fiber_file": path, "mode": "lockstep"}):
        live = play_live([trial], domain_id=domain, find_s=60.0)[0].force_n
    assert (live == offline).all()
    bare = simulate_trial(Muscle(load_fibre(FIBRE, "3state_coop", method)), trial).force_n
    assert abs(live - bare).max() > 0.005
