"""Isometric force and the unconditioned stretch are made equal."""

from __future__ import annotations

import numpy as np
import pytest
from made_muscles import Spring, peer

from xb_muscle_ros.bench.peers.matching import Target, activation_for, activations, at_bound, fitted, unconditioned_srs
from xb_muscle_ros.bench.peers.muscle import Free, loosest
from xb_muscle_ros.errors import UserError

STIFFNESS = Free("stiffness", "stiffness", 1.0, 100.0)


def test_activation_gives_the_isometric_force_or_is_the_nearest_allowed() -> None:
    """0.98 F0 times activation, from 0.01 to 1."""
    muscle = Spring({})
    assert activation_for(muscle, 0.49) == pytest.approx(0.5, abs=1e-6)
    assert activation_for(muscle, 0.0) == 0.01
    assert activation_for(muscle, 1.0) == 1.0


def test_nothing_is_sent_where_nothing_was_measured() -> None:
    """Levels of pCa without isometric force stay without."""
    muscle = Spring({})
    at = activations(muscle, Target(np.array([0.49, np.nan]), np.array([10.0, np.nan])))
    np.testing.assert_allclose(at, [0.5, np.nan], atol=1e-6)
    np.testing.assert_allclose(unconditioned_srs(muscle, at), [5.0, np.nan], atol=1e-5)
    assert len(muscle.sent) == 1


def test_the_stiffness_that_made_the_srs_is_found() -> None:
    """Least squares on SRS of 37 F0/L0 times activation; isometric force is matched too."""
    force = np.array([0.98, 0.49, 0.098, np.nan])
    found = fitted(peer(free=(STIFFNESS,)), Target(force, 37.0 * force / 0.98))
    assert found["stiffness"] == pytest.approx(37.0, rel=1e-3)
    assert at_bound(peer(free=(STIFFNESS,)), found) == []


def test_a_value_at_its_bound_is_known() -> None:
    """SRS that no allowed stiffness gives."""
    force = np.array([0.98, 0.49])
    found = fitted(peer(free=(STIFFNESS,)), Target(force, 1000.0 * force))
    assert at_bound(peer(free=(STIFFNESS,)), found) == ["stiffness"]


def test_too_little_to_fit_to_is_refused() -> None:
    """One line with what is there and what is needed."""
    with pytest.raises(UserError, match=r"known at 0 pCa; 1 are needed to fit stiffness"):
        fitted(peer(free=(STIFFNESS,)), Target(np.array([0.5]), np.array([np.nan])))


def test_nothing_free_is_nothing_fitted() -> None:
    """No trial is run."""
    assert fitted(peer(), Target(np.array([0.5]), np.array([10.0]))) == {}


def test_the_loosest_accuracy_is_one_below_which_all_are_accurate() -> None:
    """1e-3 F0; a lucky loose one does not count."""
    assert loosest({1e-3: 1e-4, 1e-4: 0.01, 1e-5: 9e-4, 1e-6: 1e-5}) == 1e-5
    assert loosest({1e-3: 1.0, 1e-4: 0.5}) == 1e-4
