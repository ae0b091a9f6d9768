"""Markdown tables of plain text."""

from __future__ import annotations

from collections.abc import Iterable, Sequence


def cell(text: str) -> str:
    """Plain text on one line, in which nothing is taken for Markdown."""
    for character in "\\|*_<[":
        text = text.replace(character, f"\\{character}")
    return " ".join(text.split())


def table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A table; cells are Markdown on one line."""
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines) + "\n"


def number(value: float) -> str:
    """A number as short as it can be; infinite bounds are none."""
    return "" if value in (float("inf"), float("-inf")) else f"{value:g}"


def span(lower: float, upper: float) -> str:
    """An allowed range."""
    return f"{number(lower)} to {number(upper)}" if number(lower) or number(upper) else ""
