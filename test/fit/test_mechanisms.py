"""Mechanisms put into a model by its name are fitted, start where the catalogue says, and are never left out unsaid."""

from __future__ import annotations

import json
from dataclasses import replace
from types import MappingProxyType

import numpy as np
import pytest

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.fit.coordinates import FITTED, Choice, free_names, parameter_coordinates
from xb_muscle_ros.fit.data import fit_trials
from xb_muscle_ros.fit.problem import Problem
from xb_muscle_ros.fit.report import as_json
from xb_muscle_ros.fit.run import Settings, _starts, fit
from xb_muscle_ros.fit.start import begun, held, null_lines, start_lines
from xb_muscle_ros.fit.table import table
from xb_muscle_ros.models.catalogue import CATALOGUE, without_effect_line
from xb_muscle_ros.models.fibre_file import Fibre, borrowed_line, changed, load_fibre
from xb_muscle_ros.models.muscle import Muscle
from xb_muscle_ros.models.registry import EXTRAS, SWAPS
from xb_muscle_ros.simulation.made import made
from xb_muscle_ros.trials.protocol import StretchShortenStretch
from xb_muscle_ros.work import Options

HERE = Options(processes=0, quiet=True)
# Models that have the other form of the block, or nothing in its place.
BASES = {
    "series_compliance": "2state_rigid",
    "thin_filament_cooperativity": "2state",
    "thick_filament_cooperativity": "2state",
}


def loaded(mechanism: str) -> Fibre:
    model = f"{BASES.get(mechanism, '3state_coop')}+{mechanism}"
    return changed(load_fibre("18Dec2017a", model, for_fit=True), {"smoothing": 0.0}, "test")


def test_the_catalogue_has_every_mechanism_of_the_registry() -> None:
    assert set(CATALOGUE) == {name for name, extra in EXTRAS.items() if not extra.geometry} | set(SWAPS)


def test_geometry_moves_only_where_it_is_asked_for() -> None:
    model = "3state_coop_slack+active_force_length+passive_force_length+viscous_drag"
    fibre = load_fibre("18Dec2017a", model, for_fit=True)
    names = free_names(fibre, None, (), {})
    assert "drag" in names
    assert not {"fl_min", "fl_max", "fl_optimum", "fp_max"} & set(names)
    assert begun(fibre, None, (), {}).values["fp_max"] == 1.3
    coordinates = parameter_coordinates(fibre, ["f", "fl_optimum"], (), {}, {})
    assert [c.name for c in coordinates] == ["f", "fl_optimum"]


@pytest.mark.slow
@pytest.mark.parametrize("mechanism", CATALOGUE)
def test_a_mechanism_is_fitted_away_from_its_start_on_a_trial_made_with_it(mechanism: str) -> None:
    entry, given = CATALOGUE[mechanism], loaded(mechanism)
    fixed = [n for n in FITTED if n in given.values and n not in entry.parameters]
    start = begun(given, None, fixed, {})
    coordinates = parameter_coordinates(start, None, fixed, {}, {})
    assert {c.name for c in coordinates} == set(entry.parameters)
    main = entry.effect or next(iter(entry.shape))
    truth = changed(start, {main: 1.5 * start.values[main]}, "test")
    random, muscle = np.random.default_rng(1), Muscle(truth)
    trials = [made(muscle, StretchShortenStretch(0.0383, 0.1).trial("made", pca), random) for pca in (4.5, 6.1)]
    found = fit(Problem(start, fit_trials(trials, [False] * 2), coordinates, {}), Settings(1, level=None), HERE)
    report = as_json(found, {})
    assert report["train_rmsd_f0"] < min(2e-3, report["before"]["train_rmsd_f0"])
    if entry.effect is not None:
        fitted = next(row for row in report["parameters"] if row["name"] == entry.effect)
        # Not at its null, by far: its own standard deviation says so.
        assert abs(fitted["value"]) > 2.0 * fitted["sd"] > 0.0


def test_defaults_are_the_papers_and_the_mechanisms_own() -> None:
    fibre = load_fibre("18Dec2017a", "3state_coop+viscous_drag+active_titin", for_fit=True)
    names = free_names(fibre, None, (), {})
    assert set(CATALOGUE["active_titin"].parameters) | {"drag", "f", "kse"} < set(names)
    start = begun(fibre, None, (), {})
    assert start.values["drag"] == 0.01
    assert start.values["titin_stiffness"] == 1.0
    assert start_lines(start)[0] == (
        "viscous_drag has no fitted values in the fibre file; starts from the catalogue's: drag 0.01"
    )
    # What the file or the user says stays.
    assert begun(changed(fibre, {"drag": 0.3}, "t"), None, (), {}).values["drag"] == 0.3
    assert begun(fibre, None, (), {}, ["drag"]).values["drag"] == 0.0


def test_a_mechanism_that_is_not_free_stays_at_its_null_and_that_is_said() -> None:
    fibre = load_fibre("18Dec2017a", "3state_coop+viscous_drag", for_fit=True)
    start = begun(fibre, ["f"], (), {})
    assert start.values["drag"] == 0.0
    problem = Problem(start, (), parameter_coordinates(start, ["f"], (), {}, {}), {})
    assert held(problem)["drag"] == 0.0
    (line,) = null_lines(problem)
    assert "viscous_drag is at its null value (drag 0) and not fitted, its effect is exactly zero" in line


def test_a_block_without_a_set_starts_from_the_catalogue_and_goes_nowhere_else() -> None:
    with pytest.raises(UserError, match="needs parameter 'JF'"):
        load_fibre("18Dec2017a", "2state+thick_filament_cooperativity")
    base = load_fibre("18Dec2017a", "2state")
    fibre = load_fibre("18Dec2017a", "2state+thick_filament_cooperativity", for_fit=True)
    assert (fibre.values["JF"], fibre.values["f"]) == (30.0, 2.0 * base.values["f"])
    (line,) = start_lines(fibre)
    assert "JF 30" in line
    assert "f 100" in line
    # The base's sigmoid tells where a cooperative filament may start.
    kappa = base.values["kappa"]
    thin = load_fibre("18Dec2017a", "2state+thin_filament_cooperativity", for_fit=True)
    assert thin.values["kon"] == pytest.approx(80.0 * 0.7 / kappa)


def test_starts_go_round_the_catalogues() -> None:
    fibre = begun(loaded("passive_viscoelasticity"), ["pv_stiffness", "pv_tau"], (), {})
    coordinates = parameter_coordinates(fibre, ["pv_stiffness", "pv_tau"], (), {}, {})
    tau = coordinates[1]
    assert tau.others == (0.03, 0.2, 1.0)
    assert tau.lower < 0.005 < 1.0 < tau.upper
    # The prior favours none of them.
    assert tau.prior_mean == pytest.approx(np.mean(np.log([0.005, 0.03, 0.2, 1.0])))
    fifth = _starts(Problem(fibre, (), coordinates, {}), Settings(400))
    medians = [np.exp(np.median([z[1] for z in fifth[k::4]])) for k in range(4)]
    np.testing.assert_allclose(medians, [0.005, 0.03, 0.2, 1.0], rtol=0.35)


def test_coordinates_of_mechanisms_survive_the_way_to_a_worker() -> None:
    fibre = begun(loaded("passive_viscoelasticity"), None, (), {})
    problem = Problem(fibre, (), parameter_coordinates(fibre, None, (), {}, {}), {})
    assert Problem.from_json(json.loads(json.dumps(problem.to_json()))).coordinates == problem.coordinates


def test_bounds_and_priors_of_a_mechanism_can_be_chosen() -> None:
    fibre = begun(loaded("viscous_drag"), ["drag"], (), {})
    choice = Choice(lower=0.001, upper=2.0, prior_mean=0.02, prior_sd=0.5)
    (drag,) = parameter_coordinates(fibre, ["drag"], (), {}, {"drag": choice})
    assert (drag.lower, drag.upper, drag.prior_mean, drag.prior_sd, drag.log) == (0.001, 2.0, 0.02, 0.5, False)
    # A value beyond the catalogue's reach is one all the same.
    (far,) = parameter_coordinates(changed(fibre, {"drag": 5.0}, "t"), ["drag"], (), {}, {})
    assert (far.start, far.upper) == (5.0, 10.0)
    with pytest.raises(UserError, match="'k11' has a bound or prior but is not fitted"):
        parameter_coordinates(fibre, ["f"], (), {}, {"k11": Choice(lower=1.0)})


def test_a_parameter_without_effect_is_named(problem: Problem) -> None:
    """A rate of a mechanism that is off, and a steepness of smooth functions that are not used."""
    model = f"{problem.fibre.model}+passive_viscoelasticity"
    off = {"pv_stiffness": 0.0, "pv_tau": 0.1, "pv_ratio": 0.5}
    fibre = replace(problem.fibre, model=model, values=MappingProxyType({**problem.fibre.values, **off}))
    coordinates = parameter_coordinates(fibre, ["f", "pv_tau"], (), {}, {})
    found = as_json(fit(replace(problem, fibre=fibre, coordinates=coordinates), Settings(1), HERE), {})
    assert any(line.startswith("pv_tau has no effect on what is fitted") for line in found["warnings"])
    assert any(line.startswith("passive_viscoelasticity is at its null value") for line in found["warnings"])
    assert found["held"]["pv_ratio"] == 0.5
    text = table(found)
    assert "held at their values: " in text
    assert "pv_ratio 0.5" in text
    assert "taken as absent: pca_shift, " in text


def test_lines_on_what_a_fibre_lacks() -> None:
    fibre = load_fibre("18Dec2017a", "3state_coop+viscous_drag+phosphate")
    line = without_effect_line(fibre.model, fibre.values)
    assert line.startswith("viscous_drag and phosphate are at their null values, their effects are exactly zero")
    one = changed(fibre, {"drag": 0.1}, "test")
    assert without_effect_line(one.model, one.values) == (
        "phosphate is at its null value, its effect is exactly zero; fit it or give --set phosphate_detachment=VALUE"
    )
    assert borrowed_line(fibre) == ""
    assert "that of 3state_coop is used" in borrowed_line(load_fibre("18Dec2017a", "3state_coop_rigid"))


def test_the_shape_of_a_soft_parallel_spring_is_fitted_where_a_model_has_one() -> None:
    shape = {"lpe0", "pe_sharpness"}
    assert shape <= set(free_names(load_fibre("18Dec2017a", "3state_coop_softplus"), None, (), {}))
    assert not shape & set(free_names(load_fibre("18Dec2017a", "3state_coop"), None, (), {}))
