"""The lifecycle of the node, walked by its services from another process."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

FIBRE = "18Dec2017a"


def change(driver: Any, transition: str) -> bool:
    """Ask for a transition by its label; whether it succeeded."""
    from lifecycle_msgs.msg import Transition
    from lifecycle_msgs.srv import ChangeState

    number = getattr(Transition, f"TRANSITION_{transition.upper()}")
    request = ChangeState.Request(transition=Transition(id=number))
    # The first configuration on a machine compiles.
    return bool(driver.link.call(ChangeState, "change_state", request, timeout_s=60.0).success)


@pytest.mark.slow
def test_every_transition(start: Callable[..., Any]) -> None:
    """Up and down twice, with answers only while active, and the state held while not."""
    driver = start(wait=False, autostart=False, mode="lockstep")
    for _ in range(2):
        assert driver.link.state() == "unconfigured"
        assert change(driver, "configure")
        driver.ready()
        assert driver.link.state() == "inactive"
        driver.calcium(0.0, 5.0)
        driver.send("length", 0.5, 1.0)
        assert change(driver, "activate")
        driver.meet()
        driver.calcium(0.0, 5.0)
        settled = driver.ask(1.0, 1.0).effort[0]
        stretched = driver.ask(1.01, 1.02).effort[0]
        assert change(driver, "deactivate")
        assert change(driver, "activate")
        # Not settled anew: the fibre goes on from where it was.
        assert driver.ask(1.011, 1.02).effort[0] == pytest.approx(stretched, rel=0.1)
        assert stretched > 1.2 * settled
        assert change(driver, "deactivate")
        assert change(driver, "cleanup")
        assert driver.report(lambda r: r["state"] == "unconfigured")["fibre"] == ""
    assert change(driver, "unconfigured_shutdown")
    assert driver.process.wait() == 0


@pytest.mark.slow
def test_shutdown_from_active(start: Callable[..., Any]) -> None:
    """The process ends with its lifecycle."""
    driver = start(mode="realtime")
    assert change(driver, "active_shutdown")
    assert driver.process.wait() == 0
    assert "Traceback" not in driver.process.log()


@pytest.mark.slow
def test_a_transition_that_is_not_allowed_is_refused(start: Callable[..., Any]) -> None:
    """And the node is still there."""
    driver = start(wait=False, autostart=False)
    assert not change(driver, "activate")
    assert driver.link.state() == "unconfigured"


def test_bad_configuration_fails_the_transition_with_the_reason(start: Callable[..., Any]) -> None:
    """Mended, it configures; the model can be chosen while unconfigured and no later."""
    driver = start(wait=False, autostart=False, fiber_file="18Dec2017x", mode="lockstep")
    assert not change(driver, "configure")
    assert driver.link.state() == "unconfigured"
    assert "fibre '18Dec2017x' is not known" in driver.process.log()
    driver.link.set_parameters({"fiber_file": FIBRE, "model": "2state"})
    assert change(driver, "configure")
    assert driver.link.parameters(["model", "fibre"]) == {"model": "2state", "fibre": FIBRE}
    with pytest.raises(Exception, match="when unconfigured only; clean up first"):
        driver.link.set_parameters({"model": "3state_coop"})
    with pytest.raises(Exception, match="when unconfigured only; clean up first"):
        driver.link.set_parameters({"fiber_file": "13Dec2017a"})


def test_unknown_parameter_fails_the_transition(start: Callable[..., Any]) -> None:
    """What was misspelt on the command line is not forgotten."""
    driver = start(wait=False, autostart=False, rate_hzz=500.0)
    assert not change(driver, "configure")
    assert "did you mean 'rate_hz'?" in driver.process.log()


def test_reset_before_configuring_says_so(start: Callable[..., Any]) -> None:
    """There is nothing to forget yet."""
    driver = start(wait=False, autostart=False)
    with pytest.raises(Exception, match="not configured"):
        driver.link.reset()


@pytest.mark.slow
def test_a_node_that_started_by_itself_tells_why_a_later_configuration_fails(start: Callable[..., Any]) -> None:
    """Nobody else is there to tell it then."""
    driver = start(mode="lockstep", meet=False)
    assert change(driver, "deactivate")
    assert change(driver, "cleanup")
    driver.link.set_parameters({"fiber_file": "18Dec2017x"})
    assert not change(driver, "configure")
    assert driver.process.log().count("cannot be configured: fibre '18Dec2017x' is not known") == 1
