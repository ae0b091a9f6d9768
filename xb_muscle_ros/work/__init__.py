"""Many independent computations: on the cores of this machine or on a Dask cluster, with progress, resumable."""

from xb_muscle_ros.work.outcome import TaskFailed
from xb_muscle_ros.work.running import JsonValue, Options, run, stream

__all__ = ["JsonValue", "Options", "TaskFailed", "run", "stream"]
