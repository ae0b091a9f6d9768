"""Play a bag of trials through a muscle node in lockstep, and score its forces.

ros2 launch xb_muscle_ros replay.launch.py bags:=bags fiber_file:=18Dec2017a out:=out/replay

Ends with the replay. `ros2 bag play` can drive the node as well (docs/node.md); this one waits for every answer.
"""

import sys

from launch.actions import DeclareLaunchArgument, ExecuteProcess, OpaqueFunction, Shutdown
from launch.substitutions import LaunchConfiguration

from launch import LaunchDescription
from xb_muscle_ros.node.launching import argument, common_arguments, node, values

PARAMETERS = {"autostart": bool, "fiber_file": str, "model": str}


def generate_launch_description() -> LaunchDescription:
    """Return the launch arguments, the node and the player."""
    arguments = [
        DeclareLaunchArgument("bags", description="a bag of a trial, or a folder of them"),
        argument("fiber_file", "18Dec2017a", "fibre file, a path or the name of a packaged fibre"),
        argument("model", "3state_coop", "parameter set of the fibre file"),
        argument("out", "replay", "folder for the report, figure and bags; those of an older replay are replaced"),
        *common_arguments(),
    ]
    return LaunchDescription([*arguments, OpaqueFunction(function=_nodes)])


def _nodes(context):
    player = ExecuteProcess(
        cmd=[
            *(sys.executable, "-m", "xb_muscle_ros.cli.main", "replay", LaunchConfiguration("bags"), "--live"),
            *("--fiber", LaunchConfiguration("fiber_file"), "--model", LaunchConfiguration("model")),
            *("--out", LaunchConfiguration("out"), "--overwrite"),
        ],
        output="screen",
        on_exit=Shutdown(),
    )
    return [node(context, "muscle_node", {"mode": "lockstep", **values(PARAMETERS)}), player]
