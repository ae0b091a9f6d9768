"""A muscle node in a second process, and a node here that talks to it over DDS."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from xb_muscle_ros.models.batch import MuscleBatch
from xb_muscle_ros.models.fibre_file import load_fibre
from xb_muscle_ros.models.muscle import Muscle

sys.path.insert(0, str(Path(__file__).parent))

from many_fibres import NAMES

FIBRE = "18Dec2017a"
# Discovery takes 0.1 s, at times some seconds; starting Python on a busy machine takes longer.
PATIENCE_S = 30.0


@pytest.fixture(scope="session")
def muscle() -> Muscle:
    """The fibre that the nodes of these tests have."""
    return Muscle(load_fibre(FIBRE))


@pytest.fixture(scope="session")
def batch() -> MuscleBatch:
    """Three fibres that differ, in metres and newtons of their own."""
    files = ("18Dec2017a", "13Dec2017a", "7Aug2018a")
    made = [replace(load_fibre(file), name=name) for file, name in zip(files, NAMES, strict=True)]
    return MuscleBatch([replace(f, reference_length_m=0.1 * (k + 1), f0_n=10.0 * (k + 3)) for k, f in enumerate(made)])


@pytest.fixture
def started() -> Iterator[list[Any]]:
    """Benches of realtime threads, which end with the test."""
    benches: list[Any] = []
    yield benches
    for bench in benches:
        bench.realtime.stop()


@pytest.fixture(scope="session")
def domain(new_domain: Callable[[], int]) -> int:
    """The ROS domain of all node tests."""
    return new_domain()


class Notes:
    """A log that remembers, one line per message: its level, then its text."""

    def __init__(self) -> None:
        self.lines: list[str] = []

    def error(self, message: str) -> None:
        """Keep it."""
        self.lines.append(f"error {message}")

    def warning(self, message: str) -> None:
        """Keep it."""
        self.lines.append(f"warning {message}")

    def info(self, message: str) -> None:
        """Keep it."""
        self.lines.append(f"info {message}")


@pytest.fixture
def notes() -> Notes:
    """A log without ROS."""
    return Notes()


class Driver:
    """Publishes to a muscle node and collects what it says.

    Attributes:
        link: see `xb_muscle_ros.node.link`.
        process: the node's; see `xb_muscle_ros.node.process`.
        forces, moments, reports: messages so far; reports as dictionaries, level and message among them.
    """

    def __init__(self, process: Any, domain: int, namespace: str) -> None:
        from diagnostic_msgs.msg import DiagnosticArray
        from sensor_msgs.msg import JointState

        from xb_muscle_ros.node.link import Link

        self.process = process
        self.domain = domain
        self.namespace = namespace
        self.link = Link("driver", namespace, domain)
        self.link.peer = f"{namespace}/muscle_node"
        self.forces: list[Any] = []
        self.moments: list[Any] = []
        self.reports: list[dict[str, Any]] = []
        node = self.link.node
        self._kind = JointState
        self._publishers: dict[str, Any] = {}
        self._met = False
        node.create_subscription(JointState, "muscle/force", self.forces.append, 100)
        node.create_subscription(JointState, "muscle/moments", self.moments.append, 100)
        node.create_subscription(DiagnosticArray, "/diagnostics", self._on_diagnostics, 10)

    def ready(self) -> None:
        """Wait until the node is on the graph and both sides know each other's topics."""
        node = self.link.node

        def met() -> bool:
            return all(node.count_publishers(f"muscle/{t}") for t in ("force", "moments"))

        assert self.link.wait_for(met, PATIENCE_S), self.process.log()
        # Reports come without being asked for: once one is here, the node's side knows this one too.
        assert self.link.wait_for(lambda: bool(self.reports), PATIENCE_S), self.process.log()

    def meet(self, fibre: str = FIBRE) -> None:
        """Make sure that a lockstep node hears all that is sent from now on, and is heard.

        A sender knows of a listener some time before the listener knows of the sender.
        """
        end = time.monotonic() + PATIENCE_S
        while not self._met:
            assert time.monotonic() < end, self.process.log()
            self.link.reset()
            self.forces.clear()
            self.moments.clear()
            self.send("calcium", 0.0, 1.0, name=[fibre])
            self.send("length", 0.0, 1.0, name=[fibre])
            self._met = self.link.wait_for(lambda: bool(self.forces) and bool(self.moments), 1.0)
        self.link.reset()
        self.forces.clear()
        self.moments.clear()

    def send(self, topic: str, time_s: float, *position: float, **fields: Any) -> None:
        """Publish a message; `name` defaults to the fibre."""
        stamp = round(time_s * 1e9)
        message = self._kind(**{"name": [FIBRE], **fields})
        message.position = list(position)
        message.header.stamp.sec, message.header.stamp.nanosec = divmod(stamp, 1_000_000_000)
        self._publisher(topic).publish(message)

    def calcium(self, time_s: float, calcium_um: float) -> None:
        """Publish calcium. Messages of one process arrive in order here, so that no wait is needed."""
        self.send("calcium", time_s, calcium_um)

    def ask(self, time_s: float, *position: float, **fields: Any) -> Any:
        """Publish a length and return the force that answers it, or None after 5 s."""
        before = len(self.forces)
        self.send("length", time_s, *position, **fields)
        self.link.wait_for(lambda: len(self.forces) > before, 5.0)
        return self.forces[-1] if len(self.forces) > before else None

    def report(self, holds: Callable[[dict[str, Any]], bool]) -> dict[str, Any]:
        """The first report from now on for which a condition holds."""
        self.reports.clear()
        assert self.link.wait_for(lambda: any(holds(r) for r in self.reports), PATIENCE_S), (
            f"{self.reports[-1:]}; {self.process.log()}"
        )
        return next(r for r in self.reports if holds(r))

    def _publisher(self, topic: str) -> Any:
        if topic not in self._publishers:
            made = self._publishers[topic] = self.link.node.create_publisher(self._kind, f"muscle/{topic}", 100)
            assert self.link.wait_for(lambda: bool(made.get_subscription_count()), PATIENCE_S), self.process.log()
        return self._publishers[topic]

    def _on_diagnostics(self, message: Any) -> None:
        for status in message.status:
            if status.name == f"{self.link.peer[1:]}: stepping":
                values = {pair.key: pair.value for pair in status.values}
                self.reports.append({**values, "level": status.level, "message": status.message})


@pytest.fixture(scope="module")
def start(domain: int, request: pytest.FixtureRequest) -> Iterator[Callable[..., Driver]]:
    """Start nodes with given parameters, each in a namespace of its own; they end with the module.

    With `meet` false the driver stays silent, so that a player can have the topics for itself.
    """
    from xb_muscle_ros.node.process import NodeProcess

    drivers: list[Driver] = []
    group = request.module.__name__.rpartition(".")[2]

    def make(wait: bool = True, meet: bool = True, arguments: Sequence[str] = (), **parameters: object) -> Driver:
        namespace = f"/{group}_{len(drivers)}"
        given = {"fiber_file": FIBRE, **parameters}
        process = NodeProcess(domain, given, ["-r", f"__ns:={namespace}", *arguments])
        try:
            driver = Driver(process, domain, namespace)
        except BaseException:
            process.stop()
            raise
        drivers.append(driver)
        if wait:
            driver.ready()
        if wait and meet and parameters.get("mode") == "lockstep":
            driver.meet(str(parameters.get("fibre", FIBRE)))
        return driver

    yield make
    for driver in drivers:
        driver.link.close()
        driver.process.stop()


@pytest.fixture(scope="module")
def lockstep(start: Callable[..., Driver]) -> Driver:
    """A node in lockstep, shared by the tests of a module."""
    return start(mode="lockstep")


@pytest.fixture
def fresh(lockstep: Driver) -> Driver:
    """The same, after a reset and with 1 m and 1 N as constants."""
    lockstep.link.set_parameters({"constants.reference_length_m": 1.0, "constants.f0_n": 1.0})
    lockstep.meet()
    return lockstep
