"""Units that stand as text beside the numbers of a MATLAB file."""

from __future__ import annotations

import numpy as np

from xb_muscle_ros.trials.readers.mat_nodes import Node, Struct
from xb_muscle_ros.trials.readers.mat_path import MatPath

UNIT_NAMES = ("units", "unit")
# The numbers of a struct whose field 'units' is theirs.
_VALUES = ("values", "value", "data", "signal")


def unit_beside(content: Struct, path: MatPath) -> str | None:
    """The unit that stands beside a variable or field, or beside the structs it is in."""
    *above, leaf = path.names
    structs: list[Node] = [content]
    for name in above:
        structs.append(first_of(structs[-1].get(name)) if isinstance(structs[-1], dict) else None)
    for depth, struct in reversed(list(enumerate(structs))):
        if isinstance(struct, dict):
            by_name = {name.casefold(): node for name, node in struct.items()}
            beside = [by_name.get(f"{leaf.casefold()}_{each}") for each in UNIT_NAMES]
            inside = [first_of(by_name.get(each)) for each in UNIT_NAMES]
            beside += [node.get(leaf) for node in inside if isinstance(node, dict)]
            if depth == len(above) > 0 and leaf.casefold() in _VALUES:
                beside += inside
            for node in map(first_of, beside):
                if isinstance(node, str) and node.strip():
                    return node
    return None


def first_of(node: Node) -> Node:
    """The first of an array of structs, cells or texts, or what is no such array itself."""
    while isinstance(node, np.ndarray) and node.dtype == object and node.size:
        node = node.ravel()[0]
    return node
