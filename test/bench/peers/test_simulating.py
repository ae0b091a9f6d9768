"""Tables and scores of muscles of which everything is known."""

from __future__ import annotations

import numpy as np
import pytest
from made_muscles import Forgetful, Spring, peer

from xb_muscle_ros.bench.peers.conditions import Path
from xb_muscle_ros.bench.peers.muscle import Free
from xb_muscle_ros.bench.peers.scoring import mean_srs, score_of
from xb_muscle_ros.bench.peers.simulating import simulate
from xb_muscle_ros.errors import UserError
from xb_muscle_ros.evaluate.srs_table import SrsTable
from xb_muscle_ros.scores.conditions import CONDITIONS
from xb_muscle_ros.trials.trial import Array

STIFFNESS = Free("stiffness", "stiffness", 1.0, 200.0)


def test_a_spring_has_relative_srs_of_one_everywhere(measured: SrsTable) -> None:
    """The measured table has one half over large reductions at all levels, and one elsewhere."""
    found = simulate(peer(), measured, ["a", "b"])
    table = found.table.relative("mean", "conditioning").centre
    np.testing.assert_allclose(table[np.isfinite(table)], 1.0)
    score = score_of(found.table, measured)
    assert score.relative["released"]["large"] == pytest.approx(0.5)
    assert score.relative["released"]["small"] == pytest.approx(0.0, abs=1e-12)
    assert score.relative["text"]["large"] == pytest.approx(0.5)


def test_unconditioned_srs_and_isometric_force_are_scored_by_fibre_and_pca(measured: SrsTable) -> None:
    """A spring of 10 F0/L0 at full activation where the fibres have 30 times their force."""
    score = score_of(simulate(peer(), measured, ["a", "b"]).table, measured)
    force = np.array([0.9, 0.5, 0.2, 0.02, 0.81, 0.45, 0.18, 0.018])
    assert score.unconditioned == pytest.approx(np.sqrt(np.mean(((10.0 / 0.98 - 30.0) * force) ** 2)), rel=1e-5)
    assert score.isometric == pytest.approx(0.0, abs=1e-6)


def test_what_halves_its_stiffness_after_any_stretch_is_wrong_over_small_ones(measured: SrsTable) -> None:
    """Fitted to 30 times isometric force, right over large reductions."""
    found = simulate(peer(Forgetful, (STIFFNESS,)), measured, ["a", "b"])
    assert found.values["a"]["stiffness"] == pytest.approx(0.98 * 30.0, rel=1e-3)
    score = score_of(found.table, measured)
    assert score.relative["released"]["large"] == pytest.approx(0.0, abs=1e-4)
    assert score.srs["large"] == pytest.approx(0.0, abs=1e-2)
    assert score.relative["released"]["small"] == pytest.approx(0.5 * np.sqrt(9.0 / 18.0), rel=1e-3)
    # High, intermediate, low, passive: the last of three amplitudes is right.
    assert mean_srs(measured)[3, 0] == pytest.approx(30.0 * 0.855)


def test_every_condition_is_sent_once_at_each_pca_that_was_measured(measured: SrsTable) -> None:
    """No condition of no isometric force; the reference stands for all recovery times."""
    measured.fibres["a"].isometric[1] = np.nan
    made: list[Spring] = []

    class Kept(Spring):
        def __init__(self, values: dict[str, float]) -> None:
            super().__init__(values)
            made.append(self)

    table = simulate(peer(Kept), measured, ["a"]).table
    assert [len(muscle.sent) for muscle in made] == [3 * len(CONDITIONS)]
    assert np.isnan(table.fibres["a"].test[1]).all()
    assert np.isfinite(table.fibres["a"].test[[0, 2, 3]]).all()


def test_a_trial_that_cannot_be_integrated_is_left_out_and_told(measured: SrsTable) -> None:
    """Its condition has no value; all others have theirs."""

    class Failing(Spring):
        def force_f0(self, activation: float, path: Path) -> Array:
            if path.corner_l0.max() > 0.03:
                raise UserError("made failure")
            return super().force_f0(activation, path)

    found = simulate(peer(Failing), measured, ["a"])
    assert len(found.problems) == 4 * 5
    assert found.problems[0] == "fibre a, pCa 4.5, amplitude 0.0383 L0, recovery 0.001 s: made failure"
    assert np.isnan(found.table.fibres["a"].test[:, :, -1]).all()
    assert np.isfinite(found.table.fibres["a"].test[:, :, :-1]).all()
