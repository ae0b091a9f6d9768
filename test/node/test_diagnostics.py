"""What the node says of itself."""

from __future__ import annotations

from typing import Any

import pytest

from xb_muscle_ros.node.lateness import LatenessSummary
from xb_muscle_ros.node.status import Account, Status

LATE = LatenessSummary(1000, 60.0, 300.0, 900.0, 1500.0)


def status_of(**changes: Any) -> Any:
    """The status that a report makes; fields of `Report` may be given."""
    from xb_muscle_ros.node.diagnostics import Report, diagnostics

    status = Status(ticks=10, violations=0, fault="", waiting="", lateness=LATE, overruns=3, dropped=1)
    report = Report(**{"node": "/a/muscle", "mode": "realtime", "state": "active", "status": status, **changes})
    return diagnostics(report).status[0]


@pytest.mark.usefixtures("domain")
def test_levels() -> None:
    """Stopped is an error, odd or refused input and overruns are warnings, inactive is fine."""
    from diagnostic_msgs.msg import DiagnosticStatus

    from xb_muscle_ros.node.rules import Counts

    assert (status_of().level, status_of().message) == (DiagnosticStatus.OK, "stepping")
    fault = Status(ticks=10, violations=1, fault="state q2 became -1", waiting="")
    stopped = status_of(status=fault)
    assert stopped.level == DiagnosticStatus.ERROR
    assert stopped.message == "stopped: state q2 became -1; call ~/reset to start again"
    assert status_of(state="inactive", status=fault).level == DiagnosticStatus.OK
    refused = Counts()
    refused["not finite"] += 2
    warned = status_of(refused=refused, overruns_new=3)
    assert (warned.level, warned.message) == (DiagnosticStatus.WARN, "refused 2 samples; 3 overruns")


@pytest.mark.usefixtures("domain")
def test_length_that_stays_away() -> None:
    """An error where the clock steps on without it, a warning where nothing steps or where it has come back."""
    from diagnostic_msgs.msg import DiagnosticStatus

    away = Status(ticks=10, violations=0, fault="", waiting="", lateness=LATE, on_timeout="hold", timeouts=2)
    late = {"timeout_s": 0.1, "input_age_s": 1.25}
    gone = status_of(status=away, **late)
    assert (gone.level, gone.message) == (DiagnosticStatus.ERROR, "no length for 1.250 s: hold")
    assert {pair.key: pair.value for pair in gone.values}["timeouts"] == "2"
    loaded = status_of(status=away, **{**late, "input_age_s": None})
    assert (loaded.level, loaded.message) == (DiagnosticStatus.ERROR, "no length since the state was loaded: hold")
    lockstep = Status(ticks=10, violations=0, fault="", waiting="")
    quiet = status_of(mode="lockstep", status=lockstep, **late)
    assert (quiet.level, quiet.message) == (DiagnosticStatus.WARN, "no length for 1.250 s")
    assert status_of(**{**late, "timeout_s": 0.0}).level == DiagnosticStatus.OK
    assert status_of(**{**late, "input_age_s": 0.05}).level == DiagnosticStatus.OK
    over = status_of(timeouts_new=1, timeout_s=0.1, input_age_s=0.05)
    assert (over.level, over.message) == (DiagnosticStatus.WARN, "no length in time 1 times")
    waiting = status_of(status=Status(ticks=0, violations=0, fault="", waiting="waiting for length"), **late)
    assert waiting.message == "waiting for length"


@pytest.mark.usefixtures("domain")
def test_the_name_is_node_and_task() -> None:
    """As aggregators of diagnostics expect it."""
    assert status_of(node="/left/muscle_node").name == "left/muscle_node: stepping"


@pytest.mark.usefixtures("domain")
@pytest.mark.parametrize(
    ("reason", "times", "error"),
    [
        ("stamp too far ahead", 2, True),
        ("stamp not after the last", 2, True),
        ("not finite", 2, True),
        ("out of range", 2, True),
        ("wrong array size", 2, True),
        ("waiting for calcium", 2, False),
        ("not finite", 1, False),
    ],
)
def test_input_that_is_refused_for_good(reason: str, times: int, error: bool) -> None:
    """Whatever the reason, the report names it with the remedy, also when no sample comes any more."""
    from diagnostic_msgs.msg import DiagnosticStatus

    from xb_muscle_ros.node.inlet import Refused

    refusing = {("length", "left"): Refused(100.0, times, f"{reason}: so and so; do this")}
    found = status_of(refusing=refusing, now_s=104.0)
    assert found.level == (DiagnosticStatus.ERROR if error else DiagnosticStatus.WARN)
    assert found.message == f"no length of left taken for 4 s, newest refused: {reason}: so and so; do this"
    assert status_of(refusing=refusing, now_s=100.5).level == DiagnosticStatus.OK
    both = status_of(refusing={**refusing, ("calcium", ""): refusing["length", "left"]}, now_s=104.0)
    assert both.message.endswith("do this (1 more likewise)")


@pytest.mark.usefixtures("domain")
def test_lost_messages_are_a_warning_with_the_count() -> None:
    """The count of the last second in words, that since the reset among the values."""
    from diagnostic_msgs.msg import DiagnosticStatus

    found = status_of(lost={"length": "5000", "calcium": "0"}, lost_new={"length": 4000, "calcium": 0})
    assert (found.level, found.message) == (DiagnosticStatus.WARN, "lost 4000 length messages")
    values = {pair.key: pair.value for pair in found.values}
    assert (values["lost: length"], values["lost: calcium"]) == ("5000", "0")


@pytest.mark.usefixtures("domain")
def test_values() -> None:
    """Everything a dashboard needs, by name."""
    values = {pair.key: pair.value for pair in status_of(rate_hz=999.96, input_age_s=0.25).values}
    assert values["lateness p50 (µs)"] == "60.0"
    assert values["lateness max (µs)"] == "1500.0"
    assert values["overruns"] == "3"
    assert values["rate (Hz)"] == "1000.0"
    assert values["input age (s)"] == "0.250"
    assert values["state violations"] == "0"


def test_account_can_be_read_back() -> None:
    """The player reads it from the reply to a reset."""
    account = Account(100, 7, 1)
    assert Account.read(f"state forgotten after {account}; the next one settles") == account
    assert Account.read("nothing of the kind") is None


@pytest.mark.usefixtures("domain")
def test_a_fibre_that_pushes_is_a_warning_until_the_next_report() -> None:
    """The strongest push since the last report, by fibre, whether there is one fibre or many."""
    from types import SimpleNamespace

    import numpy as np
    from diagnostic_msgs.msg import DiagnosticStatus

    from xb_muscle_ros.models.muscle import Outputs
    from xb_muscle_ros.node.outputs import OutputMessages

    nowhere: Any = SimpleNamespace(publish=lambda message: None, get_subscription_count=lambda: 0)
    one = OutputMessages(["soleus"], nowhere, nowhere)
    for force_f0 in (0.5, -0.2, -0.54, -0.1, -1e-5):
        one.publish(0, None, np.array([Outputs(force_f0, *([0.0] * 10))]), np.ones((1, 2)))
    assert one.pushed == ("soleus", -0.54)
    many = OutputMessages(["a", "b"], nowhere, nowhere)
    table = np.zeros((2, 11))
    many.publish(0, None, table, np.ones((2, 2)))
    assert many.pushed is None
    table[1, 0] = -0.3
    many.publish(0, None, table, np.ones((2, 2)))
    table[1, 0] = -0.1
    many.publish(0, None, table, np.ones((2, 2)))
    assert many.pushed == ("b", -0.3)
    told = status_of(model="3state_coop", pushed=one.pushed)
    assert told.level == DiagnosticStatus.WARN
    assert told.message == "soleus pushes, -0.54 F0, where a muscle would be slack (model 3state_coop_slack does not)"
    assert status_of(model="3state_coop").message == "stepping"
