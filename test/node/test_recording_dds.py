"""Recording over real DDS: nothing is missed, whatever is offered, and a kill leaves a bag that can be read."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from background import Background

rclpy = pytest.importorskip("rclpy")

from rclpy.context import Context  # noqa: E402
from rclpy.qos import QoSDurabilityPolicy, QoSProfile, QoSReliabilityPolicy  # noqa: E402
from sensor_msgs.msg import JointState  # noqa: E402

import xb_muscle_ros as xb  # noqa: E402
from xb_muscle_ros.errors import UserError  # noqa: E402
from xb_muscle_ros.node.client.player import Player  # noqa: E402
from xb_muscle_ros.node.client.process import child_environment  # noqa: E402
from xb_muscle_ros.node.program import take_in_news  # noqa: E402
from xb_muscle_ros.node.recording import record  # noqa: E402

FACTS = {
    "fibre": "soleus",
    "trial": "live",
    "pca": "6.1",
    "reference_length_m": "0.03",
    "f0_n": "20.0",
    "source": "test",
}
PERIOD_S = 0.002


class Laboratory(Background):
    """Publishes length, calcium and force of a fibre from a thread."""

    def __init__(self, domain: int, reliable: bool = True) -> None:
        super().__init__()
        self.context = Context()
        self.context.init(args=[], domain_id=domain)
        self.node = rclpy.create_node("laboratory", context=self.context, use_global_arguments=False)
        kept = QoSProfile(depth=1, durability=QoSDurabilityPolicy.TRANSIENT_LOCAL)
        reliability = QoSReliabilityPolicy.RELIABLE if reliable else QoSReliabilityPolicy.BEST_EFFORT
        self.calcium = self.node.create_publisher(JointState, "/muscle/calcium", kept)
        plain = QoSProfile(depth=500, reliability=reliability)
        self.length = self.node.create_publisher(JointState, "/muscle/length", plain)
        self.force = self.node.create_publisher(JointState, "/muscle/measured_force", plain)
        self.sent = 0
        self.calcium.publish(self.message(0, position=[0.8]))

    def message(self, k: int, **values: list[float]) -> JointState:
        message = JointState(name=["soleus"], **values)
        message.header.stamp.sec, message.header.stamp.nanosec = divmod(k * round(PERIOD_S * 1e9), 10**9)
        return message

    def work(self) -> None:
        end = time.monotonic() + 20.0
        while not (self.length.get_subscription_count() and self.force.get_subscription_count()):
            if self.ended.wait(0.01) or time.monotonic() > end:
                return
        while not self.ended.wait(PERIOD_S):
            self.length.publish(self.message(self.sent, position=[0.03 + 1e-6 * self.sent]))
            self.force.publish(self.message(self.sent, effort=[10.0 + 1e-3 * self.sent]))
            self.sent += 1

    def close(self) -> None:
        take_in_news()
        self.node.destroy_node()
        self.context.try_shutdown()


@pytest.fixture
def domain(new_domain: Callable[[], int], monkeypatch: pytest.MonkeyPatch) -> int:
    number = new_domain()
    monkeypatch.setenv("ROS_DOMAIN_ID", str(number))
    return number


@pytest.mark.parametrize("reliable", [True, False])
def test_what_is_published_is_in_the_bag(domain: int, tmp_path: Path, reliable: bool) -> None:
    heard: list[str] = []
    with Laboratory(domain, reliable) as laboratory:
        found = record(tmp_path / "live", FACTS, duration_s=1.5, wait_s=20.0, say=heard.append)
        sent = laboratory.sent
    (trial,) = xb.read_trials(found.bag, tell=lambda line: None)
    assert trial.facts.trial == "live"
    assert trial.facts.pca == 6.1
    assert trial.facts.reference_length_m == 0.03
    assert trial.calcium_um.tolist() == [0.8]  # published before, and kept for who comes later
    numbers = np.round((trial.length_m - 0.03) / 1e-6).astype(int)
    assert numbers.size > 100
    assert numbers[-1] < sent
    # Not one between the first and the last is missing, where the publisher is reliable.
    if reliable:
        assert numbers.tolist() == list(range(numbers[0], numbers[0] + numbers.size))
    assert np.allclose(trial.time_s - trial.time_s[0], PERIOD_S * (numbers - numbers[0]), atol=1e-9)
    assert trial.force_n.size > 100
    assert {line.split()[1] for line in heard} >= {"/muscle/length", "/muscle/measured_force", "/muscle/calcium"}
    assert not found.lines


def test_a_killed_recorder_leaves_what_came_before(domain: int, tmp_path: Path) -> None:
    bag = tmp_path / "killed"
    command = [sys.executable, "-m", "xb_muscle_ros.cli.main", "record", "--fiber", "soleus", "--pca", "6.1"]
    command += ["--reference-length", "30 mm", "--f0", "20 N", "--out", str(bag)]
    recorder = subprocess.Popen(command, env=child_environment(domain), stdout=subprocess.PIPE, text=True)
    try:
        with Laboratory(domain) as laboratory:
            assert recorder.stdout is not None
            next(line for line in recorder.stdout if line.startswith("hears /muscle/length"))
            end, first = time.monotonic() + 30.0, laboratory.sent
            while laboratory.sent < first + 600 and time.monotonic() < end:
                time.sleep(0.05)
            recorder.send_signal(signal.SIGKILL)
            sent = laboratory.sent - first
    finally:
        recorder.kill()
        recorder.communicate(timeout=10.0)
    assert sent >= 600
    told: list[str] = []
    (trial,) = xb.read_trials(bag, tell=told.append)
    assert trial.facts.fibre == "soleus"
    assert trial.facts.f0_n == 20.0
    # What came in the last fifth of a second may be lost; twice that is allowed for.
    assert trial.length_m.size > sent - 0.5 / PERIOD_S
    assert any("killed_0.mcap" in line for line in told), told  # that the file has no end is said


def test_ctrl_c_ends_a_recording_and_its_bag_is_whole(domain: int, tmp_path: Path) -> None:
    bag = tmp_path / "stopped"
    command = [sys.executable, "-m", "xb_muscle_ros.cli.main", "record", "--fiber", "soleus", "--out", str(bag)]
    recorder = subprocess.Popen(command, env=child_environment(domain), stdout=subprocess.PIPE, text=True)
    try:
        with Laboratory(domain) as laboratory:
            # What was sent before the recorder knew the publisher it does not hear.
            assert recorder.stdout is not None
            heard = next(line for line in recorder.stdout if line.startswith("hears /muscle/length"))
            end, sent = time.monotonic() + 30.0, laboratory.sent
            while laboratory.sent < sent + 100 and time.monotonic() < end:
                time.sleep(0.05)
            recorder.send_signal(signal.SIGINT)
            out, _ = recorder.communicate(timeout=20.0)
    finally:
        recorder.kill()
    assert recorder.returncode == 0
    assert "sensor_msgs/msg/JointState" in heard
    assert "on /muscle/length" in out
    told: list[str] = []
    (trial,) = xb.read_trials(bag, reference_length="30 mm", f0="20 N", tell=told.append)
    assert trial.length_m.size > 50
    assert not any("recovered" in line or "no end" in line for line in told), told


def test_silence_leaves_no_bag_and_keeps_an_older_one(domain: int, tmp_path: Path) -> None:
    (older,) = xb.write_trials(xb.StretchShortenStretch(0.0, 0.1).trial("soleus", 4.5, name="live"), tmp_path)
    with pytest.raises(UserError, match="no message came on /muscle/length"):
        record(older, FACTS, ["/muscle/length"], wait_s=0.3)
    assert len(xb.read_trials(older, tell=lambda line: None)) == 1
    with pytest.raises(UserError, match="no message came"):
        record(tmp_path / "none", FACTS, wait_s=0.3)
    assert not (tmp_path / "none").exists()


def test_options(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    from xb_muscle_ros.cli.main import main

    for arguments, said in (
        (["--pca", "2"], "--pca is 2; allowed is 3 to 12"),
        (["--duration", "-1"], "--duration is -1 s; allowed is above 0"),
        (["--reference-length", "first_isometric"], "which a recorder does not know yet"),
        (["--f0", "20 mm"], "'mm' is no unit of force"),
    ):
        assert main(["record", "--fiber", "a", "--out", str(tmp_path / "x"), *arguments]) == 2
        assert said in capsys.readouterr().err
    assert not (tmp_path / "x").exists()


def test_environment_is_private(domain: int) -> None:
    assert os.environ["ROS_AUTOMATIC_DISCOVERY_RANGE"] == "LOCALHOST"
    assert os.environ["ROS_DOMAIN_ID"] == str(domain)


def test_what_a_node_and_a_player_say_can_be_read(domain: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Messages that are published as bytes are no longer than what is in them: no reader takes a longer one."""
    meet = Player.meet

    def meet_recorder(player: Player, timeout_s: float) -> None:
        # A player does not wait for those that only listen; discovery takes DDS some seconds at times.
        meet(player, timeout_s)
        ends = (player._driver.publisher, player._calcium.publisher)
        assert player._link.wait_for(lambda: all(end.get_subscription_count() > 1 for end in ends), 30.0)

    monkeypatch.setattr(Player, "meet", meet_recorder)
    node = subprocess.Popen(
        [sys.executable, "-m", "xb_muscle_ros.node.main", "--ros-args", "-p", "fiber_file:=18Dec2017a", "-p",
         "mode:=lockstep"],
        env=child_environment(domain), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
    )  # fmt: skip
    recorder = subprocess.Popen(
        [sys.executable, "-m", "xb_muscle_ros.cli.main", "record", "--fiber", "18Dec2017a", "--trial", "live",
         "--wait", "60", "--duration", "60", "--out", str(tmp_path / "live")],
        env=child_environment(domain), stdout=subprocess.PIPE, text=True,
    )  # fmt: skip
    try:
        made = xb.run_protocol("ramp-hold", "18Dec2017a", pca=4.5, hold=3.0, live=True, tell=lambda line: None)
        time.sleep(1.0)
        recorder.send_signal(signal.SIGINT)
        recorder.communicate(timeout=30.0)
    finally:
        for process in (recorder, node):
            process.kill()
            process.communicate(timeout=10.0)
    (trial,) = xb.read_trials(tmp_path / "live", tell=lambda line: None)
    (run,) = made.results[0].runs
    # The recorder may know the player a moment after the player knows the recorder.
    assert 0.2 * run.time_s.size < trial.length_m.size <= run.time_s.size
    assert trial.length_change_l0[-1] == pytest.approx(run.trial.length_change_l0[-1], abs=1e-12)
