# shellcheck shell=bash
# Read by the other scripts: where things are, and an environment with exactly one ROS in it.

root=$(CDPATH='' cd -- "$(dirname -- "${BASH_SOURCE[0]}")/.." && pwd -P)
venv=$root/.venv

# A python that lives under a ROS-wheels bootstrap hands this on; another environment's libraries would come with it.
if [[ -n ${_ROS_WHEELS_BOOTSTRAP_COMPLETE:-} ]]; then
    unset _ROS_WHEELS_BOOTSTRAP_COMPLETE LD_LIBRARY_PATH
fi

# Forget a sourced ROS, so that the wheels of .venv are the only one.
forget_ros() {
    unset AMENT_PREFIX_PATH CMAKE_PREFIX_PATH COLCON_PREFIX_PATH PYTHONPATH LD_LIBRARY_PATH
    unset ROS_DISTRO ROS_VERSION ROS_PYTHON_VERSION RMW_IMPLEMENTATION
}

# After scripts/setup: the environment of .venv, as `activate` would make it, and its place in the ament index.
enter_venv() {
    if [[ -n ${ROS_DISTRO:-} && $(<"$venv/.setup/ros") == wheels ]]; then
        forget_ros
    fi
    unset PYTHONHOME
    # A sourced workspace may hold another copy of this package, and its PYTHONPATH comes before .venv.
    if [[ -n ${PYTHONPATH:-} ]]; then export PYTHONPATH=$root:$PYTHONPATH; fi
    export VIRTUAL_ENV=$venv
    export PATH=$venv/bin:$PATH
    export AMENT_PREFIX_PATH=$venv${AMENT_PREFIX_PATH:+:$AMENT_PREFIX_PATH}
    # The home folder may be missing or read-only.
    export NUMBA_CACHE_DIR=${NUMBA_CACHE_DIR:-$venv/cache/numba}
    export MPLCONFIGDIR=${MPLCONFIGDIR:-$venv/cache/matplotlib}
    export ROS_LOG_DIR=${ROS_LOG_DIR:-$venv/cache/ros_log}
    export MPLBACKEND=${MPLBACKEND:-agg}
    # Nobody else's robot hears this, and nobody's robot is heard.
    export ROS_AUTOMATIC_DISCOVERY_RANGE=${ROS_AUTOMATIC_DISCOVERY_RANGE:-LOCALHOST}
}
