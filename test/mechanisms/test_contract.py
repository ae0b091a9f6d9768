"""What holds for every mechanism: it is complete, says itself in words, and is exactly nothing where it is absent."""

from __future__ import annotations

import re

import pytest

from xb_muscle_ros.distribution.gaussian import Gaussian
from xb_muscle_ros.mechanisms import Family, Parameter, State, discovery
from xb_muscle_ros.models import checking, registry
from xb_muscle_ros.models.catalogue import CATALOGUE, mechanisms_of
from xb_muscle_ros.models.registry import BLOCKS, EXTRAS, SWAPS

UNITS = {"1", "s", "K", "N", "m"} | {"L0", "F0", "µM", "power strokes", "power strokes²", "power stroke"}
ALL = {**SWAPS, **EXTRAS}
# How a muscle is built: no diagnosis looks for it, and it has no entry.
GEOMETRY = {name for name, extra in EXTRAS.items() if extra.geometry}


def test_every_mechanism_is_in_the_catalogue_with_its_words() -> None:
    assert set(CATALOGUE) == set(ALL) - GEOMETRY
    assert {b.name for b in BLOCKS if b.family is Family.EXTRA and b.entry is None} == GEOMETRY
    titles = [entry.title for entry in CATALOGUE.values()]
    assert len(set(titles)) == len(titles)
    for entry in CATALOGUE.values():
        assert entry.title
        assert entry.meaning
        assert not entry.meaning.endswith(".")
        assert re.fullmatch("[a-z_]+", entry.family)


def test_everything_of_this_package_is_complete() -> None:
    checking.refuse_incomplete(BLOCKS)


@pytest.mark.parametrize("block", BLOCKS, ids=lambda block: f"{block.family.value}-{block.name}")
def test_units_are_those_of_the_field(block: discovery.Block) -> None:
    rows: list[Parameter | State] = [*block.parameters, *block.states]
    for row in rows:
        parts = [part for part in re.split(r"[/() ]+(?!strokes?)", row.unit) if part]
        assert set(parts) <= UNITS, row.name


@pytest.mark.parametrize("name", ALL)
def test_no_mechanism_is_refused_and_its_null_is_null(name: str) -> None:
    """The check that mechanisms from outside go through; frames have another model for a null."""
    registry._refuse_wrong(name, ALL[name])


def test_geometry_is_what_is_measured_and_not_missing() -> None:
    assert {"active_force_length", "passive_force_length"} == GEOMETRY
    model = "3state_coop_slack+active_force_length+viscous_drag"
    assert [entry.name for entry in mechanisms_of(model)] == ["viscous_drag"]


@pytest.mark.parametrize("name", CATALOGUE)
def test_every_mechanism_can_be_absent_or_is_a_frame(name: str) -> None:
    entry = CATALOGUE[name]
    assert entry.frame != bool(entry.absent) or name == "half_sarcomere_spread"
    assert registry.compose("2state_rigid" if name in SWAPS else "3state_coop").name
    if entry.effect is not None:
        assert entry.absent[entry.effect] == 0.0
    assert ALL[name].family is Family.EXTRA or CATALOGUE[name].name != ALL[name].name


def test_blocks_made_of_others_are_no_mechanisms_of_theirs() -> None:
    slack = next(block for block in BLOCKS if block.name == "slack")
    exponential = next(block for block in BLOCKS if block.name == "exponential")
    assert issubclass(slack, exponential)
    assert exponential.entry is not None
    assert slack.entry is None
    assert (exponential.suffix, slack.suffix) == ("", "slack")
    assert Gaussian.name in registry.METHODS
