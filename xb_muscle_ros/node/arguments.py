"""Arguments of this package's nodes: handed to ROS, or refused in one line."""

# mypy: allow-untyped-calls

from __future__ import annotations

import re

import rclpy
from rclpy.signals import SignalHandlerOptions
from rclpy.utilities import remove_ros_args

from xb_muscle_ros.errors import UserError


def begin(program: str, arguments: list[str]) -> None:
    """Start ROS with a program's arguments; signals stay the program's own.

    Raises:
        UserError: an argument that is not ROS', or one that ROS cannot use.
    """
    try:
        # The first entry stands for the program.
        rest = remove_ros_args([program, *arguments])[1:]
        if rest:
            raise UserError(f"argument '{rest[0]}' is not known; ROS arguments come after --ros-args (see --help)")
        rclpy.init(args=[program, *arguments], signal_handler_options=SignalHandlerOptions.NO)
    except UserError:
        raise
    except Exception as error:
        raise UserError(f"ROS arguments cannot be used: {first_words(error)}{_hint(arguments, str(error))}") from error


def first_words(error: Exception) -> str:
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
