"""The loop over DDS: a muscle node in a process of its own."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
import pytest

from xb_muscle_ros.models.fibre_file import load_fibre
from xb_muscle_ros.plant.loop import run_ankle, run_knee
from xb_muscle_ros.plant.reflex import Reflex
from xb_muscle_ros.plant.translation import RampAndHold

pytest.importorskip("mujoco", reason="needs the extra mujoco")

MODEL = "3state_coop"


@pytest.fixture(scope="module")
def nodes(new_domain: Callable[[], int]) -> Iterator[int]:
    """Muscle nodes in lockstep for both scenes, in namespaces of their own; their ROS domain."""
    from xb_muscle_ros.node.client.process import NodeProcess

    domain = new_domain()
    wanted = {"fiber_file": "18Dec2017a", "model": MODEL, "mode": "lockstep"}
    ankle = NodeProcess(domain, {**wanted, "fibers": "[soleus, tibialis_anterior]"}, ["-r", "__ns:=/ankle"])
    knee = NodeProcess(domain, {**wanted, "fibers": "[vasti]"}, ["-r", "__ns:=/knee"])
    with ankle, knee:
        yield domain


@pytest.mark.slow
def test_over_dds_is_as_in_process_and_repeats(nodes: int) -> None:
    from xb_muscle_ros.plant.live import over_ros

    fibre, platform = load_fibre("18Dec2017a", MODEL), RampAndHold()
    first, second = (run_ankle(fibre, platform, 0.15, muscles=over_ros(nodes, "/ankle")) for _ in range(2))
    assert first.force_n.tobytes() == second.force_n.tobytes()
    assert first.angle_rad.tobytes() == second.angle_rad.tobytes()
    inside = run_ankle(fibre, platform, 0.15)
    # Lengths go through metres, so that they differ in the last bit.
    assert np.max(np.abs(first.force_n - inside.force_n)) < 1e-6
    assert first.force_n[-1, 0] > first.force_n[0, 0] + 100.0


def test_elastic_tendons_over_dds(nodes: int) -> None:
    """One answer per tick does nearly as well as the balance that is solved for in one process."""
    from xb_muscle_ros.plant.live import over_ros

    fibre, platform = load_fibre("18Dec2017a", MODEL), RampAndHold()
    live = run_ankle(fibre, platform, 0.15, True, over_ros(nodes, "/ankle"))
    inside = run_ankle(fibre, platform, 0.15, elastic=True)
    rise = inside.force_n[-1, 0] - inside.force_n[0, 0]
    assert rise > 50.0
    assert np.max(np.abs(live.force_n[:, 0] - inside.force_n[:, 0])) < 0.001 * rise
    assert np.max(np.abs(live.length_change_l0 - inside.length_change_l0)) < 1e-5


@pytest.mark.slow
@pytest.mark.parametrize("elastic", [False, True])
def test_knee_over_dds(nodes: int, elastic: bool) -> None:
    """Without the parallel element, which the plant takes out of the node's fibre; moved before release as well."""
    from xb_muscle_ros.plant.live import over_ros

    fibre = load_fibre("18Dec2017a", MODEL)
    assert fibre.values["kpe"] > 0.0
    live = run_knee(fibre, True, 0.3, elastic, over_ros(nodes, "/knee"))
    inside = run_knee(fibre, True, 0.3, elastic)
    # Peak 180 N.
    assert np.max(np.abs(live.force_n - inside.force_n)) < (1.0 if elastic else 1e-5)
    assert np.max(np.abs(live.angle_rad - inside.angle_rad)) < (1e-3 if elastic else 1e-9)
    assert live.angle_rad[-1] > 0.3


def test_wrong_nodes_are_named(nodes: int) -> None:
    from xb_muscle_ros.errors import UserError
    from xb_muscle_ros.plant.live import over_ros

    with pytest.raises(
        UserError, match=r"has model = 3state_coop, needed is hill_se; .* -r __ns:=/ankle .*model:=hill_se"
    ):
        run_ankle(load_fibre("18Dec2017a", "hill_se"), RampAndHold(), 0.05, muscles=over_ros(nodes, "/ankle"))
    with pytest.raises(UserError, match="has no fibre 'soleus'"):
        run_ankle(load_fibre("18Dec2017a", MODEL), RampAndHold(), 0.05, muscles=over_ros(nodes, "/knee"))


@pytest.mark.slow
def test_reflex_over_dds(nodes: int) -> None:
    """Calcium is sent as far ahead as the reflex is delayed, so that no step waits for it; elastic tendons as well."""
    from xb_muscle_ros.plant.live import over_ros

    fibre, reflex = load_fibre("18Dec2017a", MODEL), Reflex(4.0, 0.2, 0.5)
    for elastic, nearness in ((False, 1e-6), (True, 0.5)):
        live = run_ankle(fibre, RampAndHold(), 0.25, elastic, over_ros(nodes, "/ankle"), reflex)
        inside = run_ankle(fibre, RampAndHold(), 0.25, elastic, reflex=reflex)
        assert live.level[-1, 0] > live.level[0, 0]
        assert np.max(np.abs(live.force_n - inside.force_n)) < nearness


def test_a_body_that_falls_ends_the_run_with_what_went_before(nodes: int) -> None:
    """The node would refuse the next length; nobody waits for its answer."""
    from xb_muscle_ros.plant.live import over_ros

    live = run_ankle(
        load_fibre("18Dec2017a", MODEL), RampAndHold(-0.9, 3.0, 30.0), 0.6, muscles=over_ros(nodes, "/ankle")
    )
    assert 0.05 < live.time_s[-1] < 0.55
    assert "beyond 0.5 to 1.5 L0, which the node refuses" in live.ended
    assert np.all(np.abs(live.length_change_l0) <= 0.5)
