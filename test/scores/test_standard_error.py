"""Standard errors against repeated noise: slow noise, hum of the mains, slow and fast ramps, fast and slow sampling."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import NamedTuple

import numpy as np
import pytest
from scipy.linalg import matmul_toeplitz, toeplitz
from scipy.signal import lfilter

from xb_muscle_ros.evaluate.trials import _mean_in_cells
from xb_muscle_ros.scores.enhancement import Enhancement, Side, enhancement
from xb_muscle_ros.scores.estimate import Estimate, notes_of
from xb_muscle_ros.scores.readout import isometric_force, read_off, read_off_measured
from xb_muscle_ros.scores.redevelopment import Redevelopment, redevelopment
from xb_muscle_ros.scores.standard_error import force_noise
from xb_muscle_ros.tables import error_text, unsound, with_error
from xb_muscle_ros.trials.hum import hum
from xb_muscle_ros.trials.trial import Array, Phase, Trial, TrialFacts

SRS, LEVEL = 20.0, 0.4


class Setting(NamedTuple):
    """Of a recording: what precedes the stretch (s), its speed (L0/s), sampling step (s), noise and hum (F0)."""

    lead_s: float = 0.4
    speed: float = 0.4545
    step_s: float = 1e-3
    memory: float = 0.95
    sd: float = 1e-3
    hum: float = 0.0
    hum_hz: float = 50.0


def noise(random: np.random.Generator, time_s: Array, setting: Setting) -> Array:
    """First-order autoregression, and hum of a random phase whose size changes from record to record."""
    white = random.standard_normal(time_s.size + 500) * np.sqrt(1.0 - setting.memory**2)
    slow = lfilter([1.0], [1.0, -setting.memory], white)[500:]
    # Both quadratures random: the hum of a record at a time is normal, as the noise is.
    a, b = random.standard_normal(2)
    turn = 2.0 * np.pi * setting.hum_hz * time_s
    out: Array = setting.sd * slow + setting.hum * (a * np.cos(turn) + b * np.sin(turn))
    return out


def trial(random: np.random.Generator, setting: Setting) -> Trial:
    time_s = np.arange(round((setting.lead_s + 0.1) / setting.step_s) + 1) * setting.step_s
    length = setting.speed * np.clip(time_s - setting.lead_s, 0.0, None)
    phases = (Phase("isometric", 0.0, setting.lead_s), Phase("test_stretch", setting.lead_s, float(time_s[-1])))
    force = LEVEL + SRS * length + noise(random, time_s, setting)
    facts = TrialFacts("f", "t", 6.0, phases=phases)
    return Trial(facts, time_s, 1.0 + length, np.zeros(1), np.ones(1), time_s, force)


def errors(name: str, true: float, setting: Setting, repeats: int = 60) -> Iterator[float]:
    """Of repeated records, how many standard errors each is off."""
    random = np.random.default_rng(11)
    for _ in range(repeats):
        found = read_off_measured(trial(random, setting))[name]
        assert found.value is not None
        assert found.se is not None
        yield (found.value - true) / found.se


def assert_covers(off: list[float]) -> None:
    """68 and 95 % within three binomial errors."""
    n = len(off)
    for share, reach in ((0.683, 1.0), (0.954, 2.0)):
        inside = float(np.mean(np.abs(off) < reach))
        assert inside == pytest.approx(share, abs=3.0 * np.sqrt(share * (1.0 - share) / n) + 0.02)


@pytest.mark.slow
@pytest.mark.parametrize(
    "setting",
    [
        Setting(lead_s=0.1),
        Setting(memory=0.98),
        Setting(speed=2.0, step_s=4e-4, memory=0.98),
    ],
    ids=["short", "0.98", "fast"],
)
def test_srs_in_slow_noise(setting: Setting) -> None:
    assert_covers(list(errors("srs_test", SRS, setting)))


@pytest.mark.parametrize(("speed", "hum_hz"), [(0.02, 50.0), (0.4545, 60.0)])
def test_srs_in_hum(speed: float, hum_hz: float) -> None:
    """The size of the hum is another in each record, and is found in each."""
    off = list(errors("srs_test", SRS, Setting(speed=speed, hum=5e-3, hum_hz=hum_hz)))
    assert np.sqrt(np.mean(np.square(off))) == pytest.approx(1.0, abs=0.25)
    # A sine of random phase lies within its own amplitude.
    assert np.mean(np.abs(off) < 2.0) > 0.9


@pytest.mark.slow
@pytest.mark.parametrize(
    "setting",
    [
        Setting(lead_s=1.0, hum=5e-3),
        Setting(lead_s=2.0, step_s=6e-3, memory=0.7, hum=5e-3, hum_hz=60.0),
        Setting(lead_s=2.0, step_s=1e-2, memory=0.0),
    ],
    ids=["hum", "6 ms, hum", "white"],
)
def test_isometric_force(setting: Setting) -> None:
    assert_covers(list(errors("isometric_f0", LEVEL, setting)))


@pytest.mark.slow
@pytest.mark.parametrize("memory_s", [0.0, 2e-3, 0.02])
@pytest.mark.parametrize("step_s", [2e-4, 5e-5])
def test_srs_sampled_fast(step_s: float, memory_s: float) -> None:
    """Errors at 20 kHz were 30 to 300 times too large in white noise, and a third in noise that fades within 20 ms."""
    memory = float(np.exp(-step_s / memory_s)) if memory_s else 0.0
    off = list(errors("srs_test", SRS, Setting(lead_s=1.0, speed=2.0, step_s=step_s, memory=memory), 40))
    assert_covers(off)


def true_error(weights: Array, memory: float, white_share: float = 0.0) -> float:
    """Of a weighted sum of samples, with noise of SD 1e-3 F0."""
    gamma = (1.0 - white_share) * memory ** np.arange(weights.size)
    gamma[0] += white_share
    return 1e-3 * float(np.sqrt(weights @ matmul_toeplitz(gamma, weights)))


@pytest.mark.parametrize("memory_s", [0.0, 2e-3, 0.02])
@pytest.mark.parametrize("step_s", [1e-3, 4e-4, 2e-4, 5e-5])
def test_errors_of_means_and_slopes_at_any_rate(step_s: float, memory_s: float) -> None:
    memory = float(np.exp(-step_s / memory_s)) if memory_s else 0.0
    setting = Setting(lead_s=1.0, step_s=step_s, memory=memory)
    known = [force_noise(trial(np.random.default_rng(seed), setting)) for seed in range(5)]
    for span_s in (0.005, 0.05, 0.2):
        time_s = np.arange(round(span_s / step_s)) * step_s
        from_middle = time_s - time_s.mean()
        for weights in (np.full(time_s.size, 1.0 / time_s.size), from_middle / (from_middle @ from_middle)):
            ratios = [each.of_sum(weights, time_s) / true_error(weights, memory) for each in known if each]
            assert len(ratios) == 5
            assert np.median(ratios) == pytest.approx(1.0, abs=0.12 if memory_s < 0.01 else 0.4)


def test_white_and_slow_noise_together_sampled_fast() -> None:
    """Six samples at 5 kHz do not show slow noise under as much white noise; means of a millisecond do."""
    time_s, ratios = np.arange(1000) * 2e-4, []
    for seed in range(12):
        random, memory = np.random.default_rng(seed), float(np.exp(-2e-4 / 0.02))
        one = trial(random, Setting(lead_s=1.0, step_s=2e-4, memory=memory, sd=np.sqrt(0.5) * 1e-3))
        white = np.sqrt(0.5) * 1e-3 * random.standard_normal(one.force_n.size)
        known = force_noise(replace(one, force_n=one.force_n + white))
        assert known is not None
        mean = np.full(time_s.size, 1.0 / time_s.size)
        ratios.append(known.of_sum(mean, time_s) / true_error(mean, memory, 0.5))
    assert np.median(ratios) == pytest.approx(1.1, abs=0.35)


def test_hum_sampled_fast_is_found() -> None:
    known = force_noise(trial(np.random.default_rng(3), Setting(lead_s=1.0, step_s=5e-5, memory=0.0, hum=5e-3)))
    assert known is not None
    assert known._lines[0].frequency_hz == pytest.approx(50.0, abs=0.1)
    assert known._lines[0].power_f0 > 100.0 * sum(line.power_f0 for line in known._lines[1:])


def test_autocovariance_of_two_rates_is_one_of_noise() -> None:
    """No weighted sum has a variance below zero, and that of a sample is the noise's."""
    memory = float(np.exp(-5e-5 / 0.02))
    one = trial(np.random.default_rng(0), Setting(lead_s=1.0, step_s=5e-5, memory=memory))
    known = force_noise(one)
    assert known is not None
    gamma = known.autocovariance(one.time_s[:4000])
    assert np.sqrt(gamma[0]) == pytest.approx(1e-3, rel=0.5)
    assert np.linalg.eigvalsh(toeplitz(gamma[::4][:500])).min() > -1e-9 * gamma[0]


def test_srs_sampled_every_6_ms_has_no_value() -> None:
    found = read_off_measured(trial(np.random.default_rng(0), Setting(step_s=6e-3)))["srs_test"]
    assert found.value is None
    assert found.why.endswith(" in the first 10 ms of the stretch; 3 are needed")


def test_k_tr_in_noise_and_hum() -> None:
    random, time_s = np.random.default_rng(2), np.arange(3001) * 1e-3
    off = []
    for _ in range(60):
        force = 0.9 - 0.7 * np.exp(-3.0 * time_s) + noise(random, time_s, Setting(sd=3e-3, hum=5e-3))
        found = redevelopment(time_s, force, 0.0, 3.0)
        assert isinstance(found, Redevelopment)
        off.append((found.k_per_s - 3.0) / found.se_per_s)
    assert_covers(off)


def test_force_enhancement() -> None:
    random, time_s, setting = np.random.default_rng(4), np.arange(2001) * 1e-3, Setting(sd=3e-3)
    off = []
    for _ in range(60):
        sides = []
        for level in (1.2, 0.9):
            facts = TrialFacts("f", "t", phases=(Phase("isometric", 0.0, 2.0),))
            force = level + noise(random, time_s, setting)
            held = Trial(facts, time_s, np.ones(time_s.size), np.zeros(1), np.ones(1), time_s, force)
            sides.append(Side(time_s, force, force_noise(held)))
        found = enhancement(*sides, 1.5)
        assert isinstance(found, Enhancement)
        assert found.enhancement_se_f0 is not None
        assert found.relative_se == pytest.approx(found.enhancement_se_f0 / 0.9, rel=0.5)
        off.append((found.enhancement_f0 - 0.3) / found.enhancement_se_f0)
    assert_covers(off)


def test_hum_is_told_from_slow_noise() -> None:
    random, time_s = np.random.default_rng(6), np.arange(800) * 1e-3
    still = noise(random, time_s, Setting())
    assert hum(1e-3, still)[0] == ()
    lines, rest = hum(1e-3, still + 3e-3 * np.sqrt(2.0) * np.sin(2.0 * np.pi * 59.9 * time_s + 1.0))
    assert [line.frequency_hz for line in lines] == [pytest.approx(59.9, abs=0.1)]
    assert lines[0].power_f0 == pytest.approx(9e-6, rel=0.1)
    assert np.std(rest - still) < 3e-4


def test_simulated_force_has_no_error() -> None:
    one = trial(np.random.default_rng(0), Setting())
    assert {each.se for each in read_off(one, one.time_s, one.measured_f0).values()} == {None}


def test_a_trial_without_quiet_times_says_so() -> None:
    time_s = np.arange(60) * 1e-3
    phases = (Phase("conditioning_stretch", 0.0, 0.012), Phase("shortening", 0.012, 0.03), Phase("hold", 0.03, 0.035))
    length = 1.0 + 0.1 * np.sin(60.0 * time_s)
    moving = Trial(TrialFacts("f", "t", 6.0, phases=phases), time_s, length, np.zeros(1), np.ones(1), time_s, length)
    found = read_off_measured(moving)["srs_conditioning"]
    assert found.value is not None
    assert (found.se, found.why) == (None, "standard error not known: no quiet time to take the noise from")


def test_slow_ramp_and_large_hum_are_marked() -> None:
    """The SRS that was printed as if sound: here 20 F0/L0 with an error of a hundred."""
    found = read_off_measured(trial(np.random.default_rng(1), Setting(speed=0.005, hum=5e-3)))["srs_test"]
    assert found.se is not None
    assert found.se > 50.0
    assert unsound(found.value, found.se) == (abs(found.value or 0.0) <= found.se)


def test_text_of_errors_and_marks() -> None:
    assert [error_text(se) for se in (None, np.nan, 15.2, 0.213, 0.00012)] == ["", "", " ± 15", " ± 0.21", " ± 0.00012"]
    told = [with_error(*each, ".0f") for each in ((2.0, 5.1), (-9.0, 5.1), (2.0, None), (None, 1.0))]
    assert told == ["2 ± 5.1*", "-9 ± 5.1", "2", "–"]


def test_notes_of_one_reason_are_one_line() -> None:
    assert notes_of([("a", "SRS: x"), ("b", "SRS: y"), ("b", "k_tr: z"), ("c", "SRS: x")]) == [
        "SRS, of trial a, and of c: x",
        "SRS, of trial b: y",
        "k_tr, of trial b: z",
    ]
    assert notes_of([("a", "k_tr: 0.144 s"), ("b", "k_tr: 0.15 s"), ("c", "k_tr: 1e-3 s")]) == [
        "k_tr, of trial a, and of 2 more trials: 0.144 s (in the first; in others with other numbers)"
    ]


def test_repeats_with_an_error_as_large_as_all_of_them_are_left_out() -> None:
    cell = (np.array([0, 0, 1, 1]), np.zeros(4, dtype=np.int64), np.zeros(4, dtype=np.int64))
    values, errors = np.array([20.0, -14.0, 0.3, 0.2]), np.array([0.3, 30.0, 0.5, 0.4])
    mean, se, out = _mean_in_cells(values, errors, cell, (2, 1, 1))
    # Repeats that are all small within their errors are what they are.
    assert mean.ravel() == pytest.approx([20.0, 0.25])
    assert se.ravel() == pytest.approx([0.3, np.hypot(0.5, 0.4) / 2.0])
    assert out == 1


def test_isometric_force_carries_the_error_it_is_given() -> None:
    one = trial(np.random.default_rng(0), Setting())
    known = force_noise(one)
    assert known is not None
    found = isometric_force(one, one.time_s, one.measured_f0, known)
    assert isinstance(found, Estimate)
    assert found.se == pytest.approx(known.of_mean(one.time_s[:321]), rel=0.02)
