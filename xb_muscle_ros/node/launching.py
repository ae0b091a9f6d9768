"""What all launch files share: arguments every node has, and the nodes they make. Needs ROS' own launch."""

# mypy: allow-untyped-calls, disallow-any-unimported=False

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from launch.actions import DeclareLaunchArgument, OpaqueFunction
from launch.launch_description import LaunchDescription
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue

# Parameters that every launch file of a muscle node alone takes.
OF_MUSCLES = {
    "autostart": bool,
    "fiber_file": str,
    "model": str,
    "mode": str,
    "control": str,
    "rate_hz": float,
    "timeout_s": float,
    "on_timeout": str,
    "state_file": str,
    "load_state_at_start": bool,
    "use_sim_time": bool,
}
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


def muscle_description(
    name: str, rate_hz: str, own: Sequence[DeclareLaunchArgument], kinds: Mapping[str, type[Any]] = {}
) -> LaunchDescription:
    """A muscle node alone, with the arguments of `OF_MUSCLES` and `common_arguments`.

    Args:
        name, rate_hz: defaults of the arguments of these names.
        own: arguments that differ between launch files, ``fiber_file`` and ``model`` among them.
        kinds: types of those of them that are parameters and not in `OF_MUSCLES`.
    """

    def nodes(context: Any) -> list[Node]:
        where = {key: LaunchConfiguration(key) for key in ("name", "namespace")}
        return [node(context, "muscle_node", values({**OF_MUSCLES, **kinds}), **where)]

    mode = "realtime: steps at rate_hz; lockstep: one step per length (or load) message"
    on_timeout = "what happens then: length (or load) as sampled, length as it is, or that and calcium falling to zero"
    arguments = [
        *own,
        argument("mode", "realtime", mode, ["realtime", "lockstep"]),
        argument("control", "length", "length: length in, force out; force: load in, length out", ["length", "force"]),
        argument("rate_hz", rate_hz, "steps per second in realtime mode"),
        argument("timeout_s", "0.0", "age at which a length (or load) sample is too old; 0: no age is"),
        argument("on_timeout", "isometric", on_timeout, ["hold", "isometric", "decay"]),
        argument("state_file", "", "file of ~/save_state and ~/load_state"),
        argument("load_state_at_start", "false", "go on with what is in state_file"),
        argument("use_sim_time", "false", "time comes from /clock"),
        argument("name", name, "name of the node"),
        argument("namespace", "", "namespace of the node and its topics"),
        *common_arguments(),
    ]
    return LaunchDescription([*arguments, OpaqueFunction(function=nodes)])


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
