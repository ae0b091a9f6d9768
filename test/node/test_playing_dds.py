"""Trials by the clock: every sample at its time, to a node in realtime, and what goes wrong is said."""

from __future__ import annotations

import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from background import Background

pytest.importorskip("rclpy")

from rclpy.qos import QoSProfile, QoSReliabilityPolicy

import xb_muscle_ros as xb
from xb_muscle_ros.errors import UserError
from xb_muscle_ros.node.client.link import Link
from xb_muscle_ros.node.client.process import NodeProcess, child_environment
from xb_muscle_ros.node.joint_state import Joints
from xb_muscle_ros.node.playing import Sent, _schedule, play
from xb_muscle_ros.node.traffic import subscribe
from xb_muscle_ros.trials.trial import Trial, TrialFacts

FIBRE = "18Dec2017a"


def trial_of(**changes: Any) -> Trial:
    time_s = 5.0 + np.arange(200) * 2e-3
    given = {
        "time_s": time_s,
        "length_m": 0.03 * (1.0 + 0.01 * np.sin(20.0 * time_s)),
        "calcium_time_s": np.array([4.0, 5.0, 5.1, 5.2001]),
        "calcium_um": np.array([0.1, 1.0, 2.0, 3.0]),
        "force_time_s": time_s[::2],
        "force_n": np.linspace(1.0, 2.0, 100),
    }
    return Trial(TrialFacts(FIBRE, "wavy", reference_length_m=0.03, f0_n=2.0), **{**given, **changes})


class Audience(Background):
    """Hears what is played, from a thread."""

    def __init__(self, domain: int, *topics: str, name: str = "audience") -> None:
        super().__init__()
        self.heard: dict[str, list[Joints]] = {topic: [] for topic in topics}
        self._link = Link(name, domain_id=domain)
        # Deep, so that a machine that stands still for a moment loses none.
        deep = QoSProfile(depth=5000, reliability=QoSReliabilityPolicy.RELIABLE)
        self._kept = [subscribe(self._link.node, f"muscle/{topic}", self.heard[topic].append, deep) for topic in topics]
        self._publishers = self._link.node.count_publishers

    def work(self) -> None:
        while not self.ended.is_set():
            self._link.wait_for(lambda: False, 0.05)

    def wait_for_node(self) -> None:
        """Until a muscle node is there: this one listens too, so a player does not wait for that."""
        end = time.monotonic() + 60.0
        while not self._publishers("muscle/force") and time.monotonic() < end:
            time.sleep(0.1)

    def close(self) -> None:
        self._link.close()


def test_calcium_goes_before_the_length_of_its_time_and_what_is_outside_is_left_out() -> None:
    sent = Sent.of(trial_of(), "length")
    due, is_calcium, at = _schedule(sent, 2.0)
    assert np.all(np.diff(due) >= 0)
    assert due[-1] == pytest.approx(0.398e9 / 2.0)
    # That of 5.0 s is held from the rest on.
    assert at[is_calcium].tolist() == [2, 3]
    k = int(np.flatnonzero(is_calcium)[0])
    assert due[k] == due[k + 1] == 50_000_000
    assert at[~is_calcium].tolist() == list(range(200))


def test_what_is_sent_for_one_l0_and_one_f0() -> None:
    trial = trial_of()
    assert Sent.of(trial, "length").value.tolist() == trial.length_m.tolist()
    assert Sent.of(trial, "length", unit=0.06).value == pytest.approx(2.0 * trial.length_m)
    load = Sent.of(trial, "load", "other", 1.0)
    assert load.joint == "other"
    assert load.value == pytest.approx(0.5 * trial.force_n)
    assert load.time_s.tolist() == trial.force_time_s.tolist()
    with pytest.raises(UserError, match="trial wavy has 0 samples of force to send as load"):
        Sent.of(trial_of(force_time_s=np.empty(0), force_n=np.empty(0)), "load")
    with pytest.raises(UserError, match=r"trial wavy: samples of length do not ascend at 5.000000000 s"):
        Sent.of(trial_of(time_s=np.full(200, 5.0)), "length")


def test_every_sample_comes_with_its_time(new_domain: Callable[[], int]) -> None:
    domain, trial = new_domain(), trial_of()
    said: list[str] = []
    with Audience(domain, "length", "calcium") as audience:
        time.sleep(0.5)
        begun = time.monotonic()
        (played,) = play(
            [Sent.of(trial, "length")], rest_s=0.3, wait_s=30.0, say=said.append, speed=0.5, domain_id=domain
        )
        took = time.monotonic() - begun
        time.sleep(0.3)
    assert (played.sent, played.whole, played.answered_by, played.is_well) == (200, True, frozenset(), False)
    # It is no faster than asked; how much slower is the machine's affair.
    assert took > 0.3 + 0.398 / 0.5
    assert said[-1] == f"plays wavy as {FIBRE} on /muscle/length: 0.796 s"
    end = next(k for k, each in enumerate(audience.heard["length"]) if each.position[0] == trial.length_m[-1])
    lengths = audience.heard["length"][end - 199 : end + 1]
    assert [message.names for message in lengths] == [(FIBRE,)] * 200
    assert [float(message.position[0]) for message in lengths] == trial.length_m.tolist()
    stamps = np.array([message.stamp_ns for message in lengths])
    assert np.abs(np.diff(stamps) - 4_000_000).max() <= 1
    slopes = np.diff(trial.length_m) / 2e-3 * 0.5
    assert [float(message.velocity[0]) for message in lengths[:-1]] == pytest.approx(slopes.tolist())
    calcium = [(float(each.position[0]), each.stamp_ns - stamps[0]) for each in audience.heard["calcium"]]
    assert {value for value, at in calcium if at <= 0} == {1.0}
    assert [(value, round(at * 1e-9, 4)) for value, at in calcium if at > 0][:2] == [(2.0, 0.2), (3.0, 0.4002)]
    assert {value for value, at in calcium if at > 0.41e9} == {3.0}
    # Held before, and never earlier again.
    held = [message for message in audience.heard["length"] if message.stamp_ns < stamps[0]]
    assert held
    assert {float(message.position[0]) for message in held} == {float(trial.length_m[0])}
    # And after: still, at the last length.
    after = audience.heard["length"][end + 1 :]
    assert {(float(each.position[0]), float(each.velocity[0])) for each in after} == {(float(trial.length_m[-1]), 0.0)}
    assert np.all(np.diff([message.stamp_ns for message in audience.heard["length"]]) > 0)


def test_a_fibre_is_brought_to_its_next_trial_at_a_steady_rate(new_domain: Callable[[], int]) -> None:
    """Regression: length stepped at once, here by 4 % of L0."""
    domain, first = new_domain(), trial_of()
    next_ = trial_of(length_m=first.length_m + 0.04 * 0.03, calcium_um=np.full(4, 9.0))
    said: list[str] = []
    with Audience(domain, "length", "calcium") as audience:
        time.sleep(0.5)
        sent = [Sent.of(trial, "length") for trial in (first, next_)]
        list(play(sent, rest_s=0.05, travel_per_s=0.1, wait_s=30.0, say=said.append, domain_id=domain))
        time.sleep(0.3)
    begin, goal = float(first.length_m[-1]), float(next_.length_m[0])
    took = (goal - begin) / 0.03 / 0.1
    assert f"brings {FIBRE} from {begin / 0.03:.4g} to {goal / 0.03:.4g} L0 within {took:.3g} s" in said
    lengths = audience.heard["length"]
    position = np.array([float(each.position[0]) for each in lengths])
    # Of two samples with one length the later one begins the way, and the earlier one ends it.
    left = int(np.flatnonzero(position == begin)[-1])
    came = left + int(np.flatnonzero(position[left:] == goal)[0])
    way = position[left : came + 1]
    assert way.size == 1 + int(took / 1e-3) + 1
    assert np.all(np.diff(way) > 0.0)
    assert np.diff(way).max() <= 1.001 * 0.1 * 0.03 * 1e-3
    velocity = [float(each.velocity[0]) for each in lengths[left + 1 : came]]
    assert velocity == pytest.approx([0.1 * 0.03] * len(velocity))
    # On the way the calcium is that of the first trial.
    later = [each.stamp_ns for each in audience.heard["calcium"] if each.position[0] == 9.0]
    assert later[0] > lengths[came - 1].stamp_ns


@pytest.mark.slow
def test_a_node_in_realtime_answers_as_the_model_does(new_domain: Callable[[], int], tmp_path: Path) -> None:
    """The command over real DDS: the isometric force, then that of a stretch; and a wrong name is said."""
    domain = new_domain()
    options = {"pca": 4.5, "hold": 0.3}
    (found,) = xb.run_protocol("ramp-hold", FIBRE, tell=lambda line: None, **options).results
    (run,) = found.runs
    (bag,) = xb.write_trials([run.trial], tmp_path)
    command = [sys.executable, "-m", "xb_muscle_ros.cli.main", "play", str(bag), "--wait", "60"]
    parameters = {"fiber_file": FIBRE, "mode": "realtime", "rate_hz": 500.0, "extrapolate": True, "max_catch_up": 100}
    with NodeProcess(domain, parameters) as node, Audience(domain, "force") as audience:
        audience.wait_for_node()
        done = subprocess.run(
            [*command, "--rest", "4"],
            env=child_environment(domain),
            capture_output=True,
            text=True,
            timeout=120.0,
        )
        assert done.returncode == 0, done.stderr + node.log()
        forces = np.array([float(message.effort[0]) for message in audience.heard["force"]])
        # One that comes late, on a busy machine, is no fault of theirs.
        assert "refused" not in done.stderr
        assert "heard" not in done.stderr
        longer = subprocess.run(
            [*command, "--as-l0", "30 mm"], env=child_environment(domain), capture_output=True, text=True,
            timeout=120.0,
        )  # fmt: skip
        other = subprocess.run(
            [*command, "--fiber", "stranger"], env=child_environment(domain), capture_output=True, text=True,
            timeout=120.0,
        )  # fmt: skip
    assert f"plays {run.trial.facts.trial} as {FIBRE} on /muscle/length" in done.stdout
    assert f"{run.time_s.size} samples, late by " in done.stdout
    assert forces[0] == pytest.approx(run.force_f0[0], rel=1e-3)
    # A late sample smears the stretch or makes a step of it; that it is there a busy machine leaves.
    assert forces.max() > 0.5 * (run.force_f0[0] + run.force_f0.max())
    assert longer.returncode == 1
    assert (
        "one L0 is 0.03 m in what is sent and 1 m for node /muscle_node; --as-l0 '1 m' sends its own" in longer.stdout
    )
    assert "the muscle node refused " in longer.stderr
    assert "samples: out of range; its log tells more" in longer.stderr
    assert other.returncode == 1
    assert f"force of {FIBRE} alone was heard at its end" in other.stderr
    assert "knows fibre stranger" in other.stderr
    # Regression: what the node had refused of the one before was told of this one too.
    assert "refused" not in other.stderr


def test_nobody_listens(new_domain: Callable[[], int]) -> None:
    with pytest.raises(UserError, match=r"nobody but recorders listens to /muscle/length \(looked for 0.2 s\)"):
        list(play([Sent.of(trial_of(), "length")], wait_s=0.2, domain_id=new_domain()))


def test_a_recorder_alone_is_no_listener_and_another_control_is_named(new_domain: Callable[[], int]) -> None:
    domain = new_domain()
    with (
        Audience(domain, "length", "load", name="muscle_recorder"),
        pytest.raises(UserError, match="nobody but recorders listens to /muscle/length"),
    ):
        list(play([Sent.of(trial_of(), "length")], wait_s=1.0, domain_id=domain))
    with (
        Audience(domain, "load", "calcium"),
        pytest.raises(UserError, match=r"/muscle/load is listened to: take --drive load, or start .* control:=length"),
    ):
        list(play([Sent.of(trial_of(), "length")], wait_s=3.0, domain_id=domain))


@pytest.mark.slow
def test_loads_are_borne_and_a_muscle_that_dies_is_noticed(new_domain: Callable[[], int]) -> None:
    """Two trials under force control; in the second the node is killed."""
    domain, asked = new_domain(), 0
    load = trial_of(force_n=np.linspace(0.5, 0.4, 100) * 2.0, calcium_time_s=np.zeros(1), calcium_um=np.full(1, 30.0))
    sent = Sent.of(load, "load", unit=1.0)
    parameters = {"fiber_file": FIBRE, "mode": "realtime", "control": "force", "rate_hz": 500.0}
    said: list[str] = []
    with NodeProcess(domain, parameters) as node, Audience(domain, "load") as audience:
        audience.wait_for_node()

        def stop() -> bool:
            nonlocal asked
            asked += len(played)
            if asked == 50:
                node.process.kill()
            return False

        played: list[Any] = []
        for each in play([sent, sent], "load", rest_s=0.5, wait_s=60.0, stop=stop, say=said.append, domain_id=domain):
            played.append(each)
        log = node.log()
    first, second = played
    assert first.is_well, (first, log)
    assert (second.sent, second.answered_by, second.is_well) == (100, frozenset(), False)
    assert not any("one F0" in line or "lockstep" in line for line in said)
    assert np.all(np.diff([each.stamp_ns for each in audience.heard["load"]]) > 0)


def test_ctrl_c_ends_a_trial_between_samples(new_domain: Callable[[], int], tmp_path: Path) -> None:
    domain = new_domain()
    long = trial_of(time_s=5.0 + np.arange(200) * 0.1, force_time_s=np.empty(0), force_n=np.empty(0))
    (bag,) = xb.write_trials([long], tmp_path)
    command = [sys.executable, "-m", "xb_muscle_ros.cli.main", "play", str(bag), "--rest", "0", "--wait", "60"]
    with Audience(domain, "length", "calcium") as audience:
        player = subprocess.Popen(
            command, env=child_environment(domain), stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
        )
        try:
            end = time.monotonic() + 60.0
            while len(audience.heard["length"]) < 5 and time.monotonic() < end:
                time.sleep(0.05)
            player.send_signal(signal.SIGINT)
            out, err = player.communicate(timeout=20.0)
        finally:
            player.kill()
    assert player.returncode == 130
    assert "wavy: " in out
    assert "Traceback" not in err
    assert "stopped after 0 of 1 trials" in err


def test_options(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    from xb_muscle_ros.cli.main import main

    (bag,) = xb.write_trials([trial_of(force_time_s=np.empty(0), force_n=np.empty(0))], tmp_path)
    for arguments, said in (
        (["--speed", "0"], "--speed is 0; allowed is 1e-06 to"),
        (["--rest", "-1"], "--rest is -1; allowed is 0 to"),
        (["--travel", "0"], "--travel is 0; allowed is 0.001 to"),
        (["--as-f0", "20 N"], "--as-f0 is of no use with --drive length"),
        (["--drive", "load", "--as-l0", "3 mm"], "--as-l0 is of no use with --drive load"),
        (["--as-l0", "20 N"], "'N' is no unit of length"),
        (["--as-l0", "2 L0"], "--as-l0 is '2 L0'; needed is a length"),
        (["--drive", "load"], "trial wavy has 0 samples of force to send as load"),
    ):
        assert main(["play", str(bag), *arguments]) == 2
        assert said in capsys.readouterr().err
