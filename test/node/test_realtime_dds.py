"""A node in realtime on the other side of DDS."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

RATE_HZ = 250.0


def feed(driver: Any, seconds: float, fresh_stamps: bool = True, enough: int | None = None) -> None:
    """Length that swings at about 100 Hz, and calcium, for some time or until there are enough forces."""
    begin = time.monotonic()
    while (now := time.monotonic() - begin) < seconds and (enough is None or len(driver.forces) < enough):
        # Best effort: a message sent before both sides know each other is lost, so it is sent again and again.
        driver.send("calcium", time.time() if fresh_stamps else 0.0, 5.0)
        swing = 0.01 * np.sin(2 * np.pi * now)
        driver.send("length", time.time() if fresh_stamps else 0.0, 1.0 + swing, velocity=[0.0])
        driver.link.wait_for(lambda: False, 0.01)


@pytest.mark.slow
def test_forces_come_at_the_rate_and_never_violate(start: Callable[..., Any]) -> None:
    """Also with the length carried on by its velocity; reset and bad input do not stop it."""
    driver = start(mode="realtime", rate_hz=RATE_HZ, extrapolate=True)
    assert driver.report(lambda r: True)["message"] == "waiting for length and calcium"
    feed(driver, 30.0, enough=1)
    driver.link.reset()
    driver.forces.clear()
    feed(driver, 1.0)
    for stamp, position in ((time.time(), float("nan")), (1.0, 1.0)):
        driver.send("length", stamp, position)
        # Only the newest of messages that wait together is kept.
        driver.link.wait_for(lambda: False, 0.3)
    feed(driver, 2.0)
    report = driver.report(lambda r: int(r["refused"]) >= 2)
    stamps = np.array([m.header.stamp.sec + m.header.stamp.nanosec * 1e-9 for m in driver.forces])
    assert np.all(np.isfinite([m.effort[0] for m in driver.forces]))
    assert np.all(np.diff(stamps) > 0.0)
    # A loaded machine makes ticks up in one go and sends only the newest of them.
    assert np.median(np.diff(stamps)) < 1.2 / RATE_HZ
    assert int(report["ticks since reset"]) > 0.8 * 3.0 * RATE_HZ
    assert int(report["state violations"]) == 0
    assert int(report["refused: not finite"]) == 1
    assert int(report["refused: stamp not after the last"]) == 1
    late = [float(report[f"lateness {q} (µs)"]) for q in ("p50", "p99", "p99.9", "max")]
    assert late == sorted(late)
    assert int(report["overruns"]) >= int(report["dropped ticks"]) >= 0
    assert float(report["input age (s)"]) < 5.0


@pytest.mark.slow
def test_unstamped_messages_are_taken(start: Callable[..., Any]) -> None:
    """`ros2 topic pub` leaves stamps at zero; the steady clock needs none."""
    driver = start(mode="realtime", rate_hz=RATE_HZ)
    feed(driver, 30.0, fresh_stamps=False, enough=11)
    assert len(driver.forces) > 10
    assert int(driver.report(lambda r: True)["refused"]) == 0


@pytest.mark.slow
def test_nodes_in_different_namespaces_do_not_mix(start: Callable[..., Any]) -> None:
    """Only the one that is fed answers."""
    fed, idle = start(mode="realtime", rate_hz=RATE_HZ), start(mode="realtime", rate_hz=RATE_HZ)
    feed(fed, 30.0, enough=50)
    idle.link.wait_for(lambda: bool(idle.forces), 0.5)
    assert fed.forces
    assert not idle.forces


@pytest.mark.slow
def test_rate_can_be_set_while_inactive(start: Callable[..., Any]) -> None:
    """And counts from the next activation on."""
    from lifecycle_msgs.msg import Transition
    from lifecycle_msgs.srv import ChangeState

    def change(number: int) -> None:
        request = ChangeState.Request(transition=Transition(id=number))
        assert driver.link.call(ChangeState, "change_state", request).success

    driver = start(mode="realtime", rate_hz=RATE_HZ)
    change(Transition.TRANSITION_DEACTIVATE)
    driver.link.set_parameters({"rate_hz": 50.0})
    change(Transition.TRANSITION_ACTIVATE)
    feed(driver, 30.0, enough=1)
    driver.forces.clear()
    feed(driver, 1.5)
    assert 30 < len(driver.forces) < 120


@pytest.mark.slow
def test_node_and_plain_timer_are_measured_side_by_side(domain: int) -> None:
    """All figures of a short run; which is better is not for a test to say."""
    from xb_muscle_ros.bench.timing import run_beside_plain_timer

    for figures in run_beside_plain_timer(3.0, 250.0):
        assert figures["ticks"] > 0.7 * 3.0 * 250.0
        assert 0.0 < figures["lateness_p50_us"] <= figures["lateness_p99_us"] <= figures["lateness_p99.9_us"]
        assert figures["lateness_p99.9_us"] <= figures["lateness_max_us"]
        assert figures["state_violations"] == 0
        assert 0.0 < figures["cpu_share"] < 2.0
        # Ticks and dropped ones are all that were due in the time from the reset to the last report.
        due = figures["seconds"] * 250.0
        assert figures["ticks"] + figures["dropped_ticks"] == pytest.approx(due, abs=30.0)
        assert {"overruns", "dropped_ticks", "rate_hz", "refused", "load"} <= figures.keys()


@pytest.mark.slow
def test_the_way_there_and_back_is_measured(domain: int) -> None:
    """With several fibres in each message."""
    from xb_muscle_ros.bench.roundtrip import run_roundtrip

    figures = run_roundtrip(3.0, 100.0, fibres=3)
    assert 50.0 < figures["p50_us"] <= figures["p99_us"] <= figures["p99.9_us"] <= figures["max_us"]
    assert figures["first_us"] > 0.0
    assert figures["last_us"] > 0.0
    assert 0.0 < figures["rate_hz"] < 101.0
    assert figures["forces"] > 3 * 250
    assert figures["unequal"] == 0


@pytest.mark.slow
def test_lockstep_is_measured_as_fast_as_it_answers(domain: int) -> None:
    """With calcium in every tick, and its forces to the bit."""
    from xb_muscle_ros.bench.roundtrip import run_roundtrip

    figures = run_roundtrip(2.5, None, fibres=3, calcium_every=1)
    assert figures["behind"] == 0
    assert figures["forces"] == 3 * round(figures["forces"] / 3) > 0
    assert figures["unequal"] == 0
