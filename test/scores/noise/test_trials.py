"""From what the noise of each trial is taken, and how right it is where no trial holds still for long."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from xb_muscle_ros.diagnose.noise.cells import Residual
from xb_muscle_ros.diagnose.noise.significance import significance
from xb_muscle_ros.errors import UserError
from xb_muscle_ros.fit.linear_fit import LinearFit
from xb_muscle_ros.scores.noise.model import LEAST_SD_F0, NoiseModel, Source
from xb_muscle_ros.scores.noise.trials import by_windows, completed, noise_of
from xb_muscle_ros.scores.noise.windows import Window
from xb_muscle_ros.scores.steady import steady_part
from xb_muscle_ros.trials.readers.assembly import trial_of
from xb_muscle_ros.trials.readers.mapping import load_mapping
from xb_muscle_ros.trials.readers.settings import ImportSettings
from xb_muscle_ros.trials.trial import Phase, Trial, TrialFacts

Array = npt.NDArray[np.float64]
Windows = Callable[..., list[Window]]
SDS = (2e-3, 1e-3, 4e-3)


def nothing_fitted(samples: int) -> LinearFit:
    return LinearFit(np.zeros((samples, 0)), np.ones(samples), np.zeros(0))


def quick(made: Any, seed: int, shape: str = "exponentials") -> tuple[list[Trial], list[Array]]:
    """Three trials at 1 kHz with a hold of 50 ms, their noise fading within 20 ms, and the noise."""
    times = made.even_times(0.08, 0.05, 1e-3)
    return study(made, seed, times, 0.08, 0.0195, 1.0, shape)


def slow(
    made: Any, seed: int, shape: str = "exponentials", tau_s: float = 0.02, share: float = 0.5
) -> tuple[list[Trial], list[Array]]:
    """Three trials with a hold of 60 s, sampled further and further apart."""
    return study(made, seed, made.spreading_times(0.1, 60.0), 0.1, tau_s, share, shape)


def study(
    made: Any, seed: int, times: Array, ramp_s: float, tau_s: float, share: float, shape: str
) -> tuple[list[Trial], list[Array]]:
    random = np.random.default_rng(seed)
    noise = [sd * made.fading_noise(random, times, tau_s, share) for sd in SDS]
    return [made.relaxing(f"t{i}", times, ramp_s, e, shape) for i, e in enumerate(noise)], noise


def covers(model: NoiseModel, trials: Sequence[Trial], noise: Sequence[Array]) -> list[bool]:
    """Whether draws spread around the size of each trial's noise."""
    drawn = model.draw([t.force_time_s for t in trials], 100, np.random.default_rng(0))
    parts = np.split(drawn, np.cumsum([e.size for e in noise])[:-1])
    found = []
    for part, e in zip(parts, noise, strict=True):
        low, high = np.quantile(np.sqrt(np.mean(part**2, axis=0)), [0.02, 0.98])
        found.append(bool(low < np.sqrt(np.mean(e**2)) < high))
    return found


@pytest.mark.slow
@pytest.mark.parametrize("shape", ["exponentials", "power", "active"])
@pytest.mark.parametrize("make", [quick, slow])
def test_noise_beside_a_transient_is_of_the_right_size(made: Any, make: Any, shape: str) -> None:
    """A fall from 30 % F0 is no noise, and noise of 0.1 to 0.4 % F0 is not taken for part of it."""
    logs, covered = [], []
    for seed in range(8):
        trials, noise = make(made, seed, shape)
        model = noise_of(trials)
        assert {n.source for n in model.trials} == {Source.CURVE}
        logs += [np.log(n.sd_f0 / sd) for n, sd in zip(model.trials, SDS, strict=True)]
        covered += covers(model, trials, noise)
    # 50 ms hold two or three independent samples of noise that fades within 20 ms.
    assert abs(np.median(logs)) < 0.2
    assert np.quantile(np.abs(logs), 0.9) < (0.6 if make is quick else 0.35)
    assert np.mean(covered) > 0.85


@pytest.mark.slow
@settings(max_examples=15, deadline=None)
@given(st.integers(0, 10_000), st.floats(0.001, 0.3), st.floats(0.0, 1.0), st.sampled_from(["exponentials", "power"]))
def test_size_whatever_the_memory(made: Any, seed: int, tau_s: float, share: float, shape: str) -> None:
    """For every one that is short beside the hold: rather too large, at times twice, than too small."""
    trials, _ = slow(made, seed, shape, tau_s, share)
    for noise, sd in zip(noise_of(trials).trials, SDS, strict=True):
        assert 0.5 < noise.sd_f0 / sd < 3.0


@pytest.mark.slow
@pytest.mark.parametrize("make", [quick, slow])
def test_false_alarms_on_noise_taken_from_curves(made: Any, make: Any) -> None:
    """Studies without a mismatch, whose noise is estimated beside transients that a fit took away."""
    p = []
    for seed in range(12):
        trials, noise = make(made, seed)
        residuals = [
            Residual(t.facts.trial, 6.0, t.force_time_s, e, t.facts.phases, t.length_change_l0, np.ones(e.size))
            for t, e in zip(trials, noise, strict=True)
        ]
        found = significance(residuals, nothing_fitted(sum(e.size for e in noise)), noise_of(trials), 60, seed)
        assert not found.detected(0.05)
        p.append(found.overall_p)
    # 4 and more of 12 at 5 % have a chance of 0.2 %.
    assert np.count_nonzero(np.array(p) <= 0.05) <= 3


def test_windows_where_trials_hold_still_for_long_enough(made: Any) -> None:
    times = made.even_times(0.08, 0.3, 1e-3)
    trials, _ = study(made, 0, times, 0.08, 0.0195, 1.0, "exponentials")
    model = noise_of(trials)
    assert [(n.source, n.samples) for n in model.trials] == [(Source.WINDOW, 100)] * 3


def test_each_trial_by_what_it_has(made: Any) -> None:
    """Windows where samples are even, curves where they are not, and the others' noise where there is nothing."""
    times = made.even_times(0.08, 0.3, 1e-3)
    (even, _, loud), _ = study(made, 0, times, 0.08, 0.0195, 1.0, "exponentials")
    (uneven, *_), _ = slow(made, 1)
    uneven = replace(uneven, facts=replace(uneven.facts, trial="uneven"))
    short = replace(even, facts=replace(even.facts, trial="short"), force_time_s=times[:9], force_n=np.full(9, 0.2))
    model = noise_of([short, even, uneven, loud])
    assert [n.source for n in model.trials] == [Source.OTHERS, Source.WINDOW, Source.CURVE, Source.WINDOW]
    assert [n.trial for n in model.trials] == ["short", "t0", "uneven", "t2"]
    sizes = [n.sd_f0 for n in model.trials[1:]]
    assert min(sizes) < model.trials[0].sd_f0 < max(sizes)


def test_slow_samples_know_no_hum(made: Any) -> None:
    """White noise at 10 Hz is neither thought to last for long nor to be larger than it is."""
    times = made.even_times(1.0, 5.0, 0.1)
    trials, _ = study(made, 0, times, 1.0, 0.02, 0.5, "exponentials")
    model = noise_of([replace(t, facts=replace(t.facts, phases=t.facts.phases[1:])) for t in trials])
    for noise, sd in zip(model.trials, SDS, strict=True):
        assert noise.source is Source.CURVE
        assert 0.7 < noise.sd_f0 / sd < 1.4
        assert noise.likeliest.variance_of_mean(times) < 3.0 * sd**2


def test_trial_without_any_has_the_noise_of_the_others(windows: Windows) -> None:
    known = by_windows(windows(0, 200))
    model = completed(known, {**dict.fromkeys(known, 1e-3), "none": 1e-3})
    last, sizes = model.trials[-1], [n.sd_f0 for n in known.values()]
    assert (last.trial, last.source, last.samples) == ("none", Source.OTHERS, 0)
    assert min(sizes) < last.sd_f0 < max(sizes)
    drawn = model.of(["none"]).draw([np.arange(500) * 1e-3], 200, np.random.default_rng(0))
    # Not knowing which of the others it is like, sizes differ by more than a factor of two.
    low, high = np.quantile(np.std(drawn, axis=0), [0.1, 0.9])
    assert high > 2.0 * low


def test_errors_are_one_line(made: Any) -> None:
    with pytest.raises(UserError, match="at least 10 in one trial are needed"):
        noise_of([])
    times = made.even_times(0.01, 0.01, 1e-3)
    trial = made.relaxing("a", times, 0.01, np.zeros(times.size))
    short = replace(trial, force_time_s=trial.force_time_s[:9], force_n=trial.force_n[:9])
    with pytest.raises(UserError, match="at least 10 in one trial are needed"):
        noise_of([short])
    with pytest.raises(UserError, match="trial a: force is not finite"):
        noise_of([replace(trial, force_n=np.full(times.size, np.nan))])


def test_silence_is_allowed(made: Any) -> None:
    """A recording without noise: as little as is allowed, however it is sampled."""
    for times in (made.spreading_times(0.1, 60.0), made.even_times(0.08, 0.05, 1e-3)):
        trial = made.relaxing("a", times, 0.1, np.zeros(times.size))
        still = replace(trial, force_n=np.full(times.size, 0.3))
        (noise,) = noise_of([still]).trials
        assert noise.sd_f0 == 1e-5


def few(made: Any, hold_s: float, step_s: float, sd: float, seed: int) -> list[Trial]:
    """Four trials of which nothing holds still for 20 samples."""
    random = np.random.default_rng(seed)
    times = made.even_times(0.08, hold_s, step_s)
    noise = [sd * random.standard_normal(times.size) for _ in range(4)]
    return [made.relaxing(f"t{i}", times, 0.08, e, "exponentials") for i, e in enumerate(noise)]


def test_noise_of_holds_with_few_samples(made: Any) -> None:
    """Holds of 14 samples, 6 ms apart: none has the 20 that smooth curves usually need."""
    logs = []
    for seed in range(12):
        trials = few(made, 0.084, 0.006, 2e-3, seed)
        model = noise_of(trials)
        assert {n.source for n in model.trials} == {Source.CURVE}
        assert all(8 <= n.samples < 20 for n in model.trials)
        logs += [np.log(n.sd_f0 / 2e-3) for n in model.trials]
    assert abs(np.median(logs)) < 0.35


def test_noise_where_nothing_is_smooth_comes_from_neighbouring_samples(made: Any) -> None:
    """A length that never stands still or moves steadily: white noise is seen, and slower noise allowed for."""
    found = []
    for seed in range(6):
        trials = []
        for trial in few(made, 0.3, 0.006, 2e-3, seed):
            swung = 1.0 + 0.03 * np.sin(40.0 * trial.time_s)
            trials.append(replace(trial, length_m=swung * trial.facts.reference_length_m))
        model = noise_of(trials)
        assert {n.source for n in model.trials} == {Source.DIFFERENCES}
        found += [n.sd_f0 for n in model.trials]
        drawn = model.draw([t.force_time_s for t in trials], 200, np.random.default_rng(0))
        low, high = np.quantile(np.std(drawn, axis=0), [0.05, 0.95])
        # Rather too much than too little: what bends fast counts as noise.
        assert low < 2.6e-3 < high
    assert 1e-3 < np.median(found) < 6e-3


def test_silence_and_too_few_samples(made: Any) -> None:
    (trial, *_) = few(made, 0.3, 0.006, 0.0, 0)
    swung = replace(trial, length_m=1.0 + 0.03 * np.sin(40.0 * trial.time_s))
    flat = replace(swung, force_n=np.full(trial.force_n.size, 0.5))
    assert noise_of([flat]).trials[0].sd_f0 == pytest.approx(1e-5)
    short = replace(swung, force_time_s=trial.force_time_s[:9], force_n=trial.force_n[:9])
    with pytest.raises(UserError, match="at least 10 in one trial are needed"):
        noise_of([short])


def test_noise_of_a_trial_without_any_goes_with_its_force(windows: Windows) -> None:
    """Noise grows with force: a trial at full calcium is not given that of relaxed ones."""
    known = by_windows(windows(0, 200))
    steps = {**dict.fromkeys(known, 1e-3), "none": 1e-3}
    alike = completed(known, steps, dict.fromkeys(steps, 0.03)).trials[-1]
    strong = completed(known, steps, {**dict.fromkeys(known, 0.03), "none": 1.0}).trials[-1]
    assert alike.sd_f0 == pytest.approx(completed(known, steps).trials[-1].sd_f0)
    assert 2.0 < strong.sd_f0 / alike.sd_f0 < 12.0
    # How much it grows is not well known, and draws say so.
    spread = [np.log(n.members[-1].times(1.0).variance_of_mean(np.zeros(1)) ** 0.5) for n in (alike, strong)]
    least = [np.log(n.members[0].times(1.0).variance_of_mean(np.zeros(1)) ** 0.5) for n in (alike, strong)]
    assert spread[1] - least[1] > 1.5 * (spread[0] - least[0])


def test_power_of_force_is_learnt_from_the_trials_that_have_noise(windows: Windows) -> None:
    """Where noise was seen to be the same at all forces, it is taken to be the same at others."""
    base = by_windows(windows(0, 200))["t0"]
    known = {f"k{i}": replace(base, trial=f"k{i}") for i in range(6)}
    levels = {f"k{i}": level for i, level in enumerate((0.02, 0.1, 0.2, 0.3, 0.4, 0.5))}
    model = completed(known, dict.fromkeys([*known, "none"], 1e-3), {**levels, "none": 1.0})
    assert model.trials[-1].sd_f0 == pytest.approx(base.sd_f0, rel=0.05)


def test_noise_is_not_less_than_what_steady_force_scatters_by(made: Any) -> None:
    """Noise that fades within 50 ms, of which curves through holds of 14 samples leave half."""
    times = np.arange(45) * 0.006
    phases = (Phase("isometric", 0.0, 0.09), Phase("test_stretch", 0.09, 0.17), Phase("hold", 0.17, float(times[-1])))
    length = np.interp(times, [0.0, 0.09, 0.17, 1.0], [1.0, 1.0, 1.04, 1.04])
    found = []
    for seed in range(10):
        random = np.random.default_rng(seed)
        trials = []
        for k in range(3):
            quiet = made.relaxing(f"t{k}", times, 0.17, np.zeros(times.size))
            noise = 2e-3 * made.fading_noise(random, times, 0.05, 1.0)
            force = np.where(times < 0.09, 0.1, quiet.force_n) + noise
            trials.append(replace(quiet, facts=replace(quiet.facts, phases=phases), length_m=length, force_n=force))
        for trial, noise_of_trial in zip(trials, noise_of(trials).trials, strict=True):
            inside = steady_part(trial, times, trial.force_n).inside
            steady_s, steady = times[inside], trial.force_n[inside]
            line = np.polyval(np.polyfit(steady_s, steady, 1), steady_s)
            assert noise_of_trial.sd_f0 > 0.999 * float(np.sqrt(np.sum((steady - line) ** 2) / (steady.size - 2)))
            found.append(noise_of_trial.sd_f0 / 2e-3)
    assert 0.35 < np.median(found) < 1.5


@pytest.mark.parametrize("offset", [0, 3])
def test_recordings_every_6_ms_have_the_noise_of_those_at_1_khz(shared_data: Path, offset: int) -> None:
    """Of 18Dec2017a at five pCa, with all its rest and with 84 ms of it."""
    trials = recorded(shared_data)
    full = noise_of(trials)
    for rest_s in (0.11, 0.084):
        ratios = []
        coarse = noise_of([thinned(trial, 6, offset, rest_s) for trial in trials])
        assert {noise.source for noise in coarse.trials} <= {Source.CURVE, Source.WINDOW}
        for noise, reference in zip(coarse.trials, full.trials, strict=True):
            ratios.append(noise.sd_f0 / reference.sd_f0)
        assert min(ratios) > 0.45
        assert 0.6 < np.median(ratios) < 1.5
        assert max(ratios) < 2.0


def recorded(shared_data: Path) -> list[Trial]:
    """Force and length of the 1 kHz recordings, in F0 and L0."""
    scripts = Path(__file__).parents[3] / "scripts" / "datasets" / "rat_soleus_18Dec2017a.yaml"
    settings = ImportSettings(load_mapping(scripts), "test")
    found = []
    for file in sorted((shared_data / "recordings" / "rat_soleus_18Dec2017a").glob("amp*.csv")):
        prepared = settings.prepare(file)
        for pending in prepared.reader.trials(file, prepared.mapping):
            found.append(trial_of(pending.read(), prepared.mapping, file, True))
    return found


def thinned(trial: Trial, stride: int, offset: int, rest_s: float) -> Trial:
    """Every so many samples of a trial, from so long before the first stretch."""
    begin_s = max(trial.facts.phases[0].end_s - rest_s, 0.0)
    kept = np.flatnonzero(trial.time_s >= begin_s)[offset::stride]
    start_s = float(trial.time_s[kept[0]])
    phases = tuple(replace(p, start_s=max(p.start_s, start_s)) for p in trial.facts.phases)
    return replace(
        trial,
        facts=replace(trial.facts, phases=phases),
        time_s=trial.time_s[kept],
        length_m=trial.length_m[kept],
        calcium_time_s=np.array([start_s]),
        calcium_um=trial.calcium_um[:1],
        force_time_s=trial.force_time_s[kept],
        force_n=trial.force_n[kept],
    )


@settings(max_examples=25)
@given(
    st.lists(
        st.tuples(st.integers(10, 60), st.floats(5e-4, 5e-2), st.booleans(), st.booleans()), min_size=1, max_size=4
    ),
    st.floats(0.0, 1e-2),
    st.integers(0, 1000),
)
def test_ten_samples_are_enough_for_a_noise_of_some_size(
    shapes: list[tuple[int, float, bool, bool]], sd: float, seed: int
) -> None:
    """Short, coarse, uneven, without phases, without noise: there is a size, a source and something to draw from."""
    random = np.random.default_rng(seed)
    trials = []
    for k, (n, step_s, even, told) in enumerate(shapes):
        times = np.cumsum(np.full(n, step_s) if even else step_s * random.uniform(0.2, 3.0, n))
        onset_s, end_s = times[n // 3], times[2 * n // 3]
        length = 1.0 + np.interp(times, [onset_s, end_s], [0.0, 0.04])
        force = 0.3 + 8.0 * (length - 1.0) + sd * random.standard_normal(n)
        phases = (Phase("isometric", times[0], onset_s), Phase("test_stretch", onset_s, end_s))
        phases = (*phases, Phase("hold", end_s, times[-1])) if told else ()
        facts = TrialFacts("made", f"t{k}", 6.0, phases=phases)
        trials.append(Trial(facts, times, length, times[:1], np.ones(1), times, force))
    model = noise_of(trials)
    assert [noise.trial for noise in model.trials] == [trial.facts.trial for trial in trials]
    for noise in model.trials:
        assert np.isfinite(noise.sd_f0)
        assert noise.sd_f0 >= LEAST_SD_F0
        assert noise.source in Source
    drawn = model.draw([trial.force_time_s for trial in trials], 3, random)
    assert np.all(np.isfinite(drawn))
