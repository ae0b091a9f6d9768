"""What does the work: what local processes, a cluster and this process have in common."""

from __future__ import annotations

import pickle
from collections.abc import Callable
from types import TracebackType
from typing import Any, Protocol, TypeAlias

from xb_muscle_ros.work.outcome import Outcome, attempt

Function: TypeAlias = Callable[[Any], Any]


class Backend(Protocol):
    """Takes tasks of one function, gives outcomes in any order; ends all that it started with its ``with`` block."""

    def busy(self) -> int:
        """Number of tasks whose outcome was not given yet."""

    def full(self) -> bool:
        """Whether another task would only wait."""

    def submit(self, index: int, task: object) -> None:
        """Take a task; its index comes back with its outcome."""

    def collect(self) -> list[tuple[int, Outcome]]:
        """Wait for outcomes, at least one; only while busy."""

    def __enter__(self) -> Backend: ...

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None: ...


class Here:
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

    def __enter__(self) -> Here:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._found.clear()
