"""Where a signal is in a MATLAB file: ``force``, ``data(:,2)``, ``exp.trials(trial).force``, ``trials{3}.length``.

Indices count from 1, ``:`` is all samples, and ``trial`` the index that runs over the trials of the file. An array of
structs or a cell array that is given no index runs over trials as well.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from xb_muscle_ros.errors import UserError, suggest
from xb_muscle_ros.trials.readers.mat_nodes import Node, Objects, Opaque, listed, shape_of
from xb_muscle_ros.trials.trial import Array

TRIAL = "trial"
_STEP = re.compile(r"\s*([A-Za-z]\w*)((?:\([^(){}]*\)|\{[^(){}]*\})*)\s*")
_INDEX = re.compile(r"[({]([^(){}]*)[)}]")
_EXAMPLES = "'force', 'data(:,2)', 'trials(3).force' or 'force(:,trial)'"
Index = tuple["int | str", ...]


class Found(NamedTuple):
    """What a path leads to.

    Attributes:
        node: of the trial that was asked for.
        runs: how many trials the path runs over; None where it is the same for all.
        padded: trials are columns or rows of one array, so short ones are filled up.
    """

    node: Node
    runs: int | None = None
    padded: bool = False


class MatPath:
    """The way to a variable of a MATLAB file.

    Attributes:
        text: as the mapping has it.
        names: of the variable and of the fields below it.
    """

    def __init__(self, text: str, where: str) -> None:
        """Take the path apart.

        Raises:
            UserError: it is no path.
        """
        self.text = text
        self._steps: list[str | Index] = []
        for part in text.split("."):
            match = _STEP.fullmatch(part)
            if match is None:
                raise UserError(f"{where}: column '{text}' is no path into a MATLAB file such as {_EXAMPLES}")
            self._steps.append(match.group(1))
            self._steps += [_index(text, inside, where) for inside in _INDEX.findall(match.group(2))]
        self.names = tuple(step for step in self._steps if isinstance(step, str))

    def find(self, content: Mapping[str, Node], trial: int, where: str) -> Found:
        """What the path leads to for a trial (from 0); see `Found`.

        Raises:
            UserError: there is no such variable, field or index, or the path runs over trials twice.
        """
        walk = _Walk(self.text, trial, where)
        found: Node = dict(content)
        for step in self._steps:
            found = walk.field(found, step) if isinstance(step, str) else walk.element(found, step)
            walk.so_far.append(step)
        found = walk.single(found, at_end=True)
        return Found(found, walk.runs, walk.padded)

    def numbers(self, content: Mapping[str, Node], trial: int, where: str) -> Array:
        """The numbers of a trial, shape (n,).

        Raises:
            UserError: as `find`; or what is there holds no numbers, or more than one row or column.
        """
        node = self.find(content, trial, where).node
        if isinstance(node, Opaque):
            raise UserError(f"{where}: {self.text} is {node.what}, which cannot be read; {node.remedy}")
        if not isinstance(node, np.ndarray) or node.dtype == object:
            below = f": {listed({self.text: node})}" if isinstance(node, dict) else ""
            what = "text" if isinstance(node, str) else "a struct" if isinstance(node, dict) else "no array of numbers"
            raise UserError(f"{where}: {self.text} is {what}; needed are numbers; name a field with them{below}")
        if sum(n > 1 for n in node.shape) > 1:
            ways = f"'{self.text}(:,1)' is its first column, '{self.text}(:,{TRIAL})' a trial for each column"
            more = f"'{self.text}({TRIAL},:)' a trial for each row"
            raise UserError(f"{where}: {self.text} is {shape_of(node)}; needed is one row or column; {ways}, {more}")
        values: Array = node.ravel()
        return values


class _Walk:
    """One way through the content of a file."""

    def __init__(self, text: str, trial: int, where: str) -> None:
        self.text, self.trial, self.where = text, trial, where
        self.so_far: list[str | Index] = []
        self.runs: int | None = None
        self.padded = False

    @property
    def here(self) -> str:
        """The path as far as it was gone."""
        made = ""
        for step in self.so_far:
            made += (f".{step}" if made else step) if isinstance(step, str) else f"({','.join(map(str, step))})"
        return made

    def field(self, node: Node, name: str) -> Node:
        """A field of a struct, or a variable."""
        node = self.single(node)
        if isinstance(node, Opaque):
            raise UserError(f"{self.where}: {self.here} is {node.what}, which cannot be read; {node.remedy}")
        if not isinstance(node, dict):
            raise UserError(f"{self.where}: {self.here} has no fields, so there is no '{self.text}'; name another")
        if name not in node:
            what = f"{self.here} has no field" if self.so_far else "there is no variable"
            raise UserError(f"{self.where}: {what} '{name}'{suggest(name, node)}; it holds {listed(node)}")
        return node[name]

    def single(self, node: Node, at_end: bool = False) -> Node:
        """The one element of an array of structs or cells, or that of the trial."""
        if not isinstance(node, np.ndarray) or node.dtype != object:
            return node
        if node.size == 1:
            return self.single(node.ravel()[0], at_end)
        if at_end and node.size and all(isinstance(each, str) for each in node.ravel()) and self.runs is not None:
            return node
        return self._of_trial(node, node.size, lambda i: node.ravel(order="F")[i])

    def element(self, node: Node, index: Index) -> Node:
        """The elements an index picks."""
        if isinstance(node, Opaque):
            raise UserError(f"{self.where}: {self.here} is {node.what}, which cannot be read; {node.remedy}")
        if not isinstance(node, np.ndarray):
            node = _alone(node)
        if node.dtype == object and set(index) == {":"}:
            return node  # all of them: they run over trials
        axes = index
        if len(index) == 1:
            node = node.reshape(-1, order="F")
        elif set(index[node.ndim :]) <= {1, ":"}:
            axes = index[: node.ndim]
        if len(axes) != node.ndim:
            raise UserError(
                f"{self.where}: {self.here} is {shape_of(node)}; '{self.text}' has {len(index)} indices; give one for "
                "each axis"
            )
        picks: list[int | slice] = []
        for axis, each in enumerate(axes):
            count = node.shape[axis]
            if each == TRIAL:
                self.padded = node.dtype != object
                picks.append(self._of_trial(node, count, lambda i: i))
            elif each == ":":
                picks.append(slice(None))
            elif isinstance(each, int) and each <= count:
                picks.append(each - 1)
            else:
                raise UserError(
                    f"{self.where}: '{self.text}' asks for number {each} of {count} (its shape is {shape_of(node)}); "
                    "indices count from 1"
                )
        picked = node[tuple(picks)]
        return picked if isinstance(picked, (np.ndarray, dict, str, Opaque)) else np.array([picked])

    def _of_trial(self, node: Objects | Array, count: int, pick: object) -> Node:
        if self.runs is not None:
            raise UserError(
                f"{self.where}: '{self.text}' runs over {self.runs} trials, and over {count} again at {self.here}; "
                "give one of them a number"
            )
        self.runs = count
        if self.trial >= count:
            raise UserError(
                f"{self.where}: {self.here} is {shape_of(node)}, so there is no trial {self.trial + 1}; all signals "
                "need as many trials"
            )
        assert callable(pick)
        return pick(self.trial)


def _index(text: str, inside: str, where: str) -> Index:
    made: list[int | str] = []
    for part in (each.strip() for each in inside.split(",")):
        if part in (":", TRIAL):
            made.append(part)
        elif part.isdecimal() and int(part) > 0:
            made.append(int(part))
        else:
            raise UserError(
                f"{where}: column '{text}': index '{part}' is none; allowed are numbers from 1, ':' and '{TRIAL}'"
            )
    if made.count(TRIAL) > 1:
        raise UserError(f"{where}: column '{text}' has '{TRIAL}' twice; one index runs over the trials")
    return tuple(made)


def _alone(node: Node) -> Objects:
    made = np.empty((1, 1), dtype=object)
    made[0, 0] = node
    return made
