"""Bodies and muscles in processes of their own, that die and come back."""

from __future__ import annotations

import itertools
import signal
from collections.abc import Callable, Iterator
from typing import Any

import pytest

from xb_muscle_ros.errors import UserError

pytest.importorskip("mujoco", reason="needs the extra mujoco")

PLANT = "xb_muscle_ros.plant.plant_node"
PATIENCE_S = 30.0


class Stage:
    """One domain, processes by name, and what the bodies say of their joints.

    Attributes:
        joints: time (s) and angle (rad) so far, by namespace.
    """

    def __init__(self, domain: int) -> None:
        from xb_muscle_ros.node.client.link import Link

        self.domain = domain
        self.link = Link("audience", domain_id=domain)
        self.processes: dict[str, Any] = {}
        self.joints: dict[str, list[tuple[float, float]]] = {}

    def muscle(self, space: str, mode: str) -> None:
        """Start the muscles of a namespace's body."""
        given = {"fiber_file": "18Dec2017a", "mode": mode, "fibers": "[soleus, tibialis_anterior]", "timeout_s": 0.2}
        self._start(f"muscle{space}", space, given, "xb_muscle_ros.node.main")

    def plant(self, space: str, mode: str, **given: Any) -> None:
        """Start a body."""
        self._start(f"plant{space}", space, {"mode": mode, "timeout_s": 0.5, **given}, PLANT)

    def _start(self, name: str, space: str, given: dict[str, Any], module: str) -> None:
        from sensor_msgs.msg import JointState

        from xb_muscle_ros.node.client.process import NodeProcess

        self.processes[name] = NodeProcess(self.domain, given, ["-r", f"__ns:={space}"], module)
        if space not in self.joints:
            heard = self.joints[space] = []

            def hear(message: Any) -> None:
                stamp = message.header.stamp
                heard.append((stamp.sec + stamp.nanosec * 1e-9, message.position[0]))

            # While processes start and end nobody listens, for seconds of some thousand ticks each.
            self.link.node.create_subscription(JointState, f"{space}/plant/joint", hear, 5000)

    def kill(self, name: str) -> None:
        """Without a warning."""
        process = self.processes.pop(name)
        process.process.kill()
        assert process.wait() == -signal.SIGKILL

    def until(self, condition: Callable[[], Any]) -> None:
        """Wait until something holds."""
        assert self.link.wait_for(lambda: bool(condition()), PATIENCE_S), (
            {name: process.log()[-600:] for name, process in self.processes.items()},
            {s: len(j) for s, j in self.joints.items()},
        )

    def moves_on(self, space: str, ticks: int = 200) -> None:
        """A body ticks."""
        target = len(self.joints[space]) + ticks
        self.until(lambda: len(self.joints[space]) >= target)

    def until_ended(self, name: str) -> int:
        """Exit code of a process, which ends by itself; meanwhile the audience listens."""
        process = self.processes[name].process
        self.until(lambda: process.poll() is not None)
        self.link.wait_for(lambda: False, 0.3)
        return int(process.poll())

    def episode_statuses(self, node: str) -> list[Any]:
        """What a body says of its episodes in /diagnostics from now on."""
        from diagnostic_msgs.msg import DiagnosticArray

        heard: list[Any] = []
        name = f"{node.lstrip('/')}: episode"

        def hear(message: Any) -> None:
            heard.extend(status for status in message.status if status.name == name)

        self.link.node.create_subscription(DiagnosticArray, "/diagnostics", hear, 100)
        return heard

    def peer(self, space: str) -> Any:
        """The link, as a client of a namespace's muscle node."""
        self.link.peer = f"{space}/muscle_node"
        return self.link

    def log(self, name: str) -> str:
        """Of a process."""
        return str(self.processes[name].log())


@pytest.fixture
def stage(new_domain: Callable[[], int]) -> Iterator[Stage]:
    """All ends with the test."""
    made = Stage(new_domain())
    yield made
    for process in made.processes.values():
        process.stop()
    made.link.close()


THROWN = {"displacement_m": -0.9, "speed_m_per_s": 3.0, "acceleration_m_per_s2": 30.0, "duration_s": 5.0}
"""A push after which no fibre can follow the body."""


def last_episode(heard: list[tuple[float, float]]) -> list[tuple[float, float]]:
    """From the last time 0 on."""
    return heard[max(k for k, (time_s, _) in enumerate(heard) if time_s == 0.0) :]


def episodes(heard: list[tuple[float, float]]) -> list[list[tuple[float, float]]]:
    """Whole episodes: each begins at time 0."""
    starts = [k for k, (time_s, _) in enumerate(heard) if time_s == 0.0]
    return [heard[a:b] for a, b in itertools.pairwise(starts)]


@pytest.mark.slow
def test_lockstep_survives_the_death_of_either_side_and_namespaces_do_not_mix(stage: Stage) -> None:
    """Two loops on one graph: one suffers, the other repeats its episodes bit for bit all the while."""
    for space in ("/a", "/b"):
        stage.muscle(space, "lockstep")
        stage.plant(space, "lockstep", duration_s=0.2)
    for space in ("/a", "/b"):
        stage.until(lambda space=space: len(episodes(stage.joints[space])) >= 2)
    stage.kill("muscle/a")
    stage.until(lambda: "asking again" in stage.log("plant/a") or "waiting" in stage.log("plant/a"))
    # What was said before its end may still be on its way.
    stage.moves_on("/b")
    count = len(stage.joints["/a"])
    stage.moves_on("/b")
    assert len(stage.joints["/a"]) == count
    stage.muscle("/a", "lockstep")
    stage.moves_on("/a", 450)
    stage.kill("plant/a")
    stage.moves_on("/b")
    stage.joints["/a"].clear()
    stage.plant("/a", "lockstep", duration_s=0.2)
    stage.until(lambda: len(episodes(stage.joints["/a"])) >= 2)
    reference = episodes(stage.joints["/b"])[0]
    assert len(reference) == 200
    assert len({angle for _, angle in reference}) > 100
    assert all(episode == reference for episode in episodes(stage.joints["/b"]))
    assert all(episode == reference for episode in episodes(stage.joints["/a"]))
    assert "Traceback" not in "".join(stage.log(name) for name in stage.processes)


@pytest.mark.slow
def test_realtime_survives_the_death_of_either_side(stage: Stage) -> None:
    """The body waits for its muscles, the muscles notice that length stays away; both go on when the other is back."""
    stage.muscle("/c", "realtime")
    stage.plant("/c", "realtime", duration_s=0.5)
    stage.until(lambda: stage.log("plant/c").count("episode of 500 ticks") >= 1)
    stage.kill("muscle/c")
    stage.until(lambda: "the body waits for it" in stage.log("plant/c") or "waiting:" in stage.log("plant/c"))
    stage.muscle("/c", "realtime")
    before = stage.log("plant/c").count("episode of 500 ticks")
    # The first to end may be one that the killed node had played to its last tick.
    stage.until(lambda: stage.log("plant/c").count("episode of 500 ticks") > before + 1)
    stage.kill("plant/c")
    # A slow machine may have been late before.
    stage.until(lambda: stage.log("muscle/c").rfind("no length for") > stage.log("muscle/c").rfind("length is back"))
    stage.plant("/c", "realtime", duration_s=0.5)
    stage.until(lambda: stage.log("plant/c").count("episode of 500 ticks") >= 1)
    assert "Traceback" not in "".join(stage.log(name) for name in stage.processes)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("given", "words"),
    [({"scene": "elbow"}, "allowed is ankle or knee"), ({"duration": 1.0}, "did you mean 'duration_s'?")],
)
def test_bad_parameters_end_with_code_2_and_one_line(stage: Stage, given: dict[str, Any], words: str) -> None:
    """As the muscle node does."""
    stage._start("plant", "/d", given, PLANT)
    assert stage.processes["plant"].wait() == 2
    assert words in stage.log("plant")
    assert stage.log("plant").count("\n") == 1


def test_arguments_that_are_not_of_ros_are_refused() -> None:
    """Both nodes; without --ros-args a parameter would be passed over."""
    from xb_muscle_ros.node.program import begin

    for arguments in (["extra"], ["--", "x"]):
        with pytest.raises(UserError, match=f"argument '{arguments[0]}' is not known; ROS arguments come after"):
            begin("plant_node", arguments)


@pytest.mark.slow
@pytest.mark.parametrize("mode", ["lockstep", "realtime"])
def test_a_body_that_falls_ends_its_episode_with_reason_code_and_last_state(stage: Stage, mode: str) -> None:
    """No fibre can follow it any further; the node that would refuse its lengths is not asked for ever."""
    heard = stage.episode_statuses("/e/plant_node")
    stage.plant("/e", mode, episodes=2, **THROWN)
    stage.until(lambda: stage.link.node.count_publishers("/e/plant/joint") > 0)
    stage.muscle("/e", mode)
    assert stage.until_ended("plant/e") == 2
    log = stage.log("plant/e")
    # The next one begins all the same; the exit tells of both.
    assert "episode 1 ended before its time: the fibre of" in log
    assert "plant_node: 2 of 2 episodes ended before their time; the last: episode 2 ended" in log
    # The first may have come before the audience was known, and the last may still be on its way.
    stage.until(lambda: any(status.level == b"\x02" and status.values[0].value == "2" for status in heard))
    errors = [status for status in heard if status.level == b"\x02"]
    assert [value.value for value in errors[-1].values][:2] == ["2", "2"]
    assert all("beyond 0.5 to 1.5 L0" in status.message for status in errors)
    playing = [status for status in heard if status.message == "playing" and status.values[0].value == "2"]
    assert playing[0].level == b"\x00"
    assert "episode 1 ended before its time" in playing[0].values[2].value
    if mode == "lockstep":
        first, second = (e for e in [*episodes(stage.joints["/e"]), last_episode(stage.joints["/e"])])
        assert first == second
    assert "beyond 0.5 to 1.5 L0" in log
    assert "last state: t = " in log
    assert "does not answer" not in log
    assert "Traceback" not in log


@pytest.mark.slow
def test_a_muscle_node_that_takes_no_more_lengths_ends_the_episode(stage: Stage) -> None:
    """Here another sender has moved its time on; the reason comes from its diagnostics."""
    from xb_muscle_ros.node.client.link import Link

    stage.muscle("/f", "lockstep")
    with Link("meddler", "/f", stage.domain) as link:
        link.find(10.0, "")
        from sensor_msgs.msg import JointState

        sender = link.node.create_publisher(JointState, "muscle/length", 10)
        assert link.wait_for(lambda: sender.get_subscription_count() > 0, PATIENCE_S)
        # Longer than it takes until the audience is known.
        stage.plant("/f", "lockstep", displacement_m=-0.001, episodes=1, duration_s=60.0)
        stage.moves_on("/f", 50)
        message = JointState(name=["soleus", "tibialis_anterior"], position=[0.05, 0.1])
        message.header.stamp.sec = 3000
        sender.publish(message)
        assert stage.processes["plant/f"].wait(60.0) == 2
    log = stage.log("plant/f")
    assert "takes no more lengths" in log
    assert "stamp not after the last" in log


@pytest.mark.slow
def test_a_body_that_falls_again_and_again_goes_on_until_stopped(stage: Stage) -> None:
    """`episodes` of 0 knows no last one; told to stop, it says how many ended early."""
    stage.muscle("/g", "lockstep")
    stage.plant("/g", "lockstep", **THROWN)
    stage.until(lambda: "episode 2 ended before its time" in stage.log("plant/g"))
    assert stage.processes["plant/g"].stop() == 0
    assert "episodes ended before their time; the last" in stage.log("plant/g")


@pytest.mark.slow
@pytest.mark.parametrize("mode", ["lockstep", "realtime"])
def test_a_muscle_node_that_is_put_to_sleep_is_waited_for_by_name_and_not_for_ever(stage: Stage, mode: str) -> None:
    """Deactivated, it is on the graph and answers nothing: the log says how to wake it, `give_up_s` ends the wait."""
    from lifecycle_msgs.msg import Transition
    from lifecycle_msgs.srv import ChangeState

    def change(transition: int) -> None:
        request = ChangeState.Request()
        request.transition.id = transition
        assert stage.peer("/h").call(ChangeState, "change_state", request).success

    stage.muscle("/h", mode)
    heard = stage.episode_statuses("/h/plant_node")
    stage.plant("/h", mode, displacement_m=-0.001, duration_s=0.5, give_up_s=4.0)
    stage.moves_on("/h")
    change(Transition.TRANSITION_DEACTIVATE)
    stage.until(lambda: "muscle_node is inactive; activate it" in stage.log("plant/h"))
    stage.until(lambda: any(s.level == b"\x01" and "is inactive" in s.message for s in heard))
    change(Transition.TRANSITION_ACTIVATE)
    stage.until(lambda: "going on with node" in stage.log("plant/h"))
    stage.moves_on("/h")
    change(Transition.TRANSITION_DEACTIVATE)
    assert stage.until_ended("plant/h") == 2
    assert "gave up after" in stage.log("plant/h")
    assert "give_up_s is 4" in stage.log("plant/h")
    stage.until(lambda: heard[-1].level == b"\x02")


@pytest.mark.slow
def test_realtime_mends_constants_that_somebody_changed(stage: Stage) -> None:
    """With another reference length the node refuses all lengths; the body gives it the right one and goes on."""
    stage.muscle("/i", "realtime")
    stage.plant("/i", "realtime", displacement_m=-0.001, duration_s=0.5)
    stage.moves_on("/i")
    peer = stage.peer("/i")

    def waits() -> bool:
        return "the body waits for it" in stage.log("plant/i")

    # Where an episode begins between the two calls, its own reset takes the change up, or mends it at once.
    for _ in range(10):
        peer.set_parameters({"soleus.constants.reference_length_m": 5.0})
        peer.reset()
        if peer.wait_for(waits, 3.0):
            break
    assert waits(), stage.log("plant/i")
    count = stage.log("plant/i").count("episode of 500 ticks")
    stage.until(lambda: stage.log("plant/i").count("episode of 500 ticks") > count + 1)
    assert "Traceback" not in stage.log("plant/i")


@pytest.mark.slow
def test_reflex_in_lockstep_is_that_of_the_run_in_process(stage: Stage) -> None:
    """Calcium travels as far ahead as the reflex is delayed, and so is always there in time."""
    import numpy as np

    from xb_muscle_ros.models.fibre_file import load_fibre
    from xb_muscle_ros.plant.loop import run_ankle
    from xb_muscle_ros.plant.reflex import Reflex
    from xb_muscle_ros.plant.translation import RampAndHold

    stage.plant(
        "/j", "lockstep", duration_s=0.4, episodes=2, reflex_length_per_l0=4.0, reflex_velocity_s_per_l0=0.2,
        reflex_muscles="[soleus]",
    )  # fmt: skip
    # Two episodes take less time than it takes to be known: the body waits for its muscles until it has an audience.
    stage.until(lambda: stage.link.node.count_publishers("/j/plant/joint") > 0)
    stage.muscle("/j", "lockstep")
    assert stage.until_ended("plant/j") == 0
    assert "not exactly those of the reflex" not in stage.log("plant/j")
    played = [*episodes(stage.joints["/j"]), last_episode(stage.joints["/j"])]
    assert played[0] == played[1]
    fibre, reflex = load_fibre("18Dec2017a"), Reflex(4.0, 0.2, muscles=("soleus",))
    inside, without = (run_ankle(fibre, RampAndHold(), 0.4, reflex=each) for each in (reflex, Reflex()))
    angle = np.array([angle for _, angle in played[0]])
    assert np.max(np.abs(angle - inside.angle_rad[: angle.size])) < 1e-10
    assert without.angle_rad[-1] - inside.angle_rad[-1] > 1e-3
