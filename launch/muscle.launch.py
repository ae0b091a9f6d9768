"""Start one muscle node with a fibre file.

ros2 launch xb_muscle_ros muscle.launch.py fiber_file:=18Dec2017a mode:=realtime rate_hz:=1000.0 namespace:=left_leg
ros2 launch xb_muscle_ros muscle.launch.py params_file:=leg.yaml remaps:='muscle/length:=leg/length' respawn:=true
"""

from launch import LaunchDescription
from xb_muscle_ros.node.launching import argument, muscle_description


def generate_launch_description() -> LaunchDescription:
    """Return the launch arguments and the node they configure."""
    own = [
        argument("fiber_file", "18Dec2017a", "fibre file, a path or the name of a packaged fibre"),
        argument("model", "", "parameter set of the fibre file; empty: the one the file names"),
    ]
    return muscle_description("muscle", "1000.0", own)
