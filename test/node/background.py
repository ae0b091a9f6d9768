"""Work in a thread of its own, for the ``with`` block of a test."""

from __future__ import annotations

import abc
import threading
from typing import TypeVar

T = TypeVar("T", bound="Background")


class Background(abc.ABC):
    """Does `work` until `ended` is set, then closes."""

    def __init__(self) -> None:
        self.ended = threading.Event()
        self._thread = threading.Thread(target=self.work)

    @abc.abstractmethod
    def work(self) -> None:
        """In the thread."""

    @abc.abstractmethod
    def close(self) -> None:
        """After the thread."""

    def __enter__(self: T) -> T:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self.ended.set()
        self._thread.join(10.0)
        self.close()
