"""Hill's equation put in comes out."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import xb_muscle_ros as xb
from xb_muscle_ros.protocols.base import MEASURED, Run
from xb_muscle_ros.protocols.registry import PROTOCOLS
from xb_muscle_ros.trials.trial import Trial, TrialFacts

PCAS = (4.5, 5.4, 5.8, 6.0, 6.2, 6.4, 6.8, 7.5, 9.0)


def recorded(pca: float, force_f0: float, random: np.random.Generator | None = None) -> Trial:
    time_s = np.arange(2000) / 1000.0
    noise = np.zeros(time_s.size) if random is None else 1e-3 * random.normal(size=time_s.size)
    facts = TrialFacts("made", f"pca{pca:g}", pca=pca, phases=(xb.Phase("isometric", 0.0, float(time_s[-1])),))
    return Trial(
        facts, time_s, np.ones(time_s.size), np.zeros(1), np.array([10.0 ** (6.0 - pca)]), time_s, force_f0 + noise
    )


def curve(pca: float, pca50: float, n: float, passive: float = 0.02, maximal: float = 1.0) -> float:
    return passive + (maximal - passive) / (1.0 + 10.0 ** (n * (pca - pca50)))


def test_the_hill_model_has_the_pca50_of_its_parameters() -> None:
    """Activation is act_max·Ca^n/(kappa^n + Ca^n), and force follows it: pCa50 = 6 - log10(kappa)."""
    fibre = xb.load_fibre("18Dec2017a", model="hill")
    found = xb.run_protocol("force-pca", fibre, tell=lambda line: None)
    numbers = found.results[0].numbers
    assert numbers["pca50"].value == pytest.approx(6.0 - np.log10(fibre.values["kappa"]), abs=0.01)
    assert numbers["n_hill"].value == pytest.approx(fibre.values["n"], rel=0.03)


@pytest.mark.parametrize(("pca50", "n"), [(6.1, 2.7), (5.7, 1.4), (6.3, 5.0)])
def test_what_is_put_in_comes_out(pca50: float, n: float) -> None:
    trials = [recorded(pca, curve(pca, pca50, n), np.random.default_rng(1)) for pca in PCAS]
    (found,) = xb.analyse_protocol("force-pca", trials, tell=lambda line: None).results
    assert found.of == MEASURED
    numbers = found.numbers
    assert numbers["pca50"].value == pytest.approx(pca50, abs=0.01)
    assert numbers["n_hill"].value == pytest.approx(n, rel=0.02)
    assert numbers["maximal_f0"].value == pytest.approx(1.0, abs=0.005)
    assert all(row["force_f0"].se is not None for row in found.rows)


def test_intervals_hold_what_was_put_in_as_often_as_they_say() -> None:
    """Points that scatter by 2 % F0: of 200 made fibres 95 % should have their pCa50 within."""
    random = np.random.default_rng(3)
    inside = 0
    for _ in range(200):
        scattered = [curve(pca, 6.1, 2.5) + 0.02 * random.normal() for pca in PCAS]
        trials = [recorded(pca, force) for pca, force in zip(PCAS, scattered, strict=True)]
        runs = [Run(trial, trial.force_time_s, trial.measured_f0) for trial in trials]
        pca50 = PROTOCOLS["force-pca"].analyse("made", MEASURED, runs).numbers["pca50"]
        assert pca50.low is not None
        assert pca50.high is not None
        inside += pca50.low <= 6.1 <= pca50.high
    assert 180 <= inside <= 198  # 190 expected, within 3 SD of a binomial


def test_too_few_levels_are_a_note_and_no_number() -> None:
    found = xb.run_protocol("force-pca", "18Dec2017a", pca=[4.5, 6.1, 9.0], tell=lambda line: None)
    assert found.results[0].numbers["pca50"].value is None
    assert "isometric force is known at 3 levels of pCa; 5 are needed" in found.warnings[-1]


@pytest.mark.parametrize(
    ("model", "pca"), [("2state", [4.0, 4.5, 5.0, 5.2, 5.4, 5.6]), ("3state_coop", [6.5, 7.0, 7.5, 8.0, 8.5, 9.0])]
)
def test_a_pca50_at_the_end_of_the_levels_is_none(model: str, pca: list[float]) -> None:
    told: list[str] = []
    (found,) = xb.run_protocol("force-pca", "18Dec2017a", model=model, pca=pca, tell=told.append).results
    assert found.numbers["pca50"].value is None
    assert any("lies beyond the levels of pCa" in line for line in told)


def test_force_that_still_rises_is_told() -> None:
    told: list[str] = []
    trials = []
    for pca in PCAS:
        made = recorded(pca, curve(pca, 6.1, 2.7))
        trials.append(replace(made, force_n=made.force_n * (1.0 - np.exp(-made.force_time_s / 0.5))))
    (found,) = xb.analyse_protocol("force-pca", trials, tell=told.append).results
    assert found.numbers["maximal_f0"].value == pytest.approx(0.94, abs=0.02)
    assert any("isometric force, of trial pca4.5" in line and "has not settled at first" in line for line in told)
