"""Changes to the content of a file, for tests of what a reader says of them."""

from __future__ import annotations

from collections.abc import Callable
from typing import AnyStr


def swap(old: AnyStr, new: AnyStr) -> Callable[[AnyStr], AnyStr]:
    """A change that puts something in the place of what has to be there."""

    def change(content: AnyStr) -> AnyStr:
        assert old in content
        return content.replace(old, new, 1)

    return change
