"""How the program begins and ends: exit codes, one line, no traceback."""

from __future__ import annotations

import signal
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import yaml

from xb_muscle_ros.models.fibre_file import find_fibre_file

FIBRE = "18Dec2017a"


def fibre_file(folder: Path, change: Callable[[dict[str, Any]], None]) -> Path:
    """A copy of the fibre file with something changed in its parameters."""
    tree = yaml.safe_load(find_fibre_file(FIBRE).read_text(encoding="utf-8"))
    change(tree["/**"]["ros__parameters"])
    path = folder / "changed.yaml"
    path.write_text(yaml.safe_dump(tree), encoding="utf-8")
    return path


def set_f(value: object) -> Callable[[dict[str, Any]], None]:
    """A change of the attachment rate."""
    return lambda p: p["models"]["3state_coop"].update(f=value)


BAD_FILES = {
    "negative": (set_f(-3.0), ["'f' is -3 1/s", "0 to 1e+06 1/s"]),
    "nan": (set_f(float("nan")), ["'f' is nan", "0 to 1e+06 1/s"]),
    "text": (set_f("fast"), ["'fast', not a number"]),
    "unknown parameter": (lambda p: p["models"]["3state_coop"].update(kooop=1.0), ["'kooop'", "did you mean 'koop'?"]),
    "unknown model": (lambda p: p.update(model="3state_cop"), ["'3state_cop'", "did you mean '3state_coop'?"]),
    "unknown group": (lambda p: p.update(constant={"f0_n": 1.0}), ["'constant.f0_n'", "did you mean 'constants'?"]),
}
BAD_ARGUMENTS = {
    "no fibre": ([], ["no fibre is given", "--params-file"]),
    "unknown fibre": (["-p", "fiber_file:=18Dec2017x"], ["'18Dec2017x' is not known", "did you mean"]),
    "unknown name": (["-p", f"fiber_file:={FIBRE}", "-p", "rate_hzz:=5.0"], ["'rate_hzz'", "did you mean 'rate_hz'?"]),
    "out of range": (["-p", f"fiber_file:={FIBRE}", "-p", "rate_hz:=0.0"], ["'rate_hz' is 0 Hz", "10 to 10000 Hz"]),
    "wrong choice": (["-p", f"fiber_file:={FIBRE}", "-p", "mode:=lock"], ["'lock'", "realtime or lockstep"]),
    "wrong type": (["-p", f"fiber_file:={FIBRE}", "-p", "mode:=3"], ["'mode' is 3", "text"]),
    "missing file": (["--params-file", "nowhere.yaml"], ["nowhere.yaml"]),
    "empty file": (["--params-file", "EMPTY"], ["the node's full name or '/**' at its top"]),
    "other node's file": (["--params-file", "OTHER"], ["no fibre is given to /muscle_node", "'/muscle_node' or '/**'"]),
    "digit in -p": (["-p", "models.3state_coop.f:=80.0"], ["in a parameter file only"]),
}


def assert_ends_with_one_line(domain: int, arguments: list[str], expected: list[str]) -> None:
    """Run the node with arguments that cannot work."""
    from xb_muscle_ros.node.client.process import NodeProcess

    with NodeProcess(domain, {}, arguments) as child:
        code = child.wait()
        log = child.log()
    assert code == 2, log
    assert log.count("\n") == 1, log
    assert log.startswith("muscle_node: ")
    for words in expected:
        assert words in log


@pytest.mark.slow
@pytest.mark.parametrize("case", BAD_FILES)
def test_bad_parameter_file_ends_with_code_2_and_one_line(domain: int, tmp_path: Path, case: str) -> None:
    """The value, the range and the remedy, and nothing else."""
    change, expected = BAD_FILES[case]
    assert_ends_with_one_line(domain, ["--params-file", str(fibre_file(tmp_path, change))], expected)


@pytest.mark.slow
@pytest.mark.parametrize("case", BAD_ARGUMENTS)
def test_bad_arguments_end_with_code_2_and_one_line(domain: int, tmp_path: Path, case: str) -> None:
    """Also where ROS itself finds fault with them."""
    arguments, expected = BAD_ARGUMENTS[case]
    files = {
        "EMPTY": "/**:\n  ros__parameters:\n",
        "OTHER": f"/other:\n  ros__parameters:\n    fiber_file: {FIBRE}\n",
    }
    for name, text in files.items():
        (tmp_path / name).write_text(text, encoding="utf-8")
    arguments = [str(tmp_path / argument) if argument in files else argument for argument in arguments]
    assert_ends_with_one_line(domain, arguments, expected)


@pytest.mark.slow
@pytest.mark.parametrize(("mode", "number"), [("lockstep", signal.SIGTERM), ("realtime", signal.SIGINT)])
def test_signals_end_the_node_cleanly(start: Callable[..., Any], mode: str, number: signal.Signals) -> None:
    """Exit code 0 and no traceback."""
    driver = start(mode=mode)
    driver.process.process.send_signal(number)
    assert driver.process.wait() == 0
    assert "Traceback" not in driver.process.log()


@pytest.mark.slow
def test_a_signal_while_starting_ends_the_node_cleanly(domain: int) -> None:
    """Python is long at importing; that is no time for tracebacks either."""
    from xb_muscle_ros.node.client.process import NodeProcess

    with NodeProcess(domain, {"fiber_file": FIBRE}) as child:
        maps = Path(f"/proc/{child.process.pid}/maps")
        deadline = time.monotonic() + 30.0
        while "rclpy" not in maps.read_text(encoding="utf-8") and time.monotonic() < deadline:
            time.sleep(0.005)
        child.process.send_signal(signal.SIGINT)
        assert child.wait() == 0
        assert "Traceback" not in child.log()


@pytest.mark.slow
def test_parameter_file_alone_starts_a_node(start: Callable[..., Any]) -> None:
    """A fibre file is a ROS parameter file; whole numbers stand for floating ones."""
    path = find_fibre_file(FIBRE)
    driver = start(fiber_file="''", mode="lockstep", arguments=["--params-file", str(path)])
    driver.calcium(0.0, 5.0)
    assert driver.ask(1.0, 1.0) is not None
    names = ["fibre", "model", "models.2state.kappa"]
    values = driver.link.parameters(names)
    assert values["fibre"] == FIBRE
    assert values["model"] == "3state_coop"
    assert values["models.2state.kappa"] > 0.0


@pytest.mark.slow
def test_quality_of_service_can_be_overridden(start: Callable[..., Any], tmp_path: Path) -> None:
    """A best-effort sender can drive lockstep, if the user says so."""
    path = tmp_path / "qos.yaml"
    # The topic's full name; parameter files of ROS allow slashes in names.
    for topic in ("length", "calcium"):
        overrides = {f"/test_start_{n}/muscle/{topic}": {"subscription": {"depth": 7}} for n in range(9)}
        text = yaml.safe_dump({"/**": {"ros__parameters": {"qos_overrides": overrides}}})
        path.with_name(f"{topic}.yaml").write_text(text, encoding="utf-8")
    files = [str(path.with_name(f"{topic}.yaml")) for topic in ("length", "calcium")]
    driver = start(mode="lockstep", arguments=["--params-file", files[0], "--params-file", files[1]])
    topic = f"{driver.namespace}/muscle/length"
    depth = f"qos_overrides.{topic}.subscription.depth"
    assert driver.link.parameters([depth]) == {depth: 7}
    driver.calcium(0.0, 5.0)
    assert driver.ask(1.0, 1.0) is not None
