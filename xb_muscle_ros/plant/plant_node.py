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

    from xb_muscle_ros.plant.episodes import Episodes

    del arguments
    make = functools.partial(rclpy.create_node, "plant_node", automatically_declare_parameters_from_overrides=True)
    plant = Episodes(program.created(make), stop)
    try:
        plant.run()
    finally:
        plant.close()


if __name__ == "__main__":
    main()
