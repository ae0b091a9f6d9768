"""What the programs of nodes share: arguments, signals, exit codes."""

# mypy: allow-untyped-calls

from __future__ import annotations

import re
import signal
import sys
import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from types import FrameType
from typing import Any

from xb_muscle_ros import programs
from xb_muscle_ros.errors import UserError

_NEWS_S = 0.1

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


def take_in_news() -> None:
    """Wait before a participant ends, while Fast DDS may still take in that others have left, which takes it some ms.

    Fast DDS 2.14 may hang for ever otherwise: ``DomainParticipant::set_listener``, which the middleware calls at the
    end, holds a lock while it waits for a discovery callback, which waits for that lock.
    """
    time.sleep(_NEWS_S)


def created(make: Callable[[], Any]) -> Any:
    """A node of rclpy.

    Raises:
        UserError: it cannot be made.
    """
    try:
        return make()
    except UserError:
        raise
    except Exception as error:
        raise UserError(f"the node cannot be created: {_first_words(error)}; check names and parameters") from error


def begin(program: str, arguments: list[str]) -> None:
    """Start ROS with a program's arguments; signals stay the program's own.

    Raises:
        UserError: an argument that is not ROS', or one that ROS cannot use.
    """
    import rclpy
    from rclpy.signals import SignalHandlerOptions
    from rclpy.utilities import remove_ros_args

    try:
        # The first entry stands for the program.
        rest = remove_ros_args([program, *arguments])[1:]
        if rest:
            raise UserError(f"argument '{rest[0]}' is not known; ROS arguments come after --ros-args (see --help)")
        rclpy.init(args=[program, *arguments], signal_handler_options=SignalHandlerOptions.NO)
    except UserError:
        raise
    except Exception as error:
        raise UserError(f"ROS arguments cannot be used: {_first_words(error)}{_hint(arguments, str(error))}") from error


def _first_words(error: Exception) -> str:
    """Text of an error of ROS without the places in ROS' own source."""
    text = " ".join(str(error).split())
    return text.split(", at ")[0]


def _hint(arguments: list[str], error: str) -> str:
    if "params file" in error:
        return "; such a file has the node's full name or '/**' at its top, below it 'ros__parameters', then the names"
    # ROS' grammar of -p has no names with a part that starts with a digit; parameter files have.
    if any(re.match(r"[^:]*\.\d[^:]*:=", argument) for argument in arguments):
        return "; a name such as models.3state_coop.f can be given in a parameter file only, not with -p"
    return "; see --help"


def make_executor(context: Any = None) -> Any:
    """Return an executor to be driven by `serve_once`, single-threaded.

    The one driven by events answers in two thirds of the time, but early releases of Jazzy do not have it, and its
    ``spin`` without a timeout does not return.
    """
    from rclpy.executors import SingleThreadedExecutor
    from rclpy.utilities import get_default_context

    context = context or get_default_context()
    try:
        from rclpy.experimental.events_executor import EventsExecutor
    except ImportError:
        return SingleThreadedExecutor(context=context)
    return EventsExecutor(context=context)


def serve_once(executor: Any, timeout_s: float) -> None:
    """Serve what comes within a time, s.

    What a subscription still had to tell when it was given up (that a publisher's quality of service does not fit it,
    for example) is nobody's any more; rclpy raises where it meets that.
    """
    from rclpy.exceptions import InvalidHandle

    with suppress(InvalidHandle):
        executor.spin_once(timeout_sec=timeout_s)
