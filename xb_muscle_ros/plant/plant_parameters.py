"""Parameters of ``plant_node``, one row each."""

# mypy: allow-untyped-calls

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from xb_muscle_ros.node.foreign_keys import foreign_keys, ignored
from xb_muscle_ros.node.parameters import START, Row, check_value, is_foreign, of_muscle_node, row_descriptor

# All are read at the start only.
PLANT_PARAMETERS: Mapping[str, Row] = {
    "scene": Row("ankle", "what to move", START, choices=("ankle", "knee")),
    "mode": Row("lockstep", "of the muscle node and so of this one", START, choices=("lockstep", "realtime")),
    "fiber_file": Row("18Dec2017a", "fibre file, path or packaged fibre name", START),
    "model": Row("3state_coop", "parameter set of the fibre file", START),
    "elastic_tendon": Row(False, "tendons stretch", START),
    "duration_s": Row(1.0, "length of an episode; then all starts anew", START, unit="s", bounds=(0.01, 3600.0)),
    "episodes": Row(0, "how many; 0: until stopped", START, bounds=(0, 10**9)),
    "displacement_m": Row(-0.075, "of the platform in the scene ankle", START, unit="m", bounds=(-1.0, 1.0)),
    "speed_m_per_s": Row(0.2, "of the platform", START, unit="m/s", bounds=(1e-3, 5.0)),
    "acceleration_m_per_s2": Row(2.0, "of the platform", START, unit="m/s²", bounds=(1e-2, 50.0)),
    "timeout_s": Row(
        0.5, "age of the force beyond which the body waits for it", START, unit="s", bounds=(0.01, 3600.0)
    ),
}


def read(node: Any) -> dict[str, Any]:
    """Values of the parameters, checked and declared with their descriptors."""
    given = {name: p.value for name, p in node.get_parameters_by_prefix("").items() if not is_foreign(name)}
    values: dict[str, Any] = {}
    # A file for both nodes has the muscle node's as well, some of which are spelt like some of these.
    of_muscle = [name for name in given if name not in PLANT_PARAMETERS and of_muscle_node(name)]
    foreign = [*foreign_keys([name for name in given if name not in of_muscle], PLANT_PARAMETERS), *of_muscle]
    if foreign:
        node.get_logger().warning(ignored(foreign, node.get_fully_qualified_name()))
    for name in given:
        node.undeclare_parameter(name)
    for name, row in PLANT_PARAMETERS.items():
        values[name] = check_value(name, row, given.get(name, row.default))
        node.declare_parameter(name, values[name], row_descriptor(row), ignore_override=True)
    return values
