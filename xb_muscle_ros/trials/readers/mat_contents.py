"""What is in a MATLAB file, under the paths that a mapping would give."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.trials.inspecting.words import read_name
from xb_muscle_ros.trials.readers import mat_grid
from xb_muscle_ros.trials.readers.contents import Content, Contents
from xb_muscle_ros.trials.readers.mapping import build_mapping
from xb_muscle_ros.trials.readers.mat_nodes import Node, Opaque, Struct, listed, shape_of
from xb_muscle_ros.trials.readers.mat_path import MatPath
from xb_muscle_ros.trials.readers.mat_pca import is_pca, leaves_of
from xb_muscle_ros.trials.readers.mat_units import unit_beside
from xb_muscle_ros.trials.trial import Array

FORMAT = "MATLAB"
# A matrix with more columns is none of signals.
_MOST_COLUMNS = 32


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
    leaves = list(leaves_of("", content))
    timed = any("time" in _roles(path) for path, _, _ in leaves)
    several = max((max(count, _trials_in(path, node, timed)) for path, node, count in leaves), default=0)
    for path, node, count in leaves:
        if isinstance(node, np.ndarray) and node.dtype != object and (node.size > 1 or is_pca(path)):
            shown = _signals(path, node, 0 if count else several, timed)
            signals += [Content(name, values, unit_beside(content, MatPath(name, "")) or "") for name, values in shown]
            others += [] if shown else [f"{path}: {shape_of(node)}"]
        elif isinstance(node, np.ndarray) and node.dtype != object and node.size == 1:
            others.append(f"{path}: {float(node.ravel()[0]):g}")
        elif isinstance(node, str):
            others.append(f"{path}: text '{node}'")
        elif isinstance(node, Opaque):
            others.append(f"{path}: {node.what}, which cannot be read; {node.remedy}")
    return Contents(FORMAT, tuple(signals), tuple(str(i + 1) for i in range(several)), others=tuple(others))


def _trials_in(path: str, node: Node, timed: bool) -> int:
    """How many trials a matrix holds, one in each column or row: it is called by a signal and has no times in it.

    Args:
        path: of the matrix.
        node: the matrix.
        timed: times stand elsewhere.
    """
    if not isinstance(node, np.ndarray) or node.dtype == object or node.ndim != 2 or min(node.shape) < 2:
        return 0
    is_time = not timed and bool(np.all(np.diff(_first(node)) > 0.0))
    return min(node.shape) if {"length", "force"} & set(_roles(path)) and not is_time else 0


def _roles(path: str) -> tuple[str, ...]:
    return read_name(path.rpartition(".")[2]).roles


def _by_column(node: Array) -> bool:
    return node.shape[1] <= node.shape[0]


def _first(node: Array) -> Array:
    """The first trial in a matrix: samples are more than trials."""
    values: Array = node[:, 0] if _by_column(node) else node[0]
    return values


def _signals(path: str, node: Array, several: int, timed: bool) -> list[tuple[str, Array]]:
    """A vector, that of the first of several trials, or each column of a matrix."""
    if several and _trials_in(path, node, timed):
        return [(f"{path}({':,trial' if _by_column(node) else 'trial,:'})", _first(node))]
    if is_pca(path) and node.size == several > 1:
        return [(f"{path}(trial)", node.ravel()[:1])]
    if sum(n > 1 for n in node.shape) < 2:
        return [(path, node.ravel())]
    if node.ndim != 2 or node.shape[1] > _MOST_COLUMNS:
        return []
    return [(f"{path}(:,{i + 1})", node[:, i]) for i in range(node.shape[1])]
