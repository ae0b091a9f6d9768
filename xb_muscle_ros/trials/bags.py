"""Trials as ROS 2 bags (MCAP, rosbag2's layout): write, read, find."""

from __future__ import annotations

from xb_muscle_ros.trials.bag_files import find_bags
from xb_muscle_ros.trials.bag_reading import read_simulated, read_trial
from xb_muscle_ros.trials.bag_writing import write_trial
from xb_muscle_ros.trials.simulated import Simulated

__all__ = ["Simulated", "find_bags", "read_simulated", "read_trial", "write_trial"]
