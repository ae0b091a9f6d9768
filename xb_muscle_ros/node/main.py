"""Entry point of ``muscle_node``."""

# mypy: allow-untyped-calls

from __future__ import annotations

from collections.abc import Sequence

from xb_muscle_ros.node import program

USAGE = """\
usage: muscle_node --ros-args [--params-file FILE] [-p NAME:=VALUE]... [-r __ns:=/NAMESPACE]

A muscle fibre as a ROS 2 node: subscribes muscle/length and muscle/calcium, publishes muscle/force and muscle/moments.
  muscle_node --ros-args --params-file config/fibers/18Dec2017a.yaml -p mode:=lockstep
  muscle_node --ros-args -p fiber_file:=18Dec2017a -p mode:=realtime -p rate_hz:=1000.0
docs/node.md lists parameters, topics and services."""


def main(argv: Sequence[str] | None = None) -> None:
    """Run the node until it is told to stop; see `program.run`."""
    program.run("muscle_node", USAGE, _play, argv)


def _play(arguments: list[str], stop: program.Stop) -> None:
    from xb_muscle_ros.node.muscle_node import MuscleNode
    from xb_muscle_ros.node.parameter_files import silent_files

    node = program.created(MuscleNode)
    try:
        node.autostart()
        for line in silent_files(arguments, node.get_fully_qualified_name()):
            node.get_logger().warning(line)
        executor = program.make_executor()
        executor.add_node(node)
        while not stop() and not node.finished:
            program.serve_once(executor, 0.1)
        # Let the answer to the request that ended the node go out.
        program.serve_once(executor, 0.1)
        executor.shutdown()
    finally:
        node.close()
        program.take_in_news()
        node.destroy_node()


if __name__ == "__main__":
    main()
