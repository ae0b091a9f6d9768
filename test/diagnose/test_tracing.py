"""What a component does, in words that agree with its numbers."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pytest

from xb_muscle_ros.diagnose.noise.cells import Residual
from xb_muscle_ros.diagnose.tracing import direction
from xb_muscle_ros.trials.trial import Phase

PHASES = (
    Phase("isometric", 0.0, 0.1),
    Phase("conditioning_stretch", 0.1, 0.2),
    Phase("shortening", 0.2, 0.3),
    Phase("hold", 0.3, 0.4),
)
TIME_S = np.arange(401) / 1e3


def residual(phases: tuple[Phase, ...] = PHASES) -> Residual:
    none = np.zeros(TIME_S.size)
    return Residual("a", 6.0, TIME_S, none, phases, none, none)


def adds(**levels: float) -> npt.NDArray[np.float64]:
    """Force in each phase, F0; its borders belong to none."""
    out = np.zeros(TIME_S.size)
    for phase in PHASES:
        out[(phase.start_s < TIME_S) & (phase.end_s > TIME_S)] = levels.get(phase.name, 0.0)
    return out


def told(*trials: npt.NDArray[np.float64]) -> str:
    return direction([(residual(), trial) for trial in trials])


def test_where_it_raises_most_and_where_it_lowers_most() -> None:
    text = told(adds(conditioning_stretch=0.02, shortening=-0.03, hold=0.005))
    # Samples on a phase's borders are averaged with it.
    assert text == (
        "raises force in the conditioning stretch by 2.0 % F0 and lowers it in the shortening by 2.9 % F0 on average"
    )


def test_one_way_alone() -> None:
    assert told(adds(hold=0.01)).startswith("raises force in the hold by 0.98 % F0")
    assert "lowers" not in told(adds(hold=0.01))
    down = told(adds(**{phase.name: -0.01 for phase in PHASES}))
    assert down.startswith("lowers force in the ")
    assert "raises" not in down


@pytest.mark.parametrize("size", [0.0, 4e-4, -4e-4])
def test_less_than_can_be_told_is_said_to_be(size: float) -> None:
    assert told(adds(hold=size)) == "changes force by less than 0.05 % F0 on average in every phase"


def test_trials_are_averaged() -> None:
    both = direction([(residual(), adds(hold=0.02)), (residual(), adds(hold=0.0))])
    assert both == told(adds(hold=0.01))


def test_without_phases_there_is_nothing_to_say() -> None:
    assert direction([(residual(()), adds(hold=0.02))]) == ""
    assert direction([]) == ""
