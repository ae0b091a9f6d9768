"""Fibre files written: parameter sets with where each came from, as ROS and the offline tools read them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import yaml

from xb_muscle_ros.files import replaced
from xb_muscle_ros.models.fibre_file import Fibre, load_fibre

_SOURCE = "see 'sources' of each set"


def fibre_text(
    fibre: Fibre, sets: Mapping[str, Mapping[str, float]], sources: Mapping[str, str], comments: Sequence[str] = ()
) -> str:
    """Text of a fibre file.

    Args:
        fibre: name, constants, and the set and method that the file picks.
        sets: values of each set by name.
        sources: where each set comes from, by name.
        comments: lines for the top.
    """
    inner = {
        "fibre": fibre.name,
        "model": fibre.model,
        "method": fibre.method,
        "source": fibre.source or _SOURCE,
        "sources": dict(sources),
        "constants": {"reference_length_m": fibre.reference_length_m, "f0_n": fibre.f0_n},
        "models": {name: {key: float(value) for key, value in values.items()} for name, values in sets.items()},
    }
    head = "".join(f"# {line}\n" for line in comments)
    tree = {"/**": {"ros__parameters": inner}}
    return head + yaml.safe_dump(tree, sort_keys=False, allow_unicode=True, width=110)


def write_fibre(path: Path, fibre: Fibre, comments: Sequence[str] = ()) -> None:
    """Write one fibre with the set it has in use; the file appears whole and readable, or not at all.

    Args:
        path: the file, ending in ``.yaml``.
        fibre: its values go into the file in their units.
        comments: lines for the top of the file.

    Raises:
        UserError: the folder cannot be written, or the fibre is none that could be read back.

    Source:
        layout of the file: docs/node.md.

    Examples:
        >>> import pathlib, tempfile, xb_muscle_ros as xb
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     file = pathlib.Path(folder) / "mine.yaml"
        ...     xb.write_fibre(file, xb.changed(xb.load_fibre("18Dec2017a"), {"f": 95.0}))
        ...     xb.load_fibre(file).values["f"]
        95.0
    """
    text = fibre_text(fibre, {fibre.model: fibre.values}, {fibre.model: fibre.source}, comments)
    with replaced(path) as temporary:
        temporary.write_text(text, encoding="utf-8")
        load_fibre(temporary)
