"""What the programs of nodes share: arguments, signals, exit codes."""

# mypy: allow-untyped-calls

from __future__ import annotations

import signal
import sys
from collections.abc import Callable, Sequence
from types import FrameType
from typing import Any

from xb_muscle_ros import programs
from xb_muscle_ros.errors import UserError

Stop = Callable[[], bool]


def run(name: str, usage: str, play: Callable[[list[str], Stop], None], argv: Sequence[str] | None = None) -> None:
    """Run a node until it is told to stop.

    Args:
        name: of the program.
        usage: what ``--help`` prints.
        play: runs the node, with ROS started; takes the arguments, and whether to end.
        argv: arguments without the program; those of the process where None.

    Raises:
        SystemExit: code 0, or 2 after one line on stderr, where the user can mend something.
    """
    # Nothing but the help is printed. `ros2 run` complains of any other code, and then of the pipe itself.
    programs.run(lambda: _code(name, usage, play, [*(sys.argv[1:] if argv is None else argv)]), reader_left=0)


def _code(name: str, usage: str, play: Callable[[list[str], Stop], None], arguments: list[str]) -> int:
    asked: list[int] = []

    def stop(number: int, frame: FrameType | None) -> None:
        asked.append(number)

    # Set here and not by rclpy, so that a signal ends the program quietly at any moment of its life, and so that SIGINT
    # counts even where a shell started the program in the background with SIGINT ignored.
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, stop)
    if "-h" in arguments or "--help" in arguments:
        print(usage)
        return 0
    try:
        try:
            from rclpy.utilities import try_shutdown

            from xb_muscle_ros.node.arguments import begin
        except ImportError as error:
            remedy = "source a ROS 2 Jazzy, or run scripts/setup"
            raise UserError(f"ROS 2 cannot be imported ({error}); {remedy}") from error
        begin(name, arguments)
        try:
            play(arguments, lambda: bool(asked))
        finally:
            try_shutdown()
    except UserError as error:
        print(f"{name}: {error}", file=sys.stderr)
        return 2
    return 0


def created(make: Callable[[], Any]) -> Any:
    """A node of rclpy.

    Raises:
        UserError: it cannot be made.
    """
    from xb_muscle_ros.node.arguments import first_words

    try:
        return make()
    except UserError:
        raise
    except Exception as error:
        raise UserError(f"the node cannot be created: {first_words(error)}; check names and parameters") from error
