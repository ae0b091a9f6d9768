"""A node of many fibres on the other side of DDS."""

from __future__ import annotations

import signal
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from xb_muscle_ros.models.fibre_file import load_fibre
from xb_muscle_ros.models.muscle import Muscle
from xb_muscle_ros.trials.simulated import MOMENTS

NAMES = ["left", "right", "back"]
FILES = ["18Dec2017a", "13Dec2017a", "18Dec2017a"]


@pytest.fixture(scope="module")
def parameter_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Common constants for all, one of its own for one."""
    path = tmp_path_factory.mktemp("many") / "muscles.yaml"
    path.write_text(
        f"""/**:
  ros__parameters:
    fibers: [{", ".join(NAMES)}]
    fiber_files: [{", ".join(FILES)}]
    constants: {{reference_length_m: 1.0, f0_n: 2.0}}
    back: {{constants: {{f0_n: 8.0}}}}
""",
        encoding="utf-8",
    )
    return path


def begin(start: Callable[..., Any], parameter_file: Path, **parameters: Any) -> Any:
    """A node of the three, in lockstep, that knows this side."""
    driver = start(
        meet=False,
        fiber_file="''",
        mode="lockstep",
        arguments=["--params-file", str(parameter_file)],
        **parameters,
    )
    # Whoever meets it sends one value for its name.
    driver.meet("left")
    return driver


@pytest.fixture(scope="module")
def three(start: Callable[..., Any], parameter_file: Path) -> Any:
    """Shared by the tests of this module."""
    return begin(start, parameter_file)


def play(driver: Any, first: int, last: int) -> list[list[float]]:
    """Forces of a swing that differs between the fibres."""
    answers = []
    for k in range(first, last):
        if k % 7 == 0:
            driver.send("calcium", 1.0 + 1e-3 * k, 1.0 + k, 2.0 + k, 3.0 + k, name=NAMES)
        lengths = [1.0 + 1e-4 * k * (i + 1) for i in range(3)]
        answers.append(list(driver.ask(1.0 + 1e-3 * k, *lengths, name=NAMES).effort))
    return answers


@pytest.mark.slow
def test_arrays_by_name_in_any_order(three: Any) -> None:
    """Files, common and own constants, and forces that are those of one fibre alone, to the bit."""
    three.link.reset()
    three.moments.clear()
    order = ["back", "left", "right"]
    three.send("calcium", 0.0, 3.0, 1.0, 2.0, name=order)
    answer = three.ask(1.0, 1.02, 1.0, 1.01, name=order)
    assert list(answer.name) == NAMES
    outputs = []
    for i, (file, change) in enumerate(zip(FILES, (0.0, 1.01 - 1.0, 1.02 - 1.0), strict=True)):
        muscle = Muscle(load_fibre(file))
        outputs.append(muscle.outputs(muscle.settle(change, float(i + 1))))
    forces = [f * out.force_f0 for f, out in zip((2.0, 2.0, 8.0), outputs, strict=True)]
    assert list(answer.effort) == forces
    assert list(answer.position) == [1.0 + out.ce_length_change_l0 for out in outputs]
    assert three.link.wait_for(lambda: bool(three.moments), 5.0)
    assert list(three.moments[-1].name) == [f"{name}/{moment}" for name in NAMES for moment in MOMENTS]
    assert three.moments[-1].position[6] == outputs[1].q0


def test_some_names_strangers_and_bad_values(three: Any) -> None:
    """Who is not named does not move; strangers are reported once; a bad value costs its fibre this sample only."""
    three.link.reset()
    # While both sides came to know each other the node may have refused a length whose calcium it had not heard.
    earlier = int(three.report(lambda r: True)["refused"])
    three.send("calcium", 0.0, 5.0, 5.0, 5.0, name=[])
    assert list(three.ask(1.0, 1.0, 1.0, 1.0, name=[]).name) == NAMES
    answer = three.ask(1.001, 1.001, 7.0, name=["right", "ghost"])
    assert list(answer.name) == ["right"]
    three.send("length", 1.002, 7.0, name=["ghost"])
    answer = three.ask(1.002, 1.0, float("nan"), 1.0, name=NAMES)
    assert list(answer.name) == ["left", "back"]
    three.send("length", 1.003, 1.0, name=NAMES)
    assert list(three.ask(1.003, 1.0, 1.0, 1.0, name=NAMES).name) == NAMES
    log = three.process.log()
    assert log.count("names ignored: ghost; this node has fibres left, right, back") == 1
    assert "length of right refused (not finite, 1 so far)" in log
    report = three.report(lambda r: r.get("refused: wrong array size") == "1")
    assert (report["fibres"], report["ignored names"], int(report["refused"]) - earlier) == ("3", "1", 2)


def test_every_fibre_has_its_parameters(three: Any) -> None:
    """Those of the set in use, under its name; a bad set is refused whole; common ones are set when unconfigured."""
    f = "models.3state_coop.f"
    before = three.link.parameters([f"left.{f}", f"right.{f}", "back.constants.f0_n", "model"])
    assert before["back.constants.f0_n"] == 8.0
    assert before["model"] == "3state_coop"
    assert before[f"left.{f}"] == load_fibre(FILES[0]).values["f"]
    assert before[f"right.{f}"] == load_fibre(FILES[1]).values["f"]
    for bad, reason in (
        ({f"right.{f}": -1.0}, "out of range"),
        ({"ghost.models.3state_coop.f": 1.0}, "is not known"),
        ({"constants.f0_n": 3.0}, "common to all fibres .* 'left.constants.f0_n'"),
        ({"model": "2state"}, "when unconfigured only"),
        ({"fibers": ["a"]}, "when unconfigured only; clean up first"),
        ({"right.models.3state_coop.smoothing": 0.0}, "when unconfigured only"),
    ):
        with pytest.raises(Exception, match=reason):
            three.link.set_parameters({f"left.{f}": 1.0, **bad})
    assert three.link.parameters([f"left.{f}"]) == {f"left.{f}": before[f"left.{f}"]}
    three.link.reset()
    three.send("calcium", 0.0, 30.0, 30.0, 30.0, name=[])
    full = list(three.ask(1.0, 1.0, 1.0, 1.0, name=[]).effort)
    three.link.set_parameters({f"right.{f}": 0.0})
    for k in range(1, 10):
        later = list(three.ask(1.0 + 0.2 * k, 1.0, 1.0, 1.0, name=[]).effort)
    assert later[1] < 0.1 * full[1]
    assert later[0] == pytest.approx(full[0], rel=1e-3)
    three.link.set_parameters({f"right.{f}": before[f"right.{f}"]})


def test_killed_and_started_again_all_go_on_to_the_bit(
    start: Callable[..., Any], parameter_file: Path, three: Any, tmp_path: Path
) -> None:
    """SIGKILL in the middle; all fibres come from one file."""
    from std_srvs.srv import Trigger

    def call(driver: Any, service: str) -> str:
        answer = driver.link.call(Trigger, service, Trigger.Request())
        assert answer.success, answer.message
        return str(answer.message)

    path = tmp_path / "states.json"
    three.link.set_parameters({"state_file": str(path)})
    three.link.reset()
    whole = play(three, 0, 40)
    three.link.reset()
    assert play(three, 0, 20) == whole[:20]
    assert call(three, "save_state") == f"states of 3 fibres saved to {path}"
    three.process.process.kill()
    assert three.process.wait() == -signal.SIGKILL
    second = begin(start, parameter_file, state_file=str(path))
    assert call(second, "load_state") == f"states of 3 fibres loaded from {path}"
    assert play(second, 20, 40) == whole[20:]


@pytest.mark.slow
def test_realtime_serves_many_from_one_file(start: Callable[..., Any]) -> None:
    """All have the same file; priority and locked memory work, or are said not to."""
    names = [f"m{i}" for i in range(20)]
    driver = start(
        fibers=f"[{', '.join(names)}]", mode="realtime", rate_hz=250.0, realtime_priority=10, lock_memory=True
    )

    def fed() -> bool:
        driver.send("calcium", 0.0, *[5.0] * 20, name=names)
        driver.send("length", 0.0, *[1.0 + 1e-3 * i for i in range(20)], name=names)
        driver.link.wait_for(lambda: False, 0.02)
        return len(driver.forces) > 50

    assert driver.link.wait_for(fed, 30.0), driver.process.log()
    force = driver.forces[-1]
    assert list(force.name) == names
    assert all(earlier < later for earlier, later in zip(force.effort[:-1], force.effort[1:], strict=True))
    log = driver.process.log()
    assert "SCHED_FIFO with priority 10" in log or "realtime_priority 10 is not permitted here" in log
    assert "memory is locked" in log or "lock_memory is not permitted here" in log
    report = driver.report(lambda r: r["message"] == "stepping" or "overruns" in r["message"])
    assert report["fibre"] == "m0, m1, m2 and 17 more"


@pytest.mark.slow
def test_fibres_can_be_others_after_a_clean_up(start: Callable[..., Any]) -> None:
    """Their parameters go and come with them; one name alone is a list as well."""
    from lifecycle_msgs.msg import Transition
    from lifecycle_msgs.srv import ChangeState

    def change(label: str) -> bool:
        number = getattr(Transition, f"TRANSITION_{label}")
        request = ChangeState.Request(transition=Transition(id=number))
        return bool(driver.link.call(ChangeState, "change_state", request, timeout_s=60.0).success)

    driver = start(wait=False, autostart=False, fibers="[a, b]", mode="lockstep")
    f0 = "constants.f0_n"
    assert change("CONFIGURE")
    driver.link.set_parameters({f"a.{f0}": 5.0, "a.models.3state_coop.f": 70.0})
    assert change("CLEANUP")
    assert driver.link.parameters([f"a.{f0}"]) == {}
    driver.link.set_parameters({"fibers": ["c"], "model": "2state"})
    assert change("CONFIGURE")
    assert driver.link.parameters([f"a.{f0}", f"c.{f0}", "model"]) == {f"c.{f0}": 1.0, "model": "2state"}
    assert change("ACTIVATE")
    driver.ready()
    driver.meet("c")
    driver.send("calcium", 0.0, 5.0, name=["c"])
    assert list(driver.ask(1.0, 1.0, name=["c"]).name) == ["c"]


@pytest.mark.slow
def test_fibres_that_do_not_fit_fail_the_configuration(domain: int) -> None:
    """One line that names the remedy."""
    from xb_muscle_ros.node.client.process import NodeProcess

    cases = {
        "found both; give one": {"fiber_file": FILES[0], "fiber_files": f"[{FILES[0]}]"},
        "'fibers' has 1 names, 'fiber_files' has 2 files": {
            "fibers": "[a]",
            "fiber_files": f"[{FILES[0]}, {FILES[1]}]",
        },
        "fibre 'a' occurs 2 times": {"fibers": "[a, a]", "fiber_file": FILES[0]},
    }
    for words, parameters in cases.items():
        with NodeProcess(domain, parameters) as child:
            assert child.wait() == 2
            assert words in child.log()
            assert child.log().count("\n") == 1
