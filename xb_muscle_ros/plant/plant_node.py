"""Entry point of ``plant_node``: a body in MuJoCo as a ROS node, beside a muscle node that moves it."""

# mypy: allow-untyped-calls

from __future__ import annotations

import functools
import gc
from collections.abc import Callable
from typing import Any

from xb_muscle_ros.node import program
from xb_muscle_ros.plant.body import MovedBody
from xb_muscle_ros.plant.scene_fibres import LEG, default_model
from xb_muscle_ros.plant.translation import RampAndHold

USAGE = """\
usage: plant_node --ros-args [-p NAME:=VALUE]... [-r __ns:=/NAMESPACE]

A body in MuJoCo as a ROS 2 node: publishes muscle/length (with velocity), muscle/calcium, plant/joint, and
joint_states and tf for viewers; subscribes muscle/force. It needs a muscle_node with a fibre for each of its muscles,
and says how to start one.
  plant_node --ros-args -p scene:=ankle -p mode:=realtime
docs/loop.md lists parameters."""


def main() -> None:
    """Run the node until it is told to stop; see `program.run`."""
    program.run("plant_node", USAGE, _play)


def _play(arguments: list[str], stop: program.Stop) -> None:
    import rclpy

    from xb_muscle_ros.plant.episodes import Episodes
    from xb_muscle_ros.plant.plant_parameters import read

    del arguments
    make = functools.partial(rclpy.create_node, "plant_node", automatically_declare_parameters_from_overrides=True)
    node = program.created(make)
    given = read(node)
    body = _BODIES.get(given["scene"], _one_joint)(given)
    plant = Episodes(node, body, given, stop)
    # What is there now stays; the collector need not look at it again, in the middle of a tick.
    gc.collect()
    gc.freeze()
    try:
        plant.run()
    finally:
        plant.close()


def _platform(given: dict[str, Any]) -> RampAndHold:
    return RampAndHold(given["displacement_m"], given["speed_m_per_s"], given["acceleration_m_per_s2"])


def _one_joint(given: dict[str, Any]) -> MovedBody:
    from xb_muscle_ros.models.fibre_file import load_fibre
    from xb_muscle_ros.plant.body import Body
    from xb_muscle_ros.plant.plant_parameters import reflex_of

    fibre = load_fibre(given["fiber_file"], given["model"] or default_model(given["scene"]))
    return Body(given["scene"], fibre, _platform(given), given["elastic_tendon"], reflex_of(given))


def _leg(given: dict[str, Any]) -> MovedBody:
    from xb_muscle_ros.plant.leg.moved import StandingLeg
    from xb_muscle_ros.plant.plant_parameters import reflex_of

    model = given["model"] or default_model(given["scene"])
    return StandingLeg(given["fiber_file"], model, _platform(given), given["elastic_tendon"], reflex_of(given))


_BODIES: dict[str, Callable[[dict[str, Any]], MovedBody]] = {LEG: _leg}


if __name__ == "__main__":
    main()
