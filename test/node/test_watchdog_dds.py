"""Length that stays away, as the other side of DDS sees it."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest


def feed(driver: Any, enough: Callable[[], bool], calcium: bool = True) -> None:
    """Length every 20 ms until something holds."""

    def step() -> bool:
        if calcium:
            driver.send("calcium", 0.0, 31.6)
        driver.send("length", 0.0, 1.0)
        driver.link.wait_for(lambda: False, 0.02)
        return enough()

    assert driver.link.wait_for(step, 30.0), driver.process.log()


@pytest.mark.slow
def test_realtime_says_what_it_does_and_when_it_ends(start: Callable[..., Any]) -> None:
    """Level, age and behaviour in diagnostics, one line in the log at each change, and force that falls and returns."""
    from diagnostic_msgs.msg import DiagnosticStatus

    driver = start(mode="realtime", rate_hz=250.0, timeout_s=1.0, on_timeout="decay", decay_s=0.05)
    feed(driver, lambda: len(driver.forces) > 50)
    full = driver.forces[-1].effort[0]
    report = driver.report(lambda r: r["level"] == DiagnosticStatus.ERROR)
    assert report["message"].startswith("no length for ")
    assert " s: decay" in report["message"]
    assert float(report["input age (s)"]) > 1.0
    assert driver.link.wait_for(lambda: driver.forces[-1].effort[0] < 0.2 * full, 30.0)
    # Calcium was received once and for all; length alone brings it back.
    feed(driver, lambda: driver.forces[-1].effort[0] > 0.9 * full, calcium=False)
    driver.reports.clear()
    feed(driver, lambda: any(r["level"] != DiagnosticStatus.ERROR for r in driver.reports), calcium=False)
    assert int(driver.reports[-1]["timeouts"]) >= 1
    log = driver.process.log()
    assert log.count("timeout_s is 1 s: decay") >= 1
    assert log.count("length is back after ") >= 1


@pytest.mark.slow
def test_lockstep_only_reports(start: Callable[..., Any]) -> None:
    """Without messages nothing steps, and the next one is answered as if it had come at once."""
    from diagnostic_msgs.msg import DiagnosticStatus

    driver = start(mode="lockstep", timeout_s=0.5, on_timeout="decay")
    driver.calcium(0.0, 31.6)
    settled = driver.ask(1.0, 1.0).effort[0]
    report = driver.report(lambda r: r["message"].startswith("no length for "))
    assert report["level"] == DiagnosticStatus.WARN
    assert len(driver.forces) == 1
    assert driver.ask(1.001, 1.0).effort[0] == pytest.approx(settled, rel=1e-6)
    driver.link.set_parameters({"timeout_s": 0.0})
    assert driver.report(lambda r: r["level"] == DiagnosticStatus.OK)["message"] == "stepping"
