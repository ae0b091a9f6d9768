"""Names of everything that may be answered are those of mechanisms and faults everywhere."""

from __future__ import annotations

import json
import pickle

from xb_muscle_ros.diagnose import answers
from xb_muscle_ros.diagnose.names import FAMILY, MEASUREMENT, MECHANISMS, Name
from xb_muscle_ros.measurement.artefacts import ARTEFACTS
from xb_muscle_ros.models.catalogue import CATALOGUE
from xb_muscle_ros.models.registry import EXTRAS, SWAPS


def test_names_are_those_of_mechanisms_and_faults() -> None:
    wanted = {name for name, extra in EXTRAS.items() if not extra.geometry} | set(SWAPS)
    assert set(answers.MECHANISMS) == wanted == set(CATALOGUE)
    assert set(MEASUREMENT) == set(ARTEFACTS)
    assert (*answers.MECHANISMS, *MEASUREMENT) == answers.NAMES
    assert set(answers.FAMILY) == set(answers.NAMES)


def test_the_benchmark_s_names_and_families_are_those_that_blocks_say() -> None:
    """The list without models stands for itself; what it says of a mechanism is what its block says."""
    assert set(FAMILY) == {*MECHANISMS, *MEASUREMENT}
    assert answers.MECHANISMS[: len(MECHANISMS)] == MECHANISMS
    assert {name: answers.FAMILY[name] for name in FAMILY} == dict(FAMILY)


def test_a_name_is_one_object_wherever_it_comes_from() -> None:
    made = Name("".join(["viscous", "_drag"]))
    assert made is Name.VISCOUS_DRAG is pickle.loads(pickle.dumps(made)) is Name(made)
    assert (made, f"{made}", json.dumps(made)) == ("viscous_drag",) * 2 + ('"viscous_drag"',)


def test_no_family_has_physics_and_measurement() -> None:
    physics, faults = ({FAMILY[n] for n in of} for of in (MECHANISMS, MEASUREMENT))
    assert not physics & faults
