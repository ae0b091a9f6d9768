"""Start one node of many fibres, which share topics, ticks and one compiled step.

ros2 launch xb_muscle_ros muscles.launch.py fibers:='[left, right]' fiber_files:='[18Dec2017a, 13Dec2017a]'
ros2 launch xb_muscle_ros muscles.launch.py fibers:='[left, right]' fiber_file:=18Dec2017a params_file:=muscles.yaml

A parameter file can give each fibre values of its own: docs/node.md shows one.
"""

from launch import LaunchDescription
from xb_muscle_ros.node.launching import argument, muscle_description

PARAMETERS = {
    "fibers": list[str],
    "fiber_files": list[str],
    "threads": int,
    "realtime_priority": int,
    "lock_memory": bool,
}


def generate_launch_description() -> LaunchDescription:
    """Return the launch arguments and the node they configure."""
    own = [
        argument("fibers", "['']", "names; empty: those in the files"),
        argument("fiber_files", "['']", "one file for each fibre"),
        argument("fiber_file", "", "or one for all"),
        argument("model", "", "parameter set that all use; empty: the files'"),
        argument("threads", "1", "threads that step the fibres"),
        argument("realtime_priority", "0", "under SCHED_FIFO; 0: ordinary"),
        argument("lock_memory", "false", "keep the process in memory"),
    ]
    return muscle_description("muscles", "500.0", own, PARAMETERS)
