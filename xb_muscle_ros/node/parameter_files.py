"""Parameter files that say nothing to a node: ROS passes over them without a word."""

from __future__ import annotations

import itertools
import re
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import yaml

from xb_muscle_ros import fast_yaml

_BELOW = "ros__parameters"


def silent_files(arguments: Sequence[str], node: str) -> list[str]:
    """What to say of parameter files that have nothing for a node, one line each.

    Args:
        arguments: of the program.
        node: full name.
    """
    said = []
    for flag, name in itertools.pairwise(arguments):
        if flag != "--params-file":
            continue
        keys = [*_keys(_tree(name))]
        if not any(_matches(key, node) for key in keys):
            found = f"its keys are {', '.join(keys)}" if keys else f"it has no '{_BELOW}' with names below"
            said.append(
                f"parameter file {name} has nothing for {node}: {found}; only what stands below the key '{node}' or "
                f"'/**', and there below '{_BELOW}', is for this node"
            )
    return said


def _tree(name: str) -> Any:
    try:
        return fast_yaml.load(Path(name).read_text(encoding="utf-8"))
    except (OSError, ValueError, yaml.YAMLError):
        # ROS has read it already, in its own way; there is nothing to add.
        return {"/**": {_BELOW: {"unread": True}}}


def _keys(tree: Any, above: str = "") -> Iterator[str]:
    """Names of nodes that have parameters in a file; namespaces may be nested."""
    for key, below in tree.items() if isinstance(tree, dict) else ():
        if key == _BELOW:
            if isinstance(below, dict) and below:
                yield above
        else:
            yield from _keys(below, f"{above}/{str(key).strip('/')}")


def _matches(key: str, node: str) -> bool:
    """Whether a key with ROS' wildcards, ``*`` for one part and ``**`` for any number, names a node."""
    pattern = re.escape(key).replace(r"/\*\*", r"(/\w+)*").replace(r"/\*", r"/\w+")
    return re.fullmatch(pattern, node) is not None
