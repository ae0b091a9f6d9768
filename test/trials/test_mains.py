"""Hum of the mains is found and told, and a notch takes it out of length and force alike."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import xb_muscle_ros as xb
from xb_muscle_ros.errors import UserError
from xb_muscle_ros.trials.mains import hum_line, hum_of_mains, laid_notch
from xb_muscle_ros.trials.trial import Trial


def recorded(hz: float = 50.0, amplitude: float = 0.0, rate: float = 1000.0, lead_s: float = 1.5) -> Trial:
    trial = xb.StretchShortenStretch(0.0383, 0.5, lead_s=lead_s, hold_s=1.0).trial("soleus", 6.1, rate)
    noise = 5e-4 * np.random.default_rng(2).normal(size=trial.time_s.size)
    hum = amplitude * np.sin(2.0 * np.pi * hz * trial.time_s + 0.7)
    force = 0.5 + 8.0 * trial.length_change_l0 + hum + noise
    return replace(trial, force_time_s=trial.time_s, force_n=force)


def notched(trial: Trial, frequencies_hz: list[float]) -> Trial:
    notch = laid_notch(frequencies_hz, trial.force_time_s, trial.force_n)
    return replace(
        trial,
        length_m=notch.without("length", trial.time_s, trial.length_m),
        force_n=notch.without("force", trial.force_time_s, trial.force_n),
        facts=replace(trial.facts, source=notch.note),
    )


@pytest.mark.parametrize("hz", [49.9, 50.0, 50.1, 60.0])
@pytest.mark.parametrize("rate", [500.0, 1000.0, 5000.0])
def test_hum_is_found_with_frequency_and_amplitude(hz: float, rate: float) -> None:
    trial = recorded(hz, 0.01, rate)
    quiet = trial.time_s < 1.2
    found = hum_of_mains(trial.time_s[quiet], trial.force_n[quiet])
    assert found is not None
    assert found[0] == pytest.approx(hz, abs=0.05)
    assert found[1] == pytest.approx(0.01, rel=0.05)
    assert f"hum of {hz:.1f} Hz" in hum_line(trial)
    assert f"--notch {hz:g} of import takes it out" in hum_line(trial)


@pytest.mark.parametrize(("hz", "amplitude"), [(50.0, 0.0), (35.0, 0.02), (50.0, 5e-4)])
def test_no_hum_is_told_where_there_is_none(hz: float, amplitude: float) -> None:
    assert hum_line(recorded(hz, amplitude)) == ""


def test_a_notch_takes_hum_out_and_leaves_the_rest() -> None:
    clean, hummed = recorded(), recorded(50.0, 0.02)
    found = notched(hummed, [50.0])
    inside = (clean.time_s > 0.3) & (clean.time_s < clean.time_s[-1] - 0.3)
    apart = found.force_n - notched(clean, [50.0]).force_n
    # A sine at the middle of the notch is gone but for the ends.
    assert np.max(np.abs(apart[inside])) < 0.02 * 0.02
    # Length and force are filtered alike: force is still 8 F0/L0 times length, to the noise.
    clean = replace(clean, force_n=0.5 + 8.0 * clean.length_change_l0)
    both = notched(clean, [50.0, 100.0])
    assert np.allclose(both.force_n - 0.5, 8.0 * both.length_change_l0, atol=1e-9)
    assert "notch at 50, 100 Hz" in both.facts.source


@pytest.mark.parametrize("hz", [49.3, 49.8, 50.9])
def test_a_notch_lies_where_hum_has_its_frequency_and_leaves_nothing_at_the_ends(hz: float) -> None:
    found = notched(recorded(hz, 0.02), [50.0])
    assert np.max(np.abs(found.force_n - notched(recorded(), [50.0]).force_n)) < 5e-4
    assert f"notch at 50 Hz, 2 Hz wide, on length and force (laid at {hz:g} Hz)" in found.facts.source
    assert hum_line(found, [50.0]) == ""


def test_hum_beside_a_notch_is_told() -> None:
    left = hum_line(notched(recorded(60.0, 0.02), [50.0]), [50.0])
    assert "hum of 60.0 Hz with an amplitude of 2 % F0; --notch 50 60 of import takes it out" in left


@pytest.mark.parametrize(("noise", "amplitude"), [(0.0, 1e-3), (5e-5, 1e-3), (2e-4, 4e-4)])
def test_an_oscillation_of_length_beside_that_of_force_is_told(noise: float, amplitude: float) -> None:
    trial = recorded(50.0, 0.01)
    wave = amplitude * np.sin(2.0 * np.pi * 50.0 * trial.time_s + 0.2)
    still = trial.length_m + noise * np.random.default_rng(3).normal(size=trial.time_s.size)
    line = hum_line(replace(trial, length_m=still + wave))
    assert f"and length has {100.0 * amplitude:.2g} % L0 at this frequency; --notch 50 of import takes out both" in line
    assert "wrong for an oscillation of length that was meant" in line
    assert "and length has" not in hum_line(replace(trial, length_m=still))


def test_a_short_record_is_not_offered_what_it_cannot_take() -> None:
    trial = xb.StretchShortenStretch(0.0383, 0.1, lead_s=0.4, hold_s=0.3).trial("soleus", 6.1, 1000.0)
    force = 0.5 + 0.02 * np.sin(2.0 * np.pi * 50.0 * trial.time_s)
    line = hum_line(replace(trial, force_time_s=trial.time_s, force_n=force))
    assert "hum of 50.0 Hz" in line
    assert "length lasts 1.05 s, and a notch of 2 Hz needs 1.5 s, so --notch of import cannot take it out" in line


def test_a_notch_has_no_phase() -> None:
    """What is symmetric about a time stays so: nothing is shifted."""
    trial = recorded()
    t = trial.time_s - trial.time_s[trial.time_s.size // 2]
    bump = np.exp(-0.5 * (t / 0.01) ** 2)
    found = notched(replace(trial, force_n=bump), [50.0]).force_n
    middle = slice(trial.time_s.size // 2 - 400, trial.time_s.size // 2 + 401)
    assert np.allclose(found[middle], found[middle][::-1], atol=1e-6)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda trial: trial, "a notch at 600 Hz needs more than 1200 samples per second; length has 1000"),
        (
            lambda trial: replace(
                trial, time_s=np.cumsum(np.r_[0.0, np.tile([1e-3, 2e-3], 5000)])[: trial.time_s.size]
            ),
            "length is not sampled evenly, which a notch needs",
        ),
    ],
)
def test_what_cannot_be_filtered_is_said(change, said) -> None:
    with pytest.raises(UserError, match=said):
        notched(change(recorded()), [600.0])


def test_a_short_record_is_refused() -> None:
    trial = xb.StretchShortenStretch(0.0, 0.0).trial("soleus", 6.1)
    with pytest.raises(UserError, match=r"lasts 0\.284 s, and a notch of 2 Hz needs 1\.5 s"):
        notched(trial, [50.0])


OPTIONS = ["--fiber", "soleus", "--pca", "6.1", "--time-column", "time_s", "--time-unit", "s", "--f0", "20 mN"]
OPTIONS += ["--length-column", "length_mm", "--length-unit", "mm", "--force-column", "force_mN", "--force-unit", "mN"]


def table(file: Path, trial: Trial) -> str:
    """The name of a table of a trial, with L0 = 30 mm."""
    rows = np.column_stack([trial.time_s, 30.0 * (1.0 + trial.length_change_l0), 20.0 * trial.force_n])
    np.savetxt(file, rows, delimiter=",", header="time_s,length_mm,force_mN", comments="")
    return str(file)


def test_l0_and_phases_are_those_of_the_length_without_its_hum(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    from xb_muscle_ros.cli.main import main

    trial = recorded(50.0, 0.02)
    hum = 3e-3 * np.sin(2.0 * np.pi * 50.0 * trial.time_s)
    file = table(tmp_path / "ramp.csv", replace(trial, length_m=trial.length_m + hum))
    assert main(["import", file, *OPTIONS, "--out", str(tmp_path / "a")]) == 0
    assert "hides its first change, so L0 is the mean of the whole record, 0.030" in capsys.readouterr().out
    (hidden,) = xb.read_trials(tmp_path / "a", tell=lambda line: None)
    assert "mean before the first change" not in hidden.facts.source
    assert "(mean of the whole record, as noise, hum or an oscillation hides" in hidden.facts.source
    assert main(["import", file, *OPTIONS, "--notch", "50", "--out", str(tmp_path / "b")]) == 0
    assert "hides" not in capsys.readouterr().out
    (found,) = xb.read_trials(tmp_path / "b", tell=lambda line: None)
    assert found.facts.reference_length_m == pytest.approx(0.03, rel=1e-4)
    assert "(mean before the first change of length)" in found.facts.source
    assert [phase.name for phase in found.facts.phases] == [phase.name for phase in trial.facts.phases]
    for phase, made in zip(found.facts.phases, trial.facts.phases, strict=True):
        assert phase.start_s == pytest.approx(made.start_s, abs=1e-3)
    assert found.facts.amplitude_l0 == pytest.approx(0.0383, abs=3e-4)


def test_import_tells_of_hum_and_takes_it_out(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    from xb_muscle_ros.cli.main import main

    trial = recorded(50.02, 0.02)
    file = table(tmp_path / "ramp.csv", trial)
    assert main(["import", file, *OPTIONS, "--out", str(tmp_path / "a")]) == 0
    assert "force has hum of 50.0 Hz with an amplitude of 2 % F0; --notch 50" in capsys.readouterr().out
    assert main(["import", file, *OPTIONS, "--notch", "50", "--out", str(tmp_path / "b")]) == 0
    assert "has hum" not in capsys.readouterr().out
    (before,) = xb.read_trials(tmp_path / "a", tell=lambda line: None)
    (after,) = xb.read_trials(tmp_path / "b", tell=lambda line: None)
    assert "notch at 50 Hz" in after.facts.source
    assert [phase.name for phase in after.facts.phases] == [phase.name for phase in before.facts.phases]
    for found, clean in zip(after.facts.phases, before.facts.phases, strict=True):
        assert found.start_s == pytest.approx(clean.start_s, abs=1e-3)
    still = after.time_s < 1.2
    assert np.std(after.measured_f0[still]) < 0.1 * np.std(before.measured_f0[still])
    assert main(["import", file, *OPTIONS, "--notch", "5000", "--out", str(tmp_path / "c")]) == 2
    assert "notch is 5000 Hz; allowed is 1 to 1000" in capsys.readouterr().err
