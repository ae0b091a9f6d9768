"""Entry point of ``plant_node``: a body in MuJoCo as a ROS node, beside a muscle node that moves it."""

# mypy: allow-untyped-calls

from __future__ import annotations

import functools

from xb_muscle_ros.node import program

USAGE = """\
usage: plant_node --ros-args [-p NAME:=VALUE]... [-r __ns:=/NAMESPACE]

A body in MuJoCo as a ROS 2 node: publishes muscle/length (with velocity), muscle/calcium and plant/joint, subscribes
muscle/force. It needs a muscle_node with a fibre for each of its muscles, and says how to start one.
  plant_node --ros-args -p scene:=ankle -p mode:=realtime
docs/loop.md lists parameters."""


def main() -> None:
    """Run the node until it is told to stop; see `program.run`."""
    program.run("plant_node", USAGE, _play)


def _play(arguments: list[str], stop: program.Stop) -> None:
    import rclpy

    from xb_muscle_ros.models.fibre_file import load_fibre
    from xb_muscle_ros.plant.body import Body
    from xb_muscle_ros.plant.episodes import Episodes
    from xb_muscle_ros.plant.plant_parameters import read, reflex_of
    from xb_muscle_ros.plant.translation import RampAndHold

    del arguments
    make = functools.partial(rclpy.create_node, "plant_node", automatically_declare_parameters_from_overrides=True)
    node = program.created(make)
    given = read(node)
    platform = RampAndHold(given["displacement_m"], given["speed_m_per_s"], given["acceleration_m_per_s2"])
    fibre = load_fibre(given["fiber_file"], given["model"])
    body = Body(given["scene"], fibre, platform, given["elastic_tendon"], reflex_of(given))
    plant = Episodes(node, body, given, stop)
    try:
        plant.run()
    finally:
        plant.close()


if __name__ == "__main__":
    main()
