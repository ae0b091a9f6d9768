"""What does the work: what local processes, a cluster and this process have in common."""

from __future__ import annotations

import abc
import pickle
from collections.abc import Callable
from contextlib import AbstractContextManager
from typing import Any, TypeAlias

from xb_muscle_ros.work.outcome import Outcome, attempt

Function: TypeAlias = Callable[[Any], Any]


class Backend(AbstractContextManager["Backend"]):
    """Takes tasks of one function, gives outcomes in any order; ends all that it started with its ``with`` block."""

    @abc.abstractmethod
    def busy(self) -> int:
        """Number of tasks whose outcome was not given yet."""

    @abc.abstractmethod
    def full(self) -> bool:
        """Whether another task would only wait."""

    @abc.abstractmethod
    def submit(self, index: int, task: object) -> None:
        """Take a task; its index comes back with its outcome."""

    @abc.abstractmethod
    def collect(self) -> list[tuple[int, Outcome]]:
        """Wait for outcomes, at least one; only while busy."""

    @abc.abstractmethod
    def __exit__(self, *_: object) -> None:
        """End all that was started."""


class Here(Backend):
    """See `Backend`. Works in this process, a task at a time."""

    def __init__(self, function: Function) -> None:
        self._function = function
        self._found: list[tuple[int, Outcome]] = []

    def busy(self) -> int:
        return len(self._found)

    def full(self) -> bool:
        return bool(self._found)

    def submit(self, index: int, task: object) -> None:
        self._found.append((index, attempt(pickle.dumps((self._function, task)))))

    def collect(self) -> list[tuple[int, Outcome]]:
        found, self._found = self._found, []
        return found

    def __exit__(self, *_: object) -> None:
        self._found.clear()
