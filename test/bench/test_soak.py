"""The soak's own yardstick, and a short run of it."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from xb_muscle_ros.bench.balance import Balance
from xb_muscle_ros.bench.random_stretches import random_stretches
from xb_muscle_ros.errors import UserError
from xb_muscle_ros.models.fibre_file import load_fibre
from xb_muscle_ros.models.muscle import Muscle


@pytest.mark.parametrize("smoothing", [100.0, 0.0])
def test_balance_knows_the_spring_and_sees_what_is_off(smoothing: float) -> None:
    """The settled fibre is in balance; a millionth of F0 more, or a shorter element, is seen as what it is."""
    fibre = load_fibre("18Dec2017a")
    fibre = dataclasses.replace(fibre, values={**fibre.values, "smoothing": smoothing})
    muscle = Muscle(fibre)
    out = muscle.outputs(muscle.step(muscle.settle(0.0, 5.0), 0.01, 5.0, 1e-3))
    balance = Balance(fibre)

    def error(more_q1: float = 0.0, shorter: float = 0.0) -> float:
        ce = out.ce_length_change_l0 - shorter
        arrays = (np.array([x]) for x in (out.q0, out.q1 + more_q1, 0.01, ce))
        return float(balance.error_f0(*arrays)[0])

    assert abs(error()) < 1e-11
    assert error(more_q1=0.5e-6) == pytest.approx(1e-6, rel=1e-3)
    assert abs(error(shorter=1e-6)) > 1e-5


def test_models_without_heads_have_nothing_to_balance() -> None:
    """The message says what to take."""
    with pytest.raises(UserError, match="take 3state_coop"):
        Balance(load_fibre("18Dec2017a", "hill_se"))


def test_stretches_are_random_but_repeat() -> None:
    """Within bounds, with stamps that ascend, across chunks."""
    parts, again = ([*random_stretches(120_000, 5)] for _ in range(2))
    stamps = np.concatenate([part.stamps_ns for part in parts])
    lengths = np.concatenate([part.length_l0 for part in parts])
    assert stamps.size == 120_000
    assert np.all(np.diff(stamps) > 0)
    assert lengths.min() > -0.0601
    assert lengths.max() < 0.0601
    assert np.ptp(lengths) > 0.1
    speed = np.abs(np.diff(lengths)) / (np.diff(stamps) * 1e-9)
    assert speed.max() < 20.1
    assert all(
        np.array_equal(a, b) for one, two in zip(parts, again, strict=True) for a, b in zip(one, two, strict=True)
    )


def test_a_short_soak() -> None:
    """Force in balance to 1e-9 F0, as over ten million ticks."""
    pytest.importorskip("rclpy", reason="ROS 2 is not installed")
    from xb_muscle_ros.bench.soak import soak

    found = soak(load_fibre("18Dec2017a"), 4000)
    assert found.ticks == 4000
    assert found.worst_balance_f0 < 1e-9
    assert found.most_force_f0 > found.least_force_f0
