"""A parameter file with which a muscle node has a body's fibres from the start."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import yaml

from xb_muscle_ros.files import write_text
from xb_muscle_ros.models.fibre_file import Fibre


def write_node_file(path: Path, fibres: Sequence[Fibre], source: str, mode: str) -> None:
    """Write names, constants and parameters of fibres; what all have in common stands once.

    Args:
        path: YAML file.
        fibres: of one model and method, named after their muscles.
        source: fibre file or name of a fibre that they were made from.
        mode: of the node, ``lockstep`` or ``realtime``.

    Raises:
        UserError: the folder cannot be written.
    """
    first = fibres[0]
    own = [name for name in first.values if any(f.values[name] != first.values[name] for f in fibres)]
    common = {name: value for name, value in first.values.items() if name not in own}
    tree: dict[str, object] = {
        "mode": mode,
        "fiber_file": source,
        "model": first.model,
        "method": first.method,
        "fibers": [fibre.name for fibre in fibres],
        "models": {first.model: common},
    }
    for fibre in fibres:
        constants = {"reference_length_m": fibre.reference_length_m, "f0_n": fibre.f0_n}
        values = {name: fibre.values[name] for name in own}
        tree[fibre.name] = {"constants": constants, "models": {fibre.model: values}}
    text = yaml.safe_dump({"/**": {"ros__parameters": tree}}, sort_keys=False, allow_unicode=True, width=110)
    write_text(path, f"# {len(fibres)} fibres; muscle_node --ros-args --params-file {path.name}\n{text}")
