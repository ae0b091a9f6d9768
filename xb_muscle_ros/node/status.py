"""What a stepping mode tells of itself: to diagnostics, to the log, and to be kept."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np
import numpy.typing as npt

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.node.lateness import LatenessSummary
from xb_muscle_ros.node.rules import Scale


class Log(Protocol):
    """What is used of an rclpy logger."""

    def error(self, message: str) -> object:
        """What stops the fibre or leaves it without input."""

    def warning(self, message: str) -> object:
        """What a user should know of."""

    def info(self, message: str) -> object:
        """What has changed for the better."""


@dataclass(frozen=True)
class Status:
    """A moment's account.

    Attributes:
        ticks: steps taken since activation.
        violations: states violated since activation.
        fault: why stepping stopped; empty where it did not.
        waiting: what is waited for; empty where nothing is.
        lateness: of ticks since the last reset; None where no clock drives them.
        overruns: deadlines that had passed before their tick was reached, since the last reset.
        dropped: of those, ticks that were not made up for.
        on_timeout: what is done because length is overdue; empty where it is not, or where no clock drives the steps.
        timeouts: how often length became overdue since the last reset.
    """

    ticks: int
    violations: int
    fault: str
    waiting: str
    lateness: LatenessSummary | None = None
    overruns: int = 0
    dropped: int = 0
    on_timeout: str = ""
    timeouts: int = 0


class Account(NamedTuple):
    """How many samples were taken since the last reset.

    Attributes:
        length, calcium: samples of each; under force control the first are loads.
        late: calcium samples that came after the step that should have used them.
    """

    length: int = 0
    calcium: int = 0
    late: int = 0

    def __str__(self) -> str:
        return self.told()

    def told(self, topic: str = "length") -> str:
        """In words; `topic` is ``length`` or ``load``."""
        return f"{self.length} {topic} and {self.calcium} calcium samples, {self.late} of them late"

    @classmethod
    def read(cls, text: str) -> Account | None:
        """Find an account in a text; the other way of `told`."""
        found = re.search(r"(\d+) (?:length|load) and (\d+) calcium samples, (\d+) of them late", text)
        return cls(*map(int, found.groups())) if found else None


def time_went_back(last: int, stamp: int, account: Account, topic: str = "length") -> str:
    """What to say when a stamp (ns) of length or load goes back from the last one under simulated time."""
    return (
        f"{topic} went back from {last * 1e-9:.9f} s to {stamp * 1e-9:.9f} s of simulated time: state forgotten after "
        f"{account.told(topic)}; the fibre settles anew"
    )


def no_state(fault: str, needs: str) -> UserError:
    """What to say where there is nothing to save: stepping has stopped, or a fibre still needs something to settle."""
    why = f", stepping has stopped: {fault}; call ~/reset first" if fault else f" yet: the fibre settles with {needs}"
    return UserError(f"there is no state to save{why}")


class Snapshot(NamedTuple):
    """What a fibre needs to go on from where it was.

    Attributes:
        state: state vector of the muscle, shape (n,); see `xb_muscle_ros.models.muscle.Muscle`.
        scale: one L0 and one F0 as in use.
        calcium: stamps (ns) and values (µM) that a later step can need, ascending; in realtime the newest, stamped 0.
        stamp, asked: of the last length sample, and until when calcium was asked for, ns; None in realtime, where the
            clock drives the steps.
        account: samples taken until then.
    """

    state: npt.NDArray[np.float64]
    scale: Scale
    calcium: tuple[tuple[int, float], ...]
    stamp: int | None
    asked: int | None
    account: Account
