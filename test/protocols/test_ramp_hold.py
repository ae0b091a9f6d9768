"""Ramp and hold against a force that is known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import xb_muscle_ros as xb
from xb_muscle_ros.protocols.base import settings_of
from xb_muscle_ros.protocols.registry import PROTOCOLS
from xb_muscle_ros.trials.trial import Trial


def maxwell(amplitude: float, speed: float, lead_s: float = 0.1) -> Trial:
    """A spring of 2 F0/L0 beside a spring of 30 F0/L0 with a dashpot that relaxes in 50 ms, on a force of 0.5 F0."""
    protocol = PROTOCOLS["ramp-hold"]
    (planned,) = protocol.plan(
        "made", settings_of(protocol, {"pca": 6.1, "amplitude": amplitude, "speed": speed, "lead": lead_s})
    )
    trial = planned.trial
    ramp = trial.facts.phases[1]
    tau, v = 0.05, np.sign(amplitude) * speed
    on = np.clip(trial.time_s - ramp.start_s, 0.0, ramp.end_s - ramp.start_s)
    after = np.maximum(trial.time_s - ramp.end_s, 0.0)
    force = 0.5 + 2.0 * trial.length_change_l0 + 30.0 * v * tau * (1.0 - np.exp(-on / tau)) * np.exp(-after / tau)
    return replace(trial, force_time_s=trial.time_s, force_n=force)


@pytest.mark.parametrize(("amplitude", "speed"), [(0.05, 0.5), (-0.04, 0.2)])
def test_closed_form(amplitude: float, speed: float) -> None:
    (found,) = xb.analyse_protocol("ramp-hold", [maxwell(amplitude, speed)], tell=lambda line: None).results
    (row,) = found.rows
    lasts_s, tau = abs(amplitude) / speed, 0.05
    change = 2.0 * amplitude + 30.0 * np.sign(amplitude) * speed * tau * (1.0 - np.exp(-lasts_s / tau))
    assert row["isometric_f0"].value == pytest.approx(0.5, abs=1e-9)
    assert row["end_f0"].value == pytest.approx(0.5 + change, abs=0.01 * abs(change))
    assert row["held_f0"].value == pytest.approx(0.5 + 2.0 * amplitude, abs=1e-6)
    assert row["relaxed"] == pytest.approx((change - 2.0 * amplitude) / change, rel=0.01)
    assert row["half_s"].value == pytest.approx(tau * np.log(2.0), abs=2e-3)
    # Over the first 10 ms the dashpot gives a tenth: mean slope of the exponential there.
    assert row["srs_f0_per_l0"].value == pytest.approx(2.0 + 30.0 * np.exp(-0.1), rel=0.02)


def test_half_time_of_a_noisy_force_has_its_error() -> None:
    """Regression: the first sample that noise takes to half of the loss counted, 10 ms and more too early."""
    clean = maxwell(0.05, 0.5, lead_s=1.0)
    (true,) = xb.analyse_protocol("ramp-hold", [clean], tell=lambda line: None).results[0].rows
    off, errors = [], []
    for seed in range(12):
        noise = 0.03 * np.random.default_rng(seed).standard_normal(clean.force_n.size)
        noisy = replace(clean, force_n=clean.force_n + noise)
        (row,) = xb.analyse_protocol("ramp-hold", [noisy], tell=lambda line: None).results[0].rows
        assert row["half_s"].se is not None
        off.append(row["half_s"].value - true["half_s"].value)
        errors.append(row["half_s"].se)
    assert abs(np.mean(off)) < 2e-3
    assert 0.4 < np.mean(errors) / np.sqrt(np.mean(np.square(off))) < 3.0


def test_half_time_of_a_model_is_not_that_of_a_sample() -> None:
    """Regression: at 200 samples per second half times were multiples of 5 ms."""
    halves = []
    for rate in (200.0, 5000.0):
        (found,) = xb.run_protocol(
            "ramp-hold", "18Dec2017a", pca=4.5, amplitude=0.04, speed=0.8, rate=rate, tell=lambda line: None
        ).results
        halves.append(found.rows[0]["half_s"].value)
    assert halves[0] == pytest.approx(halves[1], abs=1.5e-3)


def test_a_hold_that_loses_little_has_no_half_time() -> None:
    trial = maxwell(0.05, 0.5)
    spring = replace(trial, force_n=0.5 + 2.0 * trial.length_change_l0)
    told: list[str] = []
    (found,) = xb.analyse_protocol("ramp-hold", [spring], tell=told.append).results
    assert found.rows[0]["half_s"].value is None
    assert any("time to half of that, of trial" in line and "the hold loses" in line for line in told)


def test_a_trial_of_several_ramps_is_a_note() -> None:
    made = xb.simulate("18Dec2017a", recovery=0.1, as_measured=True)
    (found,) = xb.analyse_protocol("ramp-hold", made, tell=lambda line: None).results
    assert any("there is no single stretch or shortening" in note for note in found.notes)


def test_a_ramp_between_two_samples_is_read_after_it() -> None:
    (found,) = xb.run_protocol(
        "ramp-hold", "18Dec2017a", amplitude=0.001, speed=5.0, pca=4.5, tell=lambda line: None
    ).results
    (step,) = xb.run_protocol("step", "18Dec2017a", size=0.001, tell=lambda line: None).results
    assert found.rows[0]["end_f0"].value == pytest.approx(step.rows[0]["t1_f0"].value, abs=2e-3)
    assert 0.9 < found.rows[0]["relaxed"] < 1.0


def test_a_ramp_that_hardly_changes_force_loses_no_share() -> None:
    (found,) = xb.run_protocol(
        "ramp-hold", "18Dec2017a", amplitude=1e-6, speed=0.5, pca=9.0, tell=lambda line: None
    ).results
    assert "relaxed" not in found.rows[0]
    assert any("share lost" in note for note in found.notes)
