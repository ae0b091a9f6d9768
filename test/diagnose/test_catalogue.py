"""Candidates: every mechanism of the enumeration, where it applies, and coordinates that can hold its absence."""

from __future__ import annotations

import pytest

from xb_muscle_ros.diagnose.catalogue import CATALOGUE, applicable
from xb_muscle_ros.diagnose.names import FAMILY, MEASUREMENT, MECHANISMS, Name
from xb_muscle_ros.diagnose.study import Explanation, fibre_with
from xb_muscle_ros.measurement.faults import FAULTS
from xb_muscle_ros.models.fibre_file import load_fibre
from xb_muscle_ros.models.parameters import PARAMETERS
from xb_muscle_ros.models.registry import EXTRAS, SWAPS


def test_names_are_those_of_mechanisms_and_faults_everywhere() -> None:
    assert {n.value for n in MECHANISMS} == set(EXTRAS) | set(SWAPS)
    assert {n.value for n in MEASUREMENT} == set(FAULTS)
    assert set(FAMILY) == set(Name)
    assert set(CATALOGUE) == set(MECHANISMS)


@pytest.mark.parametrize("name", CATALOGUE)
def test_starts_lie_within_the_table_and_the_coordinates(name: Name) -> None:
    base = load_fibre("18Dec2017a", "2state")
    for start in CATALOGUE[name].starting_values(base.values):
        for parameter, value in start.items():
            row = PARAMETERS[parameter]
            assert row.lower <= value <= row.upper
        for c in CATALOGUE[name].coordinates({**{r.name: r.default or 1.0 for r in PARAMETERS.values()}, **start}):
            assert c.lower <= c.start <= c.upper
            if c.name == CATALOGUE[name].effect:
                assert c.lower <= 0.0 < c.upper
                assert not c.log


@pytest.mark.parametrize(
    ("model", "absent"),
    [
        ("3state_coop", {"series_compliance", "thin_filament_cooperativity", "thick_filament_cooperativity"}),
        ("2state_coop", {"series_compliance", "thin_filament_cooperativity", "strain_recruited_heads",
                         "persistent_thick_filament"}),
        ("2state_rigid", {"strain_recruited_heads", "persistent_thick_filament"}),
        ("4state_coop", {"series_compliance", "thin_filament_cooperativity", "thick_filament_cooperativity",
                         "forcible_detachment"}),
    ],
)  # fmt: skip
def test_what_a_model_has_already_is_no_candidate(model: str, absent: set[str]) -> None:
    assert {n.value for n in MECHANISMS} - {e.name.value for e in applicable(model)} == absent


@pytest.mark.parametrize("entry", applicable("2state"), ids=lambda e: e.name.value)
def test_a_fibre_takes_each_of_its_candidates(entry: object) -> None:
    from xb_muscle_ros.diagnose.catalogue import Entry

    assert isinstance(entry, Entry)
    fibre = fibre_with(load_fibre("18Dec2017a", "2state"), (entry.name,), {})
    assert fibre.model == f"2state+{entry.name.value}"
    assert set(entry.parameters) <= set(fibre.values)


def test_explanations_grow_and_shrink() -> None:
    one = Explanation().plus(Name.VISCOUS_DRAG)
    both = one.plus(Name.PCA_SHIFT)
    assert both.label == "viscous_drag + pca_shift"
    assert both.mechanisms == (Name.VISCOUS_DRAG,)
    assert both.faults == (Name.PCA_SHIFT,)
    assert both.without(Name.PCA_SHIFT) == one
    assert Explanation().label == "base"
