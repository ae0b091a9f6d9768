"""A muscle node in a second process, and a node here that talks to it over DDS."""

from __future__ import annotations

import sys
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
from node_driver import FIBRE, Driver


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


@pytest.fixture(scope="module")
def start(domain: int, request: pytest.FixtureRequest) -> Iterator[Callable[..., Driver]]:
    """Start nodes with given parameters, each in a namespace of its own; they end with the module.

    With `meet` false the driver stays silent, so that a player can have the topics for itself.
    """
    from xb_muscle_ros.node.client.process import NodeProcess

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
        # All end side by side.
        driver.process.ask_to_stop()
    for driver in drivers:
        driver.process.stop()
    for driver in drivers:
        driver.link.close()


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
