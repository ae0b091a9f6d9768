"""Sinusoidal analysis of models against their linearised equations, and of made records."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import xb_muscle_ros as xb
from xb_muscle_ros.models.muscle import Muscle
from xb_muscle_ros.protocols.base import Found, settings_of
from xb_muscle_ros.protocols.registry import PROTOCOLS
from xb_muscle_ros.protocols.sinusoid import FREQUENCIES_HZ
from xb_muscle_ros.trials.trial import Trial

FIBRE = "18Dec2017a"


def moduli(found: Found) -> np.ndarray:
    return found.column("elastic_f0_per_l0") + 1j * found.column("viscous_f0_per_l0")


def transfer(muscle: Muscle, calcium_um: float, frequency_hz: np.ndarray) -> np.ndarray:
    """C (i2πf - A)^-1 B + D of the compiled equations at rest, Jacobians by central differences."""
    rest = muscle.settle(0.0, calcium_um)
    n, h = rest.size - 3, 1e-6

    def both(state: np.ndarray, length: float, velocity: float) -> np.ndarray:
        full = rest.copy()
        full[:n], full[-3], full[-2] = state, length, velocity
        rates = np.zeros(n)
        muscle.code.slope(full, velocity, calcium_um, muscle.parameters, rates)
        return np.append(rates, muscle.outputs(full).force_f0)

    def slope(state: np.ndarray, length: float, velocity: float) -> np.ndarray:
        up, down = (both(rest[:n] + k * state, k * length, k * velocity) for k in (h, -h))
        return (up - down) / (2.0 * h)

    by_state = np.array([slope(row, 0.0, 0.0) for row in np.eye(n)]).T
    still = np.zeros(n)
    by_length, by_velocity = slope(still, 1.0, 0.0), slope(still, 0.0, 1.0)
    found = []
    for s in 2j * np.pi * frequency_hz:
        into = by_length + s * by_velocity
        found.append(by_state[n] @ np.linalg.solve(s * np.eye(n) - by_state[:n], into[:n]) + into[n])
    return np.array(found)


@pytest.mark.parametrize(("model", "pca"), [("3state_coop", 4.5), ("3state_coop", 6.1), ("2state", 4.5)])
def test_small_oscillations_are_those_of_the_linearised_equations(model: str, pca: float) -> None:
    """To 0.1 % of the modulus at each frequency, at a tenth of the usual amplitude."""
    frequencies = list(FREQUENCIES_HZ[::4])
    made = xb.run_protocol(
        "sinusoid", FIBRE, model=model, pca=pca, frequency=frequencies, amplitude=1.25e-4, tell=lambda line: None
    )
    found = moduli(made.results[0])
    expected = transfer(Muscle(xb.load_fibre(FIBRE, model)), 10.0 ** (6.0 - pca), np.array(frequencies))
    assert np.abs(found / expected - 1.0).max() < 1e-3


def recorded(trial: Trial, force: np.ndarray, own: bool = True) -> Trial:
    facts = trial.facts if own else replace(trial.facts, protocol="", settings=(), phases=())
    return replace(trial, facts=facts, force_time_s=trial.time_s, force_n=force)


def plan(**options: object) -> list[Trial]:
    protocol = PROTOCOLS["sinusoid"]
    return [planned.trial for planned in protocol.plan("made", settings_of(protocol, options))]


def test_a_spring_beside_a_maxwell_element_has_its_closed_form() -> None:
    """H + C s/(s + r): the force of each trial solved exactly for length that is straight between corners."""
    base, size, rate = 5.0, 20.0, 12.0
    trials = []
    protocol = PROTOCOLS["sinusoid"]
    for planned in protocol.plan("made", settings_of(protocol, {"frequency": [0.3, 1.0, 2.0, 4.0, 10.0, 40.0]})):
        trial, length, dt = planned.trial, planned.corner_l0, np.diff(planned.corner_s)
        pull = np.zeros(length.size)
        decay = np.exp(-rate * dt)
        for k, rise in enumerate(np.diff(length) / dt):
            pull[k + 1] = pull[k] * decay[k] + size * rise * (1.0 - decay[k]) / rate
        force = np.interp(trial.time_s, planned.corner_s, 0.5 + base * length + pull)
        trials.append(recorded(trial, force))
    (found,) = xb.analyse_protocol("sinusoid", trials, tell=lambda line: None).results
    s = 2j * np.pi * found.column("frequency_hz")
    assert np.abs(moduli(found) / (base + size * s / (s + rate)) - 1.0).max() < 5e-4
    assert found.numbers["rate_c_per_s"].value == pytest.approx(rate, rel=1e-3)
    assert found.numbers["magnitude_c_f0_per_l0"].value == pytest.approx(size, rel=1e-3)
    assert found.numbers["base_f0_per_l0"].value == pytest.approx(base, rel=1e-2)
    assert found.numbers["rate_a_per_s"].value is None
    assert "less than 0.5 %" in found.numbers["rate_a_per_s"].why
    assert max(found.column("second_harmonic")) < 1e-3


def test_a_record_of_several_frequencies_without_settings() -> None:
    """Frequencies, segments and moduli are found from the signals, with standard errors that hold the truth."""
    time = np.arange(10_001) * 1e-3
    length, force = np.zeros(time.size), np.full(time.size, 0.5)
    begins, frequencies = (1.0, 4.0, 7.0, 9.0, 10.0), (1.5, 3.0, 8.0, 20.0)
    for begin, end, frequency in zip(begins[:-1], begins[1:], frequencies, strict=True):
        inside = (time >= begin) & (time < end)
        angle = 2.0 * np.pi * frequency * (time[inside] - begin)
        length[inside] = 0.002 * np.sin(angle)
        force[inside] += 0.002 * ((10.0 + frequency) * np.sin(angle) + 4.0 * np.cos(angle))
    force += 0.001 * np.random.default_rng(2).standard_normal(time.size)
    trial = Trial(
        xb.TrialFacts("made", "sweep", pca=4.5, phases=(xb.Phase("isometric", 0.0, 1.0),)),
        time, 1.0 + length, np.zeros(1), np.array([10.0**1.5]), time, force,
    )  # fmt: skip
    told: list[str] = []
    (found,) = xb.analyse_protocol("sinusoid", [trial], tell=told.append).results
    assert found.column("frequency_hz") == pytest.approx(frequencies, rel=1e-3)
    for key, truth in (
        ("elastic_f0_per_l0", 10.0 + np.array(frequencies)),
        ("viscous_f0_per_l0", np.full(4, 4.0)),
    ):
        apart = np.abs(found.column(key) - truth)
        assert np.all(apart < 4.0 * found.errors(key))
    assert any("found from length: 1.5" in line and "first cycle" in line for line in told), told


def test_errors_of_one_frequency_do_not_depend_on_others_in_the_record() -> None:
    """Regression: small oscillations passed for isometric, and their force for noise: errors were 40 times as large."""

    def record(*frequencies: float) -> Trial:
        begins, end = [], 0.6
        for frequency in frequencies:
            begins.append(end)
            end += 6.0 / frequency + 0.3
        time = np.arange(0.0, end + 0.2, 5e-4)
        length, force = np.zeros(time.size), np.full(time.size, 0.8)
        for begin, frequency in zip(begins, frequencies, strict=True):
            inside = (time >= begin) & (time <= begin + 6.0 / frequency)
            angle = 2.0 * np.pi * frequency * (time[inside] - begin)
            length[inside] += 0.001 * np.sin(angle)
            force[inside] += 0.001 * (20.0 * np.sin(angle) + 8.0 * np.cos(angle))
        force += 0.002 * np.random.default_rng(3).standard_normal(time.size)
        return xb.make_trial("m", "sweep", time, length, 10.0**1.5, force, tell=lambda line: None)

    alone, among = (
        xb.analyse_protocol("sinusoid", [record(*f)], tell=lambda line: None).results[0]
        for f in ((1.0,), (1.0, 5.0, 20.0))
    )
    for key, truth in (("elastic_f0_per_l0", 20.0), ("viscous_f0_per_l0", 8.0)):
        assert among.errors(key)[0] == pytest.approx(alone.errors(key)[0], rel=0.5)
        assert np.all(np.abs(among.column(key) - truth) < 4.0 * among.errors(key))


@pytest.mark.parametrize(("rate", "is_told"), [(100.0, True), (400.0, False)])
def test_a_model_that_repeats_a_coarse_length_is_told_of(rate: float, is_told: bool) -> None:
    time = np.arange(0.0, 2.0, 1.0 / rate)
    wave = 0.001 * np.sin(2.0 * np.pi * 10.0 * np.maximum(time - 0.5, 0.0))
    trial = xb.make_trial("18Dec2017a", "coarse", time, wave, 10.0**1.5, 0.8 + 20.0 * wave, tell=lambda line: None)
    told: list[str] = []
    xb.analyse_protocol("sinusoid", [trial], model="2state", fibre="18Dec2017a", tell=told.append)
    assert any("10 samples of length to a cycle of 10 Hz" in line and "by 3.2 %" in line for line in told) == is_told


def test_a_force_that_is_not_linear_is_told() -> None:
    trials = []
    for trial in plan(pca=4.5, frequency=[1.0, 2.0, 4.0]):
        x = trial.length_change_l0 / 0.00125
        trials.append(recorded(trial, 0.5 + 0.03 * x + 0.006 * x**2))
    told: list[str] = []
    (found,) = xb.analyse_protocol("sinusoid", trials, tell=told.append).results
    # x² is half a level and half the second harmonic.
    assert found.column("second_harmonic") == pytest.approx([0.1] * 3, rel=1e-3)
    assert any("second harmonic is above 5 % of the first at 3 of 3 frequencies, at most 10 %" in line for line in told)
    assert any("a spring of 24 F0/L0 leaves" in line for line in told)


@pytest.mark.parametrize(("lag", "said"), [(45.0, ""), (-20.0, "other signs than Kawai's")])
def test_three_processes_come_out_with_their_intervals(lag: float, said: str) -> None:
    """As of a fast fibre: nothing is to be said. With three leads the signs are."""
    rates, sizes = np.array([6.0, 80.0, 600.0]), np.array([20.0, -lag, 60.0])
    trials = []
    rng = np.random.default_rng(8)
    for trial in plan(pca=4.5):
        s = 2j * np.pi * (trial.facts.setting("frequency_hz") or 0.0)
        modulus = 12.0 + np.sum(sizes * s / (s + rates))
        since = trial.time_s - trial.phases_by_name()["onset"].start_s
        force = 0.5 + 0.00125 * np.imag(modulus * np.exp(s * since)) * (since > 0.0)
        trials.append(recorded(trial, force + 5e-4 * rng.standard_normal(force.size)))
    told: list[str] = []
    (found,) = xb.analyse_protocol("sinusoid", trials, tell=told.append).results
    for letter, rate in zip("abc", rates, strict=True):
        number = found.numbers[f"rate_{letter}_per_s"]
        assert number.value == pytest.approx(rate, rel=0.2)
        assert number.low is not None
        assert number.high is not None
        assert number.low / 1.1 < rate < number.high * 1.1
    assert found.numbers["magnitude_b_f0_per_l0"].value == pytest.approx(lag, rel=0.2)
    assert any(said in line for line in told) if said else told == []


def test_a_still_recording_is_a_note() -> None:
    (trial,) = plan(pca=4.5, frequency=1.0)
    still = replace(trial, length_m=np.ones(trial.time_s.size))
    told: list[str] = []
    (found,) = xb.analyse_protocol(
        "sinusoid", [recorded(still, np.full(still.time_s.size, 0.5), own=False)], tell=told.append
    ).results
    assert found.rows == ()
    assert any("length does not oscillate" in line for line in told)


def test_each_calcium_has_processes_of_its_own(tmp_path: object) -> None:
    made = xb.run_protocol(
        "sinusoid", FIBRE, pca=[6.1, 4.5], frequency=[0.3, 0.6, 1.2, 2.4, 5.0], tell=lambda line: None
    )
    (found,) = made.results
    assert list(found.numbers_at) == ["pCa 4.5", "pCa 6.1"]
    assert found.numbers == found.numbers_at["pCa 4.5"]
    assert set(made.found["found"][0]["numbers_at"]) == {"pCa 4.5", "pCa 6.1"}
    assert "pCa 6.1" in str(made)


def test_a_bag_of_slow_sinusoids_gives_what_made_it(tmp_path: Path) -> None:
    """Flanks of a slow sinusoid were taken for straight lines between corners; moduli without noise had all weight."""
    frequency = [0.5, 1.0, 2.0, 4.37, 7.49, 12.85, 40.0, 100.0]
    made = xb.run_protocol("sinusoid", "18Dec2017a", frequency=frequency, as_measured=True, tell=lambda line: None)
    made.save(tmp_path)
    told: list[str] = []
    measured, model = xb.analyse_protocol(
        "sinusoid", tmp_path, model="3state_coop", fibre="18Dec2017a", tell=told.append
    ).results
    (simulated,) = made.results
    assert not any("corners" in line for line in told)
    for found in (measured, model):
        order = np.argsort(found.column("frequency_hz"))
        for key in ("elastic_f0_per_l0", "viscous_f0_per_l0"):
            assert found.column(key)[order] == pytest.approx(simulated.column(key), rel=5e-4)
        for key in ("rate_a_per_s", "magnitude_a_f0_per_l0"):
            assert found.numbers[key].value == pytest.approx(simulated.numbers[key].value, rel=0.01)
