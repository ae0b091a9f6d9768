"""One body and its stance for all tests of the leg; finding it takes seconds."""

from __future__ import annotations

import pytest

pytest.importorskip("myo_sim", reason="needs the extra body")

from xb_muscle_ros.plant.leg.body import Body
from xb_muscle_ros.plant.leg.stance import Aim, Stance, find_stance


@pytest.fixture
def body() -> Body:
    """A fresh one."""
    return Body()


@pytest.fixture(scope="session")
def stance() -> Stance:
    """The default one."""
    return find_stance(Body(), Aim())
