"""Lines on bags that say the same of several: one line that names them."""

from __future__ import annotations

import re
from collections.abc import Iterable
from pathlib import Path

_BAG = re.compile(r"bag (.*?): ")
_NUMBER = re.compile(r"\d+(?:\.\d+)?(?:e[-+]?\d+)?")
_NAMED = 3


def alike(lines: Iterable[str]) -> list[str]:
    """Lines in their order; of those that differ in their bag and in numbers alone, the first, which names the others.

    Args:
        lines: begin with ``bag PATH: `` where they are of one bag; any other stays as it is.
    """
    first: dict[str, str] = {}
    others: dict[str, list[str]] = {}
    for line in lines:
        bag = _BAG.match(line)
        key = line if bag is None else _NUMBER.sub("0", line[bag.end() :])
        if key not in first:
            first[key] = line
        elif bag is not None:
            others.setdefault(key, []).append(Path(bag.group(1)).name)
    return [line + _likewise(others.get(key, [])) for key, line in first.items()]


def _likewise(bags: list[str]) -> str:
    if not bags:
        return ""
    named = ", ".join(bags[:_NAMED]) + (", ..." if len(bags) > _NAMED else "")
    return f" (likewise {len(bags)} more bag{'s' if len(bags) > 1 else ''}: {named})"
