"""Trials and bags made for tests."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from rosbags.rosbag2 import StoragePlugin, Writer

from xb_muscle_ros.trials import ros_types
from xb_muscle_ros.trials.bags import Simulated
from xb_muscle_ros.trials.simulated import MOMENTS
from xb_muscle_ros.trials.trial import Phase, Trial, TrialFacts

sys.path.insert(0, str(Path(__file__).resolve().parent))  # for foreign_bags

RawMessage = tuple[str, int, bytes]


@pytest.fixture
def trial() -> Trial:
    """Five samples at 1 kHz with every fact known."""
    time_s = np.array([0.0, 0.001, 0.002, 0.003, 0.004])
    return Trial(
        facts=TrialFacts(
            fibre="18Dec2017a",
            trial="stretch_1",
            pca=6.1,
            amplitude_l0=0.0383,
            recovery_s=0.001,
            reference_length_m=0.0005717,
            f0_n=0.0007,
            phases=(Phase("isometric", 0.0, 0.0015), Phase("test_stretch", 0.0015, 0.004)),
            source="made up: 'quoted' # no comment",
            data_set="set_1",
        ),
        time_s=time_s,
        length_m=0.0005717 * (1.0 + 0.4545 * time_s),
        calcium_time_s=np.array([0.0, 0.002]),
        calcium_um=np.array([0.7943282347242822, 31.622776601683793]),
        force_time_s=time_s,
        force_n=np.array([1e-4, 1.1e-4, 1.2e-4, 1.3e-4, 1.4e-4]),
    )


@pytest.fixture
def simulated() -> Simulated:
    """An answer to `trial`, every number different."""
    time_s = np.array([0.0, 0.001, 0.002, 0.003, 0.004])
    moments = {name: 10.0 * (i + 1) + time_s for i, name in enumerate(MOMENTS)}
    return Simulated(time_s, 2.0 + time_s, 3.0 + time_s, 4.0 + time_s, moments)


@pytest.fixture
def raw_bag(tmp_path: Path) -> Callable[..., Path]:
    """Make a bag of given messages (topic, log time in ns, bytes), whatever they are."""

    def make(messages: list[RawMessage], types: dict[str, str] | None = None) -> Path:
        path = tmp_path / "raw"
        with Writer(path, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
            connections = {
                topic: writer.add_connection(
                    topic, (types or {}).get(topic, ros_types.JOINT_STATE), typestore=ros_types.typestore()
                )
                for topic in dict.fromkeys(topic for topic, _, _ in messages)
            }
            for topic, log_time_ns, data in messages:
                writer.write(connections[topic], log_time_ns, data)
        return path

    return make
