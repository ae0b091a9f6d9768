"""Start one node of many fibres, which share topics, ticks and one compiled step.

ros2 launch xb_muscle_ros muscles.launch.py fibers:='[left, right]' fiber_files:='[18Dec2017a, 13Dec2017a]'
ros2 launch xb_muscle_ros muscles.launch.py fibers:='[left, right]' fiber_file:=18Dec2017a parameters:=muscles.yaml

A parameter file can give each fibre values of its own: docs/node.md shows one.
"""

from launch.actions import DeclareLaunchArgument, OpaqueFunction
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue

from launch import LaunchContext, LaunchDescription

PARAMETERS = {
    "fibers": list[str],
    "fiber_files": list[str],
    "fiber_file": str,
    "model": str,
    "mode": str,
    "rate_hz": float,
    "threads": int,
    "timeout_s": float,
    "on_timeout": str,
    "realtime_priority": int,
    "lock_memory": bool,
    "state_file": str,
    "use_sim_time": bool,
}


def generate_launch_description() -> LaunchDescription:
    """Return the launch arguments and the node they configure."""
    arguments = [
        DeclareLaunchArgument("fibers", default_value="['']", description="names; empty: those in the files"),
        DeclareLaunchArgument("fiber_files", default_value="['']", description="one file for each fibre"),
        DeclareLaunchArgument("fiber_file", default_value="", description="or one for all"),
        DeclareLaunchArgument("model", default_value="", description="parameter set that all use; empty: the files'"),
        DeclareLaunchArgument(
            "mode",
            default_value="realtime",
            choices=["realtime", "lockstep"],
            description="realtime: steps at rate_hz; lockstep: one step per length message",
        ),
        DeclareLaunchArgument("rate_hz", default_value="500.0", description="steps per second in realtime mode"),
        DeclareLaunchArgument("threads", default_value="1", description="threads that step the fibres"),
        DeclareLaunchArgument("timeout_s", default_value="0.0", description="age at which length is too old; 0: never"),
        DeclareLaunchArgument(
            "on_timeout",
            default_value="isometric",
            choices=["hold", "isometric", "decay"],
            description="what happens then: length as sampled, length as it is, or that and calcium falling to zero",
        ),
        DeclareLaunchArgument("realtime_priority", default_value="0", description="under SCHED_FIFO; 0: ordinary"),
        DeclareLaunchArgument("lock_memory", default_value="false", description="keep the process in memory"),
        DeclareLaunchArgument("state_file", default_value="", description="file of ~/save_state and ~/load_state"),
        DeclareLaunchArgument("use_sim_time", default_value="false", description="time comes from /clock"),
        DeclareLaunchArgument("parameters", default_value="", description="a parameter file, on top of the above"),
        DeclareLaunchArgument("name", default_value="muscles", description="name of the node"),
        DeclareLaunchArgument("namespace", default_value="", description="namespace of the node and its topics"),
    ]
    return LaunchDescription([*arguments, OpaqueFunction(function=_node)])


def _node(context: LaunchContext) -> list[Node]:
    given = {name: ParameterValue(LaunchConfiguration(name), value_type=kind) for name, kind in PARAMETERS.items()}
    file = LaunchConfiguration("parameters").perform(context)
    return [
        Node(
            package="xb_muscle_ros",
            executable="muscle_node",
            name=LaunchConfiguration("name"),
            namespace=LaunchConfiguration("namespace"),
            output="screen",
            parameters=[given, *([file] if file else [])],
        )
    ]
