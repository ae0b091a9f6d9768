"""Entry point of ``muscle_node``: arguments, signals, exit codes."""

# mypy: allow-untyped-calls

from __future__ import annotations

import signal
import sys
from collections.abc import Sequence
from types import FrameType

from xb_muscle_ros import programs
from xb_muscle_ros.errors import UserError

USAGE = """\
usage: muscle_node --ros-args [--params-file FILE] [-p NAME:=VALUE]... [-r __ns:=/NAMESPACE]

A muscle fibre as a ROS 2 node: subscribes muscle/length and muscle/calcium, publishes muscle/force and muscle/moments.
  muscle_node --ros-args --params-file config/fibers/18Dec2017a.yaml -p mode:=lockstep
  muscle_node --ros-args -p fiber_file:=18Dec2017a -p mode:=realtime -p rate_hz:=1000.0
docs/node.md lists parameters, topics and services."""


class _Stop:
    """Set by SIGINT and SIGTERM."""

    asked = False

    def __call__(self, number: int, frame: FrameType | None) -> None:
        self.asked = True


def main(argv: Sequence[str] | None = None) -> None:
    """Run the node until it is told to stop.

    Args:
        argv: arguments without the program; those of the process where None.

    Raises:
        SystemExit: code 0, or 2 after one line on stderr, where the user can mend something.
    """
    # Nothing but the help is printed. `ros2 run` complains of any other code, and then of the pipe itself.
    programs.run(lambda: _main(argv), reader_left=0)


def _main(argv: Sequence[str] | None) -> int:
    stop = _Stop()
    # Set here and not by rclpy, so that a signal ends the program quietly at any moment of its life, and so that SIGINT
    # counts even where a shell started the program in the background with SIGINT ignored.
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, stop)
    try:
        _run([*(sys.argv[1:] if argv is None else argv)], stop)
    except UserError as error:
        print(f"muscle_node: {error}", file=sys.stderr)
        return 2
    return 0


def _run(arguments: list[str], stop: _Stop) -> None:
    try:
        from rclpy.utilities import try_shutdown

        from xb_muscle_ros.node.arguments import begin
    except ImportError as error:
        raise UserError(f"ROS 2 cannot be imported ({error}); source a ROS 2 Jazzy, or run scripts/setup") from error
    if "-h" in arguments or "--help" in arguments:
        print(USAGE)
        return
    begin("muscle_node", arguments)
    try:
        _spin(stop, arguments)
    finally:
        try_shutdown()


def _spin(stop: _Stop, arguments: Sequence[str]) -> None:
    from xb_muscle_ros.node.arguments import first_words
    from xb_muscle_ros.node.executor import make_executor
    from xb_muscle_ros.node.muscle_node import MuscleNode
    from xb_muscle_ros.node.parameter_files import silent_files

    try:
        node = MuscleNode()
    except UserError:
        raise
    except Exception as error:
        raise UserError(f"the node cannot be created: {first_words(error)}; check names and parameters") from error
    try:
        node.autostart()
        for line in silent_files(arguments, node.get_fully_qualified_name()):
            node.get_logger().warning(line)
        executor = make_executor()
        executor.add_node(node)
        while not stop.asked and not node.finished:
            executor.spin_once(timeout_sec=0.1)
        # Let the answer to the request that ended the node go out.
        executor.spin_once(timeout_sec=0.1)
        executor.shutdown()
    finally:
        node.close()
        node.destroy_node()


if __name__ == "__main__":
    main()
