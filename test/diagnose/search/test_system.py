"""The fit of any set: which coordinates it has, where they start, and what is left out with a trial."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from made_trials import given_fibre

from xb_muscle_ros.diagnose.names import Name
from xb_muscle_ros.diagnose.search.system import BEYOND, System, label, ordered
from xb_muscle_ros.fit.features import F0_ANCHOR
from xb_muscle_ros.measurement.artefacts import ARTEFACTS, ORDINARY
from xb_muscle_ros.models.catalogue import CATALOGUE


def labels(system: System, *names: Name) -> dict[str, object]:
    return {c.label: c for c in system.problem(names, {}).coordinates}


def test_the_base_has_its_parameters_and_ordinary_errors(system: System) -> None:
    found = labels(system)
    own = {c.split("[")[0] for c in found}
    assert {"f", "k11", "k21", "kon", "koop", "kse"} <= own
    assert set(ORDINARY) <= own
    assert not own & {"drag", "titin_stiffness", "force_drift", "transducer_lag"}
    # One offset for each trial, one pCa for each solution, one gain for all.
    assert sum(c.startswith("force_offset[") for c in found) == 2
    assert sum(c.startswith("pca_shift[") for c in found) == 2
    assert "length_gain" in found


@pytest.mark.parametrize("name", [Name.PCA_SHIFT, Name.TIME_SHIFT, Name.FORCE_DRIFT])
def test_a_named_artefact_may_be_larger(name: Name, system: System) -> None:
    for c in system.problem((name,), {}).coordinates:
        if c.group is not None:
            wider = BEYOND if c.name == name else 1.0
            assert c.prior_sd == pytest.approx(wider * ARTEFACTS[c.name].sd), c.label


@pytest.mark.parametrize("name", [Name.VISCOUS_DRAG, Name.ACTIVE_TITIN, Name.FORCIBLE_DETACHMENT])
def test_a_mechanism_brings_what_its_catalogue_fits(name: Name, system: System) -> None:
    entry = CATALOGUE[name]
    found = {c.label: c for c in system.problem((name,), {}).coordinates}
    assert set(entry.parameters) <= set(found)
    assert set(found) - set(entry.parameters) == set(labels(system))
    effect = found[str(entry.effect)]
    assert effect.start == entry.starting_values(system.fibre.values)[0][effect.name]
    assert (effect.prior_mean, effect.prior_sd) == (0.0, entry.size)


def test_a_frame_s_mechanism_is_fitted_in_its_own_model() -> None:
    system = System(given_fibre("2state"), (), np.empty(0), 1e-3)
    problem = system.problem((Name.THIN_FILAMENT_COOPERATIVITY, Name.THICK_FILAMENT_COOPERATIVITY), {})
    assert problem.fibre.model.startswith("2state+thin_filament_cooperativity+")
    assert problem.fibre.values["J2"] > 0.0
    assert {"kon", "koff", "koop", "JF"} <= {c.name for c in problem.coordinates}
    assert system.problem((), {}).fibre.values["J2"] == 0.0


def test_values_are_kept_within_bounds_and_of_others_left_alone(system: System) -> None:
    problem = system.problem((Name.VISCOUS_DRAG,), {"drag": 1e6, "f": 88.0, "titin_stiffness": 5.0})
    start = {c.label: c for c in problem.coordinates}
    assert start["drag"].start == start["drag"].upper < 1e6
    assert start["f"].start == 88.0
    assert problem.fibre_at(problem.start).values["titin_stiffness"] == 0.0


def test_a_trial_left_out_takes_its_weights_along(system: System) -> None:
    first, second = system.trials
    rest = system.without({first.name})
    assert rest.trials == (second,)
    assert np.array_equal(rest.weights, system.weights[first.measured_f0.size :])
    assert np.array_equal(rest.measured, second.measured_f0)
    assert system.without(set()).weights.size == system.weights.size
    # The first one's isometric force is the unit of force, whether it is there or not.
    assert rest.features == (F0_ANCHOR,)
    assert system.without({second.name}).features == system.features == ()


def test_what_the_gaussian_form_leaves_out_is_added_everywhere(system: System) -> None:
    extra = {t.name: np.full(t.time_s.size, 0.01) for t in system.trials}
    plain, closed = system.problem((), {}), replace(system, closure_f0=extra).problem((), {})
    for a, b in zip(plain.predicted(plain.start), closed.predicted(closed.start), strict=True):
        assert b - a == pytest.approx(0.01, abs=1e-9)


def test_names_of_a_set_have_one_order_and_one_label() -> None:
    names = [Name.PCA_SHIFT, Name.VISCOUS_DRAG, Name.PCA_SHIFT]
    assert ordered(names) == (Name.VISCOUS_DRAG, Name.PCA_SHIFT)
    assert label(names) == "viscous_drag + pca_shift"
    assert label(()) == "base"
