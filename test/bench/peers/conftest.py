"""A made table of measured SRS."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

from xb_muscle_ros.bench.peers.simulating import AMPLITUDES, RECOVERIES
from xb_muscle_ros.evaluate.srs_table import FibreSrs, SrsTable

# Made muscles that several test modules share.
sys.path.insert(0, str(Path(__file__).parent))

PCA = np.array([4.5, 6.1, 6.3, 9.0])
ISOMETRIC = np.array([0.9, 0.5, 0.2, 0.02])


@pytest.fixture
def measured() -> SrsTable:
    """Two fibres whose SRS is 30 times isometric force, 15 times after a stretch of 3.83 % L0 less than 0.5 s ago."""
    shape = (PCA.size, RECOVERIES.size, AMPLITUDES.size)
    held = {}
    for name, factor in (("a", 1.0), ("b", 0.9)):
        isometric = factor * ISOMETRIC
        test = np.broadcast_to(30.0 * isometric[:, None, None], shape).copy()
        test[:, RECOVERIES < 0.5, -1] *= 0.5
        conditioning = np.full(shape, np.nan)
        conditioning[:, :, -1] = 30.0 * isometric[:, None]
        held[name] = FibreSrs(test, conditioning, np.broadcast_to(isometric[:, None, None], shape).copy())
    return SrsTable("measured", PCA, RECOVERIES, AMPLITUDES, held)
