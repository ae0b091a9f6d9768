"""Start one node of many fibres, which share topics, ticks and one compiled step.

ros2 launch xb_muscle_ros muscles.launch.py fibers:='[left, right]' fiber_files:='[18Dec2017a, 13Dec2017a]'
ros2 launch xb_muscle_ros muscles.launch.py fibers:='[left, right]' fiber_file:=18Dec2017a params_file:=muscles.yaml

A parameter file can give each fibre values of its own: docs/node.md shows one.
"""

from launch.actions import OpaqueFunction
from launch.substitutions import LaunchConfiguration

from launch import LaunchDescription
from xb_muscle_ros.node.launching import argument, common_arguments, node, values

PARAMETERS = {
    "autostart": bool,
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
    "load_state_at_start": bool,
    "use_sim_time": bool,
}


def generate_launch_description() -> LaunchDescription:
    """Return the launch arguments and the node they configure."""
    arguments = [
        argument("fibers", "['']", "names; empty: those in the files"),
        argument("fiber_files", "['']", "one file for each fibre"),
        argument("fiber_file", "", "or one for all"),
        argument("model", "", "parameter set that all use; empty: the files'"),
        argument(
            "mode",
            "realtime",
            "realtime: steps at rate_hz; lockstep: one step per length message",
            ["realtime", "lockstep"],
        ),
        argument("rate_hz", "500.0", "steps per second in realtime mode"),
        argument("threads", "1", "threads that step the fibres"),
        argument("timeout_s", "0.0", "age at which length is too old; 0: never"),
        argument(
            "on_timeout",
            "isometric",
            "what happens then: length as sampled, length as it is, or that and calcium falling to zero",
            ["hold", "isometric", "decay"],
        ),
        argument("realtime_priority", "0", "under SCHED_FIFO; 0: ordinary"),
        argument("lock_memory", "false", "keep the process in memory"),
        argument("state_file", "", "file of ~/save_state and ~/load_state"),
        argument("load_state_at_start", "false", "go on with the states in state_file"),
        argument("use_sim_time", "false", "time comes from /clock"),
        argument("name", "muscles", "name of the node"),
        argument("namespace", "", "namespace of the node and its topics"),
        *common_arguments(),
    ]
    return LaunchDescription([*arguments, OpaqueFunction(function=_nodes)])


def _nodes(context):
    where = {key: LaunchConfiguration(key) for key in ("name", "namespace")}
    return [node(context, "muscle_node", values(PARAMETERS), **where)]
