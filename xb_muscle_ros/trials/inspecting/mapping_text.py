"""A mapping as text: keys with comments, of which some are guesses and some wait to be filled in."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import yaml

from xb_muscle_ros.trials.inspecting.names import NamePattern


class Line(NamedTuple):
    """A line of the mapping; one that is not active stands as a comment."""

    depth: int
    text: str
    comment: str = ""
    active: bool = True

    def __str__(self) -> str:
        text = f"{'  ' * self.depth}{'' if self.active else '# '}{self.text}"
        return f"{text}  # {self.comment}" if self.comment else text


@dataclass(frozen=True)
class Proposal:
    """A mapping for files of one layout.

    Attributes:
        lines: of the YAML file.
        missing: what has to be filled in before it imports, one line each.
        guesses: what was taken for granted, one line each.
    """

    lines: list[Line] = field(default_factory=list)
    missing: list[str] = field(default_factory=list)
    guesses: list[str] = field(default_factory=list)

    @property
    def text(self) -> str:
        """The YAML file."""
        return "".join(f"{line}\n" for line in self.lines)

    @property
    def tree(self) -> dict[str, Any]:
        """What an import reads of it."""
        tree: dict[str, Any] = yaml.safe_load(self.text)
        return tree

    def add(self, depth: int, text: str, comment: str = "", active: bool = True) -> None:
        """Add a line."""
        self.lines.append(Line(depth, text, comment, active))

    def guess(self, depth: int, key: str, value: str, why: str, above: str = "") -> None:
        """Add a key whose value is a guess; `above` are the keys it stands below."""
        self.add(depth, f"{key}: {value}", f"guess: {why}")
        self.guesses.append(f"{above}{key}: {value} ({why})")

    def pattern(self, depth: int, pattern: NamePattern) -> None:
        """Add a pattern of names, and what numbers that it finds are multiplied with."""
        self.add(depth, f"pattern: {scalar(pattern.pattern)}")
        if pattern.factors:
            factors = ", ".join(f"{key}: {value:g}" for key, value in pattern.factors.items())
            self.add(depth, f"factors: {{{factors}}}")

    def fill_in(self, depth: int, key: str, allowed: str) -> None:
        """Add a key whose value is not known."""
        self.add(depth, f"{key}:", f"fill in: {allowed}", active=False)
        self.missing.append(f"{key}: {allowed}")


def scalar(text: object) -> str:
    """A value as YAML has it on one line."""
    dumped: str = yaml.safe_dump(text, default_flow_style=True, allow_unicode=True, width=math.inf)
    return dumped.strip().removesuffix("...").strip()
