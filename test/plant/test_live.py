"""The loop over DDS: a muscle node for each muscle, in processes of their own."""

from __future__ import annotations

import os
from collections.abc import Iterator

import numpy as np
import pytest

from xb_muscle_ros.models.fibre_file import load_fibre
from xb_muscle_ros.plant.loop import run_ankle
from xb_muscle_ros.plant.translation import RampAndHold

pytest.importorskip("mujoco", reason="needs the extra mujoco")

MODEL = "3state_coop"


@pytest.fixture(scope="module")
def nodes() -> Iterator[int]:
    """Two muscle nodes in lockstep; their ROS domain."""
    try:
        import rclpy  # noqa: F401
    except ImportError as error:
        if os.environ.get("CI"):
            raise
        pytest.skip(f"ROS 2 cannot be imported: {error}")
    from xb_muscle_ros.node.process import NodeProcess, private_domain

    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
        domain = private_domain()
        wanted = {"fiber_file": "18Dec2017a", "model": MODEL, "mode": "lockstep"}
        spaces = [["-r", f"__ns:=/{name}"] for name in ("soleus", "tibialis_anterior")]
        with NodeProcess(domain, wanted, spaces[0]), NodeProcess(domain, wanted, spaces[1]):
            yield domain


def test_over_dds_is_as_in_process_and_repeats(nodes: int) -> None:
    from xb_muscle_ros.plant.live import run_ankle_live

    fibre, platform = load_fibre("18Dec2017a", MODEL), RampAndHold()
    first, second = (run_ankle_live(fibre, platform, 0.15, nodes) for _ in range(2))
    assert first.force_n.tobytes() == second.force_n.tobytes()
    assert first.angle_rad.tobytes() == second.angle_rad.tobytes()
    inside = run_ankle(fibre, platform, 0.15)
    # Lengths go through metres, so that they differ in the last bit.
    assert np.max(np.abs(first.force_n - inside.force_n)) < 1e-6
    assert first.force_n[-1, 0] > first.force_n[0, 0] + 100.0


def test_wrong_model_is_named(nodes: int) -> None:
    from xb_muscle_ros.errors import UserError
    from xb_muscle_ros.plant.live import run_ankle_live

    with pytest.raises(UserError, match="has model = 3state_coop, needed is hill_se"):
        run_ankle_live(load_fibre("18Dec2017a", "hill_se"), RampAndHold(), 0.05, nodes)
