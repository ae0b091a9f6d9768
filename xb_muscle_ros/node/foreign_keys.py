"""Keys of other nodes in a shared parameter file: ignored, and named once; what looks like a slip is refused."""

from __future__ import annotations

import difflib
from collections.abc import Collection, Iterable

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.models.parameters import CONSTANTS, PARAMETERS

# First parts of parameter names that no fibre can have for its name.
GROUPS = ("models", "constants", "sources")

_ALIKE = 0.8
_NAMES_SHOWN = 20


def foreign_keys(names: Iterable[str], own: Collection[str], fibres: Collection[str] | None = None) -> list[str]:
    """Names of parameters that are another node's.

    A shared file gives all nodes the same keys below ``/**``. A key whose spelling is close to one of this node's, or
    that names a model or a constant, is taken for one that was meant for this node.

    Args:
        names: as given.
        own: of the node, without those of its fibres.
        fibres: names of a node of many; None: the fibre's own parameters have no prefix.

    Raises:
        UserError: a name that looks like a slip; the nearest right one is given.
    """
    found = []
    for name in names:
        head, _, rest = name.partition(".")
        if name in own or (rest and (head in GROUPS or head in (fibres or ()))):
            continue
        if of_a_fibre(rest):
            if fibres is None:
                raise UserError(
                    f"parameter '{name}' is of one of many fibres, but this node has a single one without a name of "
                    f"its own in front: write '{rest}', or name many in 'fibers'"
                )
            # Who has the names of the fibres says which of them is meant.
            continue
        near = _near(head, (*GROUPS, *(fibres or ()))) if rest else _near(name, own)
        if near:
            raise UserError(f"parameter '{name}' is not known; did you mean '{near}'?")
        found.append(name)
    return found


def of_a_fibre(name: str) -> bool:
    """Whether a name is one that a fibre has: other nodes may have models and constants of their own."""
    group, _, inner = name.partition(".")
    model, _, leaf = inner.rpartition(".")
    return (group == "constants" and inner in CONSTANTS) or (group == "models" and bool(model) and leaf in PARAMETERS)


def _near(word: str, known: Iterable[str]) -> str:
    """The known name that a word looks like; empty where it looks like none."""
    by_small = {name.lower(): name for name in known}
    near = difflib.get_close_matches(word.lower(), by_small, n=1, cutoff=_ALIKE)
    return by_small[near[0]] if near else ""


def ignored(names: Collection[str], node: str) -> str:
    """What to say of the keys of other nodes."""
    return f"parameters ignored, {node} has none of these names: {shortened(names)}"


def shortened(names: Collection[str]) -> str:
    """Names in one line; of very many the first."""
    shown = [*names][:_NAMES_SHOWN]
    more = f" and {len(names) - len(shown)} more" if len(names) > len(shown) else ""
    return f"{', '.join(shown)}{more}"
