"""Play a bag of trials through a muscle node in lockstep, and score its forces.

ros2 launch xb_muscle_ros replay.launch.py bags:=bags fiber_file:=18Dec2017a out:=out/replay

Ends with the replay. `ros2 bag play` can drive the node as well (docs/node.md); this one waits for every answer.
"""

import sys

from launch.actions import DeclareLaunchArgument, ExecuteProcess, Shutdown
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue

from launch import LaunchDescription


def generate_launch_description() -> LaunchDescription:
    """Return the launch arguments, the node and the player."""
    arguments = [
        DeclareLaunchArgument("bags", description="a bag of a trial, or a folder of them"),
        DeclareLaunchArgument(
            "fiber_file", default_value="18Dec2017a", description="fibre file, a path or the name of a packaged fibre"
        ),
        DeclareLaunchArgument("model", default_value="3state_coop", description="parameter set of the fibre file"),
        DeclareLaunchArgument(
            "out",
            default_value="replay",
            description="folder for results, in the place of older ones",
        ),
    ]
    node = Node(
        package="xb_muscle_ros",
        executable="muscle_node",
        output="screen",
        parameters=[
            {
                "mode": "lockstep",
                **{n: ParameterValue(LaunchConfiguration(n), value_type=str) for n in ("fiber_file", "model")},
            }
        ],
    )
    player = ExecuteProcess(
        cmd=[
            *(sys.executable, "-m", "xb_muscle_ros.cli.main", "replay", LaunchConfiguration("bags"), "--live"),
            *("--fiber", LaunchConfiguration("fiber_file"), "--model", LaunchConfiguration("model")),
            *("--out", LaunchConfiguration("out"), "--overwrite"),
        ],
        output="screen",
        on_exit=Shutdown(),
    )
    return LaunchDescription([*arguments, node, player])
