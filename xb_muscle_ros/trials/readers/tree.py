"""Keys and values of a mapping file, checked one by one."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from xb_muscle_ros.errors import UserError, suggest


def check_keys(tree: Iterable[str], known: Iterable[str], prefix: str, where: str) -> None:
    """Make sure that a tree has no other keys.

    Raises:
        UserError: naming the key and the nearest known one.
    """
    names = tuple(known)
    for key in tree:
        if key not in names:
            raise UserError(f"{where}: unknown {prefix}{key}{suggest(str(key), names)}")


def subtree(value: object, key: str, where: str) -> dict[str, Any]:
    """The keys and values below a key.

    Raises:
        UserError: it has none.
    """
    if not isinstance(value, dict):
        raise UserError(f"{where}: {key} is {value!r}; needed are keys with values")
    return value


def text_at(tree: Mapping[str, Any], key: str, where: str, needed: str) -> str:
    """Text that has to be there.

    Raises:
        UserError: it is missing or empty; the message ends with what is needed.
    """
    value = tree.get(key)
    if value is None or not str(value).strip():
        raise UserError(f"{where}: {key} is missing; {needed}")
    return str(value)


def words_at(tree: Mapping[str, Any], key: str) -> str:
    """Text that may be there, on one line."""
    return " ".join(str(tree.get(key, "")).split())


def choice_at(tree: Mapping[str, Any], key: str, allowed: tuple[str, ...], prefix: str, where: str) -> str:
    """One of the allowed texts, the first by default.

    Raises:
        UserError: another text.
    """
    value = str(tree.get(key, allowed[0]))
    if value not in allowed:
        raise UserError(f"{where}: {prefix}{key} is '{value}'; allowed: {', '.join(allowed)}")
    return value


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
