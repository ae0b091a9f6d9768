"""Start one muscle node with a fibre file.

ros2 launch xb_muscle_ros muscle.launch.py fiber_file:=18Dec2017a mode:=realtime rate_hz:=1000.0 namespace:=left_leg
"""

from launch.actions import DeclareLaunchArgument
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue

from launch import LaunchDescription

# Parameters of the node that may be given at launch. The types matter: `rate_hz:=500` or `model:=1` would else arrive
# as an integer and be refused.
PARAMETERS = {
    "fiber_file": str,
    "model": str,
    "mode": str,
    "rate_hz": float,
    "timeout_s": float,
    "on_timeout": str,
    "state_file": str,
    "use_sim_time": bool,
}


def generate_launch_description() -> LaunchDescription:
    """Return the launch arguments and the node they configure."""
    arguments = [
        DeclareLaunchArgument(
            "fiber_file", default_value="18Dec2017a", description="fibre file, a path or the name of a packaged fibre"
        ),
        DeclareLaunchArgument(
            "model", default_value="", description="parameter set of the fibre file; empty: the one the file names"
        ),
        DeclareLaunchArgument(
            "mode",
            default_value="realtime",
            choices=["realtime", "lockstep"],
            description="realtime: steps at rate_hz; lockstep: one step per length message",
        ),
        DeclareLaunchArgument("rate_hz", default_value="1000.0", description="steps per second in realtime mode"),
        DeclareLaunchArgument(
            "timeout_s", default_value="0.0", description="age at which a length sample is too old; 0: no age is"
        ),
        DeclareLaunchArgument(
            "on_timeout",
            default_value="isometric",
            choices=["hold", "isometric", "decay"],
            description="what happens then: length as sampled, length as it is, or that and calcium falling to zero",
        ),
        DeclareLaunchArgument("state_file", default_value="", description="file of ~/save_state and ~/load_state"),
        DeclareLaunchArgument("use_sim_time", default_value="false", description="time comes from /clock"),
        DeclareLaunchArgument("name", default_value="muscle", description="name of the node"),
        DeclareLaunchArgument("namespace", default_value="", description="namespace of the node and its topics"),
    ]
    node = Node(
        package="xb_muscle_ros",
        executable="muscle_node",
        name=LaunchConfiguration("name"),
        namespace=LaunchConfiguration("namespace"),
        output="screen",
        parameters=[
            {name: ParameterValue(LaunchConfiguration(name), value_type=kind) for name, kind in PARAMETERS.items()}
        ],
    )
    return LaunchDescription([*arguments, node])
