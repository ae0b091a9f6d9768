"""Start a standing body in MuJoCo with a muscle node for its soleus and one for its antagonist, in lockstep.

ros2 launch xb_muscle_ros closed_loop.launch.py fiber_file:=18Dec2017a model:=3state_coop out:=out/loop

Ends with the run. Where `ros2 launch` is absent, docs/loop.md has the three commands.
"""

import sys

from launch.actions import DeclareLaunchArgument, ExecuteProcess, Shutdown
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue

from launch import LaunchDescription

MUSCLES = ("soleus", "tibialis_anterior")


def generate_launch_description() -> LaunchDescription:
    """Return the launch arguments, the muscles and the body that they move."""
    arguments = [
        DeclareLaunchArgument(
            "fiber_file", default_value="18Dec2017a", description="fibre file, a path or the name of a packaged fibre"
        ),
        DeclareLaunchArgument("model", default_value="3state_coop", description="parameter set of the fibre file"),
        DeclareLaunchArgument("duration", default_value="0.5", description="length of the run in s"),
        DeclareLaunchArgument("out", default_value="loop", description="folder for loop.json, loop.csv and the figure"),
    ]
    muscles = [
        Node(
            package="xb_muscle_ros",
            executable="muscle_node",
            namespace=muscle,
            output="screen",
            parameters=[
                {
                    "mode": "lockstep",
                    # Without a type a name like 1 would arrive as an integer and be refused.
                    **{n: ParameterValue(LaunchConfiguration(n), value_type=str) for n in ("fiber_file", "model")},
                }
            ],
        )
        for muscle in MUSCLES
    ]
    body = ExecuteProcess(
        cmd=[
            *(sys.executable, "-m", "xb_muscle_ros.cli.main", "loop", "--live", "--scene", "ankle"),
            *("--fiber", LaunchConfiguration("fiber_file"), "--model", LaunchConfiguration("model")),
            *("--duration", LaunchConfiguration("duration"), "--out", LaunchConfiguration("out")),
        ],
        output="screen",
        on_exit=Shutdown(),
    )
    return LaunchDescription([*arguments, *muscles, body])
