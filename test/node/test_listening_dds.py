"""What reaches the node: kept by publishers, sent by plain ones, lost on the way, refused for good."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
import yaml

FIBRE = "18Dec2017a"
PATIENCE_S = 30.0


def publisher(driver: Any, topic: str, keeps: bool, depth: int = 10, **qos: Any) -> Any:
    """A publisher beside the driver's own, in a context of its own."""
    from rclpy.qos import QoSDurabilityPolicy, QoSProfile, QoSReliabilityPolicy
    from sensor_msgs.msg import JointState

    durability = QoSDurabilityPolicy.TRANSIENT_LOCAL if keeps else QoSDurabilityPolicy.VOLATILE
    profile = QoSProfile(depth=depth, reliability=QoSReliabilityPolicy.RELIABLE, durability=durability)
    return driver.link.node.create_publisher(JointState, f"{driver.namespace}/muscle/{topic}", profile)


def message(time_s: float, position: float) -> Any:
    """A sample of the fibre."""
    from sensor_msgs.msg import JointState

    made = JointState(name=[FIBRE], position=[position])
    made.header.stamp.sec, made.header.stamp.nanosec = divmod(round(time_s * 1e9), 1_000_000_000)
    return made


@pytest.fixture
def before(domain: int, request: pytest.FixtureRequest) -> Iterator[Callable[..., Any]]:
    """Publish something in a namespace, then start a node there."""
    from node_driver import Driver

    from xb_muscle_ros.node.client.process import NodeProcess

    made: list[Any] = []

    def make(publish: Callable[[Any], None], **parameters: object) -> Any:
        namespace = f"/before_{abs(hash(request.node.name)) % 10**8}_{len(made)}"

        class Nobody:
            def log(self) -> str:
                return ""

            def stop(self) -> None:
                """There is no process yet."""

        driver = Driver(Nobody(), domain, namespace)
        made.append(driver)
        publish(driver)
        driver.process = NodeProcess(domain, {"fiber_file": FIBRE, **parameters}, ["-r", f"__ns:={namespace}"])
        driver.ready()
        return driver

    yield make
    for driver in made:
        driver.process.stop()
        driver.link.close()


@pytest.mark.slow
@pytest.mark.parametrize("mode", ["lockstep", "realtime"])
@pytest.mark.parametrize("stamp_s", [0.0, 1.0])
def test_calcium_published_once_before_the_node_starts(before: Callable[..., Any], mode: str, stamp_s: float) -> None:
    """Transient local: the node takes it, though it listens late; what comes later is taken once."""
    kept: list[Any] = []

    def publish(driver: Any) -> None:
        kept.append(publisher(driver, "calcium", keeps=True))
        kept[0].publish(message(stamp_s, 5.0))

    driver = before(publish, mode=mode)
    length = publisher(driver, "length", keeps=False)
    begin = time.monotonic()
    k = 0
    while not driver.forces and time.monotonic() - begin < PATIENCE_S:
        k += 1
        length.publish(message(2.0 + 0.1 * k, 1.0))
        driver.link.wait_for(lambda: bool(driver.forces), 0.2)
    assert driver.forces, driver.process.log()
    # The node listens to it a second time at the moment: no sample of it may be taken for a late one.
    for n in range(5):
        kept[0].publish(message(1000.0 + n, 6.0))
        driver.link.wait_for(lambda: False, 0.05)
    report = driver.report(lambda r: True)
    assert "refused: stamp not after the last" not in report
    assert int(driver.link.reset().calcium) == 6


@pytest.mark.slow
@pytest.mark.parametrize("mode", ["lockstep", "realtime"])
def test_plain_publishers_are_heard_beside_one_that_keeps(before: Callable[..., Any], mode: str) -> None:
    """As `ros2 topic pub` sends: volatile."""
    kept: list[Any] = []

    def publish(driver: Any) -> None:
        kept.append(publisher(driver, "calcium", keeps=True))
        kept.append(publisher(driver, "calcium", keeps=False))
        kept[0].publish(message(1.0, 5.0))

    driver = before(publish, mode=mode)
    assert driver.link.wait_for(lambda: kept[1].get_subscription_count() >= 1, PATIENCE_S)
    # The node knows of both, which is why it counts no losses.
    driver.report(lambda r: "while 2 publish" in r["lost: calcium"])
    kept[1].publish(message(1.5, 7.0))
    driver.link.wait_for(lambda: False, 0.5)
    assert driver.link.reset().calcium == 2


def test_overrides_of_one_topic_leave_the_other_alone(domain: int, tmp_path: Path) -> None:
    """Calcium transient local by a parameter file: lengths of a volatile publisher still come."""
    from node_driver import Driver

    from xb_muscle_ros.node.client.process import NodeProcess

    overrides = {"/quality/muscle/calcium": {"subscription": {"durability": "transient_local", "depth": 7}}}
    path = tmp_path / "qos.yaml"
    path.write_text(yaml.safe_dump({"/**": {"ros__parameters": {"qos_overrides": overrides}}}), encoding="utf-8")
    given = {"fiber_file": FIBRE, "mode": "lockstep"}
    with NodeProcess(domain, given, ["-r", "__ns:=/quality", "--params-file", str(path)]) as child:
        driver = Driver(child, domain, "/quality")
        try:
            driver.ready()
            names = [
                f"qos_overrides./quality/muscle/{t}.subscription.{p}"
                for t in ("calcium", "length")
                for p in ("durability", "depth")
            ]
            assert list(driver.link.parameters(names).values()) == ["transient_local", 7, "volatile", 100]
            publisher(driver, "calcium", keeps=True).publish(message(0.0, 5.0))
            end = time.monotonic() + PATIENCE_S
            k = 0
            while not driver.forces and time.monotonic() < end:
                k += 1
                driver.ask(0.1 * k, 1.0)
            assert driver.forces, child.log()
        finally:
            driver.link.close()


@pytest.mark.slow
def test_a_flood_that_loses_messages_is_a_warning_with_the_count(start: Callable[..., Any]) -> None:
    """All that were sent are taken or counted as lost; a reset begins anew."""
    from diagnostic_msgs.msg import DiagnosticStatus

    driver = start(mode="realtime", rate_hz=250.0)
    driver.send("calcium", 0.0, 5.0)
    sender, sample = driver._publisher("length"), message(0.0, 1.0)
    # Numbers count from the first that comes.
    end = time.monotonic() + PATIENCE_S
    while driver.report(lambda r: True)["input age (s)"] == "none yet" and time.monotonic() < end:
        sender.publish(sample)
    driver.link.wait_for(lambda: False, 0.5)
    driver.link.reset()
    count = 3000
    for _ in range(count):
        sender.publish(sample)
    report = driver.report(lambda r: int(r["lost: length"]) > 0)
    assert report["level"] == DiagnosticStatus.WARN
    assert f"lost {report['lost: length']} length messages" in report["message"]
    # One more, so that the last gap is seen as well.
    driver.link.wait_for(lambda: False, 0.5)
    sender.publish(sample)
    report = driver.report(lambda r: True)
    lost = int(driver.report(lambda r: True)["lost: length"])
    taken = driver.link.reset().length
    assert taken + lost == count + 1
    assert driver.report(lambda r: True)["lost: length"] == "0"


@pytest.mark.slow
def test_input_that_is_refused_for_good_is_an_error_with_the_remedy(start: Callable[..., Any]) -> None:
    """More than an hour ahead: nothing is taken, also after the sender has fallen silent, until ~/reset."""
    from diagnostic_msgs.msg import DiagnosticStatus

    driver = start(mode="lockstep", use_sim_time=True)
    driver.calcium(1.0, 5.0)
    assert driver.ask(2.0, 1.0) is not None
    for k in range(3):
        driver.send("length", 9000.0 + k, 1.0)
    report = driver.report(lambda r: "no length taken" in r["message"])
    assert report["level"] == DiagnosticStatus.ERROR
    assert "stamp too far ahead" in report["message"]
    assert "call ~/reset" in report["message"]
    # The sender is silent now, and the report stays what it was.
    assert driver.report(lambda r: "refused 3" not in r["message"])["level"] == DiagnosticStatus.ERROR
    driver.link.reset()
    assert driver.report(lambda r: "no length taken" not in r["message"])["level"] == DiagnosticStatus.WARN
    driver.calcium(9000.0, 5.0)
    assert driver.ask(9001.0, 1.0) is not None


@pytest.mark.slow
def test_two_nodes_of_one_name_say_so(start: Callable[..., Any]) -> None:
    """The second one finds the first."""
    from xb_muscle_ros.node.client.process import NodeProcess

    driver = start(mode="realtime")
    given = {"fiber_file": FIBRE}
    with NodeProcess(driver.domain, given, ["-r", f"__ns:={driver.namespace}"]) as second:
        end = time.monotonic() + PATIENCE_S
        while "2 nodes are called" not in second.log() and time.monotonic() < end:
            time.sleep(0.2)
        assert f"2 nodes are called {driver.namespace}/muscle_node" in second.log()
