"""The leg's eighty muscles in one muscle node, over DDS."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest

pytest.importorskip("mujoco", reason="needs the extra mujoco")
pytest.importorskip("myo_sim", reason="needs the extra body")
pytest.importorskip("rclpy", reason="needs ROS")

FIBRE, MODEL = "18Dec2017a", "3state_coop_slack"
PUSHED_S = 0.15


def node_of(domain: int, mode: str) -> Any:
    """A muscle node with the leg's fibres, which still has other constants and parameters than the leg's."""
    from xb_muscle_ros.node.client.process import NodeProcess
    from xb_muscle_ros.plant.scene_fibres import scene_fibres

    fibres = scene_fibres("myolegs")
    given = {"mode": mode, "fiber_file": FIBRE, "model": fibres.model, "fibers": f"[{', '.join(fibres.names)}]"}
    return NodeProcess(domain, given, ["-r", f"__ns:=/{mode}"])


@pytest.fixture(scope="module")
def lockstep(new_domain: Callable[[], int]) -> Iterator[int]:
    """A node in lockstep; its ROS domain."""
    domain = new_domain()
    with node_of(domain, "lockstep"):
        yield domain


def played(stance: Any, make: Any) -> Any:
    """Pushed backwards."""
    from xb_muscle_ros.plant.leg.body import Body
    from xb_muscle_ros.plant.leg.episode import play
    from xb_muscle_ros.plant.leg.sway import Sway
    from xb_muscle_ros.plant.translation import RampAndHold

    body = Body()
    return play(body, make(body, stance), stance, RampAndHold(), Sway(), PUSHED_S)


@pytest.mark.slow
@pytest.mark.parametrize("gain", [0.0, 3.0])
def test_forces_are_those_of_the_process_but_for_metres(
    lockstep: int, stance: Any, gain: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """To 1e-9 N as they are; to the bit where lengths and forces in the process take the same way through m and N."""
    from xb_muscle_ros.models.fibre_file import load_fibre
    from xb_muscle_ros.plant.leg.drives import make_fibres
    from xb_muscle_ros.plant.leg.live import live_drive
    from xb_muscle_ros.plant.mjcf.muscles import CrossBridgeMuscles
    from xb_muscle_ros.plant.reflex import Reflex

    fibre, reflex = load_fibre(FIBRE, MODEL), Reflex(gain, 0.1 * gain, delay_s=0.02)
    with live_drive(fibre, FIBRE, False, reflex, lockstep, "/lockstep") as make:
        live = played(stance, make)
    inside = played(stance, make_fibres(fibre, FIBRE, False, reflex))
    assert live.time_s.size == inside.time_s.size == round(1000 * PUSHED_S) + 1
    assert np.max(np.abs(live.force_n - inside.force_n)) < 1e-9
    assert np.max(np.abs(inside.force_n[-1] - inside.force_n[0])) > 50.0

    plain_length, plain_pull = CrossBridgeMuscles.length_change_l0, CrossBridgeMuscles._pull

    def length(muscles: CrossBridgeMuscles, data: Any) -> Any:
        return (1.0 + plain_length(muscles, data)) * muscles.l0_m / muscles.l0_m - 1.0

    def pull(muscles: CrossBridgeMuscles, data: Any, force_f0: Any) -> Any:
        return plain_pull(muscles, data, force_f0 * muscles.f0_n / muscles.f0_n)

    make_inside = make_fibres(fibre, FIBRE, False, reflex)

    def through_metres(body: Any, stance: Any) -> Any:
        # Calcium is found without that detour, as for the node.
        drive = make_inside(body, stance)
        monkeypatch.setattr(CrossBridgeMuscles, "length_change_l0", length)
        monkeypatch.setattr(CrossBridgeMuscles, "_pull", pull)
        return drive

    exact = played(stance, through_metres)
    if not gain:
        assert live.force_n.tobytes() == exact.force_n.tobytes()
        assert live.com_m.tobytes() == exact.com_m.tobytes()
    else:
        # The reflex has lengths from before the detour, and differs in the last bit.
        assert np.max(np.abs(live.force_n - exact.force_n)) < 1e-9


@pytest.mark.slow
def test_plant_node_plays_the_same_in_lockstep_until_the_body_falls(lockstep: int, stance: Any) -> None:
    """Joints of the episode in process, tick by tick; then the reason, and all joints for viewers."""
    from sensor_msgs.msg import JointState

    from xb_muscle_ros.models.fibre_file import load_fibre
    from xb_muscle_ros.node.client.link import Link
    from xb_muscle_ros.node.client.process import NodeProcess
    from xb_muscle_ros.plant.leg.drives import make_fibres

    # One episode takes half a second: it may be over before the audience is known.
    given = {"scene": "myolegs", "duration_s": 3.0, "episodes": 6}
    module = "xb_muscle_ros.plant.plant_node"
    with Link("audience", "/lockstep", lockstep) as link:
        heard: dict[str, list[Any]] = {"plant/joint": [], "joint_states": []}
        for topic, messages in heard.items():
            link.node.create_subscription(JointState, topic, messages.append, 5000)
        with NodeProcess(lockstep, given, ["-r", "__ns:=/lockstep"], module) as plant:
            assert link.wait_for(lambda: plant.process.poll() is not None, 90.0), plant.log()
            link.wait_for(lambda: False, 0.3)
            assert plant.process.poll() == 2
            assert "the body fell: the centre of mass is before the toes" in plant.log()
            assert "Traceback" not in plant.log()
    inside = played(stance, make_fibres(load_fibre(FIBRE, MODEL), FIBRE, False))
    by_tick = {m.header.stamp.sec * 1000 + m.header.stamp.nanosec // 1_000_000: m for m in heard["plant/joint"]}
    # The first tick settles and takes no time.
    both = [k for k in range(inside.time_s.size) if k + 1 in by_tick]
    assert len(both) > 100
    angles = np.array([by_tick[k + 1].position for k in both])
    assert np.max(np.abs(angles - inside.angle_rad[both])) < 1e-12
    assert list(by_tick[both[0] + 1].name) == ["ankle_angle", "knee_angle", "hip_flexion"]
    viewed = heard["joint_states"]
    assert {"knee_angle_r", "ankle_angle_l"} <= set(viewed[0].name)
    stamps = [m.header.stamp.sec * 1000 + m.header.stamp.nanosec // 1_000_000 for m in viewed]
    anew = np.flatnonzero(np.diff(stamps) < 0)
    last = stamps[anew[-1] + 1 :]
    assert len(last) > 20
    assert np.all(np.diff(last) == 20)


@pytest.mark.slow
def test_plant_node_moves_the_leg_in_real_time(new_domain: Callable[[], int]) -> None:
    """Held without a push for its time; the fibres are stepped by the node's own clock."""
    from xb_muscle_ros.node.client.process import NodeProcess

    domain = new_domain()
    given = {"scene": "myolegs", "mode": "realtime", "duration_s": 0.3, "episodes": 2, "displacement_m": -1e-6}
    arguments = ["-r", "__ns:=/realtime"]
    with (
        node_of(domain, "realtime") as muscles,
        NodeProcess(domain, given, arguments, "xb_muscle_ros.plant.plant_node") as plant,
    ):
        assert plant.wait(90.0) == 0, plant.log()
        assert plant.log().count("episode of 300 ticks") == 2
        assert "refused" not in muscles.log()
