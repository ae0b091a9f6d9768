"""A node in lockstep on the other side of DDS."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from xb_muscle_ros.models.muscle import Muscle
from xb_muscle_ros.trials.simulated import MOMENTS

FIBRE = "18Dec2017a"


def test_late_calcium_is_counted(fresh: Any) -> None:
    """A value that an earlier step should have used is taken, but not in silence."""
    fresh.calcium(0.0, 1.0)
    assert fresh.ask(1.0, 1.0) is not None
    assert fresh.ask(1.001, 1.0) is not None
    fresh.calcium(0.5, 2.0)
    assert fresh.ask(1.002, 1.0) is not None
    account = fresh.link.reset()
    assert account == (3, 2, 1)


def test_answer_carries_stamp_names_and_settled_force(fresh: Any, muscle: Muscle) -> None:
    """Layout of the messages, and the constants of the fibre."""
    fresh.calcium(12.0, 5.0)
    force = fresh.ask(12.25, 1.01)
    assert (force.header.stamp.sec, force.header.stamp.nanosec) == (12, 250_000_000)
    assert list(force.name) == [FIBRE]
    change = 1.01 - 1.0
    out = muscle.outputs(muscle.settle(change, 5.0))
    assert force.effort[0] == out.force_f0
    assert force.position[0] == 1.0 + out.ce_length_change_l0
    assert force.velocity[0] == out.ce_velocity_l0_per_s
    assert fresh.link.wait_for(lambda: bool(fresh.moments), 5.0)
    moments = fresh.moments[-1]
    assert list(moments.name) == [f"{FIBRE}/{name}" for name in MOMENTS]
    assert list(moments.position) == [getattr(out, name) for name in MOMENTS]


def test_constants_take_effect_at_the_next_reset(fresh: Any) -> None:
    """Neither in the middle of a trial nor never."""
    fresh.calcium(0.0, 5.0)
    first = fresh.ask(1.0, 1.0).effort[0]
    fresh.link.set_parameters({"constants.reference_length_m": 2.0, "constants.f0_n": 10.0})
    assert fresh.ask(1.001, 1.0).effort[0] == pytest.approx(first, rel=1e-3)
    fresh.link.reset()
    fresh.calcium(0.0, 5.0)
    assert fresh.ask(1.0, 2.0).effort[0] == 10.0 * first


def test_other_fibres_in_the_message_do_not_matter(fresh: Any) -> None:
    """The fibre is found by name; a nameless value is its own; names of others are reported once."""
    fresh.send("calcium", 0.0, 1.0, 5.0, name=["other", FIBRE])
    settled = fresh.ask(1.0, 7.0, 1.0, name=["other", FIBRE])
    assert settled is not None
    assert fresh.ask(1.001, 1.0, name=[]).effort[0] == pytest.approx(settled.effort[0], rel=1e-6)
    fresh.send("length", 1.002, 1.0, name=["other"])
    assert fresh.ask(1.003, 1.0) is not None
    assert fresh.process.log().count("names ignored: other") == 1


BAD_LENGTHS: list[tuple[str, float, list[float], dict[str, Any]]] = [
    ("not finite", 2.0, [float("nan")], {}),
    ("not finite", 2.0, [float("inf")], {}),
    ("not finite", 2.0, [1.0], {"velocity": [float("nan")]}),
    ("stamp not after the last", 1.0, [1.0], {}),
    ("stamp not after the last", 0.5, [1.0], {}),
    ("stamp too far ahead", 1e9, [1.0], {}),
    ("out of range", 2.0, [1e3], {}),
    ("out of range", 2.0, [-1.0], {}),
    ("wrong array size", 2.0, [1.0, 1.0], {}),
    ("wrong array size", 2.0, [], {}),
    ("wrong array size", 2.0, [], {"name": []}),
    ("wrong array size", 2.0, [1.0], {"velocity": [0.0, 0.0]}),
]


def test_bad_length_is_refused_and_counted_and_the_node_goes_on(fresh: Any) -> None:
    """Refused input is never integrated: good samples are answered as if it had not been there."""
    times_s = 1.0 + 0.001 * np.arange(1, 1 + len(BAD_LENGTHS))

    def forces(disturbed: bool) -> list[float]:
        fresh.link.reset()
        fresh.calcium(0.0, 5.0)
        answers = [fresh.ask(1.0, 1.0)]
        for time_s, (_, bad_time_s, position, fields) in zip(times_s, BAD_LENGTHS, strict=True):
            if disturbed:
                fresh.send("length", bad_time_s, *position, **fields)
            answers.append(fresh.ask(time_s, 1.0 + (time_s - 1.0)))
        return [answer.effort[0] for answer in answers]

    undisturbed = forces(disturbed=False)
    reasons = [reason for reason, *_ in BAD_LENGTHS]
    before = fresh.report(lambda r: True)
    assert forces(disturbed=True) == undisturbed
    total = int(before["refused"]) + len(reasons)
    report = fresh.report(lambda r: int(r["refused"]) >= total)
    for reason in set(reasons):
        key = f"refused: {reason}"
        assert int(report[key]) == int(before.get(key, 0)) + reasons.count(reason), reason
        assert f"length refused ({reason}" in fresh.process.log()
    assert int(report["state violations"]) == 0


@pytest.mark.parametrize("calcium_um", [float("nan"), float("-inf"), -1.0, 1e9])
def test_bad_calcium_is_refused(fresh: Any, calcium_um: float) -> None:
    """The last good value goes on to hold."""
    fresh.calcium(0.0, 5.0)
    settled = fresh.ask(1.0, 1.0).effort[0]
    fresh.calcium(1.0, calcium_um)
    assert fresh.ask(1.5, 1.0).effort[0] == pytest.approx(settled, rel=1e-6)
    assert fresh.link.reset().calcium == 1


def test_length_before_calcium_waits(fresh: Any, muscle: Muscle) -> None:
    """Without calcium there is nothing to settle with; the first sample that has one settles."""
    fresh.send("length", 1.0, 1.0)
    fresh.calcium(1.5, 5.0)
    force = fresh.ask(2.0, 1.0)
    assert force.effort[0] == muscle.outputs(muscle.settle(0.0, 5.0)).force_f0
    assert force.header.stamp.sec == 2
    assert "waiting for calcium" in fresh.process.log()


def test_reset_makes_earlier_stamps_good(fresh: Any) -> None:
    """A second run may start at zero again, and starts settled."""
    fresh.calcium(9.0, 5.0)
    first = fresh.ask(10.0, 1.0).effort[0]
    fresh.ask(10.1, 1.05)
    fresh.link.reset()
    fresh.calcium(0.0, 5.0)
    assert fresh.ask(0.0, 1.0).effort[0] == first


@pytest.mark.slow
def test_a_bag_in_a_loop(start: Callable[..., Any]) -> None:
    """Under use_sim_time every turn gives the same bits, with one notice; without, and after all, it is refused."""
    driver = start(mode="lockstep", use_sim_time=True)

    def turn() -> list[float]:
        driver.calcium(20.0, 5.0)
        driver.calcium(20.05, 20.0)
        return [driver.ask(20.0 + 0.01 * k, 1.0 + 1e-3 * k).effort[0] for k in range(20)]

    first = turn()
    assert len(set(first)) == 20
    assert turn() == first
    assert turn() == first
    assert driver.process.log().count("of simulated time: state forgotten after 20 length and 2 calcium samples") == 2
    report = driver.report(lambda r: r.get("odd: time went back") == "2")
    # Topics have no order among them: the very first length may come before its calcium.
    assert {key for key in report if key.startswith("refused:")} <= {"refused: waiting for calcium"}
    refused = int(report["refused"])
    driver.link.set_parameters({"use_sim_time": False})
    driver.send("length", 20.0, 1.0)
    assert driver.report(lambda r: int(r["refused"]) == refused + 1)["odd: time went back"] == "2"
    assert driver.ask(21.0, 1.0) is not None
