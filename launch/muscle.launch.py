"""Start one muscle node with a fibre file.

ros2 launch xb_muscle_ros muscle.launch.py fiber_file:=18Dec2017a mode:=realtime rate_hz:=1000.0 namespace:=left_leg
ros2 launch xb_muscle_ros muscle.launch.py params_file:=leg.yaml remaps:='muscle/length:=leg/length' respawn:=true
"""

from launch.actions import OpaqueFunction
from launch.substitutions import LaunchConfiguration

from launch import LaunchDescription
from xb_muscle_ros.node.launching import argument, common_arguments, node, values

# Parameters of the node that may be given at launch.
PARAMETERS = {
    "autostart": bool,
    "fiber_file": str,
    "model": str,
    "mode": str,
    "rate_hz": float,
    "timeout_s": float,
    "on_timeout": str,
    "state_file": str,
    "load_state_at_start": bool,
    "use_sim_time": bool,
}


def generate_launch_description() -> LaunchDescription:
    """Return the launch arguments and the node they configure."""
    arguments = [
        argument("fiber_file", "18Dec2017a", "fibre file, a path or the name of a packaged fibre"),
        argument("model", "", "parameter set of the fibre file; empty: the one the file names"),
        argument(
            "mode",
            "realtime",
            "realtime: steps at rate_hz; lockstep: one step per length message",
            ["realtime", "lockstep"],
        ),
        argument("rate_hz", "1000.0", "steps per second in realtime mode"),
        argument("timeout_s", "0.0", "age at which a length sample is too old; 0: no age is"),
        argument(
            "on_timeout",
            "isometric",
            "what happens then: length as sampled, length as it is, or that and calcium falling to zero",
            ["hold", "isometric", "decay"],
        ),
        argument("state_file", "", "file of ~/save_state and ~/load_state"),
        argument("load_state_at_start", "false", "go on with the state in state_file"),
        argument("use_sim_time", "false", "time comes from /clock"),
        argument("name", "muscle", "name of the node"),
        argument("namespace", "", "namespace of the node and its topics"),
        *common_arguments(),
    ]
    return LaunchDescription([*arguments, OpaqueFunction(function=_nodes)])


def _nodes(context):
    where = {key: LaunchConfiguration(key) for key in ("name", "namespace")}
    return [node(context, "muscle_node", values(PARAMETERS), **where)]
