"""Variables of a MATLAB file that are called pCa: what they tell, where a mapping gives pCa as well."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.trials.readers.calcium import PCA_COLUMN, PCA_RANGE, SAME_PCA
from xb_muscle_ros.trials.readers.mat_nodes import Node, Struct
from xb_muscle_ros.trials.readers.mat_path import MatPath
from xb_muscle_ros.trials.trial import Array

_DEEPEST = 4


def is_pca(path: str) -> bool:
    """Whether a variable or field is called so."""
    return PCA_COLUMN.fullmatch(path.rpartition(".")[2]) is not None


def leaves_of(path: str, node: Node, depth: int = 0, count: int = 0) -> Iterator[tuple[str, Node, int]]:
    """Paths to what is no struct, and over how many trials each runs; of an array of structs or cells, the first."""
    if isinstance(node, dict) and depth <= _DEEPEST:
        for name, child in node.items():
            yield from leaves_of(f"{path}.{name}" if path else name, child, depth + 1, count)
    elif isinstance(node, np.ndarray) and node.dtype == object and node.size and not count:
        yield from leaves_of(path, node.ravel(order="F")[0], depth + 1, node.size if node.size > 1 else 0)
    else:
        yield path, node, count


def check_pca(content: Struct, i: int, count: int | None, length: MatPath, pca: float, where: str) -> None:
    """Make sure that no variable beside the length of trial ``i``, or above it, tells another pCa than the given one.

    Raises:
        UserError: one does.
    """
    for name, values in _told(content, i, count, length):
        if not np.all((values >= PCA_RANGE[0]) & (values <= PCA_RANGE[1])):
            continue  # no pCa
        other = values[np.abs(values - pca) > SAME_PCA]
        if other.size:
            raise UserError(
                f"{where}: {name} holds {other[0]:g}, but pCa is given as {pca:g}; read it with --calcium-column "
                f"'{name}' --calcium-unit pCa"
            )


def _told(content: Mapping[str, Node], i: int, count: int | None, length: MatPath) -> Iterator[tuple[str, Array]]:
    """Each such variable with its values for a trial."""
    for path, node, runs in leaves_of("", dict(content)):
        names = path.split(".")
        above = names[:-1] == list(length.names[: len(names) - 1])
        if not (is_pca(path) and above and isinstance(node, np.ndarray) and node.dtype != object and node.size):
            continue
        if runs:
            if runs == count:
                yield path, MatPath(path, path).numbers(content, i, path)
        elif count is not None and node.size == count > 1:
            yield f"{path}(trial)", node.ravel()[i : i + 1]
        elif node.size in (1, length.numbers(content, i, path).size):
            yield path, node.ravel()
