"""Keys and values of a mapping file, checked one by one."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping
from typing import Any

from xb_muscle_ros.errors import UserError, suggest
from xb_muscle_ros.trials.readers.units import Quantity, finite, quantity


class Keys:
    """Keys and values below a key of a mapping file.

    Attributes:
        where: the mapping file or the command line, for messages.
        path: the key above, with those above it, for messages; empty at the top.
        values: by key.
    """

    def __init__(self, tree: object, where: str, path: str = "", known: Iterable[str] | None = None) -> None:
        """Check the keys.

        Args:
            tree: what stands below the key.
            known: keys that are allowed; None for any.

        Raises:
            UserError: there are no keys, or one is not known.
        """
        if not isinstance(tree, Mapping):
            raise UserError(f"{where}: {path} is {tree!r}; needed are keys with values")
        self.where, self.path = where, path
        self.values: dict[str, Any] = dict(tree)
        if known is not None:
            check_keys(tree, known, f"{path}." if path else "", where)

    def __contains__(self, key: str) -> bool:
        """Whether the key is there."""
        return key in self.values

    def name(self, key: str) -> str:
        """A key with those above it."""
        return f"{self.path}.{key}" if self.path else key

    def below(self, key: str, *known: str) -> Keys:
        """What stands below a key, if anything; one of the keys ``known``, where these are given."""
        return Keys(self.values.get(key, {}), self.where, self.name(key), known or None)

    def text(self, key: str, needed: str) -> str:
        """Text that has to be there; the message ends with what is needed."""
        value = self.values.get(key)
        if value is None or not str(value).strip():
            raise UserError(f"{self.where}: {f'{self.path}: ' if self.path else ''}{key} is missing; {needed}")
        return str(value)

    def line(self, key: str) -> str:
        """Text that may be there, on one line."""
        return " ".join(str(self.values.get(key, "")).split())

    def choice(self, key: str, *allowed: str) -> str:
        """One of the allowed texts, the first by default."""
        value = str(self.values.get(key, allowed[0]))
        if value not in allowed:
            raise UserError(f"{self.where}: {self.name(key)} is '{value}'; allowed: {', '.join(allowed)}")
        return value

    def number(self, key: str) -> float:
        """A finite number that has to be there."""
        return finite(self.values.get(key), self.name(key), self.where)

    def quantity(self, key: str, column: str, example: str, zero: bool = False) -> Quantity | None:
        """A quantity (see `units.quantity`) that may be there; null stands for none."""
        text = self.values.get(key)
        if text is None:
            return None
        return quantity(str(text), column, self.name(key), self.where, example, zero)

    def amount(self, key: str, column: str, example: str, zero: bool = False) -> float | None:
        """Its value, in the base unit of its kind."""
        found = self.quantity(key, column, example, zero)
        return None if found is None else found.value

    def pattern(self, key: str, needed: str) -> re.Pattern[str]:
        """A regular expression that has to be there."""
        text = self.text(key, needed)
        try:
            return re.compile(text)
        except re.error as problem:
            raise UserError(f"{self.where}: {self.path}: '{text}' is no regular expression: {problem}") from problem


def check_keys(tree: Iterable[str], known: Iterable[str], prefix: str, where: str) -> None:
    """Make sure that there are no other keys.

    Raises:
        UserError: naming the key and the nearest known one.
    """
    names = tuple(known)
    for key in tree:
        if key not in names:
            raise UserError(f"{where}: unknown {prefix}{key}{suggest(str(key), names)}")


def merged(under: Mapping[str, Any], over: Mapping[str, Any]) -> dict[str, Any]:
    """Both trees in one; ``over`` goes first, and its nulls take keys out."""
    tree = dict(under)
    for key, value in over.items():
        if value is None:
            tree.pop(key, None)
        elif isinstance(value, Mapping) and isinstance(tree.get(key), Mapping):
            tree[key] = merged(tree[key], value)
        else:
            tree[key] = value
    return tree


def dotted_keys(tree: Mapping[str, Any], above: str = "") -> Iterator[str]:
    """All keys of a tree with those above them, ``columns.force.unit``, but for those that are null."""
    for key, value in tree.items():
        if value is not None:
            yield f"{above}{key}"
        if isinstance(value, Mapping):
            yield from dotted_keys(value, f"{above}{key}.")
