"""What is in a MATLAB file, under the paths that a mapping would give."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.trials.readers import mat_grid
from xb_muscle_ros.trials.readers.contents import Content, Contents
from xb_muscle_ros.trials.readers.mapping import build_mapping
from xb_muscle_ros.trials.readers.mat_nodes import Node, Opaque, Struct, listed, shape_of
from xb_muscle_ros.trials.readers.mat_path import MatPath
from xb_muscle_ros.trials.readers.mat_units import unit_beside
from xb_muscle_ros.trials.trial import Array

FORMAT = "MATLAB"
# A matrix with more columns is none of signals.
_MOST_COLUMNS = 32
_DEEPEST = 4


def grid_contents(path: Path, content: Struct) -> Contents:
    """The signals of the first measured cell of the layout of `mat_grid`.

    Raises:
        UserError: arrays that do not fit each other.
    """
    tree = mat_grid.TOLD.tree
    mapping = build_mapping({"fibre": "{file}", **tree}, f"layout of {path}")
    pending = list(mat_grid.trials(path, mapping, content))
    if not pending:
        raise UserError(f"{path} holds no measured trial; give another file")
    recording = pending[0].read()
    signals = []
    for role, signal in recording.signals.items():
        more = {key: text for key, text in tree["columns"][role].items() if key not in ("column", "unit")}
        column = mapping.columns[role]
        made = Content(column.name, signal.values, column.unit_name, told_role=role, told_more=more, at=signal.at)
        signals.append(made)
    facts = {name: f"{value:g}" for name, value in recording.facts.items() if value is not None}
    names = tuple(each.trial for each in pending)
    return Contents(FORMAT, tuple(signals), names, facts, (listed(content),), recording.warnings)


def mat_contents(content: Struct) -> Contents:
    """Vectors, columns of matrices, and what holds no numbers."""
    signals: list[Content] = []
    others: list[str] = []
    several = 0
    for path, node, count in _leaves("", content, 0, 0):
        several = max(several, count)
        if isinstance(node, np.ndarray) and node.dtype != object and node.size > 1:
            shown = _columns(path, node)
            signals += [Content(name, values, unit_beside(content, MatPath(name, "")) or "") for name, values in shown]
            others += [] if shown else [f"{path}: {shape_of(node)}"]
        elif isinstance(node, np.ndarray) and node.dtype != object and node.size == 1:
            others.append(f"{path}: {float(node.ravel()[0]):g}")
        elif isinstance(node, str):
            others.append(f"{path}: text '{node}'")
        elif isinstance(node, Opaque):
            others.append(f"{path}: {node.what}, which cannot be read; {node.remedy}")
    return Contents(FORMAT, tuple(signals), tuple(str(i + 1) for i in range(several)), others=tuple(others))


def _leaves(path: str, node: Node, depth: int, count: int) -> Iterator[tuple[str, Node, int]]:
    """Paths to what is no struct, and over how many trials each runs; of an array of structs or cells, the first."""
    if isinstance(node, dict) and depth <= _DEEPEST:
        for name, child in node.items():
            yield from _leaves(f"{path}.{name}" if path else name, child, depth + 1, count)
    elif isinstance(node, np.ndarray) and node.dtype == object and node.size and not count:
        yield from _leaves(path, node.ravel(order="F")[0], depth + 1, node.size if node.size > 1 else 0)
    else:
        yield path, node, count


def _columns(path: str, node: Array) -> list[tuple[str, Array]]:
    if sum(n > 1 for n in node.shape) < 2:
        return [(path, node.ravel())]
    if node.ndim != 2 or node.shape[1] > _MOST_COLUMNS:
        return []
    return [(f"{path}(:,{i + 1})", node[:, i]) for i in range(node.shape[1])]
