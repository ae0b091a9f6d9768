"""Names of everything that may be answered are those of mechanisms and faults everywhere."""

from __future__ import annotations

from xb_muscle_ros.diagnose.names import FAMILY, MEASUREMENT, MECHANISMS, Name
from xb_muscle_ros.measurement.artefacts import ARTEFACTS
from xb_muscle_ros.models.catalogue import CATALOGUE
from xb_muscle_ros.models.registry import EXTRAS, SWAPS


def test_names_are_those_of_mechanisms_and_faults() -> None:
    assert {n.value for n in MECHANISMS} == set(EXTRAS) | set(SWAPS) == set(CATALOGUE)
    assert {n.value for n in MEASUREMENT} == set(ARTEFACTS)
    assert set(FAMILY) == set(Name)


def test_no_family_has_physics_and_measurement() -> None:
    physics, faults = ({FAMILY[n] for n in of} for of in (MECHANISMS, MEASUREMENT))
    assert not physics & faults
