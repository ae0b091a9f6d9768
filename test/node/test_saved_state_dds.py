"""State that outlives its process."""

from __future__ import annotations

import signal
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

FIBRE = "18Dec2017a"
SAMPLES = 80


def call(driver: Any, service: str) -> tuple[bool, str]:
    """Answer of ``save_state`` or ``load_state``."""
    from std_srvs.srv import Trigger

    response = driver.link.call(Trigger, service, Trigger.Request())
    return response.success, response.message


def play(driver: Any, first: int, last: int) -> list[tuple[float, float, float]]:
    """Force, and length and velocity of the contractile element, for some samples of a wobbling trial."""
    rng = np.random.default_rng(7)
    time_s = 3.7 + np.cumsum(rng.choice([5e-4, 1e-3, 2e-3], SAMPLES))
    length_l0 = 1.0 + 0.03 * np.sin(0.2 * np.arange(SAMPLES)) + 0.001 * rng.standard_normal(SAMPLES)
    calcium_um = {0: 0.7, 20: 31.6, 45: 2.1}
    answers = []
    for k in range(first, last):
        if k in calcium_um:
            driver.calcium(time_s[k] - 1e-4, calcium_um[k])
        answer = driver.ask(time_s[k], length_l0[k])
        assert answer is not None, driver.process.log()
        answers.append((answer.effort[0], answer.position[0], answer.velocity[0]))
    return answers


@pytest.mark.slow
def test_killed_and_started_again_it_goes_on_to_the_bit(start: Callable[..., Any], tmp_path: Path) -> None:
    """SIGKILL in the middle of a trial, a new process, and the forces of an uninterrupted run."""
    path = tmp_path / "state.json"
    first = start(mode="lockstep", state_file=str(path))
    whole = play(first, 0, SAMPLES)
    assert len(set(whole)) == SAMPLES
    first.link.reset()
    half = play(first, 0, 50)
    assert half == whole[:50]
    assert call(first, "save_state") == (
        True,
        f"state of fibre {FIBRE} saved to {path} after 50 length and 3 calcium samples, 0 of them late",
    )
    first.process.process.kill()
    assert first.process.wait() == -signal.SIGKILL
    second = start(mode="lockstep", state_file=str(path))
    # What it took before is forgotten.
    second.calcium(0.0, 5.0)
    assert second.ask(1.0, 1.01) is not None
    assert call(second, "load_state")[0]
    assert play(second, 50, SAMPLES) == whole[50:]
    assert second.link.reset() == (SAMPLES, 3, 0)


def test_a_state_can_be_loaded_before_activating(start: Callable[..., Any], tmp_path: Path) -> None:
    """Unconfigured there is nothing to load into; inactive there is, and activation goes on with it."""
    from lifecycle_msgs.msg import Transition
    from lifecycle_msgs.srv import ChangeState

    def change(number: int) -> None:
        request = ChangeState.Request(transition=Transition(id=number))
        assert driver.link.call(ChangeState, "change_state", request, timeout_s=60.0).success

    driver = start(wait=False, autostart=False, mode="lockstep", state_file=str(tmp_path / "state.json"))
    assert call(driver, "load_state") == (False, "the node is not configured; configure it first")
    change(Transition.TRANSITION_CONFIGURE)
    driver.ready()
    success, message = call(driver, "save_state")
    assert (success, message.split(":")[0]) == (False, "there is no state to save yet")
    change(Transition.TRANSITION_ACTIVATE)
    driver.meet()
    whole = play(driver, 0, 30)
    driver.link.reset()
    play(driver, 0, 10)
    assert call(driver, "save_state")[0]
    change(Transition.TRANSITION_DEACTIVATE)
    driver.link.reset()
    assert call(driver, "load_state")[0]
    change(Transition.TRANSITION_ACTIVATE)
    assert play(driver, 10, 30) == whole[10:]


def test_what_is_wrong_comes_back_in_the_answer(start: Callable[..., Any], tmp_path: Path) -> None:
    """No path, no file, another value; the node goes on as if it had not been asked."""
    driver = start(mode="lockstep")
    whole = play(driver, 0, 12)
    driver.link.reset()
    play(driver, 0, 4)
    success, message = call(driver, "save_state")
    assert not success
    assert "'state_file' is empty" in message
    driver.link.set_parameters({"state_file": str(tmp_path / "state.json")})
    success, message = call(driver, "load_state")
    assert not success
    assert "cannot be read: No such file" in message
    assert message in driver.process.log()
    assert call(driver, "save_state")[0]
    f = "models.3state_coop.f"
    before = driver.link.parameters([f])[f]
    driver.link.set_parameters({f: before + 1.0})
    success, message = call(driver, "load_state")
    assert not success
    assert f"has {f} = {before}, this node has {before + 1.0}; set the parameter" in message
    driver.link.set_parameters({f: before})
    assert play(driver, 4, 12) == whole[4:]


@pytest.mark.slow
@pytest.mark.parametrize("at_start", [False, True])
def test_realtime_goes_on_with_the_force_it_had(start: Callable[..., Any], tmp_path: Path, at_start: bool) -> None:
    """A new process needs neither length nor calcium to go on, nor a call where it loads the state by itself."""
    path = tmp_path / "state.json"
    first = start(mode="realtime", rate_hz=250.0, state_file=str(path), load_state_at_start=at_start)
    assert (f"state file {path} does not exist yet" in first.process.log()) == at_start

    def fed() -> bool:
        first.send("calcium", 0.0, 31.6)
        first.send("length", 0.0, 1.02)
        first.link.wait_for(lambda: False, 0.05)
        return len(first.forces) > 20

    assert first.link.wait_for(fed, 30.0), first.process.log()
    force = first.forces[-1].effort[0]
    assert call(first, "save_state")[0]
    second = start(mode="realtime", rate_hz=250.0, state_file=str(path), load_state_at_start=at_start)
    if not at_start:
        assert not second.forces
        assert call(second, "load_state")[0]
    assert second.link.wait_for(lambda: len(second.forces) > 5, 30.0), second.process.log()
    assert second.forces[-1].effort[0] == pytest.approx(force, rel=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("text", "words"),
    [("", "'state_file' is empty; name the file there"), ("{}", "has format")],
)
def test_a_state_that_cannot_be_loaded_at_the_start_ends_the_node(
    domain: int, tmp_path: Path, text: str, words: str
) -> None:
    """With one line and code 2; a fibre that settles anew in silence would be another one."""
    from xb_muscle_ros.node.client.process import NodeProcess

    given = {"fiber_file": "18Dec2017a", "load_state_at_start": True}
    if text:
        (tmp_path / "state.json").write_text(text, encoding="utf-8")
        given["state_file"] = str(tmp_path / "state.json")
    with NodeProcess(domain, given) as child:
        assert child.wait() == 2
        assert words in child.log()
        assert child.log().count("\n") == 1
