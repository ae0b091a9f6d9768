"""Parameters of ``plant_node``, one row each."""

# mypy: allow-untyped-calls

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from xb_muscle_ros.node.foreign_keys import foreign_keys, ignored
from xb_muscle_ros.node.parameters import START, Row, check_value, is_foreign, of_muscle_node, row_descriptor
from xb_muscle_ros.plant.reflex import NO_REFLEX, Reflex
from xb_muscle_ros.plant.scene_fibres import SCENES

# All are read at the start only.
PLANT_PARAMETERS: Mapping[str, Row] = {
    "scene": Row("ankle", "what to move", START, choices=SCENES),
    "mode": Row("lockstep", "of the muscle node and so of this one", START, choices=("lockstep", "realtime")),
    "fiber_file": Row("18Dec2017a", "fibre file, path or packaged fibre name", START),
    "model": Row(
        "", "parameter set of the fibre file; empty: 3state_coop, in the scene myolegs 3state_coop_slack", START
    ),
    "elastic_tendon": Row(False, "tendons stretch", START),
    "duration_s": Row(1.0, "length of an episode; then all starts anew", START, unit="s", bounds=(0.01, 3600.0)),
    "episodes": Row(0, "how many; 0: until stopped", START, bounds=(0, 10**9)),
    "displacement_m": Row(-0.075, "of the platform in the scene ankle", START, unit="m", bounds=(-1.0, 1.0)),
    "speed_m_per_s": Row(0.2, "of the platform", START, unit="m/s", bounds=(1e-3, 5.0)),
    "acceleration_m_per_s2": Row(2.0, "of the platform", START, unit="m/s²", bounds=(1e-2, 50.0)),
    "timeout_s": Row(
        0.5, "age of the force beyond which the body waits for it", START, unit="s", bounds=(0.01, 3600.0)
    ),
    "give_up_s": Row(
        0.0, "longest wait for a muscle node that answers; 0: without end", START, unit="s", bounds=(0.0, 1e6)
    ),
    "display_hz": Row(
        50.0, "rate of joint_states and tf, for viewers; 0: none", START, unit="Hz", bounds=(0.0, 1000.0)
    ),
    "reflex_length_per_l0": Row(
        0.0,
        "excitation per L0 of stretch since the start; with all three gains at 0 no reflex",
        START,
        unit="1/L0",
        bounds=(0.0, 1e3),
    ),
    "reflex_velocity_s_per_l0": Row(0.0, "excitation per L0/s of lengthening", START, unit="s/L0", bounds=(0.0, 1e3)),
    "reflex_force_per_f0": Row(
        0.0, "excitation per F0 of force above that of the start", START, unit="1/F0", bounds=(0.0, 1e3)
    ),
    "reflex_delay_s": Row(
        NO_REFLEX.delay_s, "from fibre to excitation, whole ticks", START, unit="s", bounds=(0.0, 1.0)
    ),
    "reflex_length_threshold_l0": Row(
        0.0, "stretch below which there is no reflex of length", START, unit="L0", bounds=(0.0, 1e3)
    ),
    "reflex_velocity_threshold_l0_per_s": Row(
        0.0, "velocity below which there is no reflex of velocity", START, unit="L0/s", bounds=(0.0, 1e3)
    ),
    "reflex_muscles": Row(("",), "names or patterns of muscles that have the reflex; empty: all", START),
}


def reflex_of(given: Mapping[str, Any]) -> Reflex:
    """The reflex that parameters (see `read`) ask for."""
    front = "reflex_"
    values = {name[len(front) :]: value for name, value in given.items() if name.startswith(front)}
    return Reflex(**{**values, "muscles": tuple(filter(None, values["muscles"]))})


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
