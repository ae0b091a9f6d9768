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
        assert row["quick_per_s"].value == pytest.approx(700.0, rel=1e-4)
        assert row["slow_per_s"].value == pytest.approx(15.0, rel=1e-4)
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


@pytest.mark.parametrize(
    "options",
    [
        {"rate": 1000.0},
        {"rate": 2000.0},
        {"rate": 7000.0},
        {"rate": 12000.0},
        {"lead": 0.01003},
        {"step_time": 0.00013},
    ],
)
def test_stiffness_does_not_depend_on_where_samples_are(options: dict[str, float]) -> None:
    """A step between two samples was read off a straight line between them: 152 F0/L0 at 1 kHz."""
    (found,) = xb.run_protocol("step", "18Dec2017a", tell=lambda line: None, **options).results
    (usual,) = xb.run_protocol("step", "18Dec2017a", tell=lambda line: None).results
    assert found.column("size_l0") == pytest.approx(usual.column("size_l0"), abs=1e-12)
    stiffness, y0 = (found.numbers[key].value for key in ("stiffness_f0_per_l0", "y0_l0"))
    # A quicker step is a little stiffer.
    assert stiffness == pytest.approx(usual.numbers["stiffness_f0_per_l0"].value, rel=0.005)
    assert y0 == pytest.approx(usual.numbers["y0_l0"].value, rel=0.005)


def test_a_first_sample_that_comes_late_is_told() -> None:
    trial = recorded(-0.01)
    end_s = trial.facts.phases[1].end_s
    kept = (trial.time_s < end_s - 3e-4) | (trial.time_s > end_s + 4.2e-4)
    late = replace(
        trial, time_s=trial.time_s[kept], length_m=trial.length_m[kept], force_time_s=trial.force_time_s[kept],
        force_n=trial.force_n[kept],
    )  # fmt: skip
    (found,) = xb.analyse_protocol("step", [late], tell=lambda line: None).results
    assert any("it is that of the first sample, 0.45 ms after the step" in note for note in found.notes)


def test_noise_makes_no_quick_phase() -> None:
    """The model has none; noise of 0.1 % F0 made one in half of the steps, with rates up to 50,000 1/s."""
    made = xb.run_protocol("step", "18Dec2017a", lead=0.1, as_measured=True, tell=lambda line: None)
    found = 0
    for seed in range(6):
        random = np.random.default_rng(seed)
        noisy = [replace(t, force_n=t.force_n + 1e-3 * random.standard_normal(t.force_n.size)) for t in made.trials]
        (each,) = xb.analyse_protocol("step", noisy, tell=lambda line: None).results
        found += sum("t2_f0" in row for row in each.rows)
    assert found <= 2  # of 48


def test_what_leads_away_or_is_all_there_is_is_no_quick_phase() -> None:
    trial = recorded(-0.01)
    end_s = trial.facts.phases[1].end_s
    since = trial.time_s - end_s
    falling = np.where(since < -1e-9, 1.0, 0.6 + 0.1 * np.exp(-700.0 * since) - 0.1 * np.exp(-15.0 * since))
    (found,) = xb.analyse_protocol("step", [replace(trial, force_n=falling)], tell=lambda line: None).results
    assert "t2_f0" not in found.rows[0]
    (found,) = xb.run_protocol("step", "18Dec2017a", window=0.5, size=0.002, tell=lambda line: None).results
    assert "t2_f0" not in found.rows[0]


@pytest.mark.parametrize(("model", "viscous"), [("hill", True), ("hill_se", False), ("3state_coop", False)])
def test_force_that_is_gone_with_the_movement_is_told(model: str, viscous: bool) -> None:
    told: list[str] = []
    xb.run_protocol("step", "18Dec2017a", model=model, size=[-0.001, 0.001], tell=told.append)
    assert any("that is viscosity, not stiffness" in line for line in told) == viscous


def measured(size: float, lag_s: float, of_force: float, of_length: float, random: np.random.Generator) -> Trial:
    """A step in 0.2 ms after a second; force, whose channel lags, has stiffness 100 F0/L0 and T2 at 30 % of T1."""
    time = np.arange(0.0, 1.1, 1.0 / 20000.0)
    since = time - lag_s - 1.0002
    after = 70.0 * np.exp(-800.0 * np.maximum(since, 0.0)) + 30.0 * np.exp(-20.0 * np.maximum(since, 0.0))
    force = 1.0 + size * np.where(since < 0.0, 100.0 * np.clip((since + 2e-4) / 2e-4, 0.0, 1.0), after)
    length = np.interp(time, [1.0, 1.0002], [0.0, size]) + of_length * random.standard_normal(time.size)
    noisy = force + of_force * random.standard_normal(time.size)
    return xb.make_trial("m", f"s{1e4 * size:+.0f}", time, length, 10.0**1.5, noisy, tell=lambda line: None)


@pytest.mark.parametrize(
    ("lag_s", "of_force", "of_length", "told"),
    [(0.0, 1e-3, 0.0, ""), (5e-5, 1e-3, 0.0, "0.05 ms after"), (2e-4, 1e-3, 0.0, "0.2 ms after"),
     (0.0, 1e-2, 0.0, ""), (0.0, 1e-3, 1e-4, None)],
)  # fmt: skip
def test_force_that_lags_and_noise_of_length_do_not_hide_t1(
    lag_s: float, of_force: float, of_length: float, told: str | None
) -> None:
    """Regression: T1 was force at the end of the length step: a lag of one sample took a quarter of the stiffness."""
    random, sizes = np.random.default_rng(0), (-0.005, -0.0025, -0.001, 0.001, 0.0025)
    trials = [measured(size, lag_s, of_force, of_length, random) for size in sizes]
    lines: list[str] = []
    (found,) = xb.analyse_protocol("step", trials, tell=lines.append).results
    for key, truth in (("stiffness_f0_per_l0", 100.0), ("y0_l0", 0.01)):
        number = found.numbers[key]
        assert abs(number.value - truth) < 4.0 * number.se < 0.15 * truth
    for key, share in (("t1_f0", 100.0), ("t2_f0", 30.0)):
        apart = found.column(key) - (1.0 + share * np.array(sizes))
        assert np.all(np.abs(apart)[:2] < 5.0 * found.errors(key)[:2] + 1e-3 * (told is None))
    if told is not None:
        assert [told] * bool(told) == [told for line in lines if "comes to its extreme" in line and told in line]


def test_force_that_comes_much_later_has_no_stiffness() -> None:
    """Regression: a stiffness of 0.16 F0/L0 and a release to zero force of 618 % L0 were given."""
    random = np.random.default_rng(0)
    trials = [measured(size, 1e-3, 1e-3, 0.0, random) for size in (-0.0025, -0.001, 0.001, 0.0025)]
    lines: list[str] = []
    (found,) = xb.analyse_protocol("step", trials, tell=lines.append).results
    assert found.numbers == {}
    assert any("T1 of small steps does not rise with their size (" in line for line in lines), lines
    # Between the two, force still goes on.
    trials = [measured(size, 6e-4, 1e-3, 0.0, random) for size in (-0.0025, 0.0025)]
    (found,) = xb.analyse_protocol("step", trials, tell=lines.append).results
    assert found.rows[0]["t1_f0"].value is None
    assert any("force still goes on 0.5 ms after the step" in line for line in lines), lines
