"""k_tr put in comes out, of recordings without settings as well."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import xb_muscle_ros as xb
from xb_muscle_ros.protocols.base import settings_of
from xb_muscle_ros.protocols.registry import PROTOCOLS
from xb_muscle_ros.trials.trial import Trial


def recorded(k_per_s: float, pca: float, seed: int = 1) -> Trial:
    protocol = PROTOCOLS["ktr"]
    (planned,) = protocol.plan("made", settings_of(protocol, {"pca": pca}))
    trial = planned.trial
    end_s = next(phase.end_s for phase in trial.facts.phases if phase.name == "stretch")
    since = np.maximum(trial.time_s - end_s, 0.0)
    force = np.where(trial.time_s < 0.1, 0.8, 0.8 - 0.7 * np.exp(-k_per_s * since))
    force = force + 1e-3 * np.random.default_rng(seed).normal(size=force.size)
    return replace(
        trial, facts=replace(trial.facts, protocol="", settings=()), force_time_s=trial.time_s, force_n=force
    )


def test_rates_put_in_come_out() -> None:
    put_in = {4.5: 6.0, 6.1: 2.0, 6.4: 1.2}
    trials = [recorded(k, pca) for pca, k in put_in.items()]
    (found,) = xb.analyse_protocol("ktr", trials, tell=lambda line: None).results
    for k, row in zip(put_in.values(), found.rows, strict=True):
        rate = row["k_tr_per_s"]
        assert rate.value == pytest.approx(k, rel=0.01)
        assert rate.se is not None
        assert abs(rate.value - k) < 4.0 * rate.se
    assert found.numbers["highest_per_s"].value == pytest.approx(6.0, rel=0.01)
    assert found.numbers["lowest_per_s"].value == pytest.approx(1.2, rel=0.01)


def test_a_two_state_model_redevelops_as_fast_at_rest_as_its_rates_say() -> None:
    """With attachment f and detachment g at no strain alone, Q0 relaxes with f + g: the slack model's k_tr is near."""
    found = xb.run_protocol("ktr", "18Dec2017a", pca=[4.5, 6.0, 6.2], tell=lambda line: None)
    rates = found.results[0].column("k_tr_per_s")
    assert np.all(np.isfinite(rates))
    assert np.all(np.diff(rates) < 0.0)  # the cooperative set redevelops more slowly at lower calcium
    assert all(row["k_tr_per_s"].se is None for row in found.results[0].rows)


def test_a_trial_without_release_is_a_note() -> None:
    made = xb.simulate("18Dec2017a", amplitude=0.0383, as_measured=True)
    (found,) = xb.analyse_protocol("ktr", made, tell=lambda line: None).results
    assert found.rows[0]["k_tr_per_s"].value is None
    assert "no release by 5 % L0" in found.notes[0]


def test_what_comes_back_is_read_before_the_fibre_moves_again() -> None:
    """Regression: a stretch late in the record, and the force after it, counted as force that came back."""
    trial = recorded(6.0, 4.5)
    late = trial.time_s > 4.0
    moved = replace(trial, length_m=trial.length_m + 0.05 * late, force_n=trial.force_n + 0.6 * late)
    (found,) = xb.analyse_protocol("ktr", [moved], tell=lambda line: None).results
    back = found.rows[0]["redeveloped"]
    assert back.value == pytest.approx(1.0, abs=0.002)
    assert 0.0 < back.se < 0.01
    assert found.rows[0]["k_tr_per_s"].value == pytest.approx(6.0, rel=0.01)


@pytest.mark.parametrize(
    ("step_l0", "line"),
    [
        (-0.20, "the fibre is released 2 times, at 0.101, 0.23 s; k_tr is that of one release"),
        (0.03, "force is followed for 0.1"),
    ],
)
def test_a_second_movement_is_named(step_l0: float, line: str) -> None:
    """Regression: force was said to be followed for a short time, or no release to be taken back, and no more."""
    trial = recorded(6.0, 4.5)
    again = (trial.time_s >= 0.23) & (trial.time_s < 0.26)
    moved = replace(trial, length_m=trial.length_m + step_l0 * again)
    told: list[str] = []
    (found,) = xb.analyse_protocol("ktr", [moved], tell=told.append).results
    assert found.rows[0]["k_tr_per_s"].value is None
    (said,) = (each for each in told if "k_tr, of trial" in each)
    assert line in said
    assert step_l0 < 0.0 or "(length moves again at 0.229 s)" in said


def test_measured_fibre(shared_data: Path, repo_root: Path, tmp_path: Path) -> None:
    """Of ACB11, 15 °C: 5.5 ± 0.3 1/s at pCa 4.5 and 1.27 at pCa 6.6, as `evaluate` finds."""
    from xb_muscle_ros.cli.main import main

    files = sorted((shared_data / "recordings" / "rat_soleus_ktr" / "ACB11").glob("*.slc"))
    wanted = [str(file) for file in files if file.name[:2] in ("45", "66")]
    mapping = str(repo_root / "scripts" / "datasets" / "rat_soleus_ktr.yaml")
    assert main(["import", "--mapping", mapping, *wanted, "--out", str(tmp_path / "bags")]) == 0
    (found,) = xb.analyse_protocol("ktr", tmp_path / "bags", tell=lambda line: None).results
    by_pca = {row["pca"]: row["k_tr_per_s"] for row in found.rows}
    assert by_pca[4.5].value == pytest.approx(5.5, abs=0.1)
    assert by_pca[6.6].value == pytest.approx(1.27, abs=0.02)


def test_the_error_of_k_tr_does_not_grow_as_noise_falls() -> None:
    """What one exponential misses was taken for noise that is never forgotten: 7 ± 8 1/s without any noise."""
    made = xb.run_protocol("ktr", "18Dec2017a", pca=[4.5, 6.1], as_measured=True, tell=lambda line: None)
    (found,) = xb.analyse_protocol("ktr", made, tell=lambda line: None).results
    assert np.all(found.errors("k_tr_per_s") < 0.1)
    (trial, _), values, errors = made.trials, [], []
    for seed in range(10):
        noise = 1e-2 * np.random.default_rng(seed).standard_normal(trial.force_n.size)
        (one,) = xb.analyse_protocol(
            "ktr", [replace(trial, force_n=trial.force_n + noise)], tell=lambda _: None
        ).results
        values.append(one.column("k_tr_per_s")[0])
        errors.append(one.errors("k_tr_per_s")[0])
    assert 0.8 * np.std(values) < np.median(errors) < 5.0 * np.std(values)


def test_the_ends_of_k_tr_have_their_pca() -> None:
    (found,) = xb.run_protocol("ktr", "18Dec2017a", pca=[4.5, 6.1, 6.3], tell=lambda line: None).results
    assert (found.numbers["highest_at_pca"].value, found.numbers["lowest_at_pca"].value) == (4.5, 6.3)
