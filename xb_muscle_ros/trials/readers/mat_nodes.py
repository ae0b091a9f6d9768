"""What a MATLAB file holds, whatever its version: numbers, text, structs, and arrays of these."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from xb_muscle_ros.trials.trial import Array

# A struct is a mapping of its fields; cell arrays, arrays of structs and of texts are arrays of objects.
Struct = dict[str, "Node"]
Objects = npt.NDArray[np.object_]
Node = Any  # Array | str | Struct | Objects | Opaque; recursive types of arrays cannot be written
_MOST_TOLD = 12
_DEEPEST_TOLD = 3


class Opaque(NamedTuple):
    """A value whose numbers are not to be had.

    Attributes:
        what: in words, for example ``a MATLAB table``.
        remedy: how it is saved so that it can be read.
    """

    what: str
    remedy: str


SPARSE = Opaque("a sparse matrix", "save full(...) of it")
COMPLEX = Opaque("an array of complex numbers", "save real(...) of it, or abs(...)")
_CLASSES = {
    "table": "save its columns as arrays, for example force = T.force, or export it with writetable",
    "timetable": "save its columns as arrays, for example force = T.force, or export it with writetimetable",
    "timeseries": "save its Time and Data as arrays",
    "string": "save char(...) of it",
    "datetime": "save seconds(t - t(1)) of it",
    "duration": "save seconds(...) of it",
    "function_handle": "save the numbers themselves",
}


def opaque(kind: str) -> Opaque:
    """What stands for an object of a MATLAB class."""
    remedy = _CLASSES.get(kind, "save its numbers as arrays or in a struct")
    return Opaque(f"a MATLAB {kind}" if kind in _CLASSES else f"an object of class {kind}", remedy)


def numbers(values: npt.NDArray[Any]) -> Array | Opaque:
    """Numbers of any type, as they are in MATLAB: two axes or more."""
    if np.iscomplexobj(values):
        return COMPLEX
    return np.atleast_2d(np.asarray(values, dtype=np.float64))


def texts(rows: list[str]) -> str | Objects:
    """A char array of one row, or of several, each without the blanks that fill it."""
    if len(rows) < 2:
        return rows[0].rstrip("\x00") if rows else ""
    made = np.empty((len(rows), 1), dtype=object)
    made[:, 0] = [row.rstrip(" \x00") for row in rows]
    return made


def shape_of(array: npt.NDArray[Any]) -> str:
    """An array's shape, for messages: ``1000 x 3``."""
    return " x ".join(map(str, array.shape))


def listed(content: Mapping[str, Node]) -> str:
    """What numbers there are and where, for messages: ``force (1000 x 1), trials(1..12).length (800 x 1)``."""
    found = [text for name, node in content.items() for text in _listed(name, node, 0)]
    more = f", and {len(found) - _MOST_TOLD} more" if len(found) > _MOST_TOLD else ""
    return (", ".join(found[:_MOST_TOLD]) or "nothing") + more


def _listed(name: str, node: Node, depth: int) -> Iterator[str]:
    if isinstance(node, Opaque):
        yield f"{name} ({node.what})"
    elif isinstance(node, str):
        yield f"{name} (text)"
    elif isinstance(node, dict):
        if depth >= _DEEPEST_TOLD or not node:
            yield f"{name} (struct)"
        else:
            for key, child in node.items():
                yield from _listed(f"{name}.{key}", child, depth + 1)
    elif node.dtype != object:
        yield f"{name} ({shape_of(node)})"
    elif node.size == 0 or depth >= _DEEPEST_TOLD:
        yield f"{name} ({shape_of(node)} cells or structs)"
    else:
        first = node.ravel(order="F")[0]
        brackets = "()" if isinstance(first, dict) else "{}"
        yield from _listed(f"{name}{brackets[0]}1..{node.size}{brackets[1]}", first, depth + 1)
