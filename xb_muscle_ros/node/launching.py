"""What all launch files share: arguments every node has, and the nodes they make. Needs ROS' own launch."""

# mypy: allow-untyped-calls, disallow-any-unimported=False

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from launch.actions import DeclareLaunchArgument
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue

_LEVELS = ("debug", "info", "warn", "error", "fatal")


def argument(name: str, default: str, description: str, choices: Sequence[str] | None = None) -> DeclareLaunchArgument:
    """A launch argument with a default."""
    return DeclareLaunchArgument(name, default_value=default, description=description, choices=choices)


def common_arguments() -> list[DeclareLaunchArgument]:
    """Arguments of every launch file."""
    return [
        argument("params_file", "", "a parameter file for the nodes, on top of the other arguments"),
        argument("log_level", "info", "of the nodes", _LEVELS),
        argument("remaps", "", "topics under other names: 'muscle/length:=leg/length muscle/force:=leg/force'"),
        argument("respawn", "false", "start a node that ended again, after a second"),
        argument("autostart", "true", "configure and activate the muscle node without being asked"),
    ]


def values(kinds: Mapping[str, type[Any]]) -> dict[str, ParameterValue]:
    """Launch arguments as parameters; without a type `rate_hz:=500` or `model:=1` would arrive as an integer."""
    return {name: ParameterValue(LaunchConfiguration(name), value_type=kind) for name, kind in kinds.items()}


def node(context: Any, executable: str, parameters: Mapping[str, Any], **more: Any) -> Node:
    """A node of this package with what `common_arguments` say.

    Args:
        context: of the launch.
        executable: name.
        parameters: by name; those of the parameter file win.
        more: as for `launch_ros.actions.Node`.
    """

    def given(name: str) -> str:
        return str(LaunchConfiguration(name).perform(context))

    file = given("params_file")
    return Node(
        package="xb_muscle_ros",
        executable=executable,
        output="screen",
        parameters=[dict(parameters), *([file] if file else [])],
        remappings=_remappings(given("remaps")),
        ros_arguments=["--log-level", given("log_level")],
        respawn=given("respawn").lower() in ("true", "1"),
        respawn_delay=1.0,
        **more,
    )


def _remappings(text: str) -> list[tuple[str, str]]:
    made = []
    for word in text.split():
        source, sign, target = word.partition(":=")
        if not (source and sign and target):
            raise RuntimeError(f"remaps: '{word}' is not FROM:=TO, for example muscle/length:=leg/length")
        made.append((source, target))
    return made
