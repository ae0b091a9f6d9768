"""T1, T2 and stiffness put in come out."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import xb_muscle_ros as xb
from xb_muscle_ros.protocols.base import settings_of
from xb_muscle_ros.protocols.registry import PROTOCOLS
from xb_muscle_ros.trials.trial import Trial

STIFFNESS = 40.0


def recorded(size: float, quick: float = 0.4, noise: float = 0.0) -> Trial:
    """A force that jumps with 40 F0/L0 and recovers `quick` of it at 700 1/s, the rest at 15 1/s."""
    protocol = PROTOCOLS["step"]
    (planned,) = protocol.plan("made", settings_of(protocol, {"size": size}))
    trial = planned.trial
    end_s = trial.facts.phases[1].end_s
    jump = STIFFNESS * size
    since = np.maximum(trial.time_s - end_s, 0.0)
    after = 1.0 + jump * (quick * np.exp(-700.0 * since) + (1.0 - quick) * np.exp(-15.0 * since))
    force = np.where(trial.time_s < end_s - 1e-9, 1.0 + STIFFNESS * trial.length_change_l0, after)
    force = force + noise * np.random.default_rng(5).normal(size=force.size)
    return replace(trial, force_time_s=trial.time_s, force_n=force)


def test_t1_t2_rates_and_stiffness_come_out() -> None:
    sizes = (-0.01, -0.005, -0.002, 0.001, 0.002)
    (found,) = xb.analyse_protocol("step", [recorded(size) for size in sizes], tell=lambda line: None).results
    for size, row in zip(sizes, found.rows, strict=True):
        assert row["size_l0"] == pytest.approx(size, abs=1e-9)
        assert row["t1_f0"].value == pytest.approx(1.0 + STIFFNESS * size, abs=1e-6)
        assert row["t2_f0"].value == pytest.approx(1.0 + 0.6 * STIFFNESS * size, abs=1e-6)
        assert row["quick_per_s"] == pytest.approx(700.0, rel=1e-4)
        assert row["slow_per_s"] == pytest.approx(15.0, rel=1e-4)
    assert found.numbers["stiffness_f0_per_l0"].value == pytest.approx(STIFFNESS, rel=1e-6)
    assert found.numbers["y0_l0"].value == pytest.approx(1.0 / STIFFNESS, rel=1e-6)


def test_errors_are_no_smaller_than_what_noise_does() -> None:
    """White noise of 0.1 % F0 moves T2 by 0.019 % F0 (weights of the fit)."""
    (found,) = xb.analyse_protocol("step", [recorded(-0.01, noise=1e-3)], tell=lambda line: None).results
    t2 = found.rows[0]["t2_f0"]
    assert t2.value == pytest.approx(0.76, abs=1e-3)
    assert t2.se is not None
    assert t2.se > 1.5e-4


def test_one_phase_has_no_t2() -> None:
    (found,) = xb.analyse_protocol("step", [recorded(-0.01, quick=0.0)], tell=lambda line: None).results
    assert "t2_f0" not in found.rows[0]
    assert "no quick phase" in found.notes[0]


def test_stiffness_is_that_of_the_model() -> None:
    """The slope of T1 is what the compiled model answers to a tiny step as quick."""
    fibre = xb.load_fibre("18Dec2017a")
    muscle = xb.Muscle(fibre)
    state = muscle.settle(0.0, 10.0**1.5)
    moved = muscle.step(state, 1e-5, 10.0**1.5, 2e-4)
    slope = (muscle.outputs(moved).force_f0 - muscle.outputs(state).force_f0) / 1e-5
    found = xb.run_protocol("step", fibre, size=[-0.001, 0.001], tell=lambda line: None)
    assert found.results[0].numbers["stiffness_f0_per_l0"].value == pytest.approx(slope, rel=0.02)


def test_a_ramp_is_no_step() -> None:
    made = xb.simulate("18Dec2017a", amplitude=0.0, as_measured=True)
    (found,) = xb.analyse_protocol("step", made, tell=lambda line: None).results
    assert "there is no single step that takes 5 ms or less" in found.notes[0]
